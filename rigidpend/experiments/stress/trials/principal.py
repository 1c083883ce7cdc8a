"""Follow orbits in principal axes: another formulation, to hold route codes against.

Euler's and Poisson's equations themselves, in M and gamma and physical time, know nothing of
separatrices, of J1 or of aligned components; nor do initial states here, and a crossing is told
by the angle theta1 alone. What the routes of both formulations share is the body and heyoka.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.heyoka_peer import heyoka, typed, working_type
from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.coordinates import (
    TURN,
    momentum,
    scale,
    vertical,
)
from rigidpend.mechanics.equations import euler_poisson
from rigidpend.mechanics.free_body import separatrix_theta1
from rigidpend.numbers.exact import GUARD_BITS, context, exact, fraction
from rigidpend.routes.cycle import symbols
from rigidpend.routes.problem import RouteProblem, passage_limit

TOLERANCES = {53: 2.0**-52, 64: 2.0**-63, 113: 2.0**-112}
"""Local, of the Taylor series: the roundings of each precision."""


class PrincipalTask(NamedTuple):
    """A body's numbers and what is sought on each of its orbits: plain, for worker processes."""

    parameters: tuple[Any, ...]
    """A, r and mu, as Fractions."""
    n_crossings: int
    limit: float
    """Physical time to wait for the next crossing."""
    bits: int


def codes(
    problem: RouteProblem, phases: Sequence[Any], *, bits: int, jobs: int
) -> NDArray[np.uint8]:
    """The symbols of orbits, (n_symbols, n), `NO_SYMBOL` where there is none.

    Parameters
    ----------
    problem : RouteProblem
    phases : sequence of numbers
        theta2_0, radians.
    bits : int
        53, 64 or 113: a type that heyoka has here.
    jobs : int
        Processes at a time.
    """
    body, m = problem.body, context(bits + GUARD_BITS)
    numbers = [fraction(x.in_context(m), bits) for x in (*body.A, *body.r, body.mu)]
    # In physical time, t = t'/s.
    limit = passage_limit(problem, bits) / float(scale([float(x) for x in body.A]))
    task = PrincipalTask(tuple(numbers), problem.n_symbols + 1, limit, bits)
    states = _states(problem, phases, bits)
    share = -(-len(states) // jobs)
    parts = [states[k : k + share] for k in range(0, len(states), share)]
    theta1 = np.concatenate(side_by_side(_angles, (task,), True, parts, jobs), axis=1)
    return symbols(_beside(theta1 + body.beta0, separatrix_theta1(body.alpha0, body.beta0)))


def _states(problem: RouteProblem, phases: Sequence[Any], bits: int) -> list[list[Any]]:
    """M and gamma, physical, at theta1_0 = alpha0 + beta0, J3 = 0: numbers of `bits` bits."""
    m = context(bits + GUARD_BITS)
    p, A = problem.body.angles(bits + GUARD_BITS), [x.in_context(m) for x in problem.body.A]
    J1, J2, s = problem.J1_0.in_context(m), problem.J2_0(bits + GUARD_BITS), scale(A, m)
    sinp, cosp = (2 * J1 - J2) / J2, 2 * m.sqrt(J1 * (J2 - J1)) / J2
    sinl, cosl = m.sin(p.alpha0 / 2), m.cos(p.alpha0 / 2)
    M = [x / s for x in momentum(J2, sinp, cosp, sinl, cosl)]
    made = []
    for phase in phases:
        g = (p.alpha0 + p.beta0) / 2 + exact(phase).in_context(m)
        gamma = vertical((sinp, cosp), (m.mpf(0), m.mpf(1)), (m.sin(g), m.cos(g)), (sinl, cosl))
        made.append([fraction(x, bits) for x in (*M, *gamma)])
    return made


def _angles(states: Sequence[Sequence[Any]], task: PrincipalTask) -> NDArray[np.float64]:
    """2 l, with l = atan2(M1, M2), at the crossings of M3 = 0: (n_crossings, n), NaN for none."""
    hy, kind = heyoka(), working_type(task.bits)
    names, par = hy.make_vars("M1", "M2", "M3", "g1", "g2", "g3"), [hy.par[i] for i in range(7)]
    field = euler_poisson(names[:3], names[3:], par[:3], par[3:6], par[6])
    orbit: list[float] = []

    def record(integrator: Any, _: int) -> bool:
        M1, M2 = map(float, integrator.state[:2])
        orbit.append(2 * math.atan2(M1, M2))
        return len(orbit) < task.n_crossings

    integrator = hy.taylor_adaptive(
        list(zip(names, field, strict=True)),
        [kind(0)] * 6,
        pars=[typed(x, kind) for x in task.parameters],
        time=kind(0),
        fp_type=kind,
        tol=kind(TOLERANCES[task.bits]),
        compact_mode=task.bits > 53,
        t_events=[hy.t_event(names[2], fp_type=kind, callback=record)],
    )
    found = np.full((task.n_crossings, len(states)), np.nan)
    for column, state in enumerate(states):
        orbit.clear()
        integrator.time, integrator.state[:] = kind(0), [typed(x, kind) for x in state]
        # heyoka looks away from an event for a while after it: the last orbit's are not this one's.
        integrator.reset_cooldowns()
        integrator.propagate_until(kind(task.limit * task.n_crossings))
        found[: len(orbit), column] = orbit
    return found


def _beside(theta1: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The separatrix nearest in theta1, modulo 4 pi: 1..4, and 0 for no crossing."""
    gaps = np.abs(np.remainder(theta1 - places[:, None, None] + TURN, 2 * TURN) - TURN)
    nearest = np.argmin(np.where(np.isnan(gaps), np.inf, gaps), axis=0) + 1
    return np.where(np.isnan(theta1), 0, nearest).astype(np.uint8)
