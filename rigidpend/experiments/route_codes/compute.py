"""Experiment `route_codes`: arrays of binary route codes over the initial phase (Fig. 4)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.contract import Means, Routes
from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.route_codes.schema import Config
from rigidpend.machine import progress
from rigidpend.machine.wording import counted
from rigidpend.numbers.exact import Exact
from rigidpend.numbers.expressions import NO_SYMBOL
from rigidpend.routes.choice import expected_seconds
from rigidpend.routes.codes import RouteCodes, codes_of
from rigidpend.routes.costs import at_stake
from rigidpend.routes.phases import Grid
from rigidpend.routes.problem import passage_rotations
from rigidpend.surfaces import melnikov

BEGIN = 0.3
"""Seconds of a whole run besides its orbits."""
MAPPED, FEWEST_MAPPED = 65_536, 800
"""Columns in a part computed by return maps, and the least `at_once` that leads to such parts."""
PART = 2.0
"""Seconds on one core for a part, the columns that are stored together for an interrupted run."""
LANES = 8
"""Least number of columns computed at once: fewer would leave SIMD lanes empty."""
SLOW = 10.0
"""Seconds of a column above which it is computed alone: in high precisions there are no lanes."""
SHOWN = 5
"""Largest number of orbits that a line of progress names."""
LONG = 200
"""Rotations in a passage above which a line on long passages precedes the computation."""


def compute(config: Config, means: Means) -> Tree:
    """Compute every array of a config."""
    problem = config.problem
    zeros = np.array(melnikov.zeros(problem.routes))
    groups: dict[str, Any] = {}
    rotations = passage_rotations(problem.routes)
    if LONG < rotations < math.inf:
        expected = progress.duration(cost(config))
        means.report(
            f"passages are long: about {rotations:,.0f} rotations of the pendulum each;"
            f" some {expected} in all"
        )
    before, every = 0, sum(grid.count for grid in problem.arrays.values())
    for name, grid in problem.arrays.items():
        routes = _in_parts(name, grid.phases, config, means, (before, every))
        before += grid.count
        means.report(f"{name}: {_summary(routes)}")
        groups[name] = {**routes._asdict(), "melnikov_zeros": zeros}
        # The field is stored only if maps decided some orbits.
        if not routes.by_map.any():
            del groups[name]["by_map"]
    return groups


def _in_parts(
    name: str, phases: Grid, config: Config, means: Means, orbits: tuple[int, int]
) -> RouteCodes:
    """Compute the routes of all phases in parts of some seconds, sized by the time of the last.

    `orbits` are the numbers of orbits in earlier arrays and in all, for the finished share.
    """
    found: list[RouteCodes] = []
    first, seconds = 0, column_cost(config, len(phases))
    before, every = orbits
    mapped = at_stake(config.problem.routes, len(phases), means.arithmetic.precisions)
    while first < len(phases):
        fewest = LANES if seconds < SLOW else 1
        at_once = max(fewest * means.jobs, int(PART * means.jobs / seconds))
        # Maps compute many columns at once; but if columns are slow, parts stay short.
        if mapped and at_once >= FEWEST_MAPPED:
            at_once = max(at_once, MAPPED)
        columns = [phases[k] for k in range(first, min(first + at_once, len(phases)))]
        if len(phases) > at_once:
            text = f"{name}: {first} of {len(phases)} orbits"
            means.report(progress.PartDone(text, before + first, every))
        begun = time.perf_counter()
        work = partial(_part, columns, len(phases), config, means)
        found.append(RouteCodes(**means.part(f"{name}.{first:08d}", work)))
        # A part that an earlier run stored may have another size.
        count = len(found[-1].bits)
        took = (time.perf_counter() - begun) * means.jobs / count
        # Parts grow at most fourfold: the columns of the last one may have been exceptionally easy.
        first, seconds = first + count, max(took, seconds / 4)
    return RouteCodes(*(np.concatenate(x, axis=-1) for x in zip(*found, strict=True)))


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on two cores."""
    counts = [grid.count for grid in config.problem.arrays.values()]
    return BEGIN + sum(count * column_cost(config, count) for count in counts) / 2


def column_cost(config: Config, columns: int) -> float:
    """Estimate of the seconds of a core for each column of an array with this many."""
    routes, precisions = config.problem.routes, config.numerics.precisions
    return expected_seconds(routes, columns, precisions) / columns


def _part(phases: Sequence[Exact], of: int, config: Config, means: Means) -> Tree:
    """Routes of some columns of an array of `of` columns."""
    routes, arithmetic = config.problem.routes, means.arithmetic
    return codes_of(routes, phases, arithmetic, means.jobs, task_orbits=of)._asdict()


def orbits(config: Config, stored: Callable[[], Data]) -> Routes:
    """The orbits of each array."""
    problem = config.problem
    return {name: (problem.routes, grid.phases) for name, grid in problem.arrays.items()}


def _summary(routes: RouteCodes) -> str:
    n, uncertain = routes.bits.size, int((~routes.certain).sum())
    maps = int(routes.by_map.sum())
    # np.unique would import masked arrays, which takes a thirtieth of a run of fig4.
    columns = enumerate(np.bincount(routes.bits))
    counts = ", ".join(f"{count} in {bits} bits" for bits, count in columns if count)
    doubt = f"; {counted(uncertain, 'symbol')} uncertain" if uncertain else ""
    by_map = f", {maps} by return maps" if maps else ""
    return f"{counted(n, 'orbit')}, {counts}{by_map}{doubt}{_staying(routes)}"


def _staying(routes: RouteCodes) -> str:
    """Sentence on orbits without a further crossing, as beside an elliptic periodic orbit."""
    stay = np.flatnonzero((routes.codes == NO_SYMBOL).any(axis=0))
    if not stay.size:
        return ""
    phases = ", ".join(f"{x:.6g}" for x in routes.theta2_0[stay[:SHOWN]])
    more = f" and {stay.size - SHOWN} more" if stay.size > SHOWN else ""
    return f"; {stay.size} stay beside a pendulum motion: theta2_0 = {phases}{more}"
