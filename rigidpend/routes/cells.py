"""Route codes of many orbits, each of which may have parameters of its own: cells of a plane."""

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.body import Body, direction
from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers import Array, Scalar
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact, function
from rigidpend.orbits import columns, joined
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes import choice
from rigidpend.routes.certainty import Decided
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit
from rigidpend.routes.run import Run, Starts

OF_BODY = ("mu", "beta0", "alpha0")
"""Parameters of the body that may change from cell to cell."""
AXES = ("log10_J1_0", "h0", *OF_BODY)
"""All parameters that may change from cell to cell, beside theta2_0."""
SHARES = 4
"""Number of parts, of all bodies, that each process gets: few, because each part is sent to it."""

Values: TypeAlias = NDArray[np.float64]
Group: TypeAlias = tuple[dict[str, Values], NDArray[Any]]


class Cells(NamedTuple):
    """Codes of n orbits, the part of them that the cells of a plane keep."""

    codes: NDArray[np.uint8]
    """(n_symbols, n): 0 left, 1 right, 255 no symbol."""
    certain: NDArray[np.uint8]
    """(n,), the number of first symbols that are certain."""
    by_map: NDArray[np.bool_]
    """(n,), True where return maps alone found the orbit, without integration."""


def actions(logarithms: Array) -> Array:
    """J1_0 of decimal logarithms, on every processor those of single cells.

    NumPy's power of an array may round otherwise, with some vectors.
    """
    return np.array([10.0**x for x in logarithms.tolist()])


def cell_problem(problem: RouteProblem, values: Mapping[str, Scalar]) -> RouteProblem:
    """The problem with other values of some parameters, taken as exact, by their names in `AXES`.

    beta0 and alpha0 are in radians, mu and h0 are physical. ParameterError is raised for a value
    that the problem or the body excludes.
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
    """A body with other values; remembered, because many cells have the same body."""
    A, r, mu = body.A, body.r, body.mu
    for name, value in values:
        if name == "mu":
            mu = exact(value)
        elif name == "beta0":
            r = direction(exact(value))
        else:
            if not 0 < float(value) < math.pi:
                raise ParameterError("alpha0", f"pi > alpha0 > 0 is broken: alpha0 = {value}")
            (A1, A2, _), cos = A, function("cos", exact(value) / 2)
            # A1 and A2 are kept: alpha0 is reached by the A3 between them at which (phi) gives it.
            A = A1, A2, A1 * A2 / (A2 + (A1 - A2) * cos**2)
    return Body(A, r, mu) if values else body


def cells_of_starts(
    problem: RouteProblem,
    theta2_0: NDArray[Any],
    J1_0: Values | None,
    arithmetic: Arithmetic,
    jobs: int = 1,
    *,
    ends: tuple[float, float] | None = None,
    orbits: int | None = None,
) -> Cells:
    """Route codes of orbits of one body and h0, by maps or by integration.

    The problem holds what all orbits share; theta2_0 in radians and J1_0, dimensionless, (n,) each,
    are taken as exact. Without J1_0 all orbits have that of the problem. Where the orbits are a
    part of a plane, `ends` are the least and the largest J1_0 of the whole plane, so that all parts
    share one map, and `orbits` is the number of its orbits. No result depends on `jobs`, the number
    of threads.
    """
    if J1_0 is None:
        run = Run(problem, Phases(theta2_0), arithmetic, jobs, task_orbits=orbits)
        return _cells(choice.decide(run))
    least, largest = ends or (float(J1_0.min()), float(J1_0.max()))
    # `Starts` asks for a problem with the largest J1_0 and one with the least.
    lowest, common = (replace(problem, J1_0=exact(x)) for x in (least, largest))
    run = Run(common, Phases(theta2_0), arithmetic, jobs, Starts(J1_0, lowest), task_orbits=orbits)
    return _cells(choice.decide(run))


def cells_of_each(
    problem: RouteProblem,
    values: Mapping[str, Values],
    theta2_0: NDArray[Any],
    arithmetic: Arithmetic,
    jobs: int = 1,
) -> Cells:
    """Route codes of orbits of several bodies, all of them integrated.

    The problem holds what all orbits share. They differ in `values`, (n,) each, by names as in
    :func:`cell_problem`, and in theta2_0, (n,), radians; all are taken as exact. Orbits of one body
    are integrated side by side, whatever their energies and actions. No result depends on `jobs`,
    the number of processes: threads would not do, because most of the work is Python's own, to
    compute where the orbits start.
    """
    groups = _bodies(values, theta2_0.size)
    shares = spread(np.arange(len(groups)), jobs * SHARES, 0)
    parts: list[list[Group]] = [
        [({name: x[here] for name, x in values.items()}, theta2_0[here]) for here in share]
        for share in ([groups[k] for k in numbers] for numbers in shares)
    ]
    found = side_by_side(_of_bodies, (problem, arithmetic), True, parts, jobs)
    # Results come body by body; the inverse permutation restores the order of the cells.
    back = np.argsort(np.concatenate(groups))
    return columns(joined([cells for part in found for cells in part]), back)


def _bodies(values: Mapping[str, Values], n: int) -> list[NDArray[np.intp]]:
    """The indices of the orbits of each body, in arrays, one for a body."""
    bodies: dict[tuple[float, ...], list[int]] = {}
    of_body = [values[name].tolist() for name in OF_BODY if name in values]
    for k in range(n):
        bodies.setdefault(tuple(x[k] for x in of_body), []).append(k)
    return [np.array(columns) for columns in bodies.values()]


def _of_bodies(
    groups: Sequence[Group], problem: RouteProblem, arithmetic: Arithmetic
) -> list[Cells]:
    """Route codes of some groups of orbits, each group of one body."""
    found = []
    for values, theta2_0 in groups:
        each: Any = zip(*(x.tolist() for x in values.values()), strict=True)
        problems = [cell_problem(problem, dict(zip(values, cell, strict=True))) for cell in each]
        # One limit for all orbits of the body: that of the orbit which waits longest.
        patient = max(problems, key=lambda one: passage_limit(one, arithmetic.precisions[0]))
        run = Run(patient, Phases(theta2_0), arithmetic, problems=problems)
        found.append(_cells(choice.decide(run, "integration")))
    return found


def _cells(found: Decided) -> Cells:
    """The part of decided orbits that a plane keeps."""
    # No symbol behind an uncertain one is certain, so that the number of certain symbols is enough.
    certain = found.certain.sum(axis=0).astype(np.uint8)
    return Cells(symbols(found.crossings.separatrix), certain, found.by_map)
