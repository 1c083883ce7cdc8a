"""The fixed hodograph of the angular velocity: Poinsot's herpolhode where mu = 0.

The fixed basis has xi along the vertical gamma and the horizontal eta along M at theta3 = 0.
M and omega are physical, in principal axes; rates are per unit of the time of domega.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import aligned, aligned_coefficients, cross
from rigidpend.mechanics.precession import turning_rate
from rigidpend.numbers.generic import Elementary, Numbers


def hodograph(omega: Numbers, gamma: Numbers, domega: Numbers) -> tuple[Any, Any, Any]:
    """Compute omega_xi, omega_rho^2 and the rate of alpha (eq. eqPV).

    Parameters
    ----------
    omega, gamma, domega : 3 numbers or arrays each
        Angular velocity, vertical, and the derivative of the former.

    Returns
    -------
    tuple of 3
        The vertical component, the square of the horizontal one, and the rate at which the
        latter turns; units of omega, of its square, radians per time of `domega`.
    """
    omega_xi = _dot(omega, gamma)
    square = _dot(omega, omega) - omega_xi * omega_xi
    return omega_xi, square, _dot(cross(gamma, omega), domega) / square


def alpha_ahead(M: Numbers, omega: Numbers, gamma: Numbers) -> Any:
    """Angle alpha - theta3 from M to the horizontal part of omega at J3 = 0 (eq. th_al).

    Parameters
    ----------
    M, omega, gamma : 3 numbers or arrays each

    Returns
    -------
    number or array
        Radians. M . omega > 0, so that the paper's arctan is the angle itself.
    """
    return np.arctan2(_dot(M, cross(omega, gamma)), _dot(M, omega))


def fixed_components(omega: Numbers, gamma: Numbers, alpha: Any) -> NDArray[np.float64]:
    """Compute omega in the fixed basis, (n, 3): xi, eta, zeta, from omega_rho and alpha of (eqPV).

    Parameters
    ----------
    omega, gamma : (3, n) arrays
    alpha : (n,) array
        Radians.
    """
    omega_xi = _dot(omega, gamma)
    # Not sqrt(|omega|^2 - omega_xi^2), which cancels where omega is nearly vertical.
    rho = np.linalg.norm(cross(gamma, omega), axis=0)
    return np.stack((omega_xi, rho * np.cos(alpha), rho * np.sin(alpha)), axis=-1)


def field(body: Body) -> Callable[[Any, Any], tuple[Any, ...]]:
    """Field of the aligned equations with the quadratures of theta3 and alpha, time t'.

    Returns
    -------
    callable
        ``field(state, m)`` for `states.states_at`: of 8 numbers, the aligned components,
        theta3 and alpha, the derivatives in t'.
    """
    (A, _, _), without = body.floats(), field_without_alpha(body)
    alpha0, s = body.alpha0, scale(A, math)

    def rates(state: Numbers, m: Elementary) -> tuple[Any, ...]:
        found = without(state[:7], m)
        M, gamma = body_from_aligned(Aligned(*state[:6]), alpha0, s)
        # M is linear in the aligned components, so the same map takes their rates to its own.
        dM, _ = body_from_aligned(Aligned(*found[:6]), alpha0, s)
        omega, domega = angular_velocity(M, A), angular_velocity(dM, A)
        # domega is the rate of omega in t', so that of alpha comes out in t' as well.
        return (*found, hodograph(omega, gamma, domega)[2])

    return rates


@functools.lru_cache(maxsize=32)
def field_without_alpha(body: Body) -> Callable[[Any, Any], tuple[Any, ...]]:
    """Field of 7 numbers, without alpha, which (th_al) gives from theta3 without quadrature."""
    A, r, mu = body.floats()
    p, s = body.angles(), scale(A, math)
    coefficients = aligned_coefficients(p, math)

    def rates(state: Numbers, _: Any) -> tuple[Any, ...]:
        M, _ = body_from_aligned(Aligned(*state[:6]), p.alpha0, s)
        # The precession is known per t, and t' = t s.
        return (*aligned(state[:6], coefficients), turning_rate(M, r, mu) / s)

    return rates


def angular_velocity(M: Numbers, A: Numbers) -> list[Any]:
    """Solve M = A omega for omega, three numbers or arrays; physical units."""
    return [M[i] / A[i] for i in range(3)]


def _dot(a: Numbers, b: Numbers) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
