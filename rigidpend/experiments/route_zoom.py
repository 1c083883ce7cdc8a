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
from typing import Any

import numpy as np

from rigidpend.exact import Exact
from rigidpend.experiments import Means, Row
from rigidpend.experiments.route_codes import MEANING, array_differences
from rigidpend.experiments.rows import body_rows
from rigidpend.routes.codes import RouteCodes, route_codes
from rigidpend.routes.phases import Grid
from rigidpend.tree import Dataset, Tree

Codes = Callable[..., RouteCodes]


class NoChange(ValueError):
    """The symbol does not change between two phases, or one before it does."""


def compute(config: Any, means: Means) -> Tree:
    """Compute every level of a config.

    Parameters
    ----------
    config : rigidpend.config.schema.route_zoom.Config
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
        engine=means.engine,
        tolerance=None if config.numerics.tolerance is None else float(config.numerics.tolerance),
        precisions=config.numerics.precisions,
        jobs=means.jobs,
    )
    low, high = problem.between
    step, groups = problem.step, {}
    for level in range(problem.levels):
        low, high = bisect(codes, low, high, problem.symbol, float(step) / 2)
        centre = (low + high) / 2
        grid = Grid(centre - step * (problem.count - 1) / 2, step, problem.count)
        routes = codes(grid, n_symbols=problem.n_symbols)
        groups[f"level{level:02d}"] = _group(routes, centre, step)
        means.report(f"{level + 1}/{problem.levels}: step {float(step):.0e}, {_bits(routes)} bits")
        step = step / problem.factor
    growth = math.exp(math.pi**2 / problem.body.nu)
    same = Dataset(growth, "1", "zoom after which the rows repeat, exp(pi^2/nu)")
    changed = Dataset(problem.symbol, "1", "the symbol that changes at the centre")
    return {"levels": groups, "repeats_after": same, "symbol": changed}


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


def describe(config: Any) -> list[Row]:
    """What a config asks for, with what follows from it: for people, units named."""
    problem = config.problem
    finest = float(problem.step) / problem.factor ** (problem.levels - 1)
    return [
        *body_rows(problem.body),
        Row("h0", str(problem.h0), "energy constant, kappa J2_0^2/2"),
        Row("J1_0", str(problem.J1_0), "initial action, dimensionless"),
        Row("between", ", ".join(map(str, problem.between)), "rad, theta2_0"),
        Row("symbol", str(problem.symbol), "whose change is sought"),
        Row("levels", f"{problem.levels} of {problem.count} columns", "each finer by the factor"),
        Row("steps", f"{float(problem.step):.3g} to {finest:.3g}", "rad, spacing of columns"),
    ]


def differences(stored: Any, fresh: Any) -> list[str]:
    """Where two results of the same config disagree by more than their arithmetic explains."""
    old, new = stored["levels"], fresh["levels"]
    found = [f"{name} is in one file only" for name in sorted(set(old) ^ set(new))]
    for name in sorted(set(old) & set(new)):
        if str(old[name]["centre"]) != str(new[name]["centre"]):
            found.append(f"{name}: centre {old[name]['centre']}, computed {new[name]['centre']}")
        found += [
            f"{name}: {text}" for text in array_differences(old[name], new[name], ("offset",))
        ]
    return found


def _prefixes(codes: Codes, phases: Sequence[Exact], symbol: int) -> list[list[int]]:
    """The first symbols of each phase, all of them certain."""
    routes = codes(phases, n_symbols=symbol)
    if not routes.certain.all():
        raise NoChange(f"symbol {symbol} is not certain at {phases[0]}: add a higher precision")
    return [list(map(int, column)) for column in routes.codes.T]


def _plain(x: Exact) -> Exact:
    """The same number without the history of how it was found."""
    return x if x.fraction is None else Exact(str(x.fraction), x.fraction, x._evaluate)


def _bits(routes: RouteCodes) -> str:
    return " and ".join(map(str, np.unique(routes.bits)))


def _group(routes: RouteCodes, centre: Exact, step: Exact) -> Tree:
    kept = {name: Dataset(getattr(routes, name), *MEANING[name]) for name in list(MEANING)[1:]}
    n = routes.bits.size
    offset = (np.arange(n) - (n - 1) / 2) * float(step)
    digits = str(centre.at(200))
    return {
        **kept,
        "centre": Dataset(digits, "rad", "theta2_0 of the middle, more digits than doubles have"),
        "offset": Dataset(offset, "rad", "theta2_0 of each column less the centre"),
        "step": Dataset(float(step), "rad", "spacing of the columns"),
    }
