"""Balls: enclosures of the numbers of a problem, from exactly what its config says.

A :class:`Balls` is a namespace of elementary functions over Arb's balls, midpoint and radius,
of which each result contains the true value. The formulas of the package run over it as they
run over floats: nothing is written twice, and what comes out is an enclosure.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from flint import arb

from rigidpend.mechanics.body import Angles, Body, angles_from_moments
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.precision import precision
from rigidpend.routes.problem import RouteProblem


class Balls:
    """Elementary functions over balls, in the precision that holds when they are called."""

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


class Enclosed(NamedTuple):
    """Aligned problem of an orbit in balls: M in units of `unit`, t' in units of its inverse."""

    coefficients: AlignedCoefficients
    state: tuple[Any, ...]
    """Qp, Qm, M3, gamma1, gamma2, gamma3 at t' = 0."""
    unit: Any
    """A power of two next to |M|."""


def enclosed(problem: RouteProblem, theta2_0: Exact, bits: int) -> Enclosed:
    """Enclose the exact problem of an orbit that starts at theta1_0 = alpha0 + beta0.

    Parameters
    ----------
    problem : RouteProblem
    theta2_0 : Exact
        Radians.
    bits : int
        Working precision; what is lost in it widens the balls.
    """
    with precision(bits):
        p = angles(problem.body)
        J1 = _ball(problem.J1_0)
        J2 = (2 * _ball(problem.h0) / p.kappa).sqrt()
        # Divided by it |M| is about one, as fixed-point coefficients want
        # it; a power of two rounds nothing. A J2 that is one itself is told in spite of rounding.
        unit = _power_of_two(J2 * (1 + arb(2) ** -20))
        start = Canonical(
            J1 / unit,
            (J2 - J1) / unit,
            arb(0),
            p.alpha0 + p.beta0,
            _ball(theta2_0),
            arb(0),
            arb(1),
        )
        state = aligned_from_canonical(start, p.alpha0, p.beta0, BALLS)
        # With M in units of `unit` and t' in those of its inverse, a
        # torque is in units of the square.
        scaled = p._replace(mu=p.mu / unit**2)
        return Enclosed(aligned_coefficients(scaled, BALLS), tuple(state), unit)


def angles(body: Body) -> Angles:
    A1, A2, A3 = body.A
    differences = [_ball(x) for x in (A1 - A2, A1 - A3, A3 - A2)]
    A, r = [_ball(x) for x in body.A], [_ball(x) for x in body.r]
    return angles_from_moments(A, differences, r, _ball(body.mu), BALLS)


def _ball(x: Exact) -> arb:
    """Enclose an exact number."""
    return arb(x.over(BALLS))


def _power_of_two(x: arb) -> arb:
    """A power of two next to a positive number."""
    mantissa, exponent = x.mid().man_exp()
    return arb(2) ** (int(exponent) + int(mantissa).bit_length() - 1)
