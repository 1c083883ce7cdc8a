"""REBOUND's interface to ordinary differential equations: Gragg-Bulirsch-Stoer, rates compiled."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import rebound
from numba import cfunc, types

from rigidpend.experiments.bench.measuring.fields import compilable
from rigidpend.experiments.bench.measuring.methods.peers import one_by_one
from rigidpend.experiments.bench.measuring.tasks import RouteTask
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array

NEWTON = 4
"""Steps to a crossing, each a short integration; each doubles the digits."""

AWAY = 0.1
"""Physical time from a crossing to where the next is looked for; they are some twenty apart."""

_Vector: Any = types.CPointer(types.float64)
_SIGNATURE = types.void(types.voidptr, _Vector, _Vector, types.float64)


def ends(body: Body, states: Array, tolerance: float) -> Any:
    """Give a function that carries states on: see `peers`."""
    begun: list[Any] = []
    reached = np.empty(0)

    def carry(states: Array, start: float, times: Array) -> Array:
        nonlocal reached
        # Orbits go on in their simulations, which keep their order and step.
        if states is not reached:
            begun[:] = [_begun(body, state, tolerance, start) for state in states.T]
        for (simulation, _), time in zip(begun, times, strict=True):
            _integrate(simulation, time)
        reached = np.array([ode.y[: len(states)] for _, ode in begun]).T
        return reached

    return carry


def crossings(task: RouteTask, states: Array, tolerance: float) -> Callable[[], Array]:
    """Give a function that finds crossings, by steps until M3 changes sign and then Newton's."""
    body, wanted = task.problem.body, task.problem.n_symbols + 1
    slope = compilable(body, "t, y, dy")

    def one(state: Array) -> Array:
        simulation, ode = _begun(body, state, tolerance)
        at, derivative = np.full((3, wanted), np.nan), [0.0] * 6
        for k in range(wanted):
            side = 1.0 if k % 2 == 0 else -1.0
            while side * ode.y[2] <= 0 and simulation.t < task.horizon:
                simulation.steps(1)
            for _ in range(NEWTON):
                slope(0.0, ode.y, derivative)
                _integrate(simulation, simulation.t - ode.y[2] / derivative[2])
            at[:, k] = simulation.t, ode.y[0], ode.y[1]
            # Away from it: the steps after Newton's are as short as his, and may go back.
            simulation.dt = AWAY
            _integrate(simulation, at[0, k] + AWAY)
        return at

    return one_by_one(one, states)


def _begun(body: Body, state: Array, tolerance: float, start: float = 0.0) -> tuple[Any, Any]:
    """A simulation without particles, with one orbit as its equations."""
    simulation = rebound.Simulation()
    simulation.t = start
    simulation.integrator = "bs"
    simulation.integrator.eps_rel = simulation.integrator.eps_abs = tolerance
    ode = simulation.create_ode(length=len(state), needs_nbody=False)
    ode.derivatives = _address(body, len(state) == 8).ctypes
    for k, x in enumerate(state):
        ode.y[k] = x
    return simulation, ode


def _integrate(simulation: Any, time: float) -> None:
    try:
        simulation.integrate(time)
    except rebound.GenericError as error:
        raise ArithmeticError(str(error)) from error


@functools.cache
def _address(body: Body, angles: bool) -> Any:
    return cfunc(_SIGNATURE)(compilable(body, "ode, dy, y, t", angles))
