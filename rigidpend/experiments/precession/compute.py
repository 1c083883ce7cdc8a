"""Experiment `precession`: increments of theta3 along the separatrices, true and by (tri1)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments import shared
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree, datasets
from rigidpend.experiments.precession import BODIES, LAYOUT, SLOPE, UNCERTAINTY
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.in_space import increments, regime
from rigidpend.numbers.generic import Array
from rigidpend.surfaces import heteroclinic

if TYPE_CHECKING:
    from rigidpend.experiments.precession.schema import Config


def compute(config: Config, means: Means) -> Tree:
    """Integrate the heteroclinic orbits of every body at every mu.

    Returns
    -------
    Tree
        `mu_over_h0`; `drawn`, the place in it of the mu to be shown; `bodies`.
    """
    problem = config.problem
    found: dict[str, Any] = {
        name: means.part(name, partial(_body, config, name, means)) for name in problem.bodies
    }
    values = {
        "mu_over_h0": shared.mu_over_h0(problem),
        "drawn": problem.mu.index(problem.drawn),
        "bodies": shared.joined(found),
    }
    return datasets(LAYOUT, values)


def _body(config: Config, name: str, means: Means) -> Tree:
    """Compute the fields of one body."""
    problem = config.problem
    bodies = [problem.bodies[name].heavy(mu) for mu in problem.mu]
    found = [heteroclinic.increments(body, problem.h0, means.arithmetic) for body in bodies]
    values = _told(bodies, float(problem.h0), found)
    slopes = ", ".join(f"{x:.3f}" for x in values["slope"])
    means.report(f"{name}: {values['regime']}, slopes of the remainder {slopes}")
    return datasets(BODIES, values)


def _told(bodies: list[Body], h0: float, found: list[heteroclinic.Increments]) -> dict[str, Any]:
    first = np.array([increments(body.angles(), h0) for body in bodies])
    gained = np.array([x.gained for x in found])
    unit = np.array([unit_of(body, h0) for body in bodies])
    error = np.array([uncertainty(*pair) for pair in zip(found, unit, strict=True)])
    mu_over_h0 = np.array([float(body.mu) for body in bodies]) / h0
    remainder = np.abs(gained - first[:, None]).max(axis=1)
    mean = gained.mean(axis=1)
    mean_remainder = np.abs(mean - first)
    groups = regime(bodies[0]).value
    return {
        "alpha0": bodies[0].alpha0,
        "beta0": bodies[0].beta0,
        "regime": str(regime(bodies[0])),
        "unit": unit,
        "first_order": first,
        "gained": gained,
        "error": error,
        "remainder": remainder,
        "mean_remainder": mean_remainder,
        "slope": _slopes(mu_over_h0, remainder, error),
        "mean_slope": _slopes(mu_over_h0, mean_remainder, error),
        "ordered": np.array([in_order(x, groups, e) for x, e in zip(mean, error, strict=True)]),
    }


def uncertainty(found: heteroclinic.Increments, unit: float) -> float:
    """Error of a body's increments: the quadrature's, and rounding, of which it knows nothing."""
    return float(found.error.max()) + UNCERTAINTY * unit


def unit_of(body: Body, h0: float) -> float:
    """Increment of (tri1) where its sine is one."""
    # theta1 = alpha0 + beta0 = pi on separatrix 2, where the sine of (tri1) is 1.
    p = body.angles()
    return float(increments(p._replace(beta0=np.pi - p.alpha0), h0)[1])


def in_order(gained: Array, groups: Iterable[Iterable[int]], error: float) -> bool:
    """True if the increments of 1, 2, 3, 4 stand in the order of a regime.

    Parameters
    ----------
    gained : (4,) array
    groups : groups of separatrices, 0 for no increment
        Equal inside a group, less in each group than in the one before.
    error : float
        By how much equal increments may differ.
    """
    # Number 0 is no increment, as in `Regime`.
    with_zero = np.array([0.0, *gained])
    sorted_groups = [with_zero[list(group)] for group in groups]
    equal = all(np.ptp(group) <= 2 * error for group in sorted_groups)
    pairs = itertools.pairwise(sorted_groups)
    return bool(equal and all(high.min() > low.max() + 2 * error for high, low in pairs))


def _slopes(mu_over_h0: Array, remainder: Array, error: Array) -> Array:
    """Fit slopes in mu of (n, 4) values, both logarithmic, to those that are well known."""
    # A remainder known to SLOPE of itself leaves the slope about as uncertain.
    floor = 1 / SLOPE * error
    return np.array([shared.slope(mu_over_h0, values, floor) for values in remainder.T])


def describe(config: Config) -> list[Row]:
    """The increments of each body by the first order."""
    problem, rows = config.problem, []
    for name, shape in problem.bodies.items():
        body = shape.heavy(problem.drawn)
        first = ", ".join(f"{x:+.5f}" for x in increments(body.angles(), float(problem.h0)))
        meaning = f"rad, along 1, 2, 3, 4 by (tri1) at mu = {body.mu}; {regime(body)}"
        rows.append(Row(f"body {name}", first, meaning))
    return rows
