"""Separatrix of the free body, |M|^2 = 2 A3 h0: half an ellipse, and a spiral around Q.

At t = 0 the pole is as far from the middle axis as it comes. Physical units, time t.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.mechanics import free_body
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.hodograph import angular_velocity
from rigidpend.mechanics.poinsot.orbit import shape
from rigidpend.numbers.doubles import Array


def momentum(body: Body, number: int, t: ArrayLike, *, G: float = 1.0) -> Array:
    """Compute M on a separatrix at times t, (3, ...).

    Parameters
    ----------
    body : Body
    number : {1, 2, 3, 4}
        As in `free_body.separatrix`, in the order of (sol_1)-(sol_22).
    t : (...) array
    G : float, optional
        |M|.
    """
    u = rate(body, G) * np.asarray(t, dtype=float)
    # From the two ends of the quarter: cos of a rounded angle has lost sech of a large u.
    start, end = free_body.separatrix(body.alpha0, number, np.array([0, np.pi / 2])).T
    return G * np.stack([start[0] * sech(u), start[1] * sech(u), end[2] * np.tanh(u)])


def polhode(body: Body, number: int, t: ArrayLike, *, G: float = 1.0) -> Array:
    """Compute omega in principal axes at times t, (3, ...); see :func:`momentum`."""
    return np.stack(angular_velocity(momentum(body, number, t, G=G), body.floats()[0]))


def herpolhode(body: Body, t: ArrayLike, *, G: float = 1.0) -> Array:
    """Compute omega in the fixed basis at times t, (3, ...), the same on all four separatrices.

    Components along M, along the radius at t = 0, and along the product of both. The spiral has
    radius G s^2 sin(alpha0)/2 sech u and angle G t/A3: it is symmetric about its second axis.
    """
    t = np.asarray(t, dtype=float)
    rho, psi = rate(body, G) * sech(rate(body, G) * t), G / float(body.A[2]) * t
    along = np.full_like(rho, G / float(body.A[2]))
    return np.stack((along, rho * np.cos(psi), rho * np.sin(psi)))


def rate(body: Body, G: float = 1.0) -> float:
    """Rate du/dt = G s^2 sin(alpha0)/2; it is also the largest radius of the spiral."""
    number = shape(body)
    return G * number.s2 * number.sin * number.cos


def arc(body: Body, t: ArrayLike, *, G: float = 1.0) -> Array:
    """Arc length of polhode and herpolhode alike from 0 to t, negative before."""
    from scipy.special import ellipeinc

    # The ellipse has semiaxes G/A3 along axis 3 and hypot(G/A3, rate) across.
    short, u = G / float(body.A[2]), rate(body, G) * np.asarray(t, dtype=float)
    # The angle on the ellipse (Gudermann's of u), right at both ends; sech of a large u stays.
    phi = np.atan2(np.tanh(u), sech(u))
    return np.asarray(short * ellipeinc(phi, -((rate(body, G) / short) ** 2)))


def length(body: Body, *, G: float = 1.0) -> float:
    """Length of the whole polhode or herpolhode, half the perimeter of an ellipse."""
    from scipy.special import elliprg

    short = G / float(body.A[2])
    # Half of the perimeter 8 R_G(0, a^2, b^2), DLMF 19.30.5.
    return float(4 * elliprg(0.0, short**2, math.hypot(short, rate(body, G)) ** 2))


def sech(u: ArrayLike) -> Array:
    """Hyperbolic secant 1/cosh(u), for any u: no overflow, no cancellation."""
    fallen = np.exp(-np.abs(np.asarray(u, dtype=float)))
    return 2 * fallen / (1 + fallen * fallen)
