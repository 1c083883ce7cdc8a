"""The free body (mu = 0, Euler case): its orbits on the sphere |M| = 1, its separatrices in time.

On the sphere 2 J1 (J2 - J1) [cos(theta1 - beta0) - cos(alpha0)] is the quadratic form
sin^2(alpha0/2) M2^2 - cos^2(alpha0/2) M1^2. It is positive on the orbits around the axes +-M2,
negative around +-M1, and zero on the separatrix. The largest |M3| of an orbit, its height, tells
which orbit it is. M is in units of |M|. The first axis of arrays counts components, the second
samples.

Separatrices 2 and 4 rise from J1 = 0 to J1 = J2; 1 and 3 fall. As motions in the dimensionless time
t' they are functions of generic numbers: `m` is numpy, math or an mpmath context. With the periodic
orbits they form the heteroclinic cycle of Fig. 2, whose turns are the symbols of a route.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.coordinates import (
    TURN,
    Canonical,
    andoyer_from_body,
    canonical_from_andoyer,
    cos_sin_half,
)
from rigidpend.mechanics.equations import eq1
from rigidpend.numbers import Elementary, Numbers, Scalar
from rigidpend.numbers.texts import NO_SYMBOL

SEPARATRICES = (1, 2, 3, 4)
"""Numbers of the separatrices; 2 and 4 are the halves of one circle, 1 and 3 of the other."""
TURNS = (
    *((2, 1, 0), (2, 3, 1), (4, 3, 0), (4, 1, 1)),
    *((1, 4, 0), (1, 2, 1), (3, 2, 0), (3, 4, 1)),
)
"""Turns of an orbit near a periodic orbit: separatrix of arrival, separatrix of departure, symbol.

With symbol 0 the orbit leaves towards smaller theta1 (left), with 1 towards larger theta1 (right),
modulo 4 pi."""

MIRRORED = np.array([0, 3, 4, 1, 2], dtype=np.uint8)
"""Separatrices of the mirror image of an orbit: 1 and 3, 2 and 4 change places; 0 is none."""

# Indexed by arrival and departure. Pairs that are no turn, and 0 for no crossing, have no symbol.
_SYMBOL = np.full((5, 5), NO_SYMBOL, dtype=np.uint8)
for _arriving, _leaving, _symbol in TURNS:
    _SYMBOL[_arriving, _leaving] = _symbol


def around_M2(alpha0: Scalar, height: float, side: int, phi: ArrayLike) -> NDArray[np.float64]:
    """An orbit around the axis of the smallest moment of inertia, on side 1 or -1 of it, (3, n).

    The height is the largest |M3|, between 0 and 1. The angle phi along the orbit, (n,), is 0 where
    M3 = 0 < M1. It grows with time, at the rate sin(alpha0/2) J2 |M2| in t'. Small components keep
    their digits if alpha0 has those that `coordinates.cos_sin_half` needs.
    """
    return _around(*cos_sin_half(alpha0), height, side, phi)


def _around(
    cos: float, sin: float, height: float, side: int, phi: ArrayLike
) -> NDArray[np.float64]:
    """:func:`around_M2` from the cosine and the sine of alpha0/2."""
    x, y = height * np.cos(phi), height * np.sin(phi)
    # 1 - height^2 as a product keeps its precision beside the separatrix.
    M2 = side * np.sqrt((1 - height) * (1 + height) + (cos * x) ** 2)
    return np.stack((sin * x, M2, side * y))


def around_M1(alpha0: Scalar, height: float, side: int, phi: ArrayLike) -> NDArray[np.float64]:
    """An orbit around the axis of the largest moment of inertia.

    Exchanging M1 with M2 and alpha0 with pi - alpha0 leaves M3' = M1 M2 as it is, and turns
    the form into its negative: see :func:`around_M2` for the parameters.
    """
    cos, sin = cos_sin_half(alpha0)
    M2, M1, M3 = _around(sin, cos, height, side, phi)
    return np.stack((M1, M2, M3))


def half_circle(alpha0: Scalar, number: int, phi: ArrayLike) -> NDArray[np.float64]:
    """A separatrix of (sol_1)-(sol_22) on the sphere: half of a great circle, (3, n).

    The angle phi, (n,), goes from -pi/2 to pi/2 in the sense of the flow: M3 rises on 2 and 4,
    falls on 1 and 3.
    """
    # M1 and M2 are as the sine and the cosine of half of theta1 - beta0 (`_from_beta0`).
    cos, sin = cos_sin_half(alpha0)
    across, ahead = np.cos(phi) * (-1 if number > 2 else 1), direction(number)
    return np.stack((ahead * sin * across, cos * across, ahead * np.sin(phi)))


def separatrix_theta1(alpha0: float, beta0: float) -> NDArray[np.float64]:
    """Angle theta1 of the separatrices 1..4, radians, as in (sol_1)-(sol_22): all within 4 pi."""
    return beta0 + np.array([_from_beta0(number, alpha0, np) for number in SEPARATRICES])


def _from_beta0(number: int, alpha0: Scalar, m: Elementary) -> Any:
    """Angle theta1 - beta0 on separatrix `number`, radians."""
    # 3 and 4 lie a turn beyond 1 and 2, and are the other halves of their circles.
    return direction(number) * alpha0 + (2 * m.pi if number > 2 else 0)


def in_plane(M: ArrayLike, beta0: float, middle: ArrayLike) -> tuple[Any, Any]:
    """Map points M (3, n) of length 1 to theta1 and J1/J2, with theta1 within 2 pi of `middle`.

    None may lie on the axis of M3, where theta1 is not defined.
    """
    # theta1 and J1 do not depend on gamma, so that any unit vector serves.
    c = canonical_from_andoyer(andoyer_from_body(M, np.ones_like(M) / np.sqrt(3)), beta0)
    start = np.asarray(middle) - TURN
    return start + np.mod(c.theta1 - start, 2 * TURN), c.J1 / c.J2


class SeparatrixMotion(NamedTuple):
    """A motion on an unperturbed separatrix, given by its state at t' = t0."""

    number: int
    """Number of the separatrix, 1 to 4."""
    J1_0: Any
    J2mJ1_0: Any
    """Action J2_0 - J1_0, held beside J1_0 so that the smaller of the two keeps its digits."""
    theta2_0: Any

    @property
    def J2_0(self) -> Any:
        return self.J1_0 + self.J2mJ1_0


