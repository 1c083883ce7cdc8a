"""Answers of any method that carries states on and finds crossings, alike for all of them.

A module of a peer has two functions, which make ready for states (d, n), M and gamma:

- ``ends(body, states, tolerance, **setting)`` gives a function from states, their time and n
  later ones to the states then; of 8 components the last two are theta3 and alpha;
- ``crossings(task, states, tolerance, **setting)`` gives a function without arguments, which
  finds time, M1 and M2 at the crossings of M3 = 0: (3, wanted, n), NaN where there is none.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    MotionTask,
    RouteTask,
    Solver,
    carrier,
    crossed,
)
from rigidpend.numbers.doubles import Array


def motion(peer: Any, task: MotionTask, tolerance: float, threads: int, **setting: Any) -> Carrier:
    """Carry orbits in M and gamma."""

    def part(first: Array) -> Carrier:
        ends = peer.ends(task.body, first, tolerance, **setting)
        return carrier(first, lambda y, start, end: ends(y, start, np.full(y.shape[1], end)))

    made: Carrier = shared_out(part, task.states, threads)
    return made


def angle(peer: Any, task: AngleTask, tolerance: float, threads: int, **setting: Any) -> Solver:
    """Give alpha(T), with the quadratures of theta3 and alpha."""
    ends = peer.ends(task.problem.body, task.states, tolerance, **setting)
    return Solver(lambda: ends(task.states, 0.0, task.ends), lambda found: found[7])


def codes(peer: Any, task: RouteTask, tolerance: float, threads: int, **setting: Any) -> Solver:
    """Give the symbols between crossings of M3 = 0."""

    def part(states: Array) -> Callable[[], Array]:
        find: Callable[[], Array] = peer.crossings(task, states, tolerance, **setting)
        return find

    solve = shared_out(part, task.states, threads)
    return Solver(solve, lambda found: crossed(found[0], found[1:], task.problem.body))


def shared_out(make: Callable[[Any], Any], states: Any, threads: int) -> Any:
    """Call ``make(states)`` with the columns of `states` shared out among threads.

    It serves every method that leaves Python's lock while it computes. Others gain nothing.

    Parameters
    ----------
    make : callable
        Gives a `Carrier`, or a function without arguments that returns an array, or a named
        tuple of arrays, with the orbits last.
    states : (d, n) array
    threads : int
    """
    if threads == 1:
        return make(states)
    parts = [make(part) for part in np.array_split(states, threads, axis=1) if part.shape[1]]
    pool = ThreadPoolExecutor(len(parts))
    if isinstance(parts[0], Carrier):
        return Carrier(
            lambda: [part.start() for part in parts],
            lambda time: list(pool.map(lambda part: part.to(time), parts)),
            lambda: np.concatenate([part.states() for part in parts], axis=1),
        )
    return lambda: _joined(list(pool.map(lambda solve: solve(), parts)))


def one_by_one(find: Callable[[Array], Array], states: Array) -> Callable[[], Array]:
    """Give a function that finds something of one orbit after the other; orbits last."""
    return lambda: np.stack([find(state) for state in states.T], axis=-1)


def _joined(found: list[Any]) -> Any:
    if isinstance(found[0], tuple):
        made: Any = type(found[0])
        return made(*(np.concatenate(each, axis=-1) for each in zip(*found, strict=True)))
    return np.concatenate(found, axis=-1)
