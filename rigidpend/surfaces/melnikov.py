"""Melnikov's integral along the unperturbed separatrices, its zeros, and orbits near separatrices.

The paper gives the integral for separatrix 2; those of 1, 3 and 4 follow from the same bracket. All
is dimensionless, in numbers of any kind: `m` is numpy, math or an mpmath context. Phases are
theta2_0, radians.

Orbits near a separatrix are described to first order in mu and in their distance. Their deviations
from `free_body.separatrix` are (delta theta1, delta J1, delta theta2, delta J2), in the order of
`equations.eq1`, with t' counted from t0.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.free_body import (
    SeparatrixMotion,
    direction,
    exponent,
    separatrix,
    theta1,
    v,
)
from rigidpend.numbers import Elementary, Numbers, Scalar
from rigidpend.numbers.exact import GUARD_BITS, context

if TYPE_CHECKING:
    from rigidpend.routes.problem import RouteProblem


def integral(motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Any:
    """Melnikov's integral over t' in closed form, at the phase `motion.theta2_0` (eq. Im).

    The paper prints the opposite sign: with the bracket as defined there the integral along
    separatrix 2 is minus the closed form in (Im). The paper also calls the integral divergent and
    takes a principal value, but the integrand falls off exponentially and the integral converges.
    The paper's theta2* contains theta2_0 already, and its phase would be added once more; the phase
    here is theta2_0 itself.
    """
    swing = m.cos(delta(motion, p, m) + motion.theta2_0)
    return amplitude(motion.number, motion.J2_0, p, m) * swing


def amplitude(number: int, J2_0: Any, p: Angles, m: Elementary = np) -> Any:
    """Factor of cos(delta + theta2_0) in Melnikov's integral, zero where surfaces do not split.

    On separatrices 2 and 4 it is never zero, as 0 < alpha0 + beta0 < 2 pi; on 1 and 3 it is zero in
    the Hess case alpha0 = beta0.
    """
    # Separatrices 3 and 4 lie a turn beyond 1 and 2, where the sine of theta1/2 is opposite.
    # That of a rounded theta1 would not be zero in the Hess case.
    near, side = (number - 2, -1) if number > 2 else (number, 1)
    lean = side * m.sin(theta1(near, p, m) / 2)
    return -direction(number) * 2 / (p.kappa * J2_0) * lean * decay(p.nu, m)


def decay(nu: Any, m: Elementary = np) -> Any:
    """Factor nu/sinh(nu), by which Melnikov's integral is exponentially small."""
    # In this form it neither overflows for large nu nor cancels for small ones.
    return -2 * nu * m.exp(-nu) / m.expm1(-2 * nu)


def delta(motion: SeparatrixMotion, p: Angles, m: Elementary) -> Any:
    """Phase lag delta = theta1/2 +- kappa v/sin(alpha0), radians; + on separatrices 2 and 4."""
    lag = p.nu / m.pi * v(motion, m)
    return theta1(motion.number, p, m) / 2 + direction(motion.number) * lag


def zeros(problem: RouteProblem) -> tuple[float, ...]:
    """Phases theta2_0 in [0, 2 pi) at which Melnikov's integral vanishes, in ascending order.

    They are +-k pi/2 - delta, k = 1, 3, ..., with :func:`delta` for the orbit that has the
    problem's J1_0 and J2_0 at theta2_0, correctly rounded. Orbits of route codes start on
    separatrix 2. Their first symbol is 1 where cos(delta + theta2_0) > 0, up to O(mu) and
    :func:`missed`.
    """
    # For a tiny J1_0 the lag is many turns. The remainder takes them off, and their bits with them.
    bits = 113 + GUARD_BITS
    m, p = context(bits), problem.body.angles(bits)
    J1, J2 = problem.J1_0.at(bits), problem.J2_0(bits)
    lag = delta(SeparatrixMotion(2, J1, J2 - J1, 0), p, m)
    found = (float((quarter * m.pi / 2 - lag) % (2 * m.pi)) for quarter in (1, 3))
    # A remainder just below 2 pi may round to the double 2 pi, which is phase 0.
    return tuple(sorted(x if x < math.tau else 0.0 for x in found))


def missed(problem: RouteProblem) -> float:
    """Part of Melnikov's integral on separatrix 2 before the start, as a share of its amplitude.

    Orbits that start there, and not on S1-, miss it. For small mu and a small share their first
    symbol changes at phases that are up to so many radians from the :func:`zeros`; where the share
    is 1 or more, the zeros say nothing of the symbol. Exact for J1_0 far below J2_0.
    """
    m, nu = context(53), problem.body.angles(53).nu
    # The integral from -infinity of exp(u t - v) cos(kappa J2_0 t + ...), where the integrand of
    # (Im) has left the denominator 1. By logarithms, because sinh(nu) may overflow.
    depth = m.log(problem.J1_0.at(53) / problem.J2_0(53)) - m.log(decay(m.mpf(nu), m))
    return float(m.exp(depth) / math.hypot(1, nu / math.pi))


def linearised(
    t: Scalar, delta: Numbers, motion: SeparatrixMotion, p: Angles, m: Elementary = np
) -> tuple[Any, Any, Any, Any]:
    """The linearised equations of the perturbed motion, dimensionless time t' (eq. eq2).

    From the deviations delta theta1, delta J1, delta theta2, delta J2 from a separatrix at
    t' - t0 = t the rates of the deviations follow, in the same order. The paper has separatrix 2.
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

    `begin` is delta theta1 at t0, radians; t, a time in t', may have either sign; \\|v\\| and
    \\|u t\\| are below 1400. This is the second of the printed forms, rewritten by
    (e^x + e^v)^2 e^-x = 4 e^v cosh^2((x - v)/2), the right side of which neither overflows nor
    cancels.
    """
    from scipy.integrate import quad

    J2, half = motion.J2_0, float(theta1(motion.number, p, math)) / 2
    rate, middle = direction(motion.number) * exponent(J2, p, math), v(motion, math)

    def weight(tau: float) -> float:
        """The ratio of J1* (J2_0 - J1*), which is J2_0^2/(4 cosh^2), at tau to that at t."""
        return (math.cosh((rate * t - middle) / 2) / math.cosh((rate * tau - middle) / 2)) ** 2

    def pull(tau: float) -> float:
        return weight(tau) * math.cos(p.kappa * J2 * tau + motion.theta2_0 + half)

    # The weight is largest at the middle of the separatrix, a narrow peak that an adaptive rule on
    # a long interval could miss: the interval is divided there.
    top = middle / rate
    ends = [0.0, top, t] if min(0, t) < top < max(0, t) else [0.0, t]
    # Relative error that the rounding of the exponents leaves, of which no quadrature is better.
    noise = 1e-13 + 1e-15 * (abs(rate * t) + abs(middle))
    accuracy: Any = {"epsabs": noise * max(map(weight, ends)) / abs(rate), "epsrel": noise}
    parts = [quad(pull, a, b, **accuracy, limit=1000)[0] for a, b in itertools.pairwise(ends)]
    return weight(0) * begin + 2 * p.mu * math.sin(half) / J2 * sum(parts)
