"""The Poincare section M3 = 0 (J1 = J2/2) in coordinates (d, chi).

Upward crossings lie beside separatrix 2 or 4, downward ones beside 1 or 3. The coordinate d is the
component that is small there, Qm upward and Qp downward; the large one follows from the energy. The
coordinate chi is the phase of the vertical: gamma = cos(chi) e3 x m - sin(chi) e3 with m = M/J2.

The symmetry (-M1, -M2, M3, gamma1, gamma2, -gamma3) takes separatrix 4 to 2 and 1 to 3. Points are
described by their images on 2 or 3, where the large component is positive. So gamma3 = -sin(chi)
beside 2 and 3, and sin(chi) beside 1 and 4; and chi = theta1/2 + theta2 + pi/2 with theta1 taken
modulo 2 pi: near alpha0 + beta0 if upward, near 2 pi - alpha0 + beta0 if downward.
On this section dJ2 ^ dchi is the area that the map preserves.
"""

import math
from typing import Any

import numpy as np

from rigidpend.numbers import Numbers, Scalar
from rigidpend.orbits.precision import Precision, precision, rounded
from rigidpend.orbits.return_map.normal_form import MapError
from rigidpend.orbits.return_map.reduced import Coefficients, reduced

MOST_ITERATIONS = 60
"""Largest number of Newton's corrections of the large component."""


def section_state(
    rising: bool, d: Scalar, chi: Scalar, h: Scalar, c: Coefficients, a: Precision
) -> Any:
    """Aligned components (6, ...) of points of the section beside separatrix 2 (rising) or 3.

    Raises MapError if the energy h does not allow such a point.
    """
    return state_of(rising, d, a.cos(chi), a.sin(chi), h, c, a)


def state_of(
    rising: bool, d: Scalar, cos: Any, sin: Any, h: Scalar, c: Coefficients, a: Precision
) -> Any:
    """:func:`section_state` from the cosine and the sine of chi."""
    Q = _large(rising, d, cos, h, c, a)
    components = _ordered(rising, Q, d)
    M1, M2 = c.momenta(*components)
    J2 = a.sqrt(M1 * M1 + M2 * M2)
    # On the section m = (M1, M2, 0)/J2, so that e3 x m = (-M2, M1, 0)/J2.
    gamma = (-cos * M2 / J2, cos * M1 / J2, -sin)
    return np.stack(np.broadcast_arrays(*components, 0 * Q, *gamma))


def section_point(rising: Any, state: Numbers, c: Coefficients, a: Precision) -> tuple[Any, ...]:
    """The coordinates d and chi of states (6, N) on the section, and the side, (N,) each.

    The side is 1 beside separatrix 2 or 3, and -1 beside 4 or 1. gamma may be of any length, and
    `rising` may be an array, (N,).
    """
    Qp, Qm, _, gamma1, gamma2, gamma3 = state
    large, small = np.where(rising, Qp, Qm), np.where(rising, Qm, Qp)
    side = np.where(a.floats(large) > 0, 1.0, -1.0)
    # From here on the state is that on separatrix 2 or 3: side -1 negates M1, M2 and gamma3.
    M1, M2 = (side * x for x in c.momenta(Qp, Qm))
    J2 = a.sqrt(M1 * M1 + M2 * M2)
    return side * small, a.atan2(-side * gamma3, (gamma2 * M1 - gamma1 * M2) / J2), side


def _large(rising: bool, d: Scalar, cos: Any, h: Scalar, c: Coefficients, a: Precision) -> Any:
    """The large component of points of the section, from the energy by Newton's method."""
    if a.bits == 53:
        Q = a.sqrt(2 * h / c.aligned.kappa / (c.to_M1**2 + c.to_M2**2)) + 0 * d
    else:
        # All but the last corrections are made in doubles.
        low, (d0, cos0, h0) = precision(53), (a.floats(x) for x in (d, cos, h))
        Q = a.array(_large(rising, d0, cos0, h0, rounded(c, low), low))
    for _ in range(MOST_ITERATIONS):
        value, slope = _energy(rising, d, Q, cos, c, a)
        step = (value - h) / slope
        Q = Q - step
        # The energy is nearly a multiple of Q^2: a relative correction s leaves an error s^2/2.
        if a.largest(step / Q) < math.sqrt(a.epsilon) / 2:
            return Q
    raise MapError("the energy is too small for a crossing at such a distance")


