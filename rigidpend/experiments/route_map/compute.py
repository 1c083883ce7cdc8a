"""Experiment `route_map`: route codes over a plane, cell by cell.

Over theta2_0 and J1_0 the body and its return maps are the same for all cells. Where the rows
change the body or the energy, each makes an array of its own, by maps or by integration, whichever
is faster for so many cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from rigidpend.config.bodies import Axis
from rigidpend.experiments.contract import Means, Piece
from rigidpend.experiments.data import Coming, Streamed, Tree
from rigidpend.experiments.route_map.schema import Config, Problem
from rigidpend.machine.progress import PartDone
from rigidpend.machine.workers import worth_processes
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes import choice
from rigidpend.routes.cells import Cells, cell_problem, cells_of_starts

PIECES = True
"""All work goes through pieces, which a cluster can compute."""
TILE = 131_072
"""Cells computed at a time, and kept if the run is interrupted: about half a second by maps."""
OF_START = "log10_J1_0"
"""Parameter that leaves body and energy as they are, and so the return maps."""


def compute(config: Config, means: Means) -> Tree:
    """Compute the plane of a config and its zooms."""
    problem = config.problem
    planes = {name: _plane(name, axes, problem, means) for name, axes in problem.planes.items()}
    whole = planes.pop("")
    axis = problem.rows.axis
    whole |= {"y_axis": axis, "marked": own_value(problem, axis), "nu": float(problem.body.nu)}
    if planes:
        whole["zooms"] = planes
    return whole


def own_value(problem: Problem, axis: str) -> float:
    """The value that the config gives for a parameter."""
    if axis == OF_START:
        return float(np.log10(float(problem.J1_0)))
    return float(getattr(problem.body if axis in ("beta0", "alpha0") else problem, axis))


def _plane(name: str, axes: tuple[Axis, Axis], problem: Problem, means: Means) -> Streamed:
    """All cells of a plane, tile by tile."""
    x, y = (axis.values for axis in axes)
    shape = y.size, x.size
    tiles = list(tiled(problem.rows.axis, *shape))
    # Many tiles go to processes of one thread each: threads would wait for the interpreter.
    given = problem, means.arithmetic, 1 if worth_processes(len(tiles), means.jobs) else means.jobs
    pieces = [
        Piece(f"{name or 'plane'}.{rows.start:06d}", _tile, (x, y[rows], *given)) for rows in tiles
    ]

    def blocks() -> Iterator[dict[str, tuple[Any, Any]]]:
        for rows, tile in zip(tiles, means.pieces(pieces), strict=True):
            yield {key: ((..., rows, slice(None)), values) for key, values in tile.items()}
            done, cells = rows.stop * x.size, y.size * x.size
            means.report(PartDone(f"{name or 'plane'}: {done} of {cells} cells", done, cells))

    block = (tiles[0].stop, x.size)
    symbols = problem.n_symbols
    values = {
        "codes": Coming((symbols, *shape), np.dtype(np.uint8), (symbols, *block)),
        "certain": Coming(shape, np.dtype(np.uint8), block),
        "by_map": Coming(shape, np.dtype(bool), block),
        "x": x,
        "y": y,
    }
    return Streamed(values, blocks())


def tiled(axis: str, height: int, width: int) -> Iterator[slice]:
    """The rows of each tile, which share their return maps."""
    at_once = max(1, TILE // width) if axis == OF_START else 1
    for first in range(0, height, at_once):
        yield slice(first, min(first + at_once, height))


def _tile(x: Array, y: Array, problem: Problem, arithmetic: Arithmetic, jobs: int) -> Tree:
    """The cells of some rows."""
    found, shape = cells_of(x, y, problem, arithmetic, jobs), (y.size, x.size)
    certain, by_map = found.certain.reshape(shape), found.by_map.reshape(shape)
    return {"codes": found.codes.reshape(-1, *shape), "certain": certain, "by_map": by_map}


def cells_of(x: Array, y: Array, problem: Problem, arithmetic: Arithmetic, jobs: int) -> Cells:
    """The cells in the order of their rows."""
    theta2, upwards = np.tile(x, y.size), np.repeat(y, x.size)
    if problem.rows.axis == OF_START:
        ends, orbits = _common_starts(problem)
        given = problem.routes, theta2, 10.0**upwards, arithmetic, jobs
        return cells_of_starts(*given, ends=ends, orbits=orbits)
    # A tile is a row, of one body and one energy.
    one = cell_problem(problem.routes, {problem.rows.axis: float(y[0])})
    return cells_of_starts(one, theta2, np.full(x.size, float(one.J1_0)), arithmetic, jobs)


def _common_starts(problem: Problem) -> tuple[tuple[float, float], int]:
    """The least and the largest J1_0 of all planes, so that they share their tables; the cells."""
    planes = problem.planes.values()
    starts = [10.0**rows.values for _, rows in planes]
    ends = min(J1[0] for J1 in starts), max(J1[-1] for J1 in starts)
    return (float(ends[0]), float(ends[1])), sum(x.count * y.count for x, y in planes)


def cost(config: Config) -> float:
    """Estimate the seconds that a config takes on one core, tables included."""
    problem = config.problem
    rows, routes, arrays = problem.rows, problem.routes, 1
    if rows.axis != OF_START:
        # In the middle of what changes the body, or the energy.
        routes, arrays = cell_problem(routes, {rows.axis: sum(rows.ends) / 2}), rows.count
    cells = problem.theta2_0.count * rows.count
    one = arrays * choice.expected_seconds(routes, cells // arrays)
    return one * len(problem.planes)
