"""Rows of a plane: the problem of Fig. 4 with one of its parameters replaced."""

from __future__ import annotations

from dataclasses import replace

from rigidpend.body import Body
from rigidpend.numbers.exact import exact, function
from rigidpend.routes.problem import RouteProblem

AXES = ("log10_J1_0", "mu", "h0", "beta0")
"""Parameters that may change from row to row."""


def row_problem(problem: RouteProblem, axis: str, value: float) -> RouteProblem:
    """The problem with the value of an axis, the double taken as exact.

    Parameters
    ----------
    problem : RouteProblem
    axis : str
        One of `AXES`; beta0 in radians, the rest dimensionless.
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
    # r = (cos, sin) of beta0/2, by (phi).
    half = exact(value) / 2
    direction = function("cos", half), function("sin", half), 0
    return replace(problem, body=Body(body.A, direction, body.mu))
