"""diffrax (JAX) in double precision, vmapped over the orbits and compiled as a whole."""

from __future__ import annotations

import functools
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.fields import SMALLER
from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    MotionTask,
    RouteTask,
    Solver,
    carrier,
    crossed,
)
from rigidpend.experiments.bench.measuring.threads import shared_out
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.generic import Numbers

settings: Any = jax.config
settings.update("jax_enable_x64", True)
ready: Any = jax.block_until_ready

AT_ONCE = 1e-3
"""A time, physical, until which to go when only compilation is wanted."""


def motion(task: MotionTask, tolerance: float, threads: int, solver: str) -> Carrier:
    """Orbits in M and gamma."""
    solve = _to(task.body, False, solver)

    def part(states: Array) -> Carrier:
        def advance(states: Any, start: float, end: float) -> Any:
            return ready(solve(states, start, jnp.asarray(np.full(len(states), end)), tolerance))

        made = carrier(jnp.asarray(states.T), advance, lambda found: np.asarray(found).T)
        made.to(AT_ONCE)
        return made

    made: Carrier = shared_out(part, task.states, threads)
    return made


def angle(task: AngleTask, tolerance: float, threads: int, solver: str) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""
    solve, states = _to(task.problem.body, True, solver), jnp.asarray(task.states.T)
    ready(solve(states, 0.0, jnp.asarray(np.full(len(states), AT_ONCE)), tolerance))
    ends = jnp.asarray(task.ends)
    return Solver(
        lambda: ready(solve(states, 0.0, ends, tolerance)),
        lambda found: np.asarray(found)[:, 7],
    )


def codes(task: RouteTask, tolerance: float, threads: int, solver: str) -> Solver:
    """From crossing to crossing of M3 = 0, by `Event` with a root finder, in a scan."""
    body, wanted = task.problem.body, task.problem.n_symbols + 1
    solve = _crossings(body, wanted, solver)

    def part(states: Array) -> Any:
        first = jnp.asarray(states.T)
        ready(solve(first, tolerance, AT_ONCE))

        def run() -> Array:
            times, there = ready(solve(first, tolerance, task.horizon))
            M = np.asarray(there).transpose(2, 1, 0)[:2]
            return np.concatenate((np.asarray(times).T[None], M))

        return run

    solve_all = shared_out(part, task.states, threads)
    return Solver(solve_all, lambda found: crossed(found[0], found[1:], body))


@functools.cache
def _to(body: Body, angles: bool, solver: str) -> Any:
    """The ends of orbits, compiled: of states, start, ends and tolerance."""
    term = _term(fields.of_body(body, angles=angles))

    def end(state: Numbers, start: Any, stop: Any, tolerance: Any) -> Any:
        return diffrax.diffeqsolve(
            term,
            getattr(diffrax, solver)(),
            start,
            stop,
            None,
            state,
            stepsize_controller=_controller(tolerance),
            max_steps=None,
        ).ys[-1]

    return jax.jit(jax.vmap(end, in_axes=(0, None, 0, None)))


@functools.cache
def _crossings(body: Body, wanted: int, solver: str) -> Any:
    """Times (n, wanted) and states of the crossings, compiled: of states, tolerance and horizon."""
    term = _term(fields.of_body(body))
    event = diffrax.Event(
        # Upwards and downwards in turn.
        lambda t, y, args, **_: args * y[2],
        root_finder=optimistix.Newton(1e-14, 1e-14, optimistix.rms_norm),
        direction=True,
    )

    def route(state: Numbers, tolerance: Any, horizon: Any) -> Any:
        def passage(carried: Any, upwards: Any) -> Any:
            time, state = carried
            found = diffrax.diffeqsolve(
                term,
                getattr(diffrax, solver)(),
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


def _term(field: Any) -> Any:
    return diffrax.ODETerm(lambda t, y, args: jnp.stack(field(y)))


def _controller(tolerance: Any) -> Any:
    return diffrax.PIDController(rtol=tolerance, atol=SMALLER * tolerance)
