"""Cross-checks of peers: two runs compared, and a third where they differ.

A symbol is trusted where two runs agree on it and on all before it. Where the first two differ the
third decides, if it agrees with one of them. Nothing tells how near an agreement must be, as it
does for ours: runs of one formulation err alike.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import Crossed, RouteTask, Solver, orbits_of

Make = Callable[[RouteTask], Solver]


def compared(task: RouteTask, first: Make, second: Make, third: Make) -> Solver:
    """Run twice, compare, and run the columns that differ a third time."""
    solvers = [first(task), second(task)]

    def solve() -> Crossed:
        a, b = (solver.read(solver.solve()) for solver in solvers)
        trusted = np.logical_and.accumulate(a.codes == b.codes, axis=0)
        codes, doubtful = a.codes.copy(), np.flatnonzero(~trusted.all(axis=0))
        if doubtful.size:
            # What is compiled for other orbits serves these; only their states are new.
            again = third(orbits_of(task, doubtful))
            c = again.read(again.solve())
            for other in (a, b):
                same = np.logical_and.accumulate(other.codes[:, doubtful] == c.codes, axis=0)
                trusted[:, doubtful] |= same
            codes[:, doubtful] = c.codes
        return Crossed(codes, a.time, trusted)

    return Solver(solve, lambda found: found)
