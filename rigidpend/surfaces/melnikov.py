"""Melnikov's integral along the unperturbed separatrices, and its zeros.

The paper has it for separatrix 2; 1, 3 and 4 follow from the same bracket. Dimensionless, over
generic numbers: `m` is numpy, math or an mpmath context. Phases are theta2_0, radians.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.separatrices import (
    SeparatrixMotion,
    direction,
    separatrix,
    theta1,
    u,
    unperturbed,
    v,
)
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.numbers.generic import Elementary, Numbers, Scalar

if TYPE_CHECKING:
    from rigidpend.routes.problem import RouteProblem


def bracket(state: Numbers, p: Angles, m: Elementary = np) -> Any:
    """Poisson bracket {H0, H1/(kappa J2)} in (theta1, J1), which Melnikov's integral sums.

    The derivatives of H = H0 + mu H1 are those in Hamilton's equations.

    Parameters
    ----------
    state : 4 numbers or arrays
        theta1, J1, theta2, J2; not only of a separatrix.
    p : Angles
        Its mu has no part in this.
    m : namespace of sin and cos
    """
    # H is linear in mu: H1 has the derivatives at mu = 1 less those at mu = 0. So the equations are
    # written once, and any slip in them shows here too.
    free, heavy = unperturbed(state, p, m), eq1(state, p._replace(mu=1), m)
    H0_J1, H0_theta1 = free[0], -free[1]
    H1_J1, H1_theta1 = heavy[0] - free[0], free[1] - heavy[1]
    return (H0_theta1 * H1_J1 - H0_J1 * H1_theta1) / (p.kappa * state[3])


def integrand(t: Scalar, motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Any:
    """Integrand: :func:`bracket` at t' - t0 = t on a separatrix, to relative precision.

    It falls off like exp(-u \\|t\\|), as J1 (J2 - J1) does.
    """
    at = separatrix(t, motion, p, m)
    share = at.J1 / motion.J2_0 * (at.J2mJ1 / motion.J2_0)
    # sin(theta1 + theta2) - sin(theta2) as a product: the paper's cosine at theta1/2 + theta2.
    swing = m.cos(at.theta2 + at.theta1 / 2)
    return -direction(motion.number) * sigma(motion.number, p, m) * share * swing


def quadrature(
    motion: SeparatrixMotion, p: Angles, m: Elementary = math, eps: float = 1e-15
) -> Any:
    """Melnikov's integral by the trapezoid rule, in any precision.

    Parameters
    ----------
    motion : SeparatrixMotion
        Numbers that `m` knows, as `p`.
    p : Angles
    m : namespace of exp, log, sin, cos and pi
    eps : float, optional
        Error allowed, relative to the amplitude.

    Returns
    -------
    number

    Notes
    -----
    On the whole line the rule errs by the integrand's Fourier transform at 2 pi/step, which is
    known. As the amplitude is about nu exp(-nu) of the integrand, `m` must have nu/ln(10) digits
    more than are asked for: doubles leave 10 at nu = 14, 4 at nu = 30 and none at nu = 45.
    """
    nats, rate = 3 - math.log(eps), u(motion, p, m)
    # The rule errs by exp(nu - 2 pi^2/step) beside an amplitude of exp(-nu): their ratio is to be
    # exp(-nats). Beyond the reach the integrand is below that, for it falls as exp(-|u t|).
    step = 2 * m.pi**2 / (2 * p.nu + nats)
    reach = math.ceil((nats + p.nu) / step)
    middle = direction(motion.number) * v(motion, m) / rate
    # The integrand is largest at the section, half the way; the nodes lie evenly about it.
    times = (middle + k * step / rate for k in range(-reach, reach + 1))
    return sum(integrand(t, motion, p, m) for t in times) * step / rate


def integral(motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Any:
    """Melnikov's integral in closed form, at the phase `motion.theta2_0` (eq. Im).

    Parameters
    ----------
    motion : SeparatrixMotion
        The separatrix (the paper has number 2), where it is at t0, and the phase there.
    p : Angles
    m : namespace of exp, expm1, log, sin and pi

    Returns
    -------
    number
        Of the bracket integrated over t'.

    Notes
    -----
    The paper prints the opposite sign; with the bracket as it is defined there the integral
    along separatrix 2 is minus what stands in (Im). It also calls the integral divergent and
    takes a principal value: the integrand falls off exponentially and nothing diverges. Its
    theta2* holds theta2_0 already, to which the phase would be added once more; the phase here
    is theta2_0 itself.
    """
    swing = m.cos(delta(motion, p, m) + motion.theta2_0)
    return amplitude(motion.number, motion.J2_0, p, m) * swing


def amplitude(number: int, J2_0: Any, p: Angles, m: Elementary = np) -> Any:
    """Factor of cos(delta + theta2_0) in Melnikov's integral, zero where nothing splits.

    On 2 and 4 it is never zero, for 0 < alpha0 + beta0 < 2 pi; on 1 and 3 it is in the Hess
    case alpha0 = beta0.
    """
    # 1/sinh(nu), which neither overflows nor cancels.
    decay = -2 * m.exp(-p.nu) / m.expm1(-2 * p.nu)
    lean = m.sin(theta1(number, p, m) / 2)
    return -direction(number) * 2 * p.nu / (p.kappa * J2_0) * lean * decay


def delta(motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Any:
    """Phase lag delta = theta1/2 +- kappa v/sin(alpha0), radians; + on separatrices 2 and 4."""
    lag = p.nu / m.pi * v(motion, m)
    return theta1(motion.number, p, m) / 2 + direction(motion.number) * lag


def sigma(number: int, p: Angles, m: Elementary = np) -> Any:
    """Factor sigma_0 = 2 sin(alpha0) sin(theta1/2)/kappa; theta1 as on the separatrix."""
    return 2 * m.sin(p.alpha0) * m.sin(theta1(number, p, m) / 2) / p.kappa


def zeros(problem: RouteProblem, number: int = 2) -> tuple[float, ...]:
    """Phases theta2_0 in [0, 2 pi) at which Melnikov's integral vanishes.

    They are +-k pi/2 - delta, k = 1, 3, ..., with :func:`delta` for the orbit that has the
    problem's J1_0 and J2_0 at theta2_0.

    Parameters
    ----------
    problem : RouteProblem
    number : int, optional
        Of the separatrix, 1 to 4; orbits of route codes start on 2.

    Returns
    -------
    tuple of 2 floats
        Ascending, in radians, correctly rounded. Empty for 1 and 3 in the Hess case, where
        the separatrix does not split and the integral is zero at all phases.

    Notes
    -----
    Between the zeros the first symbol is 1 where cos(delta + theta2_0) > 0, up to O(mu).
    """
    if number % 2 and "Hess" in problem.body.special_cases:
        return ()
    # For a tiny J1_0 the lag is many turns, which the remainder takes off: it needs more bits.
    bits = 113 + GUARD_BITS
    m, p = context(bits), problem.body.angles(bits)
    J1, J2 = problem.J1_0.in_context(m), problem.J2_0(bits)
    lag = delta(SeparatrixMotion(number, J1, J2 - J1, 0), p, m)
    found = sorted(float((quarter * m.pi / 2 - lag) % (2 * m.pi)) for quarter in (1, 3))
    # A remainder just below 2 pi may round to the double 2 pi, which is phase 0.
    return tuple(x if x < math.tau else 0.0 for x in found)
