"""Route codes of orbits each of which may have a body and an energy of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigidpend.body import Body
from rigidpend.integrate.arithmetic import Arithmetic
from rigidpend.routes import certainty
from rigidpend.routes.codes import Run
from rigidpend.routes.phases import Phases
from rigidpend.routes.plane import Cells, IntegratedStarts, cells_of
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.run.workers import side_by_side, spread

SHARES = 4
"""Parts of the bodies that each process gets: few, for each is sent to it."""


def cells_of_each(
    problems: Sequence[RouteProblem],
    theta2_0: NDArray[np.float64],
    arithmetic: Arithmetic,
    jobs: int = 1,
) -> Cells:
    """Route codes of orbits of several bodies, all of them integrated.

    Orbits of one body go side by side, whatever their energies.

    Parameters
    ----------
    problems : sequence of n RouteProblem
        All with as many symbols.
    theta2_0 : (n,) array
        Radians; the doubles are taken as exact.
    arithmetic : Arithmetic
    jobs : int, optional
        Processes, for most of the work is to begin the orbits. No result depends on it.
    """
    bodies: dict[Body, list[int]] = {}
    for k, problem in enumerate(problems):
        bodies.setdefault(problem.body, []).append(k)
    groups = [np.array(columns) for columns in bodies.values()]
    shares = spread(np.arange(len(groups)), jobs * SHARES, 0)
    parts = [
        [([problems[k] for k in groups[i]], theta2_0[groups[i]]) for i in share] for share in shares
    ]
    found = side_by_side(_decided, (arithmetic,), True, parts, jobs)
    back = np.argsort(np.concatenate(groups))
    codes, certain, by_map = zip(*(cells for part in found for cells in part), strict=True)
    return Cells(
        np.concatenate(codes, axis=1)[:, back],
        np.concatenate(certain)[back],
        np.concatenate(by_map)[back],
    )


def _decided(
    groups: Sequence[tuple[Sequence[RouteProblem], NDArray[np.float64]]], arithmetic: Arithmetic
) -> list[Cells]:
    return [_of_one_body(*group, arithmetic) for group in groups]


def _of_one_body(
    problems: Sequence[RouteProblem], theta2_0: NDArray[np.float64], arithmetic: Arithmetic
) -> Cells:
    # The longest wait and the fastest rate of all: what is certain by them is by an orbit's own.
    patient = max(problems, key=lambda problem: passage_limit(problem, arithmetic.precisions[0]))
    run = Run(patient, Phases(theta2_0), arithmetic, 1)
    integrated = IntegratedStarts(run, np.arange(len(problems)), problems.__getitem__)
    rate = max(map(phase_rate, problems))
    found = certainty.decide(integrated.crossings, len(problems), rate, arithmetic.precisions)
    return cells_of(found, np.zeros(len(problems), dtype=bool))
