"""Motions beside a pendulum motion: theta1 over the phase, and periodic ones to first order in mu.

Beside a pendulum motion the phase tau, theta2 where J1 = 0 and theta1 + theta2 where
J1 = J2, grows at the rate kappa J2, and J2 is known from the energy. What is left of (eq1) is
one equation for theta1. It comes from a linear system: y = cot(theta1/2) is the quotient of two
of its components. All is dimensionless.
"""

from __future__ import annotations

from typing import Any

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.pendulum import side_of
from rigidpend.numbers.generic import Elementary, Scalar


def riccati_coefficients(
    tau: Scalar, p: Angles, h: Scalar, family: int, m: Elementary
) -> tuple[Any, Any, Any]:
    """Coefficients a0, a1, a2 of y' + a0 y^2 + a1 y + a2 = 0, y = cot(theta1/2) (eq. eq_Ric1).

    Parameters
    ----------
    tau : number or array
        theta2 for family 1, theta1 + theta2 for family 2, radians; ' is d/dtau.
    p : Angles
    h : number
        Energy, the h0 of `pendulum`; h > mu.
    family : {1, 2}
        Beside J1 = 0 or J1 = J2.
    m : namespace of sin, cos and pi

    Returns
    -------
    a0, a1, a2 : numbers or arrays

    Raises
    ------
    ValueError
        No such family.

    Notes
    -----
    The paper writes the coefficients at J1 = 0 and calls the equation at J1 = J2 similar: its
    coefficients are others. The reversal (M3, gamma3, t to their negatives) makes them
    -a0(pi - tau), -a1(pi - tau), -a2(pi - tau).
    """
    side = side_of(family)
    # cos(beta0) -+ cos(alpha0) as products, for the difference cancels beside the Hess case.
    mean, half = (p.alpha0 + p.beta0) / 2, (p.alpha0 - p.beta0) / 2
    # h - mu sin(tau), which is small at the top where h is near mu.
    kinetic = (h - p.mu) + 2 * p.mu * m.sin(m.pi / 4 - tau / 2) ** 2
    pull = p.mu / (2 * kinetic)
    # 0 * pull gives the constant a0 the shape of the other two.
    return (
        side * m.sin(mean) * m.sin(half) / p.kappa + 0 * pull,
        side * m.sin(p.beta0) / p.kappa + pull * m.cos(tau),
        -side * (m.cos(mean) * m.cos(half) / p.kappa + pull * m.sin(tau)),
    )


def theta1_rate(theta1: Scalar, a: tuple[Any, Any, Any], m: Elementary) -> Any:
    """Rate dtheta1/dtau from the coefficients: (eq_Ric1) without the poles of y.

    Parameters
    ----------
    theta1 : number or array
        Radians.
    a : 3 numbers or arrays
        Of :func:`riccati_coefficients`.
    m : namespace of sin and cos
    """
    sin, cos = m.sin(theta1 / 2), m.cos(theta1 / 2)
    return 2 * (a[0] * cos * cos + a[1] * sin * cos + a[2] * sin * sin)


def periodic_solution(
    theta2: Scalar, p: Angles, h0: Scalar, family: int, epsilon: int, m: Elementary
) -> tuple[Any, Any, Any, Any]:
    """Family T1 or T2 of periodic solutions of (eq1), to first order in mu (eq. tt).

    Parameters
    ----------
    theta2 : number or array
        The unperturbed phase theta2*, radians; it grows by kappa J2_0 in a unit of t'.
    p : Angles
    h0 : number
        Energy constant, kappa J2_0^2/2.
    family : {1, 2}
        T1, at J1 = 0, or T2, at J1 = J2.
    epsilon : {1, -1}
        1 beside separatrices 2 and 4, -1 beside 1 and 3.
    m : namespace of sqrt, sin and cos

    Returns
    -------
    theta1, J1, theta2, J2 : numbers or arrays
        The order of (eq1), dimensionless. theta1 + 2 pi gives a solution as well.

    Raises
    ------
    ValueError
        No such family, or an epsilon other than 1 and -1.

    Notes
    -----
    The last term of theta2 in T2 is printed mu/(kappa J2_0^2) cos(theta2*), which leaves a
    residual of order mu. It is mu/(kappa J2_0^2) cos(beta0 + epsilon alpha0 + theta2*).
    """
    upper, centre, J2_0 = side_of(family) < 0, _centre(p, epsilon), m.sqrt(2 * h0 / p.kappa)
    by_sin, by_cos = swing_coefficients(p, h0, family, epsilon, m)
    lean = p.mu * (by_sin * m.sin(theta2) + by_cos * m.cos(theta2))
    phase = theta2 + centre if upper else theta2
    J2 = J2_0 - p.mu / (p.kappa * J2_0) * m.sin(phase)
    # kappa J2_0^2 is 2 h0. In T2 the phase is theta2* + centre, where (tt) prints theta2* alone.
    ahead = p.mu / (2 * h0) * m.cos(phase)
    # In T2 theta1 + theta2 is the pendulum's own phase: what theta1 gains, theta2 loses.
    return centre + lean, J2 if upper else 0 * J2, theta2 + ahead - (lean if upper else 0), J2


def swing_coefficients(
    p: Angles, h0: Scalar, family: int, epsilon: int, m: Elementary
) -> tuple[Any, Any]:
    """Coefficients d_i1 and d_i2 of (tt), per mu; arguments of :func:`periodic_solution`."""
    half = _centre(p, epsilon) / 2
    # 2 sin(half) is factored out of (tt), where 1 - cos(centre) cancels for a centre near 0.
    lean, turn = m.sin(half), side_of(family) * epsilon * m.sin(p.alpha0)
    size = 2 * lean / (2 * h0 / p.kappa * (p.kappa**2 + m.sin(p.alpha0) ** 2))
    return (
        size * (p.kappa * m.cos(half) - turn * lean),
        size * (p.kappa * lean + turn * m.cos(half)),
    )


def Delta_1(p: Angles, h0: Scalar, epsilon: int, m: Elementary) -> Any:
    """Largest |theta1 - beta0 - epsilon alpha0| near T1 and T2, to first order in mu (eq. dt).

    Parameters
    ----------
    p : Angles
    h0 : number
        Energy constant, kappa J2_0^2/2.
    epsilon : {1, -1}
        1 beside separatrices 2 and 4, -1 beside 1 and 3.
    m : namespace of sqrt and sin

    Returns
    -------
    number
        Radians.
    """
    lean = m.sin((p.beta0 + epsilon * p.alpha0) / 2)
    # Half of cos(gamma0) - cos(alpha0), which cancels where A1 is near A2.
    both = m.sin((p.alpha0 + p.gamma0) / 2) * m.sin((p.alpha0 - p.gamma0) / 2)
    sin_alpha0 = m.sin(p.alpha0)
    return p.mu * sin_alpha0 * abs(lean) / (m.sqrt(sin_alpha0**2 + 16 * both**2) * h0)


def _centre(p: Angles, epsilon: int) -> Any:
    """Angle theta1 of the separatrices, beta0 + epsilon alpha0."""
    if epsilon not in (1, -1):
        raise ValueError(f"epsilon is 1 or -1, not {epsilon!r}")
    return p.beta0 + epsilon * p.alpha0
