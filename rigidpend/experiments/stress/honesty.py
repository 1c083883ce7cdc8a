"""The flags `certain` where a computation is spoilt: wrong symbols come, flagged ones do not.

Tolerances are spoilt, and the tables of return maps: the three maps behind a code are off by
smooth functions of a given size, one map alone or all, each by its own. The sample that is
integrated as well would discard such maps at once; here it is left out, so that the flags stand
alone.

The truth comes from elsewhere. Every orbit is followed in principal axes too, and where that
differs from the default run anywhere it is followed there once more in more bits, at last in 113,
whose word is final. So the default run is judged like all others, and a wrong symbol is missed
only if both formulations err alike. Some orbits go to 113 bits at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments import principal_axes
from rigidpend.experiments.stress import SPOILT, scenes
from rigidpend.experiments.stress.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.scenes import random_phases
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import ReturnMap
from rigidpend.orbits.return_map.build import FIRST, Design
from rigidpend.routes import choice, mapped
from rigidpend.routes.codes import RouteCodes
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run

Codes = NDArray[np.uint8]

STARTS = ("1e-6", "1e-8", "1e-10")
"""J1_0 of a third of the orbits each."""
SPOILT_RIGHT = 0.999
"""Share of right symbols at the coarsest tolerance above which the trial shows nothing.

For 1,500 other orbits at 1e-6 it was 0.993 to 0.995."""
LIES, NO_LIE = "wrong symbols called certain", "no wrong symbol is called certain"
DIFFER = "symbols of the default run that differ from principal axes in 113 bits"
DECIDED = "the default precisions decide every symbol of these orbits, and rightly"
UNCERTAIN = "share of symbols that the default precisions leave uncertain"
OUTLAST = "113 bits outlast 15 passages, each of which triples an error"
COARSE = "share of symbols that are right at the coarsest tolerance"
TESTED = "where nothing goes wrong, or is in doubt, flags are not put to the test"
HARD = RouteProblem(Body((2, 1, "3/2"), (1, 1, 0), "1/1000"), exact("1.3342"), exact(1e-8), 32)
"""The problem of the hard orbit: the body of Fig. 4, and twice as many symbols."""
HARD_PHASE = 3.453198983306014
"""An orbit whose error outruns the difference of two computations twentyfold, at 64 bits."""
EVER = "no wrong symbol is called certain, whatever precision decides"
HARD_CLAIM = Claim("lies on a hard orbit", 0, f"{LIES}, of 32", EVER)

SPOILT_MAPS = [(which, size) for which in ("one", "all") for size in ("1e-15", "1e-12", "1e-9")]
"""The maps that are spoilt, the first or all of them, and by how much, relative."""
MAPS_CERTAIN = 0.5
"""Share of certain symbols at the largest size above which the trial shows nothing.

Three maps that are off by 1e-12 leave a tenth certain, of 300 other orbits."""
CLIMBING = 100
"""One orbit in so many is followed in 64 bits too, and in 106 where integration takes part.

