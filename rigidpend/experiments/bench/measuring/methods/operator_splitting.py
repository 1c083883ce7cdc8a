"""Operator splittings of Lie-Poisson type, vectorised; the knob is the steps in a period."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    MotionTask,
    RouteTask,
    Solver,
    carrier,
    direction,
    moments,
)
from rigidpend.experiments.lie_poisson import Splitting, splitting
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import cross, euler_poisson
from rigidpend.mechanics.hodograph import angular_velocity
from rigidpend.numbers.doubles import Array

REFINEMENTS = 4
"""Newton's steps to a crossing; each doubles the digits."""


def motion(task: MotionTask, steps: float, threads: int, order: int) -> Carrier:
    """Orbits in M and gamma."""
    made, h = _made(task.body, order), task.period / steps

    def advance(v: list[Array], start: float, end: float) -> list[Array]:
        count = math.ceil((end - start) / h)
        return made.advance(v, (end - start) / count, count)

    return carrier(_vectors(task.states), advance, _states)


def crossings(task: RouteTask, states: Array, steps: float, order: int) -> Callable[[], Array]:
    """Give a function that finds crossings: see `peers`.

    The step in which M3 changes sign is cut short by Newton's method.
    """
    body, wanted, n = task.problem.body, task.problem.n_symbols + 1, states.shape[1]
    made, h = _made(body, order), task.period / steps

    def find() -> Array:
        v, time = _vectors(states), 0.0
        count, found = np.zeros(n, dtype=int), np.full((3, wanted, n), np.nan)
        while time < task.horizon and (count < wanted).any():
            after = made.advance(v, h)
            now = np.flatnonzero((v[2][0] * after[2][0] < 0) & (count < wanted))
            if now.size:
                part, at = _crossing(made, body, [x[:, now] for x in v], after[2][0, now], h)
                found[:, count[now], now] = time + part, at[0][0], at[1][0]
                count[now] += 1
            v, time = after, time + h
        return found

    return find


def angle(task: AngleTask, steps: float, threads: int, order: int) -> Solver:
    """alpha(T) without a quadrature: the fixed axis eta is turned like gamma."""
    body, A = task.problem.body, moments(task.problem.body)
    made = _made(body, order)
    counts = [math.ceil(steps * end / task.period) for end in task.ends]
    eta, M, gamma = _horizontal(task)
    v = [np.stack(x) for x in zip(M, gamma, eta, strict=True)]

    def solve() -> list[Any]:
        count = max(counts)
        return made.advance(v, task.ends / count, count)

    def read(found: list[Any]) -> Array:
        M, gamma, eta = ([x[k] for x in found] for k in range(3))
        omega = angular_velocity(M, A)
        zeta = cross(gamma, eta)
        along = (sum(a * b for a, b in zip(omega, axis, strict=True)) for axis in (zeta, eta))
        return np.asarray(np.arctan2(*along))

    return Solver(solve, read)


def _horizontal(task: AngleTask) -> tuple[Any, Any, Any]:
    """The axis eta, along M at theta3 = 0, with M and gamma."""
    M, gamma = task.states[:3], task.states[3:6]
    return M / np.linalg.norm(M, axis=0), M, gamma


def _crossing(
    made: Splitting, body: Body, before: Any, M3: Array, h: float
) -> tuple[Array, list[Any]]:
    """The part of the step after which M3 = 0, and the states there; it ends with another M3."""
    A, r, mu = moments(body), direction(body), float(body.mu)
    part = h * before[2][0] / (before[2][0] - M3)
    for _ in range(REFINEMENTS):
        at = made.advance(before, part)
        rate = euler_poisson([x[0] for x in at], [x[1] for x in at], A, r, mu)[2]
        part = part - at[2][0] / rate
    return part, at


def _made(body: Body, order: int) -> Splitting:
    return splitting(moments(body), direction(body), float(body.mu), order)


def _vectors(states: Array) -> list[Array]:
    """Components first, then M and gamma, then the orbits."""
    return [np.stack((states[i], states[i + 3])) for i in range(3)]


def _states(v: list[Array]) -> Array:
    return np.concatenate(([x[0] for x in v], [x[1] for x in v]))
