"""SciPy's DOP853, with a right-hand side as fast as Python has it, all orbits as one system.

A call of Python then serves all of them, which was three to eight times faster than one orbit
after the other with `solve_ivp` and its events.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from rigidpend.experiments.bench.solvers import SMALLER, Ends, Solver, Task, answering, flat
from rigidpend.numbers.generic import Array

FALSE_POSITIONS = 12
"""Steps from the ends of a step to the crossings in it."""


def answered(task: Task, tolerance: float, threads: int) -> Solver:
    """The answer to any task."""
    return answering(task, threads, lambda x: _ends(x, tolerance), lambda x: _find(x, tolerance))


def _ends(task: Task, tolerance: float) -> Ends:
    """Give a function that carries states on."""
    rates = flat(task.body, angles=len(task.states) == 8)

    def carry(states: Array, start: float, times: Array) -> Array:
        # Each orbit in units of its own way, so that all of them arrive at 1.
        solver = _solver(rates, states, 1.0, tolerance, times - start)
        while solver.status == "running":
            _step(solver)
        return solver.y.reshape(states.shape)

    return carry


def _find(task: Task, tolerance: float) -> Callable[[], Array]:
    """Give a function that finds crossings by each step's dense output."""
    rates, wanted, states = flat(task.body), task.routes.n_symbols + 1, task.states
    (n, horizon), shape = (states.shape[1], float(task.times.max())), states.shape

    def find() -> Array:
        solver = _solver(rates, states, horizon, tolerance)
        at, count = np.full((3, wanted, n), np.nan), np.zeros(n, dtype=int)
        while solver.status == "running" and (count < wanted).any():
            before = solver.y.reshape(shape)[2]
            _step(solver)
            after = solver.y.reshape(shape)[2]
            columns = np.flatnonzero((before < 0) != (after < 0))
            columns = columns[count[columns] < wanted]
            if columns.size:
                dense = solver.dense_output()
                sides = [before[columns], after[columns]]
                times = _zeros(dense, columns, shape, solver.t_old, solver.t, sides)
                there = dense(times).reshape(*shape, columns.size)
                there = there[:, columns, np.arange(columns.size)]
                at[:, count[columns], columns] = times, there[0], there[1]
                count[columns] += 1
        return at

    return find


def _solver(rates: Any, states: Array, end: float, tolerance: float, unit: Any = None) -> DOP853:
    def abreast(t: float, y: Array) -> Array:
        found = np.empty_like(states)
        rates(found, t, y.reshape(states.shape), None)
        return (found if unit is None else unit * found).ravel()

    make: Any = DOP853
    tolerances = {"rtol": tolerance, "atol": SMALLER * tolerance}
    made: DOP853 = make(abreast, 0.0, states.ravel(), end, **tolerances)
    return made


def _step(solver: DOP853) -> None:
    said = solver.step()
    if solver.status == "failed":
        raise ArithmeticError(said)


def _zeros(dense: Any, columns: Any, shape: Any, start: Any, end: Any, sides: list[Array]) -> Array:
    """The zeros of M3 of each of those orbits between two times, by false positions."""
    (fa, fb), m = sides, columns.size
    a, b = np.full(m, start), np.full(m, end)
    for _ in range(FALSE_POSITIONS):
        c = b - fb * (b - a) / np.where(fb == fa, 1.0, fb - fa)
        fc = dense(c).reshape(*shape, m)[2, columns, np.arange(m)]
        changes = (fc < 0) != (fb < 0)
        a, fa = np.where(changes, b, a), np.where(changes, fb, fa / 2)
        b, fb = c, fc
    return b
