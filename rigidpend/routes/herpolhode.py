"""Orbits that follow a given route, sampled in double precision with theta3 and alpha."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.mechanics import in_space
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, canonical_from_aligned
from rigidpend.mechanics.equations import on_section, rounded_coefficients
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers import Array, Numbers
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.integrate.step_crossings import crosses
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.start import Scales, start, states_double


class SampledOrbit(NamedTuple):
    """An orbit sampled in time, with its angles and the hodograph of its angular velocity omega."""

    t: Array
    """Times t', dimensionless, (n,)."""
    theta1: Array
    """Radians, 0 to 4 pi, (n,)."""
    J1_over_J2: Array
    """0 at the lower periodic orbit, 1 at the upper one, (n,)."""
    theta3: Array
    """Angle of precession of M, radians, (n,)."""
    alpha: Array
    """Angle of the horizontal part of omega, radians, (n,)."""
    omega: Array
    """Angular velocity in the fixed basis xi (up), eta, zeta, in 1/t, physical, (n, 3)."""

    def __repr__(self) -> str:
        return f"<orbit of {self.t.size} samples, t' = 0 to {self.t[-1]:.6g}>"


class RouteOrbit(NamedTuple):
    """A sampled orbit of a route, with the errors of its crossings."""

    t: Array
    """Times t' of the samples, (n,)."""
    states: Array
    """(7, n), six aligned components and theta3."""
    crossing_error: Array
    """Delay t' of the crossings of J1 = J2/2 behind those of the route, (k,)."""


def follow(
    problem: RouteProblem,
    theta2_0: float,
    crossing_time: Array,
    *,
    step: float,
    engine: str,
    tolerance: float,
) -> RouteOrbit:
    """Integrate the orbit of a route, sampled evenly to half a passage behind its last crossing.

    The passage is the last one of the route, or the next if that is shorter. `theta2_0` is in
    radians. `crossing_time`, (k,) with k >= 2, are the crossings of the route, and `step` is the
    distance of samples, both in t'.
    """
    end = crossing_time[-1] + (crossing_time[-1] - crossing_time[-2]) / 2
    t = np.arange(0.0, end, step)
    # One integration for both: the samples to be drawn, and the states at the route's crossings, by
    # which the samples are judged.
    times = np.union1d(t, crossing_time)
    field, begin = in_space.field(problem.body), initial_state(problem, theta2_0)
    states = states_at(field, begin, times, engine=engine, tolerance=tolerance)
    at = np.searchsorted(times, crossing_time)
    _, late = on_section(states[:6, at], rounded_coefficients(problem.body.angles(113)))
    sampled = states[:, np.searchsorted(times, t)]
    # Of a heavy body the passage after the route may be much shorter than the last one of it.
    beyond = t[1:][crosses(sampled[2, :-1], sampled[2, 1:])]
    beyond = beyond[beyond > crossing_time[-1] + step]
    n = np.searchsorted(t, (crossing_time[-1] + beyond[0]) / 2) if beyond.size else t.size
    return RouteOrbit(t[:n], sampled[:, :n], late)


def initial_state(problem: RouteProblem, theta2_0: float) -> Array:
    """State (7,) of the orbit at t' = 0, with theta3 = 0."""
    # The same start as that of route codes in doubles, so that both can be compared.
    state = states_double(start(problem, 53, Scales()), np.array([theta2_0]), 0.0)[:, 0]
    return np.array([*state, 0.0])


def separatrices(states: Array) -> NDArray[np.uint8]:
    """Separatrices 1..4 beside which successive samples (6 or more, n) change the sign of M3."""
    Qp, Qm, M3 = states[:3]
    k = np.flatnonzero(crosses(M3[:-1], M3[1:]))
    return np.asarray(separatrix_beside(M3[k] < 0, Qp[k], Qm[k]), dtype=np.uint8)


def samples(body: Body, t: Array, states: Array) -> SampledOrbit:
    """The sampled orbit of states (7, n) at times t', (n,); theta3 is the last component."""
    *state, theta3 = states
    M, gamma = physical(state, body)
    omega = in_space.angular_velocity(M, body.floats()[0])
    # alpha differs from theta3 by less than pi/2 (th_al), so it is continuous where theta3 is.
    angle = theta3 + in_space.alpha_ahead(M, omega, gamma)
    c = canonical_from_aligned(Aligned(*state), body.angles(113).alpha0, body.beta0)
    hodograph = in_space.fixed_components(omega, gamma, angle)
    return SampledOrbit(t, c.theta1, c.J1 / c.J2, theta3, angle, hodograph)


def vertices(separatrices: ArrayLike) -> str:
    """The vertices of the heteroclinic cycle that a route passes, as the paper writes them."""
    # 2 and 4 rise from vertex i to i*, 1 and 3 fall from i* to i.
    return "-".join(f"{i}-{i}*" if i in (2, 4) else f"{i}*-{i}" for i in np.ravel(separatrices))


def physical(states: Numbers, body: Body) -> tuple[Array, Array]:
    """Physical M and gamma, each (3, ...), of states with six aligned components."""
    # kappa is 1/(A3 s^2). From moments in doubles s is lost where A1 is near A2.
    s = 1 / math.sqrt(body.floats()[0][2] * body.kappa)
    return body_from_aligned(Aligned(*states[:6]), body.angles(113).alpha0, s)
