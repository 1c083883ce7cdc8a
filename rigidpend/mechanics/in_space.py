"""Motions in space at J3 = 0: precession about the vertical, and the hodograph of omega.

The fixed hodograph is the curve of the angular velocity in the fixed basis; at mu = 0 it is
Poinsot's herpolhode. The fixed basis has xi along the vertical gamma, and the horizontal eta along
M at theta3 = 0. M and omega are physical, in principal axes.
"""

import functools
from collections.abc import Callable
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.mechanics.body import SAME_WITHIN, Angles, Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, cos_sin_half
from rigidpend.mechanics.equations import aligned, cross, rounded_coefficients
from rigidpend.numbers import Numbers, Scalar
from rigidpend.numbers.exact import context


class Regime(Enum):
    """Order of the increments of theta3 along the separatrices, largest first.

    Each value is a tuple of groups of equal increments. The numbers 1 to 4 stand for the
    separatrices, 0 for an increment of zero.
    """

    i = ((1, 2), (0,), (3, 4))
    ii = ((2,), (1,), (0,), (3,), (4,))
    iii = ((2,), (0, 1, 3), (4,))
    iv = ((2,), (3,), (0,), (1,), (4,))
    v = ((2, 3), (0,), (1, 4))

    def __str__(self) -> str:
        return " > ".join(" = ".join(map(str, group)) for group in self.value)


def regime(body: Body) -> Regime:
    """Order of the increments of theta3, from the body's angles (eq. trieq).

    It is i if beta0 = pi, ii if beta0 > alpha0, iii if they are equal (the Hess case), iv if beta0
    < alpha0, and v if beta0 = 0. Equality is as in `Body.special_cases`: to within the rounding of
    doubles, from angles in 113 bits.
    """
    p, pi = body.angles(113), context(113).pi
    if abs(pi - p.beta0) <= SAME_WITHIN:
        return Regime.i
    if abs(p.beta0) <= SAME_WITHIN:
        return Regime.v
    if "Hess" in body.special_cases:
        return Regime.iii
    return Regime.ii if p.beta0 > p.alpha0 else Regime.iv


def increments(p: Angles, h0: float) -> NDArray[np.float64]:
    """Increments of theta3 along separatrices 1 to 4, radians, to first order in mu (eq. tri1).

    The energy constant h0 is kappa J2_0^2/2. The separatrices 1 and 3 lie at theta1 = beta0 -
    alpha0 (+ 2 pi), as in (sol_1) and (sol_12). The initial values alpha0 - beta0 (+ 2 pi) printed
    beside their increments are a slip; the increments are right. Small ones, near the Hess case or
    where alpha0 and beta0 are near pi, keep their digits if p has 113 bits.
    """
    # The second form of (tri1): 2/J2_0^2 = kappa/h0, and pi kappa/sin(alpha0) is nu.
    unit = float(p.mu * p.nu / h0)
    first, second = (unit * cos_sin_half(p.beta0 + side * p.alpha0)[1] for side in (-1, 1))
    # 3 and 4 lie 2 pi further in theta1, where sin(theta1/2) of (th3) has the opposite sign.
    return np.array([first, second, -first, -second])


def plateaus(
    separatrices: ArrayLike, p: Angles, h0: float, J1_0: float = 0.0, J2mJ1_0: float = 1.0
) -> NDArray[np.float64]:
    """Plateaus of theta3 near the periodic orbits that a route passes, to first order in mu.

    `separatrices` are k numbers 1 to 4 in the order of the route. The plateaus are k + 1 angles,
    radians. theta3 is 0 where the route starts, on separatrix 2 at the actions J1_0 and J2_0 -
    J1_0; only their quotient counts. From J1_0 = 0 the first plateau is 0.
    """
    along = increments(p, h0)
    # By (th3) and (sol_2) theta3 gains this share of the increment between J1 = 0 and the start. A
    # start above J1 = J2/2 has the plateau at J1 = J2 as its first, and the rest lies between them.
    share = 2 / np.pi * np.arctan2(np.sqrt(J1_0), np.sqrt(J2mJ1_0))
    rest = 2 / np.pi * np.arctan2(np.sqrt(J2mJ1_0), np.sqrt(J1_0))
    first = along[1] * (rest if J2mJ1_0 < J1_0 else -share) + 0.0
    gained = along[np.asarray(separatrices, dtype=int) - 1]
    return np.concatenate(([first], first + np.cumsum(gained)))


def turning_rate(M: Numbers, r: Numbers, mu: Scalar) -> Any:
    """Rate of theta3 in physical time t, mu r . M/M^2, from physical M.

    This is (th3) in other variables, without a singularity at J1 = 0 or J1 = J2, where theta1 has
    no value.
    """
    return mu * sum(r[i] * M[i] for i in range(3)) / sum(x * x for x in M)


def ellipsoid(x: Numbers, A: Numbers) -> Any:
    """Quadratic form A1 x^2 + A2 y^2 + A3 z^2, which is 1 on the inertia ellipsoid (eq. el)."""
    return sum(A[i] * x[i] * x[i] for i in range(3))


def hodograph(omega: Numbers, gamma: Numbers, domega: Numbers) -> tuple[Any, Any, Any]:
    """Compute omega_xi, omega_rho^2 and the rate of alpha (eq. eqPV).

    These are the vertical component of omega, the square of its horizontal component, and the rate
    at which the latter turns, in radians per unit of the time in which `domega` is the derivative
    of omega.
    """
    # gamma is a unit vector. |omega|^2 - omega_xi^2 would cancel where omega is nearly vertical.
    side = cross(gamma, omega)
    square = _dot(side, side)
    return _dot(omega, gamma), square, _dot(side, domega) / square


def alpha_ahead(M: Numbers, omega: Numbers, gamma: Numbers) -> Any:
    """Angle alpha - theta3 from M to the horizontal part of omega at J3 = 0, radians (eq. th_al).

    The paper's arctan is the angle itself, because M . omega > 0.
    """
    return np.arctan2(_dot(M, cross(omega, gamma)), _dot(M, omega))


def fixed_components(omega: Numbers, gamma: Numbers, alpha: Any) -> NDArray[np.float64]:
    """Components xi, eta, zeta of omega in the fixed basis, (n, 3), where alpha is known."""
    omega_xi = _dot(omega, gamma)
    rho = np.linalg.norm(cross(gamma, omega), axis=0)
    return np.stack((omega_xi, rho * np.cos(alpha), rho * np.sin(alpha)), axis=-1)


@functools.lru_cache(maxsize=32)
def field(body: Body) -> Callable[[Any], tuple[Any, ...]]:
    """Field of the aligned equations with the quadrature of theta3, 7 rates in time t'.

    alpha needs no quadrature: (th_al) gives it from theta3.
    """
    _, r, mu = body.floats()
    p = body.angles(113)
    coefficients = rounded_coefficients(p)

    def rates(state: Numbers) -> tuple[Any, ...]:
        # From dimensionless M follows the rate in t', and not in physical t.
        M, _ = body_from_aligned(Aligned(*state[:6]), p.alpha0, 1.0)
        return (*aligned(state[:6], coefficients), turning_rate(M, r, mu))

    return rates


def angular_velocity(M: Numbers, A: Numbers) -> list[Any]:
    """Solve M = A omega for omega, three numbers or arrays; physical units."""
    return [M[i] / A[i] for i in range(3)]


def _dot(a: Numbers, b: Numbers) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
