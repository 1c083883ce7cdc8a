"""Poinsot's picture of the free body (mu = 0) in closed form: its orbits in time.

An ellipsoid rolls on a plane. With p = sin(alpha0/2) around axis 2, cos(alpha0/2) around axis 1,
the orbit of `free_body` at angle am(u) is M_axis = side G reach dn u, M_other = G p height cn u and
M3 = side G height sn u, where u = rate t and reach = sqrt(1 - p^2 height^2). Its complementary
modulus is coheight/reach. An orbit is given by its height, the largest |M3|/|M|, together with its
coheight sqrt(1 - height^2): what is small of the two is given, not formed. So orbits at any
distance from the separatrix, or from the permanent rotations (height 0), keep their relative
precision.

In space the polar coordinates of omega about M are rho = |M x omega|/|M| and psi, 0 at t = 0: the
herpolhode. The angle of Andoyer's e1, normal to M in the plane of M and the middle axis, has the
rate G/A3 + sigma s^2 G (p coheight)^2/(1 - height^2 sn^2 u), whose integral is Legendre's third;
psi differs from it by an angle that sn, cn and dn give.

All quantities are physical, in physical time t. Components come first, samples after.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned
from rigidpend.mechanics.jacobi import Modulus, modulus, over_turns, reduced
from rigidpend.numbers.generic import Array, Numbers, Scalar

ELEMENTARY = 1e-30
"""Coheight below which the third integral is elementary: its square is far beneath rounding."""


class Orbit(NamedTuple):
    """An orbit of the free body; at t = 0 its M3 vanishes and rises on side 1, falls on -1."""

    A: tuple[float, ...]
    """Principal moments of inertia."""
    G: float
    """Length of the angular momentum, |M|, physical."""
    axis: int
    """Axis that the orbit encircles, 1 or 2."""
    side: int
    """Sign of M on that axis."""
    height: float
    """Largest |M3|/G."""
    coheight: float
    """Distance from the separatrix, sqrt(1 - height^2)."""
    p: float
    """Factor sin(alpha0/2) around axis 2, cos(alpha0/2) around axis 1."""
    reach: float
    """Largest |M_axis|/G."""
    rate: float
    """Rate du/dt of the argument of Jacobi's functions."""
    modulus: Modulus

    @property
    def sigma(self) -> int:
        """Sign of 2 A3 h0 - G^2: 1 around axis 2, -1 around axis 1."""
        return 1 if self.axis == 2 else -1

    @property
    def period(self) -> float:
        """Period of M, in t."""
        return 4 * self.modulus.K / self.rate


def shape(body: Body) -> tuple[float, float, float]:
    """s^2 = 1/A2 - 1/A1, and sine and cosine of alpha0/2, whatever the body's r and mu."""
    A1, A2, A3 = body.A
    # Exact numbers, rounded once but for a root: of nearly equal moments rounded differences are
    # noise.
    whole = A3 * (A1 - A2)
    sin2, cos2 = float(A1 * (A3 - A2) / whole), float(A2 * (A1 - A3) / whole)
    return float((A1 - A2) / (A1 * A2)), math.sqrt(sin2), math.sqrt(cos2)


def through(body: Body, a: Aligned) -> tuple[Orbit, float]:
    """Find the orbit through a dimensionless state, and the state's time t on it.

    Qp and Qm tell the distance from the separatrix with relative precision; gamma does not matter.
    ValueError is raised where M = 0, or M is on a separatrix.
    """
    s2, sin, cos = shape(body)
    Qp, Qm, M3 = (float(x) for x in a[:3])
    M1, M2 = (Qp + Qm) / (2 * cos), (Qp - Qm) / (2 * sin)
    G = math.hypot(M1, M2, M3)
    # Roots apart: the product of tiny Qp and Qm would underflow.
    form = math.sqrt(abs(Qp)) * math.sqrt(abs(Qm))
    if not form > 0:
        raise ValueError("M is zero or on a separatrix")
    # The planes Qp = 0 and Qm = 0 hold the separatrices; they part the orbits around both axes.
    sides = Qp > 0, Qm > 0
    axis, p, along, across = (1, cos, M1, M2) if sides[0] == sides[1] else (2, sin, M2, M1)
    side = 1 if along > 0 else -1
    # Both may pass 1 by a rounding.
    height, coheight = min(math.hypot(across / p, M3) / G, 1.0), min(form / (p * G), 1.0)
    q = sin if axis == 1 else cos
    reach = math.hypot(q, p * coheight)
    length, made = G / math.sqrt(s2), modulus(min(coheight / reach, 1.0))
    rate = p * length * s2 * reach
    found = Orbit(body.floats()[0], length, axis, side, height, coheight, p, reach, rate, made)
    if height == 0:
        return found, 0.0
    sn, cn, dn = side * M3 / (G * height), across / (p * G * height), abs(along) / (G * reach)
    return found, _argument(sn, cn, dn, made) / rate


def _argument(sn: float, cn: float, dn: float, modulus: Modulus) -> float:
    """Argument u, |u| <= 2 K, of given sn, cn and dn."""
    from scipy.special import elliprf

    # Carlson's form of F, DLMF 19.25.5; beyond K it is mirrored there, which cn < 0 tells.
    first = float(sn * elliprf(cn * cn, dn * dn, 1.0))
    return first if cn >= 0 else math.copysign(2 * modulus.K, sn) - first


def momentum(orbit: Orbit, t: ArrayLike) -> Array:
    """Compute M in principal axes at times t, (3, ...).

    A component errs by 1 to 3 ulp of itself times 1 + |rate t|, 9 at most in 240 comparisons with
    60 digits, beside a zero by as much of the slope there. So M1 and M2 keep their relative
    precision where M passes the middle axis, down to coheights of 1e-150. |M| stands within 2 ulp
    and the energy within 4.
    """
    sn, cn, dn = over_turns(orbit.rate * np.asarray(t, dtype=float), orbit.modulus)
    # `along` is the encircled axis, of which M keeps its sign; `across` is the other of 1 and 2.
    along, across = orbit.side * orbit.reach * dn, orbit.p * orbit.height * cn
    M3 = orbit.side * orbit.height * sn
    return orbit.G * np.stack((along, across, M3) if orbit.axis == 1 else (across, along, M3))


def ellipsoid(x: Numbers, A: Numbers) -> Any:
    """Quadratic form A1 x^2 + A2 y^2 + A3 z^2, which is 1 on the inertia ellipsoid (eq. el)."""
    return sum(A[i] * x[i] * x[i] for i in range(3))


def angle(orbit: Orbit, t: ArrayLike) -> Array:
    """Angle psi in radians, continuous, 0 at t = 0, at times t.

    It errs by less than 2 ulp of 1 + |G t/A3|, 0.9 measured against quadrature in 45 digits.
    """
    t = np.asarray(t, dtype=float)
    # Whole half periods gain what is known exactly; the integral is taken over the rest alone.
    turns, u = reduced(orbit.rate * t, orbit.modulus)
    sn, cn, dn = over_turns(u, orbit.modulus)
    ahead = np.atan2(orbit.p * orbit.coheight**2 * sn, orbit.reach * cn * dn)
    gained = turns * _gain(orbit) + _third(orbit, u, sn, cn, dn) - ahead
    return orbit.G / orbit.A[2] * t + orbit.sigma * gained


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
