"""Orbits beside an unperturbed separatrix, to first order in mu and in their distance.

The paper writes this for separatrix 2; here `SeparatrixMotion.number` says which. Deviations are
(delta theta1, delta J1, delta theta2, delta J2) from :func:`separatrices.separatrix`, in the
order of :func:`equations.eq1`. Dimensionless, t' counted from t0.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.separatrices import (
    SeparatrixMotion,
    direction,
    separatrix,
    theta1,
    u,
    v,
)
from rigidpend.numbers.generic import Elementary, Numbers, Scalar


def linearised(
    t: Scalar, delta: Numbers, motion: SeparatrixMotion, p: Angles, m: Elementary = np
) -> tuple[Any, Any, Any, Any]:
    """The linearised equations of the perturbed motion, dimensionless time t' (eq. eq2).

    Parameters
    ----------
    t : number
        t' - t0.
    delta : 4 numbers
        delta theta1, delta J1, delta theta2, delta J2.
    motion : SeparatrixMotion
        The separatrix; the paper has number 2.
    p : Angles
    m : namespace of exp, sin, cos and pi

    Returns
    -------
    tuple of 4
        The derivatives in the same order, per t'.
    """
    by_theta1, by_J1, _, by_J2 = delta
    at, J2 = separatrix(t, motion, p, m), motion.J2_0
    # (eq2) is written for separatrix 2; where the flow falls, sin(theta1 - beta0) is negative.
    steep = direction(motion.number) * m.sin(p.alpha0)
    pull, swing = p.mu / J2, m.sin(at.theta1 + at.theta2) - m.sin(at.theta2)
    upper, lower = m.cos(at.theta1 + at.theta2), m.cos(at.theta2)
    # Where (eq2) has J2_0 - J1* and 2 J1* - J2_0, the small action is carried, not formed.
    across = at.J1 * at.J2mJ1
    return (
        (at.J1 - at.J2mJ1) * steep * by_theta1 + pull * swing,
        (at.J2mJ1 - at.J1) * steep * by_J1
        + across * m.cos(p.alpha0) * by_theta1
        + at.J1 * steep * by_J2
        - pull * at.J1 * upper,
        p.kappa * by_J2 - at.J1 * steep * by_theta1 - pull * at.J1 / J2 * swing,
        -pull * (at.J1 * upper + at.J2mJ1 * lower),
    )


def delta_theta1(t: float, begin: float, motion: SeparatrixMotion, p: Angles) -> float:
    """Deviation delta theta1 after a time t, by quadrature over exponentials (eq. dtheta).

    Parameters
    ----------
    t : float
        t' - t0, of either sign.
    begin : float
        delta theta1 at t0, radians.
    motion : SeparatrixMotion
        Floats, \\|v\\| and \\|u t\\| below 1400.
    p : Angles
        Floats.

    Returns
    -------
    float
        Radians.

    Notes
    -----
    This is the second of the printed forms, with (e^x + e^v)^2 e^-x = 4 e^v cosh^2((x - v)/2):
    the right side neither overflows nor cancels. :func:`delta_theta1_by_actions` is the first.
    """
    rate, middle = direction(motion.number) * u(motion, p, math), v(motion, math)

    def width(tau: float) -> float:
        return 2 * math.cosh((rate * tau - middle) / 2)

    # J1* (J2_0 - J1*) is (J2_0/width)^2, so that its ratios are squares of ratios of widths.
    now = width(t)
    forced = _forced(t, lambda tau: (now / width(tau)) ** 2, motion, p)
    return (now / width(0)) ** 2 * begin + forced


def delta_theta1_by_actions(t: float, begin: float, motion: SeparatrixMotion, p: Angles) -> float:
    """Deviation delta theta1 by the first of the printed forms, a quadrature over J1 (J2 - J1).

    Parameters and result are those of :func:`delta_theta1`.
    """

    def across(tau: float) -> float:
        at = separatrix(tau, motion, p, math)
        return at.J1 * at.J2mJ1

    now = across(t)
    return across(0) / now * begin + _forced(t, lambda tau: across(tau) / now, motion, p)


def _forced(
    t: float, weight: Callable[[float], float], motion: SeparatrixMotion, p: Angles
) -> float:
    """Contribution of mu to delta theta1, with J1 (J2 - J1) at tau relative to t as weight."""
    from scipy.integrate import quad

    half, J2 = float(theta1(motion.number, p, math)) / 2, motion.J2_0

    def pull(tau: float) -> float:
        return weight(tau) * math.cos(p.kappa * J2 * tau + motion.theta2_0 + half)

    # The weight is largest at the middle of the separatrix, where adaptive rules must look.
    rate = u(motion, p, math)
    middle = direction(motion.number) * v(motion, math) / rate
    ends = [0.0, middle, t] if min(0, t) < middle < max(0, t) else [0.0, t]
    # What the rounding of the exponents leaves.
    noise = 1e-13 + 1e-15 * (abs(rate * t) + abs(rate * middle))
    least = noise * max(map(weight, ends)) / rate
    parts = [
        quad(pull, a, b, epsabs=least, epsrel=noise, limit=1000)
        for a, b in itertools.pairwise(ends)
    ]
    return 2 * p.mu * math.sin(half) / J2 * sum(part[0] for part in parts)