def unperturbed(state: Numbers, p: Angles, m: Elementary) -> tuple[Any, Any, Any, Any]:
    """Hamilton's equations of the body without weight, dimensionless time t' (eq. eq1_0).

    State and result are those of :func:`rigidpend.mechanics.equations.eq1`, here with mu = 0.
    """
    return eq1(state, p._replace(mu=0), m)


def separatrix(t: Scalar, motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Canonical:
    """The unperturbed separatrices 1 to 4 (eq. sol_1, sol_2, sol_12, sol_22).

    The time t is t' - t0, \\|u t\\| < 1400 in double precision. J3 = 0 exactly, theta3 = 0 to
    O(mu). J1 and J2 - J1 both keep their relative precision, but for the rounding of u t.
    """
    # Each action takes half of the exponent, so that neither factor overflows before the smaller
    # action underflows.
    rise = m.exp(direction(motion.number) * exponent(motion.J2_0, p, m) * t / 2)
    lower, upper = motion.J2mJ1_0 / rise, motion.J1_0 * rise
    J2 = motion.J2_0
    J1, J2mJ1 = J2 * (upper / (upper + lower)), J2 * (lower / (upper + lower))
    theta2 = p.kappa * J2 * t + motion.theta2_0
    return Canonical(J1, J2mJ1, 0, theta1(motion.number, p, m), theta2, 0, 1)


def theta1(number: int, p: Angles, m: Elementary = np) -> Any:
    """Angle theta1 on separatrix `number`, radians; ValueError for a number other than 1 to 4."""
    if number not in SEPARATRICES:
        raise ValueError(f"separatrices are numbered 1 to 4, got {number!r}")
    return p.beta0 + _from_beta0(number, p.alpha0, m)


def direction(number: int) -> int:
    """Sign, the paper's epsilon: 1 if J1 rises along the separatrix, -1 if it falls."""
    return 1 if number % 2 == 0 else -1


def exponent(J2: Scalar, p: Angles, m: Elementary) -> Any:
    """Rate u = J2 sin(alpha0) at which orbits leave and approach the pendulum rotation, per t'."""
    return J2 * m.sin(p.alpha0)


def fastest_rate(J2: Scalar, p: Angles, m: Elementary) -> Any:
    """The larger of two rates, per t': the rotation's kappa J2, radians, or the exponent u."""
    return max(p.kappa * J2, exponent(J2, p, m))


def v(motion: SeparatrixMotion, m: Elementary) -> Any:
    """Logarithm v = ln((J2_0 - J1_0)/J1_0): J1 passes J2/2 at u t = v rising, at -v falling."""
    return m.log(motion.J2mJ1_0 / motion.J1_0)


def separatrix_beside(rising: Any, Qp: Scalar, Qm: Scalar) -> Any:
    """The separatrix beside which an orbit crosses M3 = 0, or those of arrays of orbits.

    M3 rises on 2 (Qp > 0) and 4 (Qp < 0) and falls on 1 (Qm < 0) and 3 (Qm > 0). The other one of
    Qp and Qm is small there.
    """
    up, down = 4 - 2 * (Qp > 0), 3 - 2 * (Qm < 0)
    return down + rising * (up - down)


def symbols(separatrix: ArrayLike) -> NDArray[np.uint8]:
    """The symbols (k, n) of crossings (k + 1, n), given by separatrices 1..4, or 0 for no crossing.

    Symbol i is the side on which the orbit leaves between crossings i and i + 1; `NO_SYMBOL` where
    there is no crossing i + 1.
    """
    beside = np.asarray(separatrix)
    # One index for both separatrices, 5 i + j: 1.5 million pairs take 1.6 ms instead of 5.
    return np.take(_SYMBOL, beside[:-1] * np.uint8(len(_SYMBOL)) + beside[1:])
