"""Angular velocity of the free body in space: Poinsot's herpolhode, in closed form.

The polar coordinates of omega about M are rho = |M x omega|/|M| and psi, 0 at t = 0. The angle
of Andoyer's e1, normal to M in the plane of M and the middle axis, has the rate
G/A3 + sigma s^2 G (p coheight)^2/(1 - height^2 sn^2 u), whose integral is Legendre's third; psi
differs from it by an angle that sn, cn and dn give.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.mechanics.equations import cross, euler_poisson
from rigidpend.mechanics.hodograph import angular_velocity
from rigidpend.mechanics.jacobi import over_turns, reduced
from rigidpend.mechanics.poinsot.orbit import Orbit
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.generic import Numbers, Scalar

ELEMENTARY = 1e-30
"""Coheight below which the third integral is elementary: its square is far beneath rounding."""


def herpolhode(orbit: Orbit, t: ArrayLike) -> Array:
    """Compute omega in the fixed basis at times t, (3, ...).

    Components along M, along the radius at t = 0 (a largest one), and along the product of both.
    """
    rho, psi = radius(orbit, t), angle(orbit, t)
    along = 2 * orbit.h0 / orbit.G
    return np.stack((np.full_like(rho, along), rho * np.cos(psi), rho * np.sin(psi)))


def radius(orbit: Orbit, t: ArrayLike) -> Array:
    """Radius rho, the component of omega across M, at times t.

    Notes
    -----
    Its relative error is that of `polhode.momentum`, 9 ulp times 1 + |rate t| at most, also where
    rho is small: beside the permanent rotations and beside the separatrix. It has half the
    period of M.
    """
    sn, cn, dn = over_turns(orbit.rate * np.asarray(t, dtype=float), orbit.modulus)
    turned = np.hypot(orbit.reach * cn * dn, orbit.p * orbit.coheight**2 * sn)
    return _unit(orbit) * turned / np.hypot(orbit.coheight, orbit.height * cn)


def radii(orbit: Orbit) -> tuple[float, float]:
    """Least and largest rho: the annulus that the herpolhode fills or closes in."""
    return _unit(orbit) * orbit.p * orbit.coheight, _unit(orbit) * orbit.reach


def angle(orbit: Orbit, t: ArrayLike) -> Array:
    """Angle psi in radians, continuous, 0 at t = 0, at times t.

    Notes
    -----
    It errs by less than 2 ulp of 1 + |G t/A3|, 0.9 measured against quadrature in 45 digits.
    """
    t = np.asarray(t, dtype=float)
    # Whole half periods gain what is known exactly; the integral is taken over the rest alone.
    turns, u = reduced(orbit.rate * t, orbit.modulus)
    sn, cn, dn = over_turns(u, orbit.modulus)
    ahead = np.atan2(orbit.p * orbit.coheight**2 * sn, orbit.reach * cn * dn)
    gained = turns * _gain(orbit) + _third(orbit, u, sn, cn, dn) - ahead
    return orbit.G / orbit.shape.A[2] * t + orbit.sigma * gained


def angle_per_period(orbit: Orbit) -> float:
    """Angle psi that is gained from one largest rho to the next, in radians.

    Notes
    -----
    It takes half a period of M. The herpolhode closes where it is a rational part of 2 pi.
    """
    return orbit.G / orbit.shape.A[2] * orbit.period / 2 + orbit.sigma * _gain(orbit)


def curvature(M: Numbers, A: Numbers) -> Any:
    """Signed curvature of the herpolhode, positive where it bends towards growing psi.

    Parameters
    ----------
    M : 3 numbers or arrays
        Physical, in principal axes, not on one of them.
    A : 3 numbers
        Moments of inertia. Where A2 + A3 >= A1 the curvature is positive for any M.
    """
    omega, dM = angular_velocity(M, A), _rate(M, A)
    domega = angular_velocity(dM, A)
    # The derivative of M x omega, and then of omega in space.
    ddM = [x + y for x, y in zip(cross(dM, omega), cross(M, domega), strict=True)]
    ddomega = [x + y for x, y in zip(angular_velocity(ddM, A), cross(omega, domega), strict=True)]
    turn = cross(domega, ddomega)
    speed = sum(x * x for x in domega) ** 0.5
    return sum(M[i] * turn[i] for i in range(3)) / (sum(x * x for x in M) ** 0.5 * speed**3)


def _rate(M: Numbers, A: Numbers) -> Any:
    nothing = (0, 0, 0)
    return euler_poisson(M, nothing, A, nothing, 0)[:3]


def _unit(orbit: Orbit) -> float:
    return orbit.shape.s2 * orbit.G * orbit.p * orbit.height


def _gain(orbit: Orbit) -> float:
    """Gain of psi - G t/A3 in half a period, around axis 2."""
    # At K sn, cn and dn are 1, 0 and k' exactly.
    K, kc = orbit.modulus.K, orbit.modulus.kc
    return float(2 * _third(orbit, K, 1.0, 0.0, kc) - np.pi)


def _third(orbit: Orbit, u: Scalar, sn: Any, cn: Any, dn: Any) -> Any:
    """Legendre's integral Pi(height^2; am u) times p coheight^2/reach, |u| <= K."""
    from scipy.special import elliprj

    # The square of the last is 1 - height^2 sn^2, without cancellation.
    p, reach, beside = orbit.p, orbit.reach, np.hypot(orbit.coheight, orbit.height * cn)
    if orbit.coheight < ELEMENTARY:
        # All is gained beside the middle axis, where the orbit is a hyperbola.
        lean = np.hypot(orbit.coheight, reach * cn)
        return np.sign(sn) * (np.atan2(p, reach) - np.atan2(p * np.abs(cn), lean))
    # Carlson's form, DLMF 19.25.14, with sn^3 taken out: no term cancels, and none is infinite.
    carlson = elliprj(cn**2, dn**2, 1.0, beside**2)
    return p / reach * orbit.coheight**2 * (u + orbit.height**2 / 3 * sn**3 * carlson)
