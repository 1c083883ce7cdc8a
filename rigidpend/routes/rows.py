"""Rows of a plane: the problem of Fig. 4 with one of its parameters replaced."""

from __future__ import annotations

import math
from dataclasses import replace

from rigidpend.body import Body, BodyError
from rigidpend.numbers.exact import exact, function
from rigidpend.routes.problem import RouteProblem

AXES = ("log10_J1_0", "mu", "h0", "beta0", "alpha0")
"""Parameters that may change from row to row."""


def row_problem(problem: RouteProblem, axis: str, value: float) -> RouteProblem:
    """The problem with the value of an axis, the double taken as exact.

    Parameters
    ----------
    problem : RouteProblem
    axis : str
        One of `AXES`; beta0 and alpha0 in radians, the rest dimensionless.
    value : float

    Raises
    ------
    ParameterError
        A value that the problem or the body excludes.
    """
    body = problem.body
    if axis == "log10_J1_0":
        return replace(problem, J1_0=exact(10.0**value))
    if axis == "h0":
        return replace(problem, h0=exact(value))
    if axis == "mu":
        return replace(problem, body=Body(body.A, body.r, value))
    half = exact(value) / 2
    cos, sin = function("cos", half), function("sin", half)
    if axis == "beta0":
        # r = (cos, sin) of beta0/2, by (phi).
        return replace(problem, body=Body(body.A, (cos, sin, 0), body.mu))
    if not 0 < value < math.pi:
        raise BodyError("alpha0", f"pi > alpha0 > 0 is broken: alpha0 = {value}")
    A1, A2, _ = body.A
    # The A3 between A1 and A2 at which (phi) gives this alpha0.
    A3 = A1 * A2 / (A1 * cos * cos + A2 * sin * sin)
    return replace(problem, body=Body((A1, A2, A3), body.r, body.mu))
