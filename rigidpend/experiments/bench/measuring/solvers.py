"""Solvers: any method made ready for a task by its name, its orbits in looks and among threads.

Every module of methods has ``answered(task, knob, threads, **setting)``, which gives a
:class:`Solver`. Most methods carry states on, and find crossings by themselves: two functions of a
part of the orbits, M and gamma, which :func:`answering` makes the answer to any task.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.measuring.fields import time_unit
from rigidpend.experiments.bench.measuring.problems import Crossed, Task
from rigidpend.experiments.bench.methods import METHODS, CheckRun, Setting
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array
from rigidpend.routes.cycle import symbols


class Solver(NamedTuple):
    """A method made ready for a task."""

    solve: Callable[[], Any]
    """All the work that is timed."""
    read: Callable[[Any], Any] = lambda found: found
    """From what `solve` gave to the answer: states (k, d, n), `Crossed`, or alpha (n,)."""


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


Ends = Callable[[Any, float, Array], Any]
"""A function from states (d, n), their time and n later ones to the states then.

Of 8 components the last two are theta3 and alpha.
"""


def answering(
    task: Task,
    threads: int,
    ends: Callable[[Task], Ends],
    crossings: Callable[[Task], Callable[[], Array]],
) -> Solver:
    """The answer of a method that is made ready for a part of the orbits by two functions.

    The one gives a function that carries their states on, the other one that finds time, M1 and
    M2 at their crossings of M3 = 0: (3, wanted, n), NaN where there is none.
    """
    if task.kind == "routes":
        find = shared_out(crossings, task, threads)
        return Solver(find, lambda found: crossed(found[0], found[1:], task.body))
    solve = shared_out(lambda part: in_looks(part, ends(part)), task, threads)
    return Solver(solve, lambda found: found[-1, 7]) if task.kind == "angle" else Solver(solve)


def in_looks(task: Task, ends: Ends) -> Callable[[], Array]:
    """Give a function that carries states from look to look: (k, d, n)."""

    def solve() -> Array:
        states, time, found = task.states, 0.0, []
        for times in task.times:
            states = ends(states, time, times)
            time = times[0]
            found.append(states)
        return np.array(found)

    return solve


def shared_out(make: Callable[[Task], Any], task: Task, threads: int) -> Callable[[], Any]:
    """Give ``make(task)``, a function without arguments, with the orbits shared among threads.

    It serves every method that leaves Python's lock while it computes. What is found has the
    orbits last: an array, or a named tuple of arrays.
    """
    if threads == 1:
        return make(task)
    columns = np.array_split(np.arange(task.states.shape[1]), threads)
    parts = [make(task.of(part)) for part in columns if part.size]
    pool = ThreadPoolExecutor(len(parts))
    return lambda: np.concatenate(list(pool.map(lambda solve: solve(), parts)), axis=-1)


def crossed(time: Any, M: Any, body: Body) -> Crossed:
    """The answer from what was found at crossings of M3 = 0.

    `time` is physical, (n_symbols + 1, n), NaN where there is no crossing; `M` are M1 and M2
    there, (2, n_symbols + 1, n), or near enough to have the signs of Qp and Qm.
    """
    # M3 goes upwards and downwards in turn.
    rising = np.arange(len(time))[:, None] % 2 == 0
    half = body.alpha0 / 2
    along, across = math.cos(half) * M[0], math.sin(half) * M[1]
    beside = np.where(rising, np.where(along + across > 0, 2, 4), np.where(along < across, 1, 3))
    return Crossed(
        symbols(np.where(np.isnan(time), 0, beside)).astype(np.uint8), time_unit(body) * time
    )
