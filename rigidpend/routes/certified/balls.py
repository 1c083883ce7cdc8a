"""Balls: enclosures of a problem's numbers, and of the rate at which two of its orbits can part.

A :class:`Balls` is a namespace of elementary functions over Arb's balls, midpoint and radius;
each result contains the true value. The package's formulas run over it as they run over floats:
nothing is written twice, and the results are enclosures.

The rate is the logarithmic norm of the aligned field (lemma "growth" of `docs/certified.md`). The
square of the distance of two states with difference (p, q, s, g1, g2, g3) is

    p^2 + q^2 + (sin(alpha0) s)^2/2 + (|g|/w)^2,    w > 0 any number.

In this norm the terms of Qp, Qm and M3 among themselves cancel, except those of the periodic
orbits' saddle: they leave sin(alpha0)/2 |M3|, the true exponent beside these orbits.
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple, TypeVar, cast

from flint import arb

from rigidpend.mechanics.body import Angles, Body, angles_from_moments
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import Exact

ARB_BITS = 64
"""Precision in which bounds are computed, bits; Arb rounds each outward."""
Proving = TypeVar("Proving", bound=Callable[..., Any])
one_at_a_time = threading.RLock()
"""Held by the thread of a process that proves."""


def alone(prove: Proving) -> Proving:
    """Let a function that proves run in one thread at a time.

    The precision of Arb is that of the whole process, and a proof changes it again and again. A
    cluster's worker may have several threads.
    """

    @functools.wraps(prove)
    def proven(*given: Any, **more: Any) -> Any:
        with one_at_a_time:
            return prove(*given, **more)

    return cast(Proving, proven)


def upper(x: arb) -> arb:
    """The upper end of a ball."""
    return arb(x.upper())


def double_above(x: arb) -> float:
    """A double above a ball."""
    # The conversion rounds to nearest; the next double is above in any case.
    return math.nextafter(float(x.upper()), math.inf)


def double_below(x: arb) -> float:
    """A double below a ball."""
    return -double_above(-x)


class Balls:
    """Elementary functions over balls, in Arb's working precision at the time of the call."""

    # The name by which `Exact.over` makes a number in any namespace.
    mpf = arb

    @property
    def pi(self) -> arb:
        return arb.pi()

    def __getattr__(self, name: str) -> Callable[[Any], arb]:
        """One of sqrt, sin, cos, tan, atan, exp and log, which Arb has as methods."""
        return lambda x: getattr(arb(x), name)()

    @staticmethod
    def atan2(y: Any, x: Any) -> arb:
        return arb.atan2(arb(y), arb(x))


BALLS = Balls()


def start_of(
    body: Body, J1: arb, h0: Exact, theta2: arb, unit: arb | int = 1
) -> tuple[tuple[arb, ...], arb]:
    """The aligned start with theta1 = alpha0 + beta0, and the action J2.

    M of the start is in units of `unit`, J2 is not; angles are in radians.
    """
    p = angles(body)
    J2 = (2 * ball_of(h0) / p.kappa).sqrt()
    momenta = J1 / unit, (J2 - J1) / unit
    start = Canonical(*momenta, arb(0), p.alpha0 + p.beta0, theta2, arb(0), arb(1))
    return tuple(aligned_from_canonical(start, p.alpha0, p.beta0, BALLS)), J2


def angles(body: Body) -> Angles:
    """The angles and constants of a body, balls in the working precision."""
    # Differences of exact moments first: of balls they would cancel.
    A1, A2, A3 = body.A
    differences = [ball_of(x) for x in (A1 - A2, A1 - A3, A3 - A2)]
    A, r = [ball_of(x) for x in body.A], [ball_of(x) for x in body.r]
    return angles_from_moments(A, differences, r, ball_of(body.mu), BALLS)


def ball_of(x: Exact | Fraction) -> arb:
    """A ball that contains an exact number."""
    return arb(x.numerator) / x.denominator if isinstance(x, Fraction) else arb(x.over(BALLS))


