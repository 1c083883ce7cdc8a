"""Experiment `route_map`: route codes over a plane, cell by cell.

Over theta2_0 and J1_0 the body and its return maps are the same for all cells. If one axis
changes the body or the energy, each of its values gives an array of cells, computed by maps or by
integration, whichever is faster for that number of cells. If both do, every cell is integrated.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from rigidpend.config.bodies import Axis
from rigidpend.experiments.contract import Means, Piece
from rigidpend.experiments.data import Coming, Streamed, Tree
from rigidpend.experiments.route_map.schema import Config, Problem
from rigidpend.machine.progress import PartDone
from rigidpend.numbers import Array
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes import choice, costs
from rigidpend.routes.cells import (
    OF_BODY,
    Cells,
    actions,
    cell_problem,
    cells_of_each,
    cells_of_starts,
)

PIECES = True
"""All work goes through pieces, which a cluster can compute."""
TILE = 131_072
"""Cells in a part, which is stored for an interrupted run: about half a second by maps."""
OF_START = ("theta2_0", "log10_J1_0")
"""Parameters that leave body and energy as they are, and so the return maps."""
OWN_TILE = 2048
"""Cells in a part if each has a body or an energy of its own: some seconds."""
BEGIN = 0.3
"""Seconds of any run."""
BY_INTEGRATION = 2e-4
"""Seconds of a core for a cell of 15 symbols, if a body has few cells.

Measured with the body of Fig. 4; including 64 bits, without 113."""
BEGUN, OWN_BODY, ALONE = 2.2e-3, 3.3e-3, 3e-3
"""Seconds of a core: for an energy of its own, in addition for a body of its own, for 15 symbols.

The first two precede the integration; most of them go into the numbers in 113 bits."""
OWN_ACTION = 1.2e-3
"""Seconds of a core for each action J1_0 of an array that is integrated, to place its orbits."""

PLACES = 8
"""Largest number of values of an axis, each of another body or energy, whose time is estimated.

