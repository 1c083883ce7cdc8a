"""Hyperbolic periodic solutions to first order in mu, and their largest swing."""

from __future__ import annotations

from typing import Any

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.pendulum import side_of
from rigidpend.numbers.generic import Elementary, Scalar


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
