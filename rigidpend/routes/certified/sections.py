"""Sets of a section M3 = 0, the numbers of a body at its energies, and norms of families."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import NamedTuple

from flint import arb

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import BALLS, LogarithmicNorm, angles, precision
from rigidpend.routes.certified.families import PARAMETERS, Family
from rigidpend.routes.certified.pieces import Quad

BITS = 160
"""Bits in which the numbers of the problem are enclosed."""
LIGHT = 64
"""Weight of w in differences of orbits of different energies.

Any number will do."""
ENERGY = Family.of({(0, 0, 0, 1): 2}, 0)
"""w, by which energies differ."""
ALONG = [Family.of({(0, 0, 0): 2 * k}, 0) for k in (0, 0, 1)]
"""Its derivatives in u, v and w."""


def curve(p: Sequence[Fraction], g: Family) -> Family:
    """p(g)."""
    return _summed([Family.of_fraction(x, BITS) for x in p], g)


def moved(curves: Sequence[Sequence[Fraction]], g: Family, w: Family) -> Family:
    """The sum of w^m p_m(g)."""
    return _summed([curve(p, g) for p in curves], w)


def _summed(p: Sequence[Family], x: Family) -> Family:
    found = p[-1] if p else Family.of_fraction(0, BITS)
    for each in p[-2::-1]:
        found = found * x + each
    return found


def place(quad: Quad) -> tuple[Family, Family]:
    """d and g of the points of a set, as polynomials in u, v and w."""
    u, v = Family.of({(0, 1, 0): 2}, 0), Family.of({(0, 0, 1): 2}, 0)
    by_u, by_v, from_0, a = (
        Family.of_fraction(x, BITS)
        for x in (quad.a / quad.l1, quad.b / quad.l1, quad.l0 / quad.l1, quad.a)
    )
    g = u * by_u - v * by_v - from_0
    return moved((quad.p, *quad.moves), g, ENERGY) + u * a, g


def coordinates(quad: Quad, d: Family, g: Family, w: Family = ENERGY) -> tuple[Family, Family]:
    """U and V of points of the section, of the energies of w."""
    off = d - moved((quad.p, *quad.moves), g, w)
    l0, l1, by_a, by_b = (
        Family.of_fraction(x, BITS) for x in (quad.l0, quad.l1, 1 / quad.a, 1 / quad.b)
    )
    return off * by_a, (off - l0 - l1 * g) * by_b


def directions(quad: Quad, g: Family, w: Family, along: Sequence[Family]) -> tuple[Family, Family]:
    """Derivatives of U and V, where those of d, g and w are `along`."""
    by_d, by_g, by_w = along
    curves = quad.p, *quad.moves
    leaning = moved([[k * x for k, x in enumerate(p)][1:] for p in curves], g, w)
    moving = moved([[m * x for x in p] for m, p in enumerate(curves)][1:], g, w)
    off = by_d - leaning * by_g - moving * by_w
    l1, by_a, by_b = (Family.of_fraction(x, BITS) for x in (quad.l1, 1 / quad.a, 1 / quad.b))
    return off * by_a, (off - l1 * by_g) * by_b


class Numbers(NamedTuple):
    """Numbers of a body and an energy, or of all near them, balls."""

    field: AlignedCoefficients
    to_M1: arb
    to_M2: arb
    h: arb
    spread: Fraction
    """The energies are h + spread w."""
    h0: arb | None
    """Energy constant of starts of one J2_0, if they are not of one energy."""
    along: str = PARAMETERS
    """Variables in which derivatives are bounded: none where no theorem asks for C7."""

    @classmethod
    def of(
        cls,
        body: Body,
        h: Exact,
        spread: Fraction = Fraction(0),
        h0: Exact | None = None,
    ) -> Numbers:
        """Enclose those of a body."""
        with precision(BITS):
            p = angles(body)
            half, found, h_ball = p.alpha0 / 2, aligned_coefficients(p, BALLS), arb(h.over(BALLS))
            held = arb(h0.over(BALLS)) if h0 is not None else None
            return cls(found, 1 / (2 * half.cos()), 1 / (2 * half.sin()), h_ball, spread, held)

    @property
    def energies(self) -> Family:
        """The energies, with w."""
        return Family.of_ball(self.h, BITS) + Family.of_fraction(self.spread, BITS) * ENERGY


def double_above(x: arb) -> float:
    """A double above a ball."""
    return math.nextafter(float(x.upper()), math.inf)


def distances(bound: arb, growth: LogarithmicNorm) -> list[arb]:
    """Bounds on the distance of each component."""
    return [bound, bound, upper(bound / growth.upright)] + 3 * [upper(bound * growth.weight)]


def orders(state: Family, along: Iterable[str]) -> list[arb]:
    """Bounds on a family, and on its derivatives."""
    return [state.bound, *(state.partial(name).bound for name in along)]


def norms(states: Sequence[Family], growth: LogarithmicNorm, along: str) -> list[arb]:
    """Bounds on the norms of states, and of their derivatives."""
    return normed([orders(state, along) for state in states], growth)


def normed(bounds: Sequence[Sequence[arb]], growth: LogarithmicNorm) -> list[arb]:
    return [upper(growth.norm(each)) for each in zip(*bounds, strict=True)]


def largest(balls: Iterable[arb]) -> arb:
    """An upper bound of all."""
    found = arb(0)
    for ball in balls:
        found = found.max(upper(ball))
    return found


def upper(x: arb) -> arb:
    return arb(x.upper())
