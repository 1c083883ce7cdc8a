"""diffrax (JAX): Dopri8 in double precision, vmapped over the orbits and compiled."""

from __future__ import annotations

import functools
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from rigidpend.body import Body
from rigidpend.coordinates import aligned_from_body
from rigidpend.measure.benchmark import fields
from rigidpend.measure.benchmark.tasks import (
    Angle,
    Array,
    Crossed,
    Flow,
    Motion,
    Routes,
    Solver,
    time_unit,
)
from rigidpend.routes.cycle import symbols

settings: Any = jax.config
settings.update("jax_enable_x64", True)
ready: Any = jax.block_until_ready

AT_ONCE = 1e-3
"""A time, physical, until which to go when only compilation is wanted."""
SMALLER = 1e-2
"""The absolute tolerance, of the relative one, as for SciPy."""


def flow(task: Motion, tolerance: float) -> Flow:
    """Orbits in M and gamma."""
    solve = _to(task.body, False)
    first = jnp.asarray(task.states.T)
    now: list[Any] = [0.0, first]

    def begin() -> None:
        now[:] = [0.0, first]

    def to(time: float) -> None:
        ends = jnp.asarray(np.full(len(first), time))
        now[:] = [time, ready(solve(now[1], now[0], ends, tolerance))]

    to(AT_ONCE)
    return Flow(begin, to, lambda: np.asarray(now[1]).T)


def angle(task: Angle, tolerance: float) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""
    solve, states = _to(task.problem.body, True), jnp.asarray(task.states.T)
    ready(solve(states, 0.0, jnp.asarray(np.full(len(states), AT_ONCE)), tolerance))
    ends = jnp.asarray(task.ends)
    return Solver(
        lambda: ready(solve(states, 0.0, ends, tolerance)),
        lambda found: np.asarray(found)[:, 7],
    )


def codes(task: Routes, tolerance: float) -> Solver:
    """From crossing to crossing of M3 = 0, by `Event` with a root finder, in a scan."""
    body = task.problem.body
    solve, states = _crossings(body, task.problem.n_symbols + 1), jnp.asarray(task.states.T)
    ready(solve(states, tolerance, AT_ONCE))
    s = time_unit(body)
    return Solver(
        lambda: ready(solve(states, tolerance, task.horizon)),
        lambda found: _crossed(np.asarray(found[0]), np.asarray(found[1]), body.alpha0, s),
    )


@functools.cache
def _to(body: Body, angles: bool) -> Any:
    """The ends of orbits, compiled: of states, start, ends and tolerance."""
    term = _term(fields.of_body(body, angles=angles))

    def end(state: Any, start: Any, stop: Any, tolerance: Any) -> Any:
        return diffrax.diffeqsolve(
            term,
            diffrax.Dopri8(),
            start,
            stop,
            None,
            state,
            stepsize_controller=_controller(tolerance),
            max_steps=None,
        ).ys[-1]

    return jax.jit(jax.vmap(end, in_axes=(0, None, 0, None)))


@functools.cache
def _crossings(body: Body, wanted: int) -> Any:
    """Times (n, wanted) and states of the crossings, compiled: of states, tolerance and horizon."""
    term = _term(fields.of_body(body))
    event = diffrax.Event(
        # Upwards and downwards in turn.
        lambda t, y, args, **_: args * y[2],
        root_finder=optimistix.Newton(1e-14, 1e-14, optimistix.rms_norm),
        direction=True,
    )

    def route(state: Any, tolerance: Any, horizon: Any) -> Any:
        def passage(carried: Any, upwards: Any) -> Any:
            time, state = carried
            found = diffrax.diffeqsolve(
                term,
                diffrax.Dopri8(),
                time,
                horizon,
                None,
                state,
                args=upwards,
                stepsize_controller=_controller(tolerance),
                max_steps=None,
                event=event,
                throw=False,
            )
            carried = found.ts[-1], found.ys[-1]
            return carried, carried

        turns = jnp.where(jnp.arange(wanted) % 2 == 0, 1.0, -1.0)
        return jax.lax.scan(passage, (jnp.zeros(()), state), turns)[1]

    return jax.jit(jax.vmap(route, in_axes=(0, None, None)))


def _crossed(time: Array, states: Array, alpha0: float, s: float) -> Crossed:
    """The answer, from times (n, k) and states (n, k, 6) of the crossings."""
    M, gamma = states.T[:3], states.T[3:]
    a = aligned_from_body(M, gamma, alpha0, s)
    rising = np.arange(time.shape[1])[:, None] % 2 == 0
    beside = np.where(rising, np.where(a.Qp > 0, 2, 4), np.where(a.Qm < 0, 1, 3))
    return Crossed(symbols(beside), s * time.T)


def _term(field: Any) -> Any:
    return diffrax.ODETerm(lambda t, y, args: jnp.stack(field(y)))


def _controller(tolerance: Any) -> Any:
    return diffrax.PIDController(rtol=tolerance, atol=SMALLER * tolerance)