HEAVIEST = 2**16
"""Largest weight w of gamma times the unit of M; without a torque the best one is infinite."""


def momentum_unit(J2: arb) -> arb:
    """The unit 2^k in which an action J2, and so M, is about one: 2^k <= J2 (1 + 2^-20) < 2^(k+1).

    A power of two rounds nothing.
    """
    # The factor lifts a J2 that is itself a power of two off the boundary, so that rounding does
    # not decide its unit.
    mantissa, exponent = (J2 * (1 + arb(2) ** -20)).mid().man_exp()
    return arb(2) ** (int(exponent) + int(mantissa).bit_length() - 1)


class LogarithmicNorm(NamedTuple):
    """Constants of the norm and of the rate of growth in it, balls; beside each its letter."""

    saddle: arb
    """lambda = sin(alpha0)/2, the exponent per unit of M3."""
    upright: arb
    """sigma = sin(alpha0)/sqrt(2), the weight of M3."""
    weight: arb
    """w, exact."""
    torque: arb
    """F, a bound on the torque of a unit gamma, in the norm of M."""
    turning: arb
    """Omega, a bound on |omega| of a unit M of that norm."""

    @classmethod
    def of(cls, c: AlignedCoefficients, unit: arb) -> LogarithmicNorm:
        """Constants from the coefficients of the aligned equations, and a unit of M, balls."""
        saddle = arb(c.half_sigma)
        # With sigma^2 = 2 lambda^2 the free body's own terms cancel in the lemma, except its
        # saddle. By F and Omega, which follow, gamma and momentum drive each other.
        upright = saddle * arb(2).sqrt()
        torque = _hypotenuse(c.force_p, c.force_m).max(upright * _hypotenuse(c.mu_r1, c.mu_r2))
        turning = (arb(2).sqrt() * abs(c.omega1).max(abs(c.omega2))).max(abs(c.kappa) / upright)
        # The weight at which w F = Omega/w, where their sum is least. Any number is valid, so the
        # midpoint is taken as exact.
        most = HEAVIEST / unit
        best = (turning / torque).sqrt() if torque * most**2 > turning else most
        return cls(saddle, upright, arb(best).mid(), torque, turning)

    def rate(self, M3: arb, radius: arb) -> arb:
        """Bound on the logarithmic rate, per unit of time, at which two curves part.

        `M3` bounds |M3| halfway between them and `radius` their distance; one of the two has
        |gamma| = 1.
        """
        # The larger eigenvalue of the lemma's quadratic form l n^2 + k n |G|. Halfway |gamma| is
        # at most 1 + w radius/2, by which k grows.
        steep = self.saddle * M3
        coupling = self.weight * self.torque + (1 + self.weight * radius / 2) * (
            self.turning / self.weight
        )
        return (steep + _hypotenuse(steep, coupling)) / 2

    @property
    def bending(self) -> arb:
        """Bound on the norm of the field's second derivative along two changes of norm 1 (C7)."""
        return (1 + self.turning * self.turning).sqrt()

    def steepness(self, size: arb) -> arb:
        """Bound on the norm of the field's derivative along a change of norm 1 (C7).

        It holds at states of norm `size` or less.
        """
        # The field is quadratic: its derivative is that of the torque, which is constant, and the
        # second derivative times the state.
        return self.bending * size + self.weight * self.torque

    def norm(self, state: tuple[arb, ...]) -> arb:
        """The norm of a difference of states, or of bounds on its components."""
        p, q, s, *g = state
        squares = [p, q, self.upright * s, *(x / self.weight for x in g)]
        return sum((x * x for x in squares), arb(0)).sqrt()

    def distances(self, bound: arb) -> list[arb]:
        """Bounds on each component of a difference whose norm is at most `bound`."""
        return [bound, bound, upper(bound / self.upright)] + 3 * [upper(bound * self.weight)]


def _hypotenuse(a: arb, b: arb) -> arb:
    return (a * a + b * b).sqrt()
