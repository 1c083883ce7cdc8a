"""SciPy's `solve_ivp`, with a right-hand side as fast as Python has it.

Orbits without events advance as one system, which serves explicit methods best; LSODA and
Radau, whose Jacobian would be one of all orbits, and events take one orbit after the other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from rigidpend.coordinates import aligned_from_body
from rigidpend.integrate.records import separatrix_beside
from rigidpend.measure.benchmark import fields
from rigidpend.measure.benchmark.flat import flat
from rigidpend.measure.benchmark.methods.heyoka_scripts import read_crossings
from rigidpend.measure.benchmark.tasks import Angle, Array, Flow, Motion, Routes, Solver, time_unit

SMALLER = 1e-2
"""The absolute tolerance, of the relative one: for components that pass through zero."""


def flow(task: Motion, tolerance: float, method: str) -> Flow:
    """Orbits in M and gamma."""
    rates = flat(fields.of_body(task.body), 6)
    together = method in ("RK45", "DOP853")
    now: list[Any] = [0.0, task.states]

    def begin() -> None:
        now[:] = [0.0, task.states]

    def to(time: float) -> None:
        span = (now[0], time)
        if together:
            now[1] = _system(rates, now[1], span, method, tolerance)
        else:
            ends = [_end(rates, y, span, method, tolerance) for y in now[1].T]
            now[1] = np.array(ends).T
        now[0] = time

    return Flow(begin, to, lambda: now[1])


def codes(task: Routes, tolerance: float, method: str) -> Solver:
    """Crossings of M3 = 0, by `events`; the integration ends at the last one wanted."""
    rates, body = flat(fields.of_body(task.problem.body), 6), task.problem.body
    wanted, s = task.problem.n_symbols + 1, time_unit(task.problem.body)

    def section(_: float, y: Array) -> float:
        return float(y[2])

    section.terminal = wanted  # type: ignore[attr-defined]

    def one(state: Array) -> list[tuple[float, int]]:
        span = (0.0, task.horizon)
        found = _solved(rates, state, span, method, tolerance, events=section)
        return [
            (s * t, _beside(y, -1.0 if (k % 2) else 1.0, body.alpha0, s))
            for k, (t, y) in enumerate(zip(found.t_events[0], found.y_events[0], strict=True))
        ]

    return Solver(lambda: [one(state) for state in task.states.T], read_crossings)


def angle(task: Angle, tolerance: float, method: str) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""
    rates = flat(fields.of_body(task.problem.body, angles=True), 8)

    def solve() -> list[Array]:
        each = zip(task.states.T, task.ends, strict=True)
        return [_end(rates, y, (0.0, end), method, tolerance) for y, end in each]

    return Solver(solve, lambda found: np.array(found)[:, 7])


def _beside(y: Array, rising: float, alpha0: float, s: float) -> int:
    """The separatrix: M3 rises at the first crossing and falls at the next, in turn."""
    a = aligned_from_body(y[:3], y[3:], alpha0, s)
    return separatrix_beside(rising > 0, a.Qp, a.Qm)


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
