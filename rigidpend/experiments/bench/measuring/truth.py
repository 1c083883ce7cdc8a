"""The truth: Euler-Poisson in principal axes, in 113 bits, by heyoka."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.tasks import AngleTask, initial
from rigidpend.experiments.heyoka_peer import heyoka
from rigidpend.experiments.heyoka_peer import typed as typed_in
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.hodograph import alpha_ahead, angular_velocity
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import context
from rigidpend.numbers.generic import Numbers, Scalar

BITS = 113


def carried(body: Body, states: Array, end: float) -> Array:
    """Orbits (6, n), doubles that are taken exactly, at a later time."""
    integrator = _integrator(body, fields.principal, 6)
    return np.stack([_propagated(integrator, state, end)[:6] for state in states.T], axis=1)


def alpha(task: AngleTask) -> Array:
    """alpha at the ends, of the exact initial states."""
    from rigidpend.numbers.exact import exact

    m, body = context(BITS), task.problem.body
    integrator = _integrator(body, fields.with_angles, 8)
    found = []
    phases = [exact(x) for x in task.theta2_0]
    for state, end in zip(initial(task.problem, phases, BITS), task.ends, strict=True):
        omega = angular_velocity(state[:3], _numbers(body.A))
        # Where alpha starts is a mere constant; its double is the same for everyone.
        ahead = alpha_ahead(*(np.array(x, dtype=float) for x in (state[:3], omega, state[3:])))
        found.append(_propagated(integrator, [*state, m.mpf(0), ahead], end)[7])
    return np.array(found)


def _numbers(values: Any) -> list[Any]:
    return [x.in_context(context(BITS)) for x in values]


def _integrator(body: Body, field: Any, size: int) -> Any:
    hy = heyoka()
    numbers = [[typed(x) for x in _numbers(values)] for values in (body.A, body.r, [body.mu])]
    A, r, (mu,) = [[hy.expression(x) for x in group] for group in numbers]
    names = [hy.make_vars(f"x{i}") for i in range(size)]
    system = list(zip(names, field(A, r, mu)(names), strict=True))
    zero = hy.real128(0)
    return hy.taylor_adaptive(
        system, [zero] * size, time=zero, fp_type=hy.real128, compact_mode=True
    )


def _propagated(integrator: Any, state: Numbers, end: float) -> Array:
    integrator.state[:] = [typed(x) for x in state]
    integrator.time = heyoka().real128(0)
    integrator.propagate_until(heyoka().real128(end))
    return np.array([float(x) for x in integrator.state])


def typed(x: Scalar) -> Any:
    """A real128 from a float or an mpmath number."""
    return typed_in(x, heyoka().real128)
