"""SciPy's integrators, with a right-hand side as fast as Python has it.

Explicit methods can advance all orbits as one system, with one step for all; LSODA and Radau,
whose Jacobian would be one of all orbits, take one orbit after the other. Which is the better
form of DOP853 the benchmark tries.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import DOP853, solve_ivp

from rigidpend.experiments.bench.measuring.fields import SMALLER, flat
from rigidpend.experiments.bench.measuring.methods.peers import one_by_one
from rigidpend.experiments.bench.measuring.tasks import RouteTask
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array

FALSE_POSITIONS = 12
"""Steps from the ends of a step to the crossings in it."""


def ends(body: Body, states: Array, tolerance: float, method: str, abreast: bool = False) -> Any:
    """Give a function that carries states on: see `peers`; abreast to equal times alone."""
    rates = flat(body, angles=len(states) == 8)

    def end(y: Array, start: float, time: float, field: Any) -> Array:
        found = _solved(field, y, (start, time), method, tolerance, t_eval=[time])
        return np.asarray(found.y[:, -1])

    def carry(states: Array, start: float, times: Array) -> Array:
        if abreast and (times == times[0]).all():
            side_by_side = _abreast(rates, states.shape)
            return end(states.ravel(), start, times[0], side_by_side).reshape(states.shape)
        each = zip(states.T, times, strict=True)
        return np.array([end(y, start, time, _in_floats(rates)) for y, time in each]).T

    return carry


def crossings(
    task: RouteTask, states: Array, tolerance: float, method: str, abreast: bool = False
) -> Callable[[], Array]:
    """Give a function that finds crossings by `events`, or abreast by each step's dense output."""
    rates, wanted = flat(task.problem.body), task.problem.n_symbols + 1
    if abreast:
        return lambda: _crossings_abreast(rates, states, wanted, task.horizon, tolerance)

    def section(_: float, y: Array) -> float:
        return float(y[2])

    section.terminal = wanted  # type: ignore[attr-defined]

    def one(state: Array) -> Array:
        span = (0.0, task.horizon)
        found = _solved(_in_floats(rates), state, span, method, tolerance, events=section)
        at = np.full((3, wanted), np.nan)
        times, there = found.t_events[0][:wanted], found.y_events[0][:wanted]
        if len(times):
            at[:, : len(times)] = times, there[:, 0], there[:, 1]
        return at

    return one_by_one(one, states)


def _crossings_abreast(
    rates: Any, states: Array, wanted: int, horizon: float, tolerance: float
) -> Array:
    """Time, M1 and M2 at the crossings of all orbits as one system, (3, wanted, n)."""
    n, shape = states.shape[1], states.shape
    abreast, tolerances = _abreast(rates, shape), _tolerances(tolerance)
    solver = DOP853(abreast, 0.0, states.ravel(), horizon, **tolerances)
    at, count = np.full((3, wanted, n), np.nan), np.zeros(n, dtype=int)
    while solver.status == "running" and (count < wanted).any():
        before = solver.y.reshape(shape)[2]
        solver.step()
        after = solver.y.reshape(shape)[2]
        columns = np.flatnonzero((before < 0) != (after < 0))
        columns = columns[count[columns] < wanted]
        if columns.size:
            dense = solver.dense_output()
            ends = [before[columns], after[columns]]
            times = _zeros(dense, columns, shape, solver.t_old, solver.t, ends)
            there = dense(times).reshape(*shape, columns.size)[:, columns, np.arange(columns.size)]
            at[:, count[columns], columns] = times, there[0], there[1]
            count[columns] += 1
    return at


def _zeros(dense: Any, columns: Any, shape: Any, start: Any, end: Any, ends: list[Array]) -> Array:
    """The zeros of M3 of each of those orbits between two times, by false positions."""
    (fa, fb), m = ends, columns.size
    a, b = np.full(m, start), np.full(m, end)
    for _ in range(FALSE_POSITIONS):
        c = b - fb * (b - a) / np.where(fb == fa, 1.0, fb - fa)
        fc = dense(c).reshape(*shape, m)[2, columns, np.arange(m)]
        changes = (fc < 0) != (fb < 0)
        a, fa = np.where(changes, b, a), np.where(changes, fb, fa / 2)
        b, fb = c, fc
    return b


def _in_floats(rates: Any) -> Any:
    # Floats are faster in Python than the numbers of an array.
    return lambda t, y: rates(t, y.tolist())


def _abreast(rates: Any, shape: tuple[int, ...]) -> Any:
    """All orbits as one system: a call of Python serves all of them."""
    return lambda t, y: np.concatenate(rates(t, y.reshape(shape)))


def _tolerances(tolerance: float) -> dict[str, Any]:
    return {"rtol": tolerance, "atol": SMALLER * tolerance}


def _solved(
    field: Any, y: Array, span: tuple[float, float], method: str, tolerance: float, **more: Any
) -> Any:
    solve: Any = solve_ivp
    found = solve(field, span, y, method=method, **_tolerances(tolerance), **more)
    if found.status < 0:
        raise ArithmeticError(found.message)
    return found
