"""SUNDIALS' CVODE through scikit-sundae, one orbit after the other, with its events."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from sksundae.cvode import CVODE

from rigidpend.experiments.bench.measuring.fields import SMALLER, compilable
from rigidpend.experiments.bench.measuring.methods.peers import one_by_one
from rigidpend.experiments.bench.measuring.tasks import RouteTask
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array

STEPS = 10_000_000
"""More steps than any orbit needs; the library's own limit is 500."""


def ends(body: Body, states: Array, tolerance: float, method: str) -> Any:
    """Give a function that carries states on: see `peers`."""
    solver = _made(njit(compilable(body, "t, y, dy", len(states) == 8)), tolerance, method)

    def end(state: Array, start: float, time: float) -> Array:
        found = solver.solve(np.array([start, time]), state)
        if not found.success:
            raise ArithmeticError(str(found.message))
        reached: Array = found.y[-1]
        return reached

    return lambda states, start, times: (
        np.array([end(y, start, time) for y, time in zip(states.T, times, strict=True)]).T
    )


def crossings(task: RouteTask, states: Array, tolerance: float, method: str) -> Callable[[], Array]:
    """Give a function that finds crossings, by its events: see `peers`."""
    wanted = task.problem.n_symbols + 1

    def section(_: float, y: Array, events: Array) -> None:
        events[0] = y[2]

    section.terminal = [wanted]  # type: ignore[attr-defined]
    compiled = njit(compilable(task.problem.body, "t, y, dy"))

    def one(state: Array) -> Array:
        # A solver that has met its last event tells the same events again: each orbit has its own.
        solver = _made(compiled, tolerance, method, eventsfn=section, num_events=1)
        found = solver.solve(np.array([0.0, task.horizon]), state)
        at = np.full((3, wanted), np.nan)
        if found.t_events is not None:
            count = min(wanted, len(found.t_events))
            at[:, :count] = found.t_events[:count], *found.y_events[:count, :2].T
        return at

    return one_by_one(one, states)


def _made(compiled: Any, tolerance: float, method: str, **events: Any) -> Any:
    tolerances = {"rtol": tolerance, "atol": SMALLER * tolerance}
    return CVODE(compiled, method=method, **tolerances, max_num_steps=STEPS, **events)
