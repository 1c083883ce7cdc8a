"""SUNDIALS' CVODE through scikit-sundae, one orbit after the other, with its events."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from sksundae.cvode import CVODE

from rigidpend.experiments.bench.measuring.fields import SMALLER
from rigidpend.experiments.bench.measuring.methods.compiled_rates import rates
from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    MotionTask,
    RouteTask,
    Solver,
    carrier,
    crossed,
)
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array

STEPS = 10_000_000
"""More steps than any orbit needs; the library's own limit is 500."""


def motion(task: MotionTask, tolerance: float, threads: int, method: str) -> Carrier:
    """Orbits in M and gamma."""
    solver = _solver(task.body, tolerance, method)
    return carrier(
        task.states, lambda states, *span: np.array([_end(solver, y, *span) for y in states.T]).T
    )


def angle(task: AngleTask, tolerance: float, threads: int, method: str) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""
    solver = _solver(task.problem.body, tolerance, method, angles=True)
    each = list(zip(task.states.T, task.ends, strict=True))
    return Solver(lambda: np.array([_end(solver, y, 0.0, end)[7] for y, end in each]), np.asarray)


def codes(task: RouteTask, tolerance: float, threads: int, method: str) -> Solver:
    """Crossings of M3 = 0, by its events."""
    body, wanted = task.problem.body, task.problem.n_symbols + 1

    def section(_: float, y: Array, events: Array) -> None:
        events[0] = y[2]

    section.terminal = [wanted]  # type: ignore[attr-defined]
    compiled = njit(rates(body, "t, y, dy"))

    def one(state: Array) -> Array:
        # A solver that has met its last event tells the same events again: each orbit has its own.
        solver = _made(compiled, tolerance, method, eventsfn=section, num_events=1)
        found = solver.solve(np.array([0.0, task.horizon]), state)
        at = np.full((3, wanted), np.nan)
        if found.t_events is not None:
            count = min(wanted, len(found.t_events))
            at[:, :count] = found.t_events[:count], *found.y_events[:count, :2].T
        return at

    def solve() -> Array:
        return np.stack([one(state) for state in task.states.T], axis=-1)

    return Solver(solve, lambda found: crossed(found[0], found[1:], body))


def _solver(body: Body, tolerance: float, method: str, angles: bool = False) -> Any:
    return _made(njit(rates(body, "t, y, dy", angles)), tolerance, method)


def _made(compiled: Any, tolerance: float, method: str, **events: Any) -> Any:
    return CVODE(
        compiled,
        method=method,
        rtol=tolerance,
        atol=SMALLER * tolerance,
        max_num_steps=STEPS,
        **events,
    )


def _end(solver: Any, state: Array, start: float, time: float) -> Array:
    found = solver.solve(np.array([start, time]), state)
    if not found.success:
        raise ArithmeticError(str(found.message))
    end: Array = found.y[-1]
    return end
