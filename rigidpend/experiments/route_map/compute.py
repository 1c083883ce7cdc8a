"""Experiment `route_map`: route codes over a plane, cell by cell.

Where the rows differ in J1_0 the body and its return maps are the same for all cells; where they
differ in mu, h0 or beta0 each row is an array of its own, by maps or by integration, whichever
is faster for so many cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.description import Row, body_rows
from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_map.layout import FREQUENCY, MARKED, PLANE, Y_AXIS
from rigidpend.integrate.arithmetic import Arithmetic
from rigidpend.results import compare
from rigidpend.results.compare import Difference
from rigidpend.results.layout import datasets
from rigidpend.results.tree import Data, Tree
from rigidpend.routes.codes import MANY
from rigidpend.routes.plane import Cells, Plane
from rigidpend.routes.rows import row_problem
from rigidpend.run.parts import Piece

if TYPE_CHECKING:
    from rigidpend.config.axes import Axis
    from rigidpend.experiments.route_map.schema import Config, Problem

PIECES = True
"""All work goes through pieces, which a cluster can compute."""
TILE = 131_072
"""Cells computed at a time, and kept if the run is interrupted: about half a second by maps."""
ROUNDING = 1e-14
"""Allowed difference of the axes, relative: their rounding."""
LOST = 1e-3
"""Allowed mean loss of certain symbols a cell, where doubles round otherwise."""
BY_MAP, BY_INTEGRATION, TABLES = 3.5e-6, 2e-4, 1.5
"""Seconds of a core for a cell of 15 symbols, and for three maps that are not kept yet.

