"""Operator splittings of Lie-Poisson type, vectorised; the knob is the steps in a period."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    Crossed,
    MotionTask,
    RouteTask,
    Solver,
    carrier,
    direction,
    moments,
    time_unit,
)
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import aligned_from_body
from rigidpend.mechanics.equations import cross, euler_poisson
from rigidpend.mechanics.hodograph import angular_velocity
from rigidpend.numbers.doubles import Array
from rigidpend.orbits.integrate.lie_poisson import Splitting, splitting
from rigidpend.routes.cycle import symbols

REFINEMENTS = 4
"""Newton's steps to a crossing; each doubles the digits."""


def motion(task: MotionTask, steps: float, threads: int, order: int) -> Carrier:
    """Orbits in M and gamma."""
    made, h = _made(task.body, order), task.period / steps

    def advance(v: list[Array], start: float, end: float) -> list[Array]:
        count = math.ceil((end - start) / h)
        return made.advance(v, (end - start) / count, count)

    return carrier(_vectors(task.states), advance, _states)


def codes(task: RouteTask, steps: float, threads: int, order: int) -> Solver:
    """Crossings of M3 = 0: the step in which it changes sign, cut short by Newton's method."""
    body = task.problem.body
    made, h = _made(body, order), task.period / steps
    wanted, n, s = task.problem.n_symbols + 1, len(task.theta2_0), time_unit(body)

    def solve() -> tuple[Array, Any]:
        v, time = _vectors(task.states), 0.0
        count, found = np.zeros(n, dtype=int), np.full((wanted, n), np.nan)
        beside = np.zeros((wanted, n), dtype=int)
        while time < task.horizon and (count < wanted).any():
            after = made.advance(v, h)
            now = np.flatnonzero((v[2][0] * after[2][0] < 0) & (count < wanted))
            if now.size:
                k = count[now]
                before = [x[:, now] for x in v]
                part, at = _crossing(made, body, before, [x[:, now] for x in after], h)
                found[k, now] = s * (time + part)
                beside[k, now] = _beside(at, before[2][0] < 0, body.alpha0, s)
                count[now] += 1
            v, time = after, time + h
        return found, beside

    return Solver(solve, lambda found: Crossed(symbols(found[1]), found[0]))


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
    made: Splitting, body: Body, before: Any, after: Any, h: float
) -> tuple[Array, list[Any]]:
    """The part of the step after which M3 = 0, and the states there."""
    A, r, mu = moments(body), direction(body), float(body.mu)
    part = h * before[2][0] / (before[2][0] - after[2][0])
    for _ in range(REFINEMENTS):
        at = made.advance(before, part)
        rate = euler_poisson([x[0] for x in at], [x[1] for x in at], A, r, mu)[2]
        part = part - at[2][0] / rate
    return part, at


def _beside(at: Any, rising: Any, alpha0: float, s: float) -> Any:
    """The separatrices beside which crossings lie, as `separatrices.separatrix_beside` says."""
    a = aligned_from_body([x[0] for x in at], [x[1] for x in at], alpha0, s)
    return np.where(rising, np.where(a.Qp > 0, 2, 4), np.where(a.Qm < 0, 1, 3))


def _made(body: Body, order: int) -> Splitting:
    return splitting(moments(body), direction(body), float(body.mu), order)


def _vectors(states: Array) -> list[Array]:
    """Components first, then M and gamma, then the orbits."""
    return [np.stack((states[i], states[i + 3])) for i in range(3)]


def _states(v: list[Array]) -> Array:
    return np.concatenate(([x[0] for x in v], [x[1] for x in v]))