def section_tangents(
    rising: bool, d: Scalar, chi: Scalar, h: Scalar, c: Coefficients, a: Precision
) -> Any:
    """Derivatives (6, 2, ...) of :func:`section_state` in d and chi, along the energy level h."""
    state = section_state(rising, d, chi, h, c, a)
    Q, cos, sin = state[0 if rising else 1], a.cos(chi), a.sin(chi)
    M1, M2 = c.momenta(*_ordered(rising, Q, d))
    by_Q, by_d = (c.momenta(*_ordered(rising, *along)) for along in ((1, 0), (0, 1)))
    J2 = a.sqrt(M1 * M1 + M2 * M2)
    # Q follows from the energy: h_Q dQ + h_d dd + h_chi dchi = 0.
    _, h_Q = _energy(rising, d, Q, cos, c, a)
    h_d = _energy_slope((M1, M2), by_d, Q, cos, c, a)
    h_chi = -sin * _weight(M1, M2, c) / J2
    columns = []
    for along_d, along_chi, of_Q in ((1, 0, -h_d / h_Q), (0, 1, -h_chi / h_Q)):
        moved = [of_Q * q + along_d * x for q, x in zip(by_Q, by_d, strict=True)]
        # The change of the angle l of M, M1 = J2 sin(l) and M2 = J2 cos(l), by which
        # e3 x m = (-cos(l), sin(l), 0).
        turn = (moved[0] * M2 - moved[1] * M1) / J2**2
        gamma = (
            (along_chi * sin * M2 + turn * cos * M1) / J2,
            (turn * cos * M2 - along_chi * sin * M1) / J2,
            -along_chi * cos,
        )
        components = _ordered(rising, of_Q, along_d)
        columns.append(np.stack(np.broadcast_arrays(*components, 0 * Q, *gamma)))
    return np.stack(columns, axis=1)


def _ordered(rising: bool, large: Scalar, small: Scalar) -> tuple[Any, Any]:
    """Qp and Qm, or derivatives of them, from those of the large component and of the small one."""
    return (large, small) if rising else (small, large)


def _energy(rising: bool, d: Scalar, Q: Scalar, cos: Any, c: Coefficients, a: Precision) -> Any:
    """The energy on the section and its derivative in Q."""
    k = c.aligned
    (M1, M2), by_Q = (c.momenta(*_ordered(rising, *x)) for x in ((Q, d), (1, 0)))
    square = M1 * M1 + M2 * M2
    value = k.kappa / 2 * square - Q * d / 2 + cos * _weight(M1, M2, c) / a.sqrt(square)
    return value, _energy_slope((M1, M2), by_Q, d, cos, c, a)


def _energy_slope(
    M: tuple[Any, Any], by: tuple[Any, Any], other: Scalar, cos: Any, c: Coefficients, a: Precision
) -> Any:
    """The derivative of the energy in Q or d.

    `M` are M1 and M2, `by` their derivatives in Q or d, and `other` is the other of the two.
    """
    # Of kappa/2 J2^2 - Q d/2 + cos(chi) mu (r2 M1 - r1 M2)/J2, with J2^2 = M1^2 + M2^2.
    square, growth = M[0] * M[0] + M[1] * M[1], M[0] * by[0] + M[1] * by[1]
    turned = _weight(*by, c) - _weight(*M, c) * growth / square
    return c.aligned.kappa * growth - other / 2 + cos * turned / a.sqrt(square)


def _weight(M1: Any, M2: Any, c: Coefficients) -> Any:
    """The component of mu M x r along e3, for a vector M or its derivative."""
    return c.aligned.mu_r2 * M1 - c.aligned.mu_r1 * M2


def rotation_phase(state: Numbers, c: Coefficients, a: Precision) -> Any:
    """The angle psi of :mod:`reduced` at states (6, ...) with M3 > 0, radians in (-pi, pi]."""
    Qp, Qm, M3, gamma1, gamma2, gamma3 = state
    M1, M2 = c.momenta(Qp, Qm)
    J2 = a.sqrt(M1 * M1 + M2 * M2 + M3 * M3)
    # R takes e3 to m. Its inverse takes gamma, which is perpendicular to M as J3 = 0, to
    # gamma - (M + J2 e3) gamma3/(J2 + M3) = cos(psi) e1 - sin(psi) e2.
    share = gamma3 / (J2 + M3)
    return a.atan2(M2 * share - gamma2, gamma1 - M1 * share)


def rotation_rate(state: Numbers, psi: Any, c: Coefficients) -> Any:
    """The rate of :func:`rotation_phase` in t', from states and their phases in doubles."""
    Qp, Qm, M3, *_ = state
    M1, M2 = c.momenta(Qp, Qm)
    J2 = np.sqrt(M1**2 + M2**2 + M3**2)
    return reduced((Qp, Qm), (np.cos(psi), np.sin(psi)), (J2, M3, 1 / J2, 1 / (J2 + M3)), c).psi
