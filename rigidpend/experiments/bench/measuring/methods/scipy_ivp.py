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

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.fields import SMALLER
from rigidpend.experiments.bench.measuring.flat import flat
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

FALSE_POSITIONS = 12
"""Steps from the ends of a step to the crossings in it."""


def motion(
    task: MotionTask, tolerance: float, threads: int, method: str, abreast: bool = False
) -> Carrier:
    """Orbits in M and gamma."""
    rates = flat(fields.of_body(task.body), 6)

    def advance(states: Array, *span: float) -> Array:
        if abreast:
            return _system(rates, states, span, method, tolerance)
        return np.array([_end(rates, y, span, method, tolerance) for y in states.T]).T

    return carrier(task.states, advance)


def codes(
    task: RouteTask, tolerance: float, threads: int, method: str, abreast: bool = False
) -> Solver:
    """Crossings of M3 = 0: by `events`, or abreast by the dense output of each step."""
    rates, body = flat(fields.of_body(task.problem.body), 6), task.problem.body
    wanted = task.problem.n_symbols + 1

    def solve() -> Array:
        if abreast:
            return _crossings_abreast(rates, task.states, wanted, task.horizon, tolerance)
        each = [
            _crossings(rates, y, wanted, task.horizon, method, tolerance) for y in task.states.T
        ]
        return np.stack(each, axis=-1)

    return Solver(solve, lambda found: crossed(found[0], found[1:], body))


def angle(
    task: AngleTask, tolerance: float, threads: int, method: str, abreast: bool = False
) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha; never abreast, for the ends differ."""
    rates = flat(fields.of_body(task.problem.body, angles=True), 8)

    def solve() -> list[Array]:
        each = zip(task.states.T, task.ends, strict=True)
        return [_end(rates, y, (0.0, end), method, tolerance) for y, end in each]

    return Solver(solve, lambda found: np.array(found)[:, 7])


def _crossings(
    rates: Any, state: Array, wanted: int, horizon: float, method: str, tolerance: float
) -> Array:
    """Time, M1 and M2 at the crossings of one orbit, (3, wanted)."""

    def section(_: float, y: Array) -> float:
        return float(y[2])

    section.terminal = wanted  # type: ignore[attr-defined]
    found = _solved(rates, state, (0.0, horizon), method, tolerance, events=section)
    at = np.full((3, wanted), np.nan)
    times, states = found.t_events[0][:wanted], found.y_events[0][:wanted]
    if len(times):
        at[:, : len(times)] = times, states[:, 0], states[:, 1]
    return at


def _crossings_abreast(
    rates: Any, states: Array, wanted: int, horizon: float, tolerance: float
) -> Array:
    """Time, M1 and M2 at the crossings of all orbits as one system, (3, wanted, n)."""
    n, shape = states.shape[1], states.shape

    def side_by_side(t: float, y: Array) -> Array:
        return np.concatenate(rates(t, y.reshape(shape)))

    solver = DOP853(
        side_by_side, 0.0, states.ravel(), horizon, rtol=tolerance, atol=SMALLER * tolerance
    )
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


def _solved(
    rates: Callable[..., Any], y: Array, span: Any, method: str, tolerance: float, **more: Any
) -> Any:
    solve: Any = solve_ivp
    # Floats are faster in Python than the numbers of an array.
    found = solve(
        lambda t, y: rates(t, y.tolist()),
        span,
        y,
        method=method,
        rtol=tolerance,
        atol=SMALLER * tolerance,
        **more,
    )
    if found.status < 0:
        raise ArithmeticError(found.message)
    return found


def _end(rates: Any, y: Array, span: Any, method: str, tolerance: float) -> Array:
    end: Array = _solved(rates, y, span, method, tolerance, t_eval=span[1:]).y[:, -1]
    return end


def _system(rates: Any, states: Array, span: Any, method: str, tolerance: float) -> Array:
    """All orbits as one system: a call of Python serves all of them."""
    shape, solve = states.shape, solve_ivp

    def side_by_side(t: float, y: Array) -> Array:
        return np.concatenate(rates(t, y.reshape(shape)))

    any_method: Any = solve
    found = any_method(
        side_by_side,
        span,
        states.ravel(),
        method=method,
        rtol=tolerance,
        atol=SMALLER * tolerance,
        t_eval=span[1:],
    )
    if found.status < 0:
        raise ArithmeticError(found.message)
    return np.asarray(found.y[:, -1]).reshape(shape)
