"""The flags `certain` where the tables of return maps are spoilt: none may be wrong.

The three maps behind a code are off by smooth functions of a given size, one map alone or all,
each by its own. The sample that is integrated as well would discard such maps at once; here it
is left out, so that the flags stand alone.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.honesty import NO_LIE, true_codes
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map import ReturnMap
from rigidpend.orbits.return_map.build import FIRST, Design
from rigidpend.routes import mapped
from rigidpend.routes.codes import Run, in_threads, route_codes
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, phase_rate

SIZES = ("1e-15", "1e-12", "1e-9")
"""Relative size of what the tables are off by."""
WHICH = ("one", "all")
"""The maps that are spoilt: the first, or all of them."""
CERTAIN = 0.5
"""Share of certain symbols at the largest size above which the trial shows nothing.

Three maps that are off by 1e-12 leave a tenth certain, of 300 other orbits."""

CLIMBING = 100
"""One orbit in so many is followed in 64 bits too, and in 106 where integration takes part.

Each takes hundreds of times as long as in doubles, and spoilt maps leave most symbols open."""


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

    def __init__(self, problem: RouteProblem, phases: Phases, size: float, every: bool) -> None:
        # First, for the base class makes a map at once.
        self.size, self.every = size, every
        super().__init__(problem, phases)

    def made(self, design: Design, bits: int) -> ReturnMap:
        """The map of a design."""
        right = super().made(design, bits)
        if design != FIRST and not self.every:
            return right
        return spoilt(right, self.size, int(1000 * float(design.unit)))


def trial(
    body: Body, h0: Scalar, J1_0: str, jobs: int, *, orbits: int, n_symbols: int, seed: int
) -> Trial:
    """Codes by spoilt maps in doubles, and of some orbits in more bits too, against the truth.

    Orbits are drawn by lot from `seed`.
    """
    phases = np.random.default_rng((seed, orbits)).uniform(0, 2 * np.pi, orbits)

    def measure() -> Findings:
        problem = RouteProblem(body, exact(h0), exact(J1_0), n_symbols)
        default = route_codes(body, phases, h0=h0, J1_0=J1_0, n_symbols=n_symbols, jobs=jobs)
        true, _ = true_codes(problem, phases, default.codes, 0, jobs)
        flags = [
            _flagged(problem, phases, true, float(size), which == "all", jobs)
            for which, size in KINDS
        ]
        lies = [float((wrong & certain).sum()) for wrong, certain in flags]
        notes = [
            f"{wrong.sum()} of {wrong.size} symbols wrong, {certain.mean():.3f} certain"
            for wrong, certain in flags
        ]
        return Findings([*lies, flags[-1][1].mean()], notes=notes)

    return Trial("spoilt maps", CLAIMS, measure)


KINDS = [(which, size) for which in WHICH for size in SIZES]
CLAIMS = (
    *(
        Claim(f"lies, {which} off by {size}", 0, "wrong symbols called certain", NO_LIE)
        for which, size in KINDS
    ),
    Claim(
        "certain, all off",
        CERTAIN,
        "share of certain symbols where all maps are off by most",
        "where nothing is in doubt, flags are not put to the test",
    ),
)


def _flagged(
    problem: RouteProblem, phases: Any, true: Any, size: float, every: bool, jobs: int
) -> tuple[Any, Any]:
    """Flags of wrong symbols and of certain ones, (n_symbols, orbits and some of them again)."""
    some = slice(None, None, CLIMBING)
    wrong, certain = [], []
    for precisions, chosen in (((53,), slice(None)), ((53, 64), some), ((53, 64, 106), some)):
        maps = SpoiltMaps(problem, Phases(phases[chosen]), size, every)
        codes, flags = _codes(maps, precisions, jobs)
        wrong.append(codes != true[:, chosen])
        certain.append(flags)
    return np.hstack(wrong), np.hstack(certain)


def _codes(maps: mapped.Maps, precisions: tuple[int, ...], jobs: int) -> tuple[Any, Any]:
    """The symbols and their flags in such precisions, without the sample."""
    arithmetic = resolve("taylor", None, precisions)
    run, share = Run(maps.problem, maps.phases, arithmetic, jobs), partial(in_threads, jobs)
    rate, ladder = phase_rate(maps.problem), arithmetic.precisions
    # The integrated sample would discard such maps.
    found = mapped.decided_by(maps, run.crossings, rate, ladder, share, sampled=False).decided
    return symbols(found.crossings.separatrix), found.certain
