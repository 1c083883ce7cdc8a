"""Answers of any method that carries states on and finds crossings, alike for all of them.

A module of a peer has two functions, which make ready for states (d, n), M and gamma:

- ``ends(body, states, tolerance, **setting)`` gives a function from states, their time and n
  later ones to the states then; of 8 components the last two are theta3 and alpha;
- ``crossings(task, states, tolerance, **setting)`` gives a function without arguments, which
  finds time, M1 and M2 at the crossings of M3 = 0: (3, wanted, n), NaN where there is none.

A module that has another way has ``answered(task, knob, threads, **setting)`` besides, which
gives a :class:`Solver`, or None for what the two functions do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.problems import Crossed, Task
from rigidpend.experiments.bench.measuring.solvers import Solver, crossed, in_looks, shared_out
from rigidpend.experiments.bench.methods import METHODS, CheckRun, Setting
from rigidpend.numbers.doubles import Array


def made(name: str, task: Task, entry: Setting, threads: int = 1) -> Solver:
    """A method made ready for a task, with its knob and its setting; imports what it needs."""
    method = METHODS[name]
    if method.runs:
        return compared(task, *(_of_run(run, threads) for run in method.runs))
    source, words = _source(method.source), {**method.told, **entry["setting"]}
    own = getattr(source, "answered", None)
    found = own and own(task, entry["knob"], threads, **words)
    return found or _by_the_two(source, task, entry["knob"], threads, words)


def _source(name: str) -> Any:
    """A module of methods; each is imported alone, for it may need what is not installed."""
    found: Any
    # Spelt out, so that the hash of the code that computes finds them.
    match name:
        case "ours":
            from rigidpend.experiments.bench.measuring import ours as found
        case "heyoka":
            from rigidpend.experiments.bench.measuring import heyoka_batches as found
        case "cyrk":
            from rigidpend.experiments.bench.measuring import cyrk_compiled as found
        case "diffrax":
            from rigidpend.experiments.bench.measuring import diffrax_vmapped as found
        case "scipy":
            from rigidpend.experiments.bench.measuring import scipy_abreast as found
    return found


def _by_the_two(source: Any, task: Task, knob: Any, threads: int, words: Setting) -> Solver:
    if task.kind == "routes":

        def crossings(part: Task) -> Any:
            return source.crossings(part, part.states, knob, **words)

        find = shared_out(crossings, task, threads)
        return Solver(find, lambda found: crossed(found[0], found[1:], task.body))

    def carried(part: Task) -> Callable[[], Array]:
        return in_looks(part, source.ends(part.body, part.states, knob, **words))

    alpha = {"read": lambda found: found[-1, 7]} if task.kind == "angle" else {}
    return Solver(shared_out(carried, task, threads), **alpha)


def _of_run(run: CheckRun, threads: int) -> Callable[[Task], Solver]:
    method = METHODS[run.method]
    usual = {**method.forms[len(method.forms) // 2], **method.variants[0]}
    entry = {"knob": run.tolerance, "setting": usual | run.setting}
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
