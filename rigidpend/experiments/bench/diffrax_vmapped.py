"""diffrax (JAX) in double precision, vmapped over the orbits and compiled as a whole."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from rigidpend.experiments.bench.solvers import SMALLER, Ends, Solver, Task, answering, field_of
from rigidpend.mechanics.body import Body
from rigidpend.numbers.generic import Array, Numbers

settings: Any = jax.config
settings.update("jax_enable_x64", True)

AT_ONCE = 1e-3
"""A time, physical, until which to go when only compilation is wanted."""


def answered(task: Task, tolerance: float, threads: int, solver: str) -> Solver:
    """The answer to any task, compiled for as many orbits as each thread has."""

    def ends(part: Task) -> Ends:
        solve = _to(part.body, len(part.states) == 8, solver)

        def carry(states: Array, start: float, times: Array) -> Array:
            return np.asarray(solve(states.T, start, times, tolerance)).T

        carry(part.states, 0.0, np.full(part.states.shape[1], AT_ONCE))
        return carry

    def crossings(part: Task) -> Callable[[], Array]:
        """From crossing to crossing."""
        solve, first = _crossings(part.body, part.routes.n_symbols + 1, solver), part.states.T

        def find(horizon: float) -> Array:
            times, there = (np.asarray(x) for x in solve(first, tolerance, horizon))
            return np.concatenate((times.T[None], there.transpose(2, 1, 0)[:2]))

        find(AT_ONCE)
        return lambda: find(float(part.times.max()))

    return answering(task, threads, ends, crossings)


@functools.cache
def _to(body: Body, angles: bool, solver: str) -> Any:
    """The ends of orbits (n, d), compiled: of states, start, ends and tolerance."""
    term = _term(field_of(body, angles=angles))

    def end(state: Numbers, start: Any, stop: Any, tolerance: Any) -> Any:
        return diffrax.diffeqsolve(
            term, getattr(diffrax, solver)(), start, stop, None, state,
            stepsize_controller=_controller(tolerance), max_steps=None,
        ).ys[-1]  # fmt: skip

    return jax.jit(jax.vmap(end, in_axes=(0, None, 0, None)))


@functools.cache
def _crossings(body: Body, wanted: int, solver: str) -> Any:
    """Times (n, wanted) and states of the crossings, compiled: of states, tolerance and horizon."""
    term = _term(field_of(body))
    event = diffrax.Event(  # By a root finder, upwards and downwards in turn.
        lambda t, y, args, **_: args * y[2],
        root_finder=optimistix.Newton(1e-14, 1e-14, optimistix.rms_norm),
        direction=True,
    )

    def route(state: Numbers, tolerance: Any, horizon: Any) -> Any:
        def passage(carried: Any, upwards: Any) -> Any:
            time, state = carried
            found = diffrax.diffeqsolve(
                term, getattr(diffrax, solver)(), time, horizon, None, state, args=upwards,
                stepsize_controller=_controller(tolerance), max_steps=None,
                event=event, throw=False,
            )  # fmt: skip
            carried = found.ts[-1], found.ys[-1]
            return carried, carried

        turns = jnp.where(jnp.arange(wanted) % 2 == 0, 1.0, -1.0)
        return jax.lax.scan(passage, (jnp.zeros(()), state), turns)[1]

    return jax.jit(jax.vmap(route, in_axes=(0, None, None)))


def _term(field: Any) -> Any:
    return diffrax.ODETerm(lambda t, y, args: jnp.stack(field(y)))


def _controller(tolerance: Any) -> Any:
    return diffrax.PIDController(rtol=tolerance, atol=SMALLER * tolerance)
