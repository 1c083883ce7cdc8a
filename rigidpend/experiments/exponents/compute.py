"""Experiment `exponents`: the growth of deviations over a plane of initial phases and actions."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.exponents.schema import Config, Problem
from rigidpend.machine.progress import PartDone
from rigidpend.numbers import Array
from rigidpend.numbers.exact import exact
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.orbits.return_map import MapError
from rigidpend.routes import choice
from rigidpend.routes.cells import actions, cells_of_starts
from rigidpend.routes.symbolic.levels import OrbitFamily, orbits_of
from rigidpend.routes.symbolic.stretching import integrated, stretched

TILE = 8192
"""Cells at a time, which bounds the memory: each cell sums the tables at its own energy."""
SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
CELL, CHECK = 2e-5, 5e-5
"""Seconds of a core per cell and symbol: to follow its orbit, and to check it."""


def compute(config: Config, means: Means) -> Tree:
    """Compute the exponents of a plane; the body must have a return map."""
    problem = config.problem
    x, y = problem.theta2_0.values, problem.log10_J1_0.values
    theta2, J1 = np.tile(x, y.size), np.repeat(actions(y), x.size)
    n, shape = problem.n_symbols, (y.size, x.size)
    codes = cells_of_starts(problem.routes, theta2, J1, means.arithmetic, means.jobs)
    try:
        orbits = orbits_of(replace(problem.routes, J1_0=exact(float(J1[-1]))))
    except MapError as reason:
        said = "so there is no return map, of which exponents are derivatives"
        raise MapError(f"{reason}: {said}") from None
    grown, followed, allowed = _followed(orbits, theta2, J1, n, means)
    # The map in doubles may follow another orbit: its growth counts only with the established code.
    known = (codes.certain == n) & (followed == codes.codes).all(axis=0)
    # Rounded up to a power of two, which compresses to some bits a cell in the file.
    exponent, allowed = grown[-1] / n, 2.0 ** np.ceil(np.log2(allowed / n))
    # A value that may err by as much as itself, or more, says nothing.
    known &= allowed < np.abs(exponent)
    means.report(f"{int(known.sum())} of {known.size} cells are known")
    return {
        "codes": codes.codes.reshape(n, *shape),
        "exponent": np.where(known, exponent, np.nan).reshape(shape),
        "allowed": np.where(known, allowed, np.nan).reshape(shape),
        "theta2_0": x,
        "log10_J1_0": y,
        "marked": float(np.log10(float(problem.J1_0))),
        "growth": _quantiles(grown[:, known]),
        "checked": _checked(problem, orbits, known, (theta2, J1)),
    }


def _followed(
    orbits: OrbitFamily, theta2: Array, J1: Array, n: int, means: Means
) -> tuple[Array, NDArray[np.uint8], Array]:
    """The growth (n, N) through 1 to n passages, the symbols, and the allowed errors, (N,)."""
    parts: list[Tree] = []
    for first in range(0, theta2.size, TILE):
        part = slice(first, first + TILE)
        tile = partial(_tile, orbits, theta2[part], J1[part], n)
        parts.append(means.part(f"cells.{first:09d}", tile))
        done = min(part.stop, theta2.size), theta2.size
        means.report(PartDone("cells to {} of {}".format(*done), *done))
    grown, codes, allowed = (
        np.concatenate([part[name] for part in parts], axis=-1) for name in parts[0]
    )
    return grown, codes, allowed


def _tile(orbits: OrbitFamily, theta2: Array, J1: Array, n: int) -> Tree:
    """Logarithms of the growth after each passage, symbols, and the rounding of the last."""
    found = stretched(orbits, theta2, J1, n)
    codes = np.where(found.inside, found.symbols, NO_SYMBOL).astype(np.uint8)
    return {"growth": found.growth, "codes": codes, "allowed": found.allowed}


def _quantiles(grown: Array) -> dict[str, Any]:
    passages = np.arange(1, len(grown) + 1)
    exponents = grown / passages[:, None]
    found = np.full((len(SHARES), len(grown)), np.nan)
    if grown.size:
        found = np.quantile(exponents, SHARES, axis=1)
    return {"passages": passages, "share": np.array(SHARES), "exponent": found}


def _checked(
    problem: Problem, orbits: OrbitFamily, known: NDArray[np.bool_], starts: tuple[Array, Array]
) -> dict[str, Any]:
    """The growth in some cells beside that by the variational equations."""
    # Evenly spread and not random, so that every run checks the same cells.
    count = min(problem.checked, known.size)
    cells = np.linspace(0, known.size - 1, count + 2)[1:-1].astype(int)
    some = cells[known[cells]]
    row, column = np.divmod(cells, problem.theta2_0.count)
    values = {name: np.full(cells.size, np.nan) for name in ("growth", "difference", "allowed")}
    # Tables are not summed for no orbit at all.
    if some.size:
        found = stretched(orbits, starts[0][some], starts[1][some], problem.n_symbols)
        values["growth"][known[cells]] = found.growth[-1]
        values["difference"][known[cells]] = integrated(found) - found.growth[-1]
        values["allowed"][known[cells]] = found.allowed + found.allowed_integrated
    return {"row": row, "column": column, **values}


def cost(config: Config) -> float:
    """Estimate the seconds that a config takes."""
    problem = config.problem
    cells = problem.theta2_0.count * problem.log10_J1_0.count
    tables = choice.expected_seconds(problem.routes, cells, config.numerics.precisions)
    return tables + problem.n_symbols * (cells * CELL + problem.checked * CHECK)
