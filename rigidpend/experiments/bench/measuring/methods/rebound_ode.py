"""REBOUND's interface to ordinary differential equations: Gragg-Bulirsch-Stoer, rates compiled."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import rebound
from numba import cfunc, types

from rigidpend.experiments.bench.measuring.methods.compiled_rates import rates
from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    MotionTask,
    RouteTask,
    Solver,
    crossed,
)
from rigidpend.experiments.bench.measuring.threads import shared_out
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array

NEWTON = 4
"""Steps to a crossing, each a short integration; each doubles the digits."""

AWAY = 0.1
"""Physical time from a crossing to where the next is looked for; they are some twenty apart."""

_Vector: Any = types.CPointer(types.float64)
_SIGNATURE = types.void(types.voidptr, _Vector, _Vector, types.float64)


def motion(task: MotionTask, tolerance: float, threads: int) -> Carrier:
    """Orbits in M and gamma."""

    def part(states: Array) -> Carrier:
        begun: list[Any] = []

        def begin() -> None:
            begun[:] = [_begun(task.body, state, tolerance) for state in states.T]

        def to(time: float) -> None:
            for simulation, _ in begun:
                simulation.integrate(time)

        begin()
        return Carrier(begin, to, lambda: np.array([ode.y[:6] for _, ode in begun]).T)

    made: Carrier = shared_out(part, task.states, threads)
    return made


def angle(task: AngleTask, tolerance: float, threads: int) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""

    def one(state: Array, end: float) -> float:
        simulation, ode = _begun(task.problem.body, state, tolerance)
        simulation.integrate(end)
        return float(ode.y[7])

    return Solver(
        lambda: [one(*each) for each in zip(task.states.T, task.ends, strict=True)], np.array
    )


def codes(task: RouteTask, tolerance: float, threads: int) -> Solver:
    """Crossings of M3 = 0: steps until it changes sign, then Newton's."""
    body, wanted = task.problem.body, task.problem.n_symbols + 1
    slope = rates(body, "t, y, dy")

    def one(state: Array) -> Array:
        simulation, ode = _begun(body, state, tolerance)
        at, derivative = np.full((3, wanted), np.nan), [0.0] * 6
        for k in range(wanted):
            side = 1.0 if k % 2 == 0 else -1.0
            while side * ode.y[2] <= 0 and simulation.t < task.horizon:
                simulation.steps(1)
            for _ in range(NEWTON):
                slope(0.0, ode.y, derivative)
                simulation.integrate(simulation.t - ode.y[2] / derivative[2])
            at[:, k] = simulation.t, ode.y[0], ode.y[1]
            # Away from it: the steps after Newton's are as short as his, and may go back.
            simulation.dt = AWAY
            simulation.integrate(at[0, k] + AWAY)
        return at

    def solve() -> Array:
        return np.stack([one(state) for state in task.states.T], axis=-1)

    return Solver(solve, lambda found: crossed(found[0], found[1:], body))


def _begun(body: Body, state: Array, tolerance: float) -> tuple[Any, Any]:
    """A simulation without particles, with one orbit as its equations."""
    simulation = rebound.Simulation()
    simulation.integrator = "bs"
    simulation.integrator.eps_rel = simulation.integrator.eps_abs = tolerance
    ode = simulation.create_ode(length=len(state), needs_nbody=False)
    ode.derivatives = _address(body, len(state) == 8).ctypes
    for k, x in enumerate(state):
        ode.y[k] = x
    return simulation, ode


@functools.cache
def _address(body: Body, angles: bool) -> Any:
    return cfunc(_SIGNATURE)(rates(body, "ode, dy, y, t", angles))
