"""Route codes of many orbits, each of which may have a start of its own: cells of a plane."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body, BodyError
from rigidpend.numbers.exact import exact, function
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes import choice
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run, Starts

OF_BODY = ("mu", "beta0", "alpha0")
AXES = ("log10_J1_0", "h0", *OF_BODY)
"""Parameters that may change from cell to cell, beside theta2_0."""

Values: TypeAlias = NDArray[np.float64]


class Cells(NamedTuple):
    """Codes of n orbits, as a plane's cells keep them."""

    codes: NDArray[np.uint8]
    """(n_symbols, n): 0 left, 1 right, 255 no symbol."""
    certain: NDArray[np.uint8]
    """(n,), the number of first symbols that are certain."""
    by_map: NDArray[np.bool_]
    """(n,), whether return maps found the orbit, not integration."""


def cell_problem(problem: RouteProblem, values: Mapping[str, Scalar]) -> RouteProblem:
    """The problem with other values of some parameters, taken as exact, by names of `AXES`.

    beta0 and alpha0 are in radians, the rest dimensionless. A value that the problem or the body
    excludes is a ParameterError.
    """
    h0, J1_0 = problem.h0, problem.J1_0
    if "log10_J1_0" in values:
        J1_0 = exact(10.0 ** float(values["log10_J1_0"]))
    if "h0" in values:
        h0 = exact(values["h0"])
    of_body = tuple((name, values[name]) for name in OF_BODY if name in values)
    return RouteProblem(_changed(problem.body, of_body), h0, J1_0, problem.n_symbols)


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


def cells_of_starts(
    problem: RouteProblem,
    theta2_0: Values,
    J1_0: Values,
    arithmetic: Arithmetic,
    jobs: int = 1,
    *,
    ends: tuple[float, float] | None = None,
    orbits: int | None = None,
) -> Cells:
    """Route codes of orbits of one body and h0, by maps or by integration.

    The problem is what is common to all; theta2_0 and J1_0, (n,), are taken as exact. If these are
    a part, `ends` are the least and the largest J1_0 of all orbits, so that all share one map, and
    `orbits` is how many there are. No result depends on `jobs`, threads.
    """
    least, largest = ends or (float(J1_0.min()), float(J1_0.max()))
    lowest, common = (replace(problem, J1_0=exact(x)) for x in (least, largest))
    run = Run(common, Phases(theta2_0), arithmetic, jobs, Starts(J1_0, lowest), of=orbits)
    found = choice.decided(run)
    # Behind an uncertain symbol none is certain, so that their number says which.
    certain = found.decided.certain.sum(axis=0).astype(np.uint8)
    return Cells(symbols(found.decided.crossings.separatrix), certain, found.by_map)
