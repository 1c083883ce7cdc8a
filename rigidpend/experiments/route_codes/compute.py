"""Experiment `route_codes`: arrays of binary route codes over the initial phase (Fig. 4)."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.contract import Means, Piece, Routes
from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.route_codes.schema import Config, Problem
from rigidpend.machine import progress
from rigidpend.machine.wording import counted
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.orbits import joined
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes.choice import expected_seconds
from rigidpend.routes.codes import RouteCodes, codes_of
from rigidpend.routes.problem import passage_rotations
from rigidpend.surfaces import melnikov

PIECES = True
"""All work goes through pieces, which a cluster can compute."""
BEGIN = 0.3
"""Seconds of a whole run besides its orbits."""
PHASE = 6e-5
"""Seconds of the exact phase of a column, which no thread shares.

On a crowded machine it was 6e-5 of rational phases, and 2e-4 of those with pi."""
PART, MOST = 2.0, 65_536
"""Seconds on one core for a part, as estimated, and the most columns of one.

A part is stored for an interrupted run."""
LANES = 8
"""Least number of columns in a part: fewer would leave SIMD lanes empty."""
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
        routes = _array(name, config, means, (before, every))
        before += grid.count
        means.report(f"{name}: {_summary(routes)}")
        groups[name] = {**routes._asdict(), "melnikov_zeros": zeros}
        # The field is stored only if maps decided some orbits.
        if not routes.by_map.any():
            del groups[name]["by_map"]
    return groups


def _array(name: str, config: Config, means: Means, orbits: tuple[int, int]) -> RouteCodes:
    """Compute the routes of an array in parts of some seconds.

    `orbits` are the numbers of orbits in earlier arrays and in all, for the finished share.
    """
    before, every = orbits
    routes, count = config.problem.routes, config.problem.arrays[name].count
    seconds = expected_seconds(routes, count, config.numerics.precisions) / count
    at_once = min(MOST, max(LANES if seconds < SLOW else 1, int(PART / seconds)))
    parts = [range(first, min(first + at_once, count)) for first in range(0, count, at_once)]
    names = [f"{name}.{part.start:08d}" for part in parts]
    given = name, config.problem, means.arithmetic, means.threads(names)
    pieces = [Piece(x, partial(_part, part, *given)) for x, part in zip(names, parts, strict=True)]
    found: list[RouteCodes] = []
    for part, tree in zip(parts, means.pieces(pieces), strict=True):
        found.append(RouteCodes(**tree))
        if len(parts) > 1:
            text = f"{name}: {part.stop} of {count} orbits"
            means.report(progress.PartDone(text, before + part.stop, every))
    return joined(found)


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on two cores."""
    problem, precisions = config.problem, config.numerics.precisions
    counts = [x.count for x in problem.arrays.values()]
    each = (expected_seconds(problem.routes, x, precisions) for x in counts)
    return BEGIN + PHASE * sum(counts) + sum(each) / 2


def _part(columns: range, name: str, problem: Problem, arithmetic: Arithmetic, jobs: int) -> Tree:
    """Routes of some columns of an array."""
    grid = problem.arrays[name]
    phases = [grid.phases[k] for k in columns]
    found = codes_of(problem.routes, phases, arithmetic, jobs, task_orbits=grid.count)
    return found._asdict()


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
