"""Route codes of orbits each of which may have a body and an energy of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes import certainty
from rigidpend.routes.codes import Run, longest_wait
from rigidpend.routes.phases import Phases
from rigidpend.routes.plane import Cells, IntegratedStarts, cells_of
from rigidpend.routes.problem import RouteProblem, phase_rate
from rigidpend.routes.rows import OF_BODY, cell_problem

SHARES = 4
"""Parts of the bodies that each process gets: few, for each is sent to it."""

Values: TypeAlias = NDArray[np.float64]
Group: TypeAlias = tuple[dict[str, Values], Values]


def cells_of_each(
    problem: RouteProblem,
    values: Mapping[str, Values],
    theta2_0: Values,
    arithmetic: Arithmetic,
    jobs: int = 1,
) -> Cells:
    """Route codes of orbits of several bodies, all of them integrated.

    Orbits of one body go side by side, whatever their energies and actions.

    Parameters
    ----------
    problem : RouteProblem
        What is common to all.
    values : mapping of (n,) arrays
        What is not, as for `cell_problem`.
    theta2_0 : (n,) array
        Radians; the doubles are taken as exact.
    arithmetic : Arithmetic
    jobs : int, optional
        Processes, for most of the work is to begin the orbits. No result depends on it.

    Raises
    ------
    ParameterError
        A value that the problem or the body excludes.
    """
    groups = _bodies(values, theta2_0.size)
    shares = spread(np.arange(len(groups)), jobs * SHARES, 0)
    parts: list[list[Group]] = [
        [({name: x[here] for name, x in values.items()}, theta2_0[here]) for here in share]
        for share in ([groups[k] for k in numbers] for numbers in shares)
    ]
    found = side_by_side(_decided, (problem, arithmetic), True, parts, jobs)
    back = np.argsort(np.concatenate(groups))
    codes, certain, by_map = zip(*(cells for part in found for cells in part), strict=True)
    return Cells(
        np.concatenate(codes, axis=1)[:, back],
        np.concatenate(certain)[back],
        np.concatenate(by_map)[back],
    )


def _bodies(values: Mapping[str, Values], n: int) -> list[NDArray[np.intp]]:
    """The numbers of the orbits of each body."""
    bodies: dict[tuple[float, ...], list[int]] = {}
    of_body = [values[name].tolist() for name in OF_BODY if name in values]
    for k in range(n):
        bodies.setdefault(tuple(x[k] for x in of_body), []).append(k)
    return [np.array(columns) for columns in bodies.values()]


def _decided(groups: Sequence[Group], problem: RouteProblem, arithmetic: Arithmetic) -> list[Cells]:
    return [_of_one_body(*group, problem, arithmetic) for group in groups]


def _of_one_body(
    values: Mapping[str, Values], theta2_0: Values, problem: RouteProblem, arithmetic: Arithmetic
) -> Cells:
    each = zip(*(x.tolist() for x in values.values()), strict=True)
    problems = [cell_problem(problem, dict(zip(values, cell, strict=True))) for cell in each]
    # The longest wait and the fastest rate of all: what is certain by them is by an orbit's own.
    patient = max(problems, key=lambda one: longest_wait(one, arithmetic.precisions[0]))
    run = Run(patient, Phases(theta2_0), arithmetic, 1)
    integrated = IntegratedStarts(run, np.arange(len(problems)), problems.__getitem__)
    rate = max(map(phase_rate, problems))
    found = certainty.decide(integrated.crossings, len(problems), rate, arithmetic.precisions)
    return cells_of(found, np.zeros(len(problems), dtype=bool))
