"""Experiment `route_zoom`: successive zooms into the arrays of Fig. 4.

At a change of symbol i the orbit ends on a periodic orbit: it is doubly asymptotic. Beside it,
at a distance d, orbits spend ln(1/d)/lambda more time there before they leave, and what they
do next depends on the phase then. So a zoom by exp(pi^2/nu), which adds one rotation, shows
the same rows above i again, however deep.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.description import Row, body_rows, exact_row
from rigidpend.experiments.contract import Means
from rigidpend.experiments.route_arrays import APART, ROUNDING, array_differences
from rigidpend.experiments.route_zoom.layout import PLACE, REPEATS_AFTER, ROUTES, SYMBOL
from rigidpend.numbers.exact import Exact, exact
from rigidpend.results import compare
from rigidpend.results.compare import Difference
from rigidpend.results.layout import datasets
from rigidpend.results.tree import Data, Dataset, Tree
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.phases import Grid

if TYPE_CHECKING:
    from rigidpend.experiments.route_zoom.schema import Config, Problem


Codes = Callable[..., RouteCodes]


class NoChange(ValueError):
    """Error: the symbol does not change between two phases, or one before it does."""


def compute(config: Config, means: Means) -> Tree:
    """Compute every level of a config.

    Parameters
    ----------
    config : Config
    means : Means

    Returns
    -------
    Tree
        A group for each level, with the fields of `RouteCodes` but for phases beyond doubles:
        `offset` from the level's `centre`, whose digits are a text.
    """
    problem = config.problem
    codes = partial(
        route_codes,
        problem.body,
        h0=problem.h0,
        J1_0=problem.J1_0,
        jobs=means.jobs,
        **means.arithmetic._asdict(),
    )
    (low, high), step, groups = problem.between, problem.step, {}
    for level in range(problem.levels):
        name, finest = f"level{level:02d}", float(step) / 2
        narrowed = partial(_bracket, codes, low, high, problem.symbol, finest)
        bracket: Any = means.part(f"{name}.centre", narrowed)
        low, high = (exact(bracket[side].values) for side in ("low", "high"))
        array: Any = means.part(name, partial(_level, codes, problem, low, high, step))
        groups[name] = array
        bits = " and ".join(map(str, np.unique(array["bits"].values)))
        means.report(f"{level + 1}/{problem.levels}: step {float(step):.0e}, {bits} bits")
        step = step / problem.factor
    growth = math.exp(math.pi**2 / problem.body.nu)
    repeats, symbol = REPEATS_AFTER.dataset(growth), SYMBOL.dataset(problem.symbol)
    return {"levels": groups, "repeats_after": repeats, "symbol": symbol}


def _bracket(codes: Codes, low: Exact, high: Exact, symbol: int, width: float) -> Tree:
    """Keep the two phases of :func:`bisect`, as texts that say them exactly."""
    low, high = bisect(codes, low, high, symbol, width)
    return {
        "low": Dataset(low.text, "rad", "theta2_0 below the change"),
        "high": Dataset(high.text, "rad", "theta2_0 above the change"),
    }


def _level(codes: Codes, problem: Problem, low: Exact, high: Exact, step: Exact) -> Tree:
    centre = (low + high) / 2
    grid = Grid(centre - step * (problem.count - 1) / 2, step, problem.count)
    return _group(codes(grid, n_symbols=problem.n_symbols), centre, step)


def bisect(codes: Codes, low: Exact, high: Exact, symbol: int, width: float) -> tuple[Exact, Exact]:
    """Narrow two phases, between which a symbol changes, to a distance of at most `width`.

    Parameters
    ----------
    codes : callable
        ``codes(phases, n_symbols=k)`` gives their routes.
    low, high : Exact
        Radians.
    symbol : int
        The symbol that changes; those before it must be equal on both sides.
    width : float
        Radians.

    Raises
    ------
    NoChange
        The symbol is the same on both sides, or an earlier one differs.
    """
    left, right = _prefixes(codes, [low, high], symbol)
    if left[:-1] != right[:-1] or left == right:
        found = f"{left} at {low} and {right} at {high}"
        raise NoChange(f"symbol {symbol} must change, and no other before it; it is {found}")
    while float(high - low) > width:
        middle = _plain((low + high) / 2)
        (prefix,) = _prefixes(codes, [middle], symbol)
        low, high = (middle, high) if prefix == left else (low, middle)
    return low, high


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, with what follows from it, units named."""
    problem = config.problem
    finest = float(problem.step) / problem.factor ** (problem.levels - 1)
    return [
        *body_rows(problem.body),
        exact_row("h0", "energy constant, kappa J2_0^2/2", problem.h0),
        exact_row("J1_0", "initial action, dimensionless", problem.J1_0),
        exact_row("between", "rad, theta2_0", *problem.between),
        exact_row("symbol", "whose change is sought", problem.symbol),
        Row("levels", f"{problem.levels} of {problem.count} columns", "each finer by the factor"),
        Row("steps", f"{float(problem.step):.3g} to {finest:.3g}", "rad, spacing of columns"),
    ]


def differences(stored: Data, fresh: Data) -> list[Difference]:
    """Find where two results of a config disagree by more than their arithmetic explains.

    Beside a doubly asymptotic orbit errors grow as fast as the zoom: crossing times are held
    to what certain symbols allow. What is given, and how it rounds, must be the same.
    """
    found = compare.keys(stored, fresh)
    for name in ("repeats_after", "symbol"):
        found += compare.arrays(name, stored[name], fresh[name], 10 * ROUNDING)
    old, new = stored["levels"], fresh["levels"]
    found += compare.keys(old, new, "levels")
    for name in [name for name in old if name in new]:
        found += compare.inside(f"levels/{name}", _level_differences(old[name], new[name]))
    return found


def _level_differences(stored: Data, fresh: Data) -> list[Difference]:
    found = compare.arrays("centre", stored["centre"], fresh["centre"])
    rounding = dict.fromkeys(("offset", "step"), ROUNDING * abs(float(stored["step"])))
    return found + array_differences(stored, fresh, rounding, APART)


def _prefixes(codes: Codes, phases: Sequence[Exact], symbol: int) -> list[list[int]]:
    """Compute the first symbols of each phase, all of them certain."""
    routes = codes(phases, n_symbols=symbol)
    if not routes.certain.all():
        raise NoChange(f"symbol {symbol} is not certain at {phases[0]}: add a higher precision")
    return [list(map(int, column)) for column in routes.codes.T]


def _plain(x: Exact) -> Exact:
    """Shorten a number's text: the same value without the history of how it was found."""
    return x if x.fraction is None else Exact(str(x.fraction), x.fraction, x._evaluate)


def _group(routes: RouteCodes, centre: Exact, step: Exact) -> Tree:
    n = routes.bits.size
    offset = (np.arange(n) - (n - 1) / 2) * float(step)
    place = {"centre": str(centre.at(200)), "offset": offset, "step": float(step)}
    return {
        **datasets(ROUTES, routes._asdict()),
        **datasets(PLACE, place),
    }
