"""Truths of closed and of periodic orbits, and of alpha(T), for :mod:`scripts.stated`."""

import functools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend import Body
from rigidpend.experiments.principal_axes import carry, initial, integrator
from rigidpend.mechanics import pendulum
from rigidpend.mechanics.coordinates import scale
from rigidpend.mechanics.equations import (
    AlignedCoefficients,
    aligned,
    aligned_coefficients,
    euler_poisson,
)
from rigidpend.mechanics.in_space import alpha_ahead, angular_velocity, hodograph, turning_rate
from rigidpend.numbers import Numbers, Scalar
from rigidpend.numbers.exact import Exact, context, exact, fraction
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic.closed import ClosedOrbit, Closing

BITS = 212
APART = Fraction(1, 2**110)
"""Distance of the orbits whose differences tell a derivative.

Grown by 2^60, as behind 14 passages, its square is still below rounding."""
SAMPLES = 64
"""Samples of a passage in the first quadrature of an action."""
MIRROR = np.array([-1, -1, 1, 1, 1, -1])
"""The symmetry by which some orbits close, of aligned components."""


class Once:
    """A closed orbit, refined, in 212 bits once round."""

    def __init__(self, orbit: ClosedOrbit, fine: Closing) -> None:
        self.m, a, level = context(BITS), precision(BITS), orbit.chain.level
        h, c = level.energy, coefficients(level.body.angles(BITS + 32), "1", a)
        d, chi = (a.array([self.m.mpf(x.numerator) / x.denominator]) for x in fine.place)
        state = section_state(True, d, chi, a.array([h.at(BITS)]), c, a)
        self.start = np.array([fraction(x, BITS) for x in state[:, 0]], dtype=object)
        self.c = AlignedCoefficients(*(fraction(x, BITS) for x in c.aligned))
        self.period, self.h = fine.period, fraction(h.at(BITS), BITS)
        self.mirrored, self.passages = orbit.mirrored, len(orbit.chain.b)

    def exponent(self) -> float:
        """ln of the larger multiplier, per passage.

        Of the six of M and gamma four are 1, so that the trace tells the sum of the others. But
        the mirror image has M . gamma of the other sign: there one of the four is -1.
        """
        whole = monodromy_trace(self.c, self.start, self.period, self.mirrored)
        half = abs(float(whole - (2 if self.mirrored else 4))) / 2
        return math.acosh(half) / self.passages if half > 1 else 0.0

    def action(self) -> float:
        """2 (h T - mu times the integral of r . gamma), by the trapezoid rule over a period."""
        n, before = SAMPLES * self.passages, math.nan
        while True:
            times = np.array([self.period * k / n for k in range(1, n + 1)], dtype=object)
            at = states_at(self.c, self.start[:, None], times, BITS)[:, :, 0]
            heights = self.c.mu_r1 * at[3] + self.c.mu_r2 * at[4]
            found = float(2 * self.period * (self.h - sum(heights, Fraction(0)) / n))
            if found == before:
                return found
            n, before = 2 * n, found


def monodromy_trace(
    c: AlignedCoefficients, start: Any, period: Fraction, mirrored: bool = False
) -> Fraction:
    """The trace of the derivative of a period, from differences of orbits beside."""
    off = np.array([[APART * (i == j) for j in range(6)] for i in range(6)], dtype=object)
    beside = np.concatenate((start[:, None] + off, start[:, None] - off), axis=1)
    ends = states_at(c, beside, np.array([period], dtype=object), BITS)[:, 0]
    column = (ends[:, :6] - ends[:, 6:]) / (2 * APART)
    diagonal = [column[k, k] * (MIRROR[k] if mirrored else 1) for k in range(6)]
    return sum(diagonal, Fraction(0))


def multiplier(body: Body, h0: Exact, family: int) -> tuple[Any, Any]:
    """ln of the larger multiplier of a pendulum motion, and its period, in 212 bits."""
    m, p = context(BITS), body.angles(BITS)
    c = AlignedCoefficients(*(fraction(x, BITS) for x in aligned_coefficients(p, m)))
    r = m.cos(p.beta0 / 2), m.sin(p.beta0 / 2), 0
    h = h0.at(BITS)
    sign = -pendulum.side_of(family)
    M, gamma = pendulum.body_motion(m.mpf(0), sign, 1 / p.kappa, r, h, p.mu, m)
    start = np.array([Fraction(0)] * 2 + [fraction(x, BITS) for x in (M[2], *gamma)], dtype=object)
    period = Fraction(float(pendulum.period(body.angles(), float(h), math)))
    while True:
        # The lowest point again, where the horizontal part of gamma across r is 0.
        at = states_at(c, start[:, None], np.array([period], dtype=object), BITS)[:, 0, 0]
        across = at[3] * start[4] - at[4] * start[3]
        rates = aligned(at, c)
        late = -across / (rates[3] * start[4] - rates[4] * start[3])
        period += late
        if abs(late) < Fraction(1, 2**150):
            break
    trace = monodromy_trace(c, start, period) - 4
    half = m.mpf(trace.numerator) / trace.denominator / 2
    return m.acosh(abs(half)), m.mpf(period.numerator) / period.denominator


def alpha(problem: RouteProblem, theta2: float, end: float) -> float:
    """alpha(T) in principal axes by heyoka, by a quadrature of its own, in 113 bits."""
    [start] = initial(problem, [exact(theta2)], 113)
    A = [x.at(113) for x in problem.body.A]
    M, gamma = ([float(x) for x in part] for part in (start[:3], start[3:]))
    ahead = float(alpha_ahead(M, angular_velocity(M, [float(x) for x in A]), gamma))
    unit = float(scale(problem.body.floats()[0]))
    return carry(_carrier(problem.body), [*start, 0.0, ahead], end / unit)[7]


@functools.cache
def _carrier(body: Body) -> Any:
    return integrator(body, _with_angles, 8, 113)


def _with_angles(A: Numbers, r: Numbers, mu: Scalar) -> Callable[[Any], tuple[Any, ...]]:
    """Euler-Poisson with the rates of theta3 and alpha, of 8 numbers."""

    def field(y: Scalar) -> tuple[Any, ...]:
        M, gamma = y[:3], y[3:6]
        rates = euler_poisson(M, gamma, A, r, mu)
        omega, domega = angular_velocity(M, A), angular_velocity(rates[:3], A)
        return (*rates, turning_rate(M, r, mu), hodograph(omega, gamma, domega)[2])

    return field
