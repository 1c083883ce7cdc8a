"""Motions beside a pendulum motion, to first order: theta1 as a function of the phase.

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


def coefficients(
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
        Of :func:`coefficients`.
    m : namespace of sin and cos
    """
    sin, cos = m.sin(theta1 / 2), m.cos(theta1 / 2)
    return 2 * (a[0] * cos * cos + a[1] * sin * cos + a[2] * sin * sin)
