"""Answers of any method by its name, and cross-checks of peers.

Every module of methods has ``answered(task, knob, threads, **setting)``, which gives a
:class:`Solver`. It imports `solvers`, so that the choice among them is apart.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.problems import Crossed, Task
from rigidpend.experiments.bench.measuring.solvers import Solver
from rigidpend.experiments.bench.methods import METHODS, CheckRun, Setting


def made(name: str, task: Task, entry: Setting, threads: int = 1) -> Solver:
    """A method made ready for a task, with its knob and its setting; imports what it needs."""
    method = METHODS[name]
    if method.runs:
        return compared(task, *(_of_run(run, threads) for run in method.runs))
    found: Any
    # Each alone, for it may need what is not installed; spelt out, so that the hash of the code
    # that computes finds them.
    match method.family:
        case "ours" | "lie_poisson":
            from rigidpend.experiments.bench.measuring import ours as found
        case "heyoka":
            from rigidpend.experiments.bench.measuring import heyoka_batches as found
        case "cyrk":
            from rigidpend.experiments.bench.measuring import cyrk_compiled as found
        case "diffrax":
            from rigidpend.experiments.bench.measuring import diffrax_vmapped as found
        case "scipy":
            from rigidpend.experiments.bench.measuring import scipy_abreast as found
    solver: Solver = found.answered(task, entry["knob"], threads, **method.told, **entry["setting"])
    return solver


def _of_run(run: CheckRun, threads: int) -> Callable[[Task], Solver]:
    entry = {"knob": run.tolerance, "setting": METHODS[run.method].usual | run.setting}
    return lambda task: made(run.method, task, entry, threads)


def compared(task: Task, *runs: Callable[[Task], Solver]) -> Solver:
    """Cross-check of a peer: run twice, compare, and run the columns that differ a third time.

    A symbol is trusted where two runs agree on it and on all before it. Where the first two differ
    the third decides, if it agrees with one of them. Nothing tells how near an agreement must be,
    as it does for ours: runs of one formulation err alike.
    """
    first, second, third = runs
    solvers = [first(task), second(task)]

    def solve() -> Crossed:
        a, b = (solver.read(solver.solve()) for solver in solvers)
        trusted = np.logical_and.accumulate(a.codes == b.codes, axis=0)
        codes, doubtful = a.codes.copy(), np.flatnonzero(~trusted.all(axis=0))
        if doubtful.size:
            # What is compiled for other orbits serves these; only their states are new.
            again = third(task.of(doubtful))
            c = again.read(again.solve())
            for other in (a, b):
                same = np.logical_and.accumulate(other.codes[:, doubtful] == c.codes, axis=0)
                trusted[:, doubtful] |= same
            codes[:, doubtful] = c.codes
        return Crossed(codes, a.time, trusted)

    return Solver(solve)