Each takes hundreds of times as long as in doubles, and spoilt maps leave most symbols open."""
SHARE = "share of certain symbols where all maps are off by most"
MAPS_CLAIMS = (
    *(Claim(f"lies, {which} off by {size}", 0, LIES, NO_LIE) for which, size in SPOILT_MAPS),
    Claim("certain, all off", MAPS_CERTAIN, SHARE, TESTED),
)


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """A hard orbit, spoilt tolerances at each start, and spoilt maps of as many orbits."""
    sizes, n = asked.honesty, len(STARTS)
    yield hard_trial()
    for k, J1_0 in enumerate(STARTS):
        # What the division leaves goes to the first starts, so that no orbit is lost.
        orbits, checked = (x // n + (k < x % n) for x in (sizes.orbits, sizes.checked))
        yield trial(asked, J1_0, orbits, checked, jobs)
    problem = RouteProblem(asked.body, asked.h0, asked.J1_0, sizes.n_symbols)
    yield maps_trial(problem, jobs, sizes.orbits // n, asked.seed)


def trial(asked: Any, J1_0: str, orbits: int, checked: int, jobs: int) -> Trial:
    """Doubles alone at spoilt tolerances, and the default run, against the truth.

    Of the orbits so many are `checked` in 113 bits in any case.
    """
    tolerances, at = [str(x) for x in asked.honesty.tolerances], f"J1_0 = {J1_0}"
    names = [*(f"lies at {x}, {at}" for x in tolerances), f"lies by default, {at}"]
    claims = (
        *(Claim(name, 0, LIES, NO_LIE) for name in names),
        Claim(f"against 113 bits, {at}", 0, DIFFER, DECIDED),
        Claim(f"uncertain, {at}", 0, UNCERTAIN, OUTLAST),
        Claim(f"right at the coarsest, {at}", SPOILT_RIGHT, COARSE, TESTED),
    )

    def measure() -> Findings:
        # Other phases for each J1_0, and the same in every run.
        phases = random_phases(orbits, (asked.seed, *J1_0.encode()))
        problem = RouteProblem(asked.body, asked.h0, exact(J1_0), asked.honesty.n_symbols)
        default = scenes.routes(problem, phases, jobs)
        true, known = true_codes(problem, phases, default.codes, checked, jobs)
        # A tolerance spoils integrations; the maps' tables have a trial of their own.
        alone = [
            scenes.routes(problem, phases, jobs, (53,), float(x), "integration") for x in tolerances
        ]
        compared, wrong, lies = np.transpose([counted(x, true, known) for x in (*alone, default)])
        spoilt = np.array(tolerances, dtype=float)
        coarse = int(np.argmax(spoilt))
        values = [
            *lies,
            (default.codes[:, :checked] != true[:, :checked]).sum(),
            1 - default.certain.mean(),
            1 - wrong[coarse] / compared[coarse],
        ]
        counts = {"symbols": compared[:-1], "wrong": wrong[:-1], "lies": lies[:-1]}
        notes = [f"of {n} symbols {k} are wrong" for n, k in zip(compared, wrong, strict=True)]
        return Findings(values, notes, {"tolerance": spoilt, **counts})

    return Trial("honesty", at, claims, measure, SPOILT)


def true_codes(
    problem: RouteProblem, phases: Any, doubted: Codes, checked: int, jobs: int
) -> tuple[Codes, NDArray[np.bool_]]:
    """The symbols of orbits from an independent formulation, and of which orbits they are known.

    Where nothing differs from `doubted`, which a run found, doubles are enough; the first
    `checked` orbits are followed in 113 bits in any case. All are known, but without heyoka only
    those, in integers of 113 bits.
    """
    known = np.ones(phases.size, dtype=bool)
    if not principal_axes.installed():
        known[checked:] = False
        true = doubted.copy()
        found = scenes.route_crossings(problem, phases[:checked], jobs, scenes.BITS, "scipy")
        true[:, :checked] = symbols(found.separatrix)
        return true, known
    true = principal_axes.codes(problem, phases, bits=53, jobs=jobs)
    differ = (true != doubted).any(axis=0)
    true[:, differ], _ = principal_axes.settled(problem, phases[differ], doubted[:, differ], jobs)
    if checked and principal_axes.offers(scenes.BITS):
        first = phases[:checked]
        true[:, :checked] = principal_axes.codes(problem, first, bits=scenes.BITS, jobs=jobs)
    return true, known


def hard_trial() -> Trial:
    """The default precisions on the orbit on which two computations once hid a radian."""

    def measure() -> Findings:
        phases = np.array([HARD_PHASE])
        found = scenes.routes(HARD, phases, 1)
        compared, wrong, lies = counted(found, *true_codes(HARD, phases, found.codes, 1, 1))
        return Findings([lies], [f"of {compared} symbols {wrong} are wrong"])

    return Trial("honesty", "hard orbit", (HARD_CLAIM,), measure)


def counted(found: RouteCodes, true: Codes, known: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Numbers of symbols of the orbits whose truth is known, of wrong ones, and of lies.

    A lie is wrong and called certain.
    """
    differ = (found.codes != true) & known
    return int(known.sum()) * len(true), int(differ.sum()), int((differ & found.certain).sum())


def spoilt(made: ReturnMap, size: float, seed: int) -> ReturnMap:
    """The map with every table off by a smooth function of a relative size."""
    random = np.random.default_rng(seed)
    charts = []
    for chart in made.charts:
        tables = []
        for table in chart:
            # A copy, of doubles or of pairs of them.
            values = table.values + 0.0
            # The lowest coefficients alone: an error that is smooth, as a
            # wrong series has it, and no noise.
            values[0, :3] += size * random.normal(size=values[0, :3].shape) * np.abs(values).max()
            tables.append(table._replace(values=values))
        charts.append(type(chart)(*tables))
    return replace(made, charts=(charts[0], charts[1]))


class SpoiltMaps(mapped.Maps):
    """Maps of which one or all are spoilt."""

    def __init__(self, run: Run, size: float, every: bool) -> None:
        # First, for the base class makes a map at once.
        self.size, self.every = size, every
        super().__init__(run)

    def made(self, design: Design, bits: int) -> ReturnMap:
        """The map of a design."""
        right = super().made(design, bits)
        if design != FIRST and not self.every:
            return right
        return spoilt(right, self.size, int(1000 * float(design.unit)))


def maps_trial(problem: RouteProblem, jobs: int, orbits: int, seed: int) -> Trial:
    """Codes by spoilt maps in doubles, and of some orbits in more bits too, against the truth."""

    def measure() -> Findings:
        phases = random_phases(orbits, (seed, orbits))
        doubted = scenes.routes(problem, phases, jobs).codes
        true, _ = true_codes(problem, phases, doubted, 0, jobs)
        flags = [
            _flagged(problem, phases, true, float(size), which == "all", jobs)
            for which, size in SPOILT_MAPS
        ]
        lies = [float((wrong & certain).sum()) for wrong, certain in flags]
        notes = [
            f"{wrong.sum()} of {wrong.size} symbols wrong, {certain.mean():.3f} certain"
            for wrong, certain in flags
        ]
        return Findings([*lies, flags[-1][1].mean()], notes)

    return Trial("honesty", "spoilt maps", MAPS_CLAIMS, measure)


def _flagged(
    problem: RouteProblem, phases: Any, true: Any, size: float, every: bool, jobs: int
) -> tuple[Any, Any]:
    """Flags of wrong symbols and of certain ones, (n_symbols, orbits and some of them again)."""
    some, wrong, certain = slice(None, None, CLIMBING), [], []
    for precisions, chosen in (((53,), slice(None)), ((53, 64), some), ((53, 64, 106), some)):
        arithmetic = resolve("taylor", None, precisions)
        run = Run(problem, Phases(phases[chosen]), arithmetic, jobs)
        # The integrated sample would discard such maps.
        found = choice.decided_by(SpoiltMaps(run, size, every), sampled=False).decided
        wrong.append(symbols(found.crossings.separatrix) != true[:, chosen])
        certain.append(found.certain)
    return np.hstack(wrong), np.hstack(certain)
