"""The flags `certain` where the tables of return maps are spoilt: none may be wrong.

The three maps behind a code are off by smooth functions of a given size, one map alone or all,
each by its own. The sample that is integrated as well would discard such maps at once; here it
is left out, so that the flags stand alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from rigidpend.experiments.stress.trials import scenes
from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.honesty import LIES, NO_LIE, STARTS, true_codes
from rigidpend.experiments.stress.trials.scenes import Way
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import ReturnMap
from rigidpend.orbits.return_map.build import FIRST, Design
from rigidpend.routes import choice, mapped
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run

KINDS = [(which, size) for which in ("one", "all") for size in ("1e-15", "1e-12", "1e-9")]
"""The maps that are spoilt, the first or all of them, and by how much, relative."""
CERTAIN = 0.5
"""Share of certain symbols at the largest size above which the trial shows nothing.

Three maps that are off by 1e-12 leave a tenth certain, of 300 other orbits."""
CLIMBING = 100
"""One orbit in so many is followed in 64 bits too, and in 106 where integration takes part.

Each takes hundreds of times as long as in doubles, and spoilt maps leave most symbols open."""
SHARE = "share of certain symbols where all maps are off by most"
TESTED = "where nothing is in doubt, flags are not put to the test"
CLAIMS = (
    *(Claim(f"lies, {which} off by {size}", 0, LIES, NO_LIE) for which, size in KINDS),
    Claim("certain, all off", CERTAIN, SHARE, TESTED),
)


def spoilt(made: ReturnMap, size: float, seed: int) -> ReturnMap:
    """The map with every table off by a smooth function of a relative size."""
    random = np.random.default_rng(seed)
    charts = []
    for chart in made.charts:
        tables = []
        for table in chart:
            values = table.values.copy()
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


def trials(asked: Any, way: Way) -> Iterator[Trial]:
    """Spoilt maps, of as many orbits as each start of the spoilt tolerances has."""
    # Maps are held against the kernel's orbits, in 64 bits too, which the other engine lacks.
    if way.engine == "taylor":
        problem = RouteProblem(asked.body, asked.h0, asked.J1_0, asked.honesty.n_symbols)
        yield trial(problem, way, asked.honesty.orbits // len(STARTS), asked.seed)


def trial(problem: RouteProblem, way: Way, orbits: int, seed: int) -> Trial:
    """Codes by spoilt maps in doubles, and of some orbits in more bits too, against the truth."""

    def measure() -> Findings:
        phases = scenes.random_phases(orbits, (seed, orbits))
        doubted = scenes.routes(problem, phases, way).codes
        true, _ = true_codes(problem, phases, doubted, 0, way.jobs)
        flags = [
            _flagged(problem, phases, true, float(size), which == "all", way.jobs)
            for which, size in KINDS
        ]
        lies = [float((wrong & certain).sum()) for wrong, certain in flags]
        notes = [
            f"{wrong.sum()} of {wrong.size} symbols wrong, {certain.mean():.3f} certain"
            for wrong, certain in flags
        ]
        return Findings([*lies, flags[-1][1].mean()], notes)

    return Trial("honesty", "spoilt maps", CLAIMS, measure)


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
