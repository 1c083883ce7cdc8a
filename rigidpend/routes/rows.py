"""Cells of a plane: the problem of Fig. 4 with some of its parameters replaced."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping

from rigidpend.mechanics.body import Body, BodyError
from rigidpend.numbers.exact import exact, function
from rigidpend.numbers.generic import Scalar
from rigidpend.routes.problem import RouteProblem

OF_BODY = ("mu", "beta0", "alpha0")
AXES = ("log10_J1_0", "h0", *OF_BODY)
"""Parameters that may change from cell to cell, beside theta2_0."""


def cell_problem(problem: RouteProblem, values: Mapping[str, Scalar]) -> RouteProblem:
    """The problem with other values of some parameters, taken as exact.

    Parameters
    ----------
    problem : RouteProblem
    values : mapping of number
        By names of `AXES`; beta0 and alpha0 in radians, the rest dimensionless.

    Raises
    ------
    ParameterError
        A value that the problem or the body excludes.
    """
    body, h0, J1_0 = problem.body, problem.h0, problem.J1_0
    if "log10_J1_0" in values:
        J1_0 = exact(10.0 ** float(values["log10_J1_0"]))
    if "h0" in values:
        h0 = exact(values["h0"])
    of_body = tuple((name, values[name]) for name in OF_BODY if name in values)
    return RouteProblem(_changed(body, of_body), h0, J1_0, problem.n_symbols)


@functools.lru_cache(maxsize=256)
def _changed(body: Body, values: tuple[tuple[str, Scalar], ...]) -> Body:
    """A body with other values; kept, for many cells have the same."""
    A, r, mu = body.A, body.r, body.mu
    for name, value in values:
        half = exact(value) / 2
        cos = function("cos", half)
        if name == "mu":
            mu = exact(value)
        elif name == "beta0":
            # r = (cos, sin) of beta0/2, by (phi).
            r = cos, function("sin", half), exact(0)
        else:
            if not 0 < float(value) < math.pi:
                raise BodyError("alpha0", f"pi > alpha0 > 0 is broken: alpha0 = {value}")
            A1, A2, _ = A
            # The A3 between A1 and A2 at which (phi) gives this alpha0.
            A = A1, A2, A1 * A2 / (A2 + (A1 - A2) * cos**2)
    return Body(A, r, mu) if values else body
