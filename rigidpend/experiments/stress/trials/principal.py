"""Follow orbits in principal axes: another formulation, to hold route codes against.

A crossing is told by the angle theta1 alone. What the routes of both formulations share is the
body.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.principal_axes import carry, initial, integrator
from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import TURN, scale
from rigidpend.mechanics.equations import euler_poisson
from rigidpend.mechanics.free_body import separatrix_theta1
from rigidpend.numbers.exact import exacts
from rigidpend.routes.cycle import symbols
from rigidpend.routes.problem import RouteProblem, passage_limit


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
    body = problem.body
    # In physical time, t = t'/s.
    limit = passage_limit(problem, bits) / float(scale([float(x) for x in body.A]))
    states = np.array(initial(problem, exacts(phases), bits), dtype=object)
    given = body, problem.n_symbols + 1, limit, bits
    theta1 = np.concatenate(
        side_by_side(_angles, given, True, spread(states, jobs, axis=0), jobs), axis=1
    )
    return symbols(_beside(theta1 + body.beta0, separatrix_theta1(body.alpha0, body.beta0)))


def _angles(
    states: Any, body: Body, n_crossings: int, limit: float, bits: int
) -> NDArray[np.float64]:
    """2 l, with l = atan2(M1, M2), at the crossings of M3 = 0: (n_crossings, n), NaN for none."""
    orbit: list[float] = []

    def record(made: Any, _: int) -> bool:
        M1, M2 = map(float, made.state[:2])
        orbit.append(2 * math.atan2(M1, M2))
        return len(orbit) < n_crossings

    made = integrator(body, _field, 6, bits, record)
    found = np.full((n_crossings, len(states)), np.nan)
    for column, state in enumerate(states):
        orbit.clear()
        carry(made, state, limit * n_crossings)
        found[: len(orbit), column] = orbit
    return found


def _field(A: Any, r: Any, mu: Any) -> Any:
    return lambda y: euler_poisson(y[:3], y[3:], A, r, mu)


def _beside(theta1: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The separatrix nearest in theta1, modulo 4 pi: 1..4, and 0 for no crossing."""
    gaps = np.abs(np.remainder(theta1 - places[:, None, None] + TURN, 2 * TURN) - TURN)
    nearest = np.argmin(np.where(np.isnan(gaps), np.inf, gaps), axis=0) + 1
    return np.where(np.isnan(theta1), 0, nearest).astype(np.uint8)
