"""Experiment `precession`: increments of theta3 along the separatrices, true and by (tri1)."""

import itertools
import math
from collections.abc import Iterable
from functools import partial

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments import shared
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.precession import CALM, SLOPE, UNCERTAINTY, UPRIGHT
from rigidpend.experiments.precession.schema import Config
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.in_space import increments, regime
from rigidpend.numbers import Array
from rigidpend.numbers.exact import Exact
from rigidpend.surfaces import heteroclinic

ORBITS, DEEPER = 0.026, 0.002
"""Seconds of a core for the orbits of a body at one mu, and those for each unit of nu.

Measured with twelve bodies, at nine mu each."""


def compute(config: Config, means: Means) -> Tree:
    """Integrate the heteroclinic orbits of every body at every mu."""
    problem = config.problem
    found = {name: means.part(name, partial(_body, config, name, means)) for name in problem.bodies}
    return {
        "mu_over_h0": shared.mu_over_h0(problem),
        "drawn": problem.mu.index(problem.drawn),
        "bodies": shared.stacked(found),
    }


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on one core."""
    problem = config.problem
    each = (ORBITS + DEEPER * shape.body.nu for shape in problem.bodies.values())
    return len(problem.mu) * sum(each)


def _body(config: Config, name: str, means: Means) -> Tree:
    """Compute the fields of one body."""
    problem, h0 = config.problem, float(config.problem.h0)
    bodies = [problem.bodies[name].heavy(mu) for mu in problem.mu]
    found = [_increments(name, body, problem.h0, means) for body in bodies]
    first = np.array([increments(body.angles(113), h0) for body in bodies])
    gained = np.array([x.gained for x in found])
    unit = np.array([unit_of(body, h0) for body in bodies])
    least = [float((problem.h0 - mu) / problem.h0) for mu in problem.mu]
    error = np.array(
        [uncertainty(x, y, bodies[0].nu, z) for x, y, z in zip(found, unit, least, strict=True)]
    )
    mean, ratio, order = gained.mean(axis=1), shared.mu_over_h0(problem), regime(bodies[0])
    rests = {
        "remainder": np.abs(gained - first[:, None]).max(axis=1),
        "mean_remainder": np.abs(mean - first),
    }
    # A remainder with a relative error of SLOPE leaves about that error in the slope.
    slope, mean_slope = (
        np.array([shared.slope(ratio, values, error / SLOPE) for values in rest.T])
        for rest in rests.values()
    )
    slopes = ", ".join("not fitted" if math.isnan(x) else f"{x:.3f}" for x in slope)
    means.report(f"{name}: {order}, slopes of the remainder {slopes}")
    return {
        "alpha0": bodies[0].alpha0,
        "beta0": bodies[0].beta0,
        "regime": str(order),
        "unit": unit,
        "first_order": first,
        "gained": gained,
        "error": error,
        **rests,
        "slope": slope,
        "mean_slope": mean_slope,
        "ordered": np.array([in_order(*x, order.value) for x in zip(mean, error, strict=True)]),
    }


def _increments(name: str, body: Body, h0: Exact, means: Means) -> heteroclinic.Increments:
    """Increments of a body at one mu; NaN, with the reason reported, if they cannot be found."""
    try:
        return heteroclinic.increments(body, h0, means.arithmetic)
    except ArithmeticError as error:
        means.report(f"body {name}, mu = {body.mu}: {error}; take less weight")
        return heteroclinic.Increments(*np.full((2, 2, 4), np.nan))


def uncertainty(found: heteroclinic.Increments, unit: float, nu: float, least: float) -> float:
    """Error of a body's increments: their own estimate, and rounding of the integration on top.

    `least` is the smallest energy above the highest point over the whole, (h0 - mu)/h0.
    """
    rounding = max(UNCERTAINTY * max(1.0, nu / CALM), UPRIGHT / least)
    return float(found.error.max()) + rounding * unit


def unit_of(body: Body, h0: float) -> float:
    """Increment of (tri1) where its sine is one."""
    # theta1 = alpha0 + beta0 = pi on separatrix 2, where the sine of (tri1) is 1.
    p = body.angles()
    return float(increments(p._replace(beta0=np.pi - p.alpha0), h0)[1])


def in_order(gained: Array, error: float, groups: Iterable[Iterable[int]]) -> bool:
    """True if the increments of 1, 2, 3, 4 stand in the order of a regime.

    Inside a group they are equal to within twice the error, and less than in the group before;
    number 0 stands for an increment of zero.
    """
    with_zero = np.array([0.0, *gained])
    sorted_groups = [with_zero[list(group)] for group in groups]
    equal = all(np.ptp(group) <= 2 * error for group in sorted_groups)
    pairs = itertools.pairwise(sorted_groups)
    return bool(equal and all(high.min() > low.max() + 2 * error for high, low in pairs))


def describe(config: Config) -> list[Row]:
    """The increments of each body by the first order."""
    problem, rows = config.problem, []
    for name, shape in problem.bodies.items():
        body = shape.heavy(problem.drawn)
        first = ", ".join(f"{x:+.5f}" for x in increments(body.angles(113), float(problem.h0)))
        meaning = f"rad, along 1, 2, 3, 4 by (tri1) at mu = {body.mu}; {regime(body)}"
        rows.append(Row(f"body {name}", first, meaning))
    return rows