Where a body is nearly symmetric at an end, it takes a hundred times as long as in the middle."""


def compute(config: Config, means: Means) -> Tree:
    """Compute the plane of a config and its zooms."""
    problem = config.problem
    cells = {name: x.values.size * y.values.size for name, (x, y) in problem.planes.items()}
    done = dict.fromkeys(cells, 0)

    def over(name: str, count: int, stay: int) -> None:
        done[name] = count
        text = f"{name or 'plane'}: {count} of {cells[name]} cells"
        # Said as soon as there are some: more bits would take longer, and decide nothing.
        if stay:
            text += f"; {stay} stay beside a pendulum motion, and no number of bits decides"
        means.report(PartDone(text, sum(done.values()), sum(cells.values())))

    planes = {
        name: _plane(name, axes, problem, means, partial(over, name))
        for name, axes in problem.planes.items()
    }
    whole = planes.pop("")
    across, upwards = problem.names
    whole |= {"y_axis": upwards, "marked": own_value(problem, upwards)}
    whole["nu"] = float(problem.body.nu)
    if problem.columns:
        whole |= {"x_axis": across, "marked_x": own_value(problem, across)}
    if planes:
        whole["zooms"] = planes
    return whole


def own_value(problem: Problem, axis: str) -> float:
    """The value that the config gives for a parameter."""
    if axis == "log10_J1_0":
        return float(np.log10(float(problem.J1_0)))
    return float(getattr(problem.body if axis in ("beta0", "alpha0") else problem, axis))


def _plane(
    name: str,
    axes: tuple[Axis, Axis],
    problem: Problem,
    means: Means,
    over: Callable[[int, int], None],
) -> Streamed:
    """All cells of a plane, tile by tile.

    `over` is told how many cells are done, and how many of these have no further crossing.
    """
    x, y = (axis.values for axis in axes)
    shape = y.size, x.size
    tiles = list(tiled(problem.names, *shape))
    # Zooms have words for names: those of the whole plane's tiles are numbers, which no word is.
    names = [f"{name}.{number:06d}".lstrip(".") for number, _ in tiles]
    given = problem, means.arithmetic, means.threads(names)
    pieces = [
        Piece(each, partial(_tile, x[columns], y[rows], *given))
        for each, (_, (rows, columns)) in zip(names, tiles, strict=True)
    ]

    def blocks() -> Iterator[dict[str, tuple[Any, Any]]]:
        count = stay = 0
        for (_, (rows, columns)), tile in zip(tiles, means.pieces(pieces), strict=True):
            yield {key: ((..., rows, columns), values) for key, values in tile.items()}
            stay += int((tile["codes"] == NO_SYMBOL).any(axis=0).sum())
            count += tile["certain"].size
            over(count, stay)

    first_rows, first_columns = tiles[0][1]
    block = (first_rows.stop, first_columns.stop)
    symbols = problem.n_symbols
    values = {
        "codes": Coming((symbols, *shape), np.dtype(np.uint8), (symbols, *block)),
        "certain": Coming(shape, np.dtype(np.uint8), block),
        "by_map": Coming(shape, np.dtype(bool), block),
        "x": x,
        "y": y,
    }
    return Streamed(values, blocks())


def tiled(
    names: tuple[str, str], height: int, width: int
) -> Iterator[tuple[int, tuple[slice, slice]]]:
    """The rows and columns of each tile, with the number of its first row or column.

    If at most one axis changes the body or the energy, tiles run along the other one, so that
    cells share return maps; otherwise they only divide the work among processes.
    """
    across, upwards = (name in OF_START for name in names)
    if upwards and not across:
        yield from ((k, (slice(0, height), slice(k, k + 1))) for k in range(width))
        return
    at_once = 1
    if across == upwards:
        at_once = max(1, (TILE if across else OWN_TILE) // width)
    for first in range(0, height, at_once):
        yield first, (slice(first, min(first + at_once, height)), slice(0, width))


def _tile(x: Array, y: Array, problem: Problem, arithmetic: Arithmetic, jobs: int) -> Tree:
    """The cells of some rows and columns."""
    found, shape = row_by_row(x, y, problem, arithmetic, jobs), (y.size, x.size)
    certain, by_map = found.certain.reshape(shape), found.by_map.reshape(shape)
    return {"codes": found.codes.reshape(-1, *shape), "certain": certain, "by_map": by_map}


def row_by_row(x: Array, y: Array, problem: Problem, arithmetic: Arithmetic, jobs: int) -> Cells:
    """The cells, row by row."""
    shares = _shares_maps(problem)
    if shares:
        x, y = (
            actions(values) if name == "log10_J1_0" else values
            for name, values in zip(problem.names, (x, y), strict=True)
        )
    spread = np.tile(x, y.size), np.repeat(y, x.size)
    values = dict(zip(problem.names, spread, strict=True))
    # A phase or an action that all cells share stays exact, as the config writes it.
    theta2 = values.pop("theta2_0", None)
    if theta2 is None:
        theta2 = np.full(x.size * y.size, problem.theta2_0, dtype=object)
    if not shares:
        return cells_of_each(problem.routes, values, theta2, arithmetic, jobs)
    J1 = values.pop("log10_J1_0", None)
    # The remaining parameters have one value in the whole tile.
    common = cell_problem(problem.routes, {name: float(v[0]) for name, v in values.items()})
    ends, orbits = (None, None) if values else _common_starts(problem)
    return cells_of_starts(common, theta2, J1, arithmetic, jobs, ends=ends, orbits=orbits)


def _shares_maps(problem: Problem) -> bool:
    """True if one axis at most changes the body or the energy."""
    return any(name in OF_START for name in problem.names)


def _common_starts(problem: Problem) -> tuple[tuple[float, float], int]:
    """The least and the largest J1_0 of all planes, which share tables, and the number of cells."""
    planes = problem.planes.values()
    upwards = problem.names.index("log10_J1_0")
    starts = [actions(axes[upwards].values) for axes in planes]
    ends = min(J1[0] for J1 in starts), max(J1[-1] for J1 in starts)
    return (float(ends[0]), float(ends[1])), sum(x.count * y.count for x, y in planes)


def cost(config: Config) -> float:
    """Estimate the seconds that a config takes on one core, tables included."""
    problem = config.problem
    precisions = config.numerics.precisions
    return BEGIN + sum(_cost(axes, problem, precisions) for axes in problem.planes.values())


def _cost(axes: tuple[Axis, Axis], problem: Problem, precisions: Sequence[int]) -> float:
    """Seconds for a plane."""
    counts = dict(zip(problem.names, (axis.count for axis in axes), strict=True))
    share, cells = problem.n_symbols / 15, math.prod(counts.values())
    if not _shares_maps(problem):
        # Orbits of one body share SIMD vectors; a lone orbit leaves most lanes empty.
        if "h0" in problem.names:
            return cells * (BEGUN + share * BY_INTEGRATION)
        return cells * (BEGUN + OWN_BODY + share * ALONE)
    arrays, sampled = 1, [dict[str, float]()]
    # At most one axis changes the body or the energy: some of its values stand for all.
    for name, axis in zip(problem.names, axes, strict=True):
        if name not in OF_START:
            arrays = axis.count
            places = np.unique(((np.arange(PLACES) + 0.5) / PLACES * arrays).astype(int))
            sampled = [{name: float(x)} for x in axis.values[places]]
    orbits, seconds = cells // arrays, 0.0
    for values in sampled:
        one = cell_problem(problem.routes, values)
        seconds += BEGUN * bool(values) + OWN_BODY * any(name in OF_BODY for name in values)
        if not costs.at_stake(one, orbits, precisions):
            seconds += OWN_ACTION * counts.get("log10_J1_0", 0)
        seconds += choice.expected_seconds(one, orbits, precisions)
    return arrays * seconds / len(sampled)
