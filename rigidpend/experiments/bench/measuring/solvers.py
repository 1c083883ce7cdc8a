"""Solvers: a method made ready for a task, its orbits in looks and shared among threads.

Most methods carry states on, and find crossings by themselves: two functions of a part of the
orbits, M and gamma, which :func:`answering` makes the answer to any task.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.measuring.fields import time_unit
from rigidpend.experiments.bench.measuring.problems import Crossed, Task
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array
from rigidpend.routes.cycle import symbols


class Solver(NamedTuple):
    """A method made ready for a task."""

    solve: Callable[[], Any]
    """All the work that is timed."""
    read: Callable[[Any], Any] = lambda found: found
    """From what `solve` gave to the answer: states (k, d, n), `Crossed`, or alpha (n,)."""


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