Measured with the body of Fig. 4; 64 bits included, 113 not."""

Values = NDArray[np.float64]


def compute(config: Config, means: Means) -> Tree:
    """Compute the plane of a config and its zooms.

    Parameters
    ----------
    config : Config
    means : Means

    Returns
    -------
    Tree
        The fields of the plane, what its rows are, and a group for each zoom.
    """
    problem = config.problem
    planes = {name: _plane(name, axes, problem, means) for name, axes in problem.planes.items()}
    zooms = {name: plane for name, plane in planes.items() if name}
    return {
        **planes[""],
        "y_axis": Y_AXIS.dataset(problem.rows.axis),
        "marked": MARKED.dataset(own_value(problem)),
        "nu": FREQUENCY.dataset(float(problem.body.nu)),
        **({"zooms": zooms} if zooms else {}),
    }


def own_value(problem: Problem) -> float:
    """The value that the config gives for what changes from row to row."""
    axis = problem.rows.axis
    if axis == "log10_J1_0":
        return float(np.log10(float(problem.J1_0)))
    return float(getattr(problem.body if axis in ("beta0", "alpha0") else problem, axis))


def _plane(name: str, axes: tuple[Axis, Axis], problem: Problem, means: Means) -> Tree:
    """All cells of a plane, tile by tile."""
    x, y = (axis.values for axis in axes)
    shape = y.size, x.size
    codes = np.empty((problem.n_symbols, *shape), dtype=np.uint8)
    certain, by_map = np.empty(shape, dtype=np.uint8), np.empty(shape, dtype=bool)
    at_once = max(1, TILE // x.size) if problem.rows.axis == "log10_J1_0" else 1
    tiles = [slice(first, min(first + at_once, y.size)) for first in range(0, y.size, at_once)]
    given = x, y, problem, means.arithmetic, means.jobs
    pieces = [Piece(f"{name or 'plane'}.{t.start:06d}", _tile, (t, *given)) for t in tiles]
    found: Iterator[Any] = means.pieces(pieces)
    for rows, tile in zip(tiles, found, strict=True):
        codes[:, rows], certain[rows], by_map[rows] = (
            tile[key].values for key in ("codes", "certain", "by_map")
        )
        means.report(f"{name or 'plane'}: rows to {rows.stop} of {y.size}")
    values = {"codes": codes, "certain": certain, "by_map": by_map, "x": x, "y": y}
    return datasets(PLANE, values)


def _tile(
    rows: slice, x: Values, y: Values, problem: Problem, arithmetic: Arithmetic, jobs: int
) -> Tree:
    """The cells of some rows."""
    found = _cells(rows, x, y, problem, arithmetic, jobs)
    shape = rows.stop - rows.start, x.size
    values = {
        "codes": found.codes.reshape(-1, *shape),
        "certain": found.certain.reshape(shape),
        "by_map": found.by_map.reshape(shape),
    }
    return datasets({name: PLANE[name] for name in values}, values)


def _cells(
    rows: slice, x: Values, y: Values, problem: Problem, arithmetic: Arithmetic, jobs: int
) -> Cells:
    common, axis = problem.routes, problem.rows.axis
    if axis == "log10_J1_0":
        ends, orbits = _common_starts(problem)
        theta2, starts = np.tile(x, rows.stop - rows.start), np.repeat(10.0 ** y[rows], x.size)
    else:
        common = row_problem(common, axis, float(y[rows.start]))
        own = float(common.J1_0)
        ends, orbits = (own, own), x.size
        theta2, starts = x, np.full(x.size, own)
    plane = Plane(common.body, common.h0, ends, common.n_symbols, arithmetic, orbits, jobs)
    return plane.cells(theta2, starts)


def _common_starts(problem: Problem) -> tuple[tuple[float, float], int]:
    """The least and the largest J1_0 of all planes, so that they share their tables; the cells."""
    planes = [(x.count, 10.0**y.values) for x, y in problem.planes.values()]
    ends = min(y[0] for _, y in planes), max(y[-1] for _, y in planes)
    return (float(ends[0]), float(ends[1])), sum(n * y.size for n, y in planes)


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    J2 = float(problem.routes.J2_0(53))
    return [
        *body_rows(problem.body),
        Row("h0", str(problem.h0), "energy constant, kappa J2_0^2/2"),
        Row("J1_0", str(problem.J1_0), "initial action, dimensionless"),
        Row("J2_0", f"{J2:.16g}", "initial |M|, dimensionless"),
        Row("n_symbols", str(problem.n_symbols), "symbols on each orbit"),
        *(_plane_row(name, axes, problem) for name, axes in problem.planes.items()),
        Row("cost", f"about {cost(config):.2g} s", "of one core, of this year's kind"),
    ]


def _plane_row(name: str, axes: tuple[Axis, Axis], problem: Problem) -> Row:
    across, along = (f"{axis.ends[0]} to {axis.ends[1]} in {axis.count}" for axis in axes)
    what = f"rad, theta2_0; by {problem.rows.axis} {along}"
    return Row(f"zoom {name}" if name else "plane", across, what)


def cost(config: Config) -> float:
    """Estimate the seconds that a config takes on one core, tables included."""
    problem, total = config.problem, 0.0
    for columns, rows in problem.planes.values():
        arrays = 1 if problem.rows.axis == "log10_J1_0" else rows.count
        cells = columns.count * rows.count
        by_map = cells // arrays >= MANY
        share = problem.n_symbols / 15
        total += cells * share * (BY_MAP if by_map else BY_INTEGRATION)
        total += arrays * TABLES if by_map else 0
    return total


def differences(stored: Data, fresh: Data) -> list[Difference]:
    """Find where two results of a config disagree by more than their arithmetic explains.

    Symbols must be the same where both are certain. What decided a cell hangs on the last bit
    and is not compared.

    Parameters
    ----------
    stored, fresh : dict
        ``/data`` of the two files, loaded.
    """
    found = compare.keys(stored, fresh)
    for name in ("y_axis", "marked", "nu"):
        found += compare.differences(stored[name], fresh[name], ROUNDING, name)
    found += _plane_differences(stored, fresh)
    old, new = stored.get("zooms", {}), fresh.get("zooms", {})
    found += compare.keys(old, new, "zooms")
    for name in [name for name in old if name in new]:
        found += compare.inside(f"zooms/{name}", _plane_differences(old[name], new[name]))
    return found


def _plane_differences(stored: Data, fresh: Data) -> list[Difference]:
    if stored["codes"].shape != fresh["codes"].shape:
        return compare.arrays("codes", stored["codes"], fresh["codes"])
    found = []
    for name in ("x", "y"):
        within = ROUNDING * float(np.abs(stored[name]).max())
        found += compare.arrays(name, stored[name], fresh[name], within)
    both = np.minimum(stored["certain"], fresh["certain"])
    known = np.arange(len(stored["codes"]))[:, None, None] < both
    allowed = np.where(known, 0.0, np.inf)
    most = np.minimum(fresh["certain"], len(fresh["codes"]))
    found += compare.arrays("certain", most, fresh["certain"])
    # Cells on the edge of a precision may lose a symbol, but hardly any do.
    lost = np.clip(stored["certain"].astype(int) - fresh["certain"], 0, None).mean()
    found += compare.arrays("codes", stored["codes"], fresh["codes"], allowed)
    return found + compare.beyond("certain", np.array([lost]), np.array([LOST]))
