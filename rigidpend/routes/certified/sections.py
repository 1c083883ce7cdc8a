"""Sets of the section M3 = 0, the numbers of a body and its energies, and where orbits begin (C1).

The orbits begin in a set or on a line of starts, whose phases theta2 are bounded as well. M and t'
are dimensionless. On the section d is the small one of Qp and Qm, Q the large one, g is gamma3;
u and v in [-1, 1] are coordinates of a set, and w in [-1, 1] tells the energy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

from flint import arb, arb_mat, ctx

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import (
    ARB_BITS,
    BALLS,
    LogarithmicNorm,
    angles,
    ball_of,
    double_above,
    double_below,
    momentum_unit,
    upper,
)
from rigidpend.routes.certified.models import INPUT_BITS, PARAMETERS, Family, horner
from rigidpend.routes.certified.proof_data import FamilyStep, Quad, Source, StartLine, Undecided

W_WEIGHT = 64
"""Weight of w in the difference of two orbits of different energies (C7); any number will do."""
W_FAMILY = Family.of({(0, 0, 0, 1): 2}, 0)
"""The variable w as a family: coefficients of T_0 are twice what they stand for."""


def moved(curves: Sequence[Sequence[Fraction]], g: Family, w: Family) -> Family:
    """The sum of w^m p_m(g), from the coefficients of the polynomials p_m."""
    values = (
        horner([Family.of_fraction(x, INPUT_BITS) for x in p or [Fraction(0)]], g)
        for p in curves or [[]]
    )
    return horner([*values], w)


def place(quad: Quad) -> tuple[Family, Family]:
    """The components d and g of the points of a set, as polynomials in u, v and w."""
    # U = u and V = v solved for d and g: l1 g = a u - b v - l0, d = p(g) + a u.
    u, v = Family.of({(0, 1, 0): 2}, 0), Family.of({(0, 0, 1): 2}, 0)
    by_u, by_v, from_0, a = (
        Family.of_fraction(x, INPUT_BITS)
        for x in (quad.a / quad.l1, quad.b / quad.l1, quad.l0 / quad.l1, quad.a)
    )
    g = u * by_u - v * by_v - from_0
    return moved(quad.p, g, W_FAMILY) + u * a, g


def coordinates(quad: Quad, d: Family, g: Family, w: Family = W_FAMILY) -> tuple[Family, Family]:
    """The coordinates U and V, in a set, of points of the section with energies of w."""
    off = d - moved(quad.p, g, w)
    l0, l1, by_a, by_b = (
        Family.of_fraction(x, INPUT_BITS) for x in (quad.l0, quad.l1, 1 / quad.a, 1 / quad.b)
    )
    return off * by_a, (off - l0 - l1 * g) * by_b


def directions(quad: Quad, g: Family, w: Family, along: Sequence[Family]) -> tuple[Family, Family]:
    """Derivatives of U and V along a direction in which those of d, g and w are `along`."""
    by_d, by_g, by_w = along
    # The partial derivatives of the curve p in g and in w, by the chain rule.
    leaning = moved([[k * x for k, x in enumerate(p)][1:] for p in quad.p], g, w)
    moving = moved([[m * x for x in p] for m, p in enumerate(quad.p)][1:], g, w)
    off = by_d - leaning * by_g - moving * by_w
    l1, by_a, by_b = (Family.of_fraction(x, INPUT_BITS) for x in (quad.l1, 1 / quad.a, 1 / quad.b))
    return off * by_a, (off - l1 * by_g) * by_b


class Numbers(NamedTuple):
    """The numbers of a body and of its energies, balls."""

    field: AlignedCoefficients
    growth: LogarithmicNorm
    to_M1: arb
    """1/(2 cos(alpha0/2)), from Qp + Qm to M1."""
    to_M2: arb
    """1/(2 sin(alpha0/2)), from Qp - Qm to M2."""
    h: arb
    spread: Fraction
    """The energies are h + spread w, |w| <= 1."""
    unit: arb
    """A power of two next to |M|, in which boxes and tubes are so wide."""
    h0: arb | None
    """Energy constant kappa J2_0^2/2 of starts of one J2_0; None if starts have these energies."""
    along: str = PARAMETERS
    """Variables in which derivatives are bounded: none where no theorem asks for C7."""
    letter: str = "C"
    """That of the hypotheses: C of sets and lines, H of single orbits and of intervals."""

    @property
    def of_symbols(self) -> Numbers:
        """The same numbers for the hypotheses H, which bound values alone."""
        return self._replace(along="", letter="H")

    @classmethod
    def of(
        cls,
        body: Body,
        h: Exact,
        spread: Fraction = Fraction(0),
        h0: Exact | None = None,
        *,
        bits: int = INPUT_BITS,
        unit: arb | int = 1,
    ) -> Numbers:
        """Enclose the numbers of a body and of the energies h + spread w.

        M is in units of `unit`, t' in those of its inverse, and so a torque in those of its square.
        """
        with ctx.workprec(bits):
            p = angles(body)
            p = p._replace(mu=p.mu / unit**2)
            half, field = p.alpha0 / 2, aligned_coefficients(p, BALLS)
            to_M = 1 / (2 * half.cos()), 1 / (2 * half.sin())
            held, middle = None if h0 is None else ball_of(h0), ball_of(h)
            own = momentum_unit((2 * middle / p.kappa).sqrt() / unit)
        with ctx.workprec(ARB_BITS):
            growth = LogarithmicNorm.of(field, own)
            return cls(field, growth, *to_M, middle, spread, own, held)

    @property
    def units(self) -> list[arb]:
        """The units of the components of a state: that of M, and 1 for gamma."""
        return 3 * [self.unit] + 3 * [arb(1)]

    @property
    def energies(self) -> Family:
        """The energies h + spread w as a family."""
        spread = Family.of_fraction(self.spread, INPUT_BITS)
        return Family.of_ball(self.h, INPUT_BITS) + spread * W_FAMILY

    def norms(self, states: Sequence[Family]) -> list[arb]:
        """Bounds on the norm of a state and on those of its derivatives, in each of `along`."""
        return self.normed([state.bounds(self.along) for state in states])

    def normed(self, bounds: Sequence[Sequence[arb]]) -> list[arb]:
        """The same from bounds on each component and on its derivatives."""
        return [upper(self.growth.norm(each)) for each in zip(*bounds, strict=True)]

    def integrals(self, states: Sequence[Family], weight: Sequence[arb]) -> list[Family]:
        """M . gamma, |gamma|^2 - 1 and the energy of states, with a weight's mu r1 and mu r2."""
        Qp, Qm, M3, g1, g2, g3 = states
        constants = (self.to_M1, self.to_M2, self.field.kappa / 2, *weight)
        m1, m2, spin, r1, r2 = (Family.of_ball(x, INPUT_BITS) for x in constants)
        M1, M2 = (Qp + Qm) * m1, (Qp - Qm) * m2
        one, half = (Family.of_fraction(x, 1) for x in (1, Fraction(1, 2)))
        return [
            M1 * g1 + M2 * g2 + M3 * g3,
            g1 * g1 + g2 * g2 + g3 * g3 - one,
            spin * (M1 * M1 + M2 * M2 + M3 * M3) - half * Qp * Qm + r1 * g1 + r2 * g2,
        ]

    def slopes(
        self, one: int, states: Sequence[arb], weight: Sequence[arb], large: int
    ) -> list[list[arb]]:
        """Rows of derivatives of the integrals in the large Q, M3 and gamma.

        They are linear in `one` and `states`. With one = 1 they are the derivatives themselves;
        with one = 0 and derivatives of states in a variable, their derivatives in that variable.
        """
        Qp, Qm, M3, g1, g2, g3 = states
        M1, M2, by = (Qp + Qm) * self.to_M1, (Qp - Qm) * self.to_M2, (1, -1)[large] * self.to_M2
        spin = self.field.kappa * (M1 * self.to_M1 + M2 * by) - states[1 - large] / 2
        return [
            [g1 * self.to_M1 + g2 * by, g3, M1, M2, M3],
            [arb(0), arb(0), 2 * g1, 2 * g2, 2 * g3],
            [spin, self.field.kappa * M3, *(one * x for x in weight), arb(0)],
        ]


def largest(balls: Iterable[arb]) -> arb:
    """An upper bound of all numbers of some balls that are not negative, 0 without any."""
    found = arb(0)
    for ball in balls:
        found = found.max(upper(ball))
    return found


POINT_BOX, START_BOX = 2.0**-5, 2.0**-40
"""Half-widths of the boxes in which a point of the section, or of a line of starts, is unique.

In the units of the components. Qp of a start, of the order of the root of J1_0, has to be more."""


def begun(piece: FamilyStep) -> list[Family]:
    """The states of a step at its beginning."""
    return [Family.of(terms, piece.bits).at("z", -1) for terms in piece.terms]


class _Equations(NamedTuple):
    """The equations that hold where the orbits of a set or of a line begin."""

    at: Sequence[Family]
    """Polynomials of the components, those that are known exactly as they are."""
    sought: tuple[int, ...]
    """The components that follow from the equations, the large Q first."""
    residual: Sequence[Family]
    """The rests of the equations at the polynomials, 0 where one holds."""
    slopes: Callable[[int, Sequence[arb]], list[list[arb]]]
    """The derivatives of each in the components sought, as :meth:`Numbers.slopes` has them."""
    room: float
    """Half-width, in their units, of the box in which they are unique."""
    signs: Mapping[int, int]
    """Signs of components in that box."""
    unsigned: str
    """Words where these are not shown."""


def beginning(numbers: Numbers, start: Source, piece: FamilyStep) -> tuple[list[arb], list[arb]]:
    """C1: the points where orbits begin near given polynomials, each the only one nearby.

    Returns the large Q, gamma1 and gamma2 of the polynomials, as balls in their units, and bounds
    on the distance of the first step's beginning from the points and on that of its derivatives.
    """
    states, units = begun(piece), numbers.units
    with ctx.workprec(INPUT_BITS):
        if isinstance(start, StartLine):
            found = _on_line(numbers, start, states)
        else:
            found = _in_set(numbers, start, states)
        at, sought, residual, slopes, room, signs, unsigned = found

        def in_units(one: int, states: Sequence[arb]) -> arb_mat:
            """The slopes along components in their units."""
            rows = [zip(sought, row, strict=True) for row in slopes(one, states)]
            return arb_mat([[x * units[k] for k, x in row] for row in rows])

        # The box is that about all points at once, which contains the box of each.
        box = [
            x.range + arb(0, room * units[k]) if k in sought else x.range for k, x in enumerate(at)
        ]
        turned = {name: in_units(0, [x.partial(name).range for x in at]) for name in numbers.along}
        near = solution(residual, in_units(1, box), turned, room)
        if not all(sign * box[k] > 0 for k, sign in signs.items()):
            raise Undecided(f"C1: {unsigned}")
        known = [(x - y).bounds(numbers.along) for x, y in zip(states, at, strict=True)]
        off = [[x * units[k] for x in near] if k in sought else known[k] for k in range(6)]
    with ctx.workprec(ARB_BITS):
        return [states[k].range / units[k] for k in (sought[0], 3, 4)], numbers.normed(off)


def _in_set(numbers: Numbers, quad: Quad, states: Sequence[Family]) -> _Equations:
    """Q, gamma1 and gamma2 follow from d and g by M . gamma = 0, |gamma| = 1 and the energy."""
    (d, g), weight = place(quad), (numbers.field.mu_r1, numbers.field.mu_r2)
    large, small = (0, 1) if quad.rising else (1, 0)
    known = {small: d, 2: Family.of({}, 0), 5: g}
    at = [known.get(k, state) for k, state in enumerate(states)]
    *others, energy = numbers.integrals(at, weight)

    def slopes(one: int, states: Sequence[arb]) -> list[list[arb]]:
        rows = numbers.slopes(one, states, weight, large)
        return [[row[k] for k in (0, 2, 3)] for row in rows]

    residual = [*others, energy - numbers.energies]
    unsigned = "the large Q is not shown to be positive at the points of a set"
    return _Equations(at, (large, 3, 4), residual, slopes, POINT_BOX, {large: 1}, unsigned)


def _on_line(numbers: Numbers, line: StartLine, states: Sequence[Family]) -> _Equations:
    """Qp, M3 and gamma follow from J1, Qm, the place on the line or strip, and the energy or h0.

    h0 is the energy without the weight's.
    """
    across = numbers.to_M1**2 + numbers.to_M2**2
    weight, level = (numbers.field.mu_r1, numbers.field.mu_r2), numbers.energies
    if numbers.h0 is not None:
        weight, level = (arb(0), arb(0)), Family.of_ball(numbers.h0, INPUT_BITS)
    J1, e1, e2, half, wide = (
        Family.of_fraction(x, INPUT_BITS) for x in (*line[:3], line.half, line.wide)
    )
    centre, four = moved([line.centre], W_FAMILY, W_FAMILY), Family.of_fraction(4, 1)
    u, v = Family.of({(0, 1, 0): 2}, 0), Family.of({(0, 0, 1): 2}, 0)
    Qp, _, M3, *gamma = states
    at = [Qp, wide * v, M3, *gamma]
    *others, energy = numbers.integrals(at, weight)
    residual = [
        *others,
        energy - level,
        # Where Qm = 0 this says |M| = 2 J1 - M3, that is J2 = |M| and J1 = (J2 + M3)/2.
        Family.of_ball(across, INPUT_BITS) * Qp * Qp - four * J1 * (J1 - M3),
        e1 * gamma[0] + e2 * gamma[1] - centre - half * u,
    ]

    def slopes(one: int, states: Sequence[arb]) -> list[list[arb]]:
        zero = arb(0)
        of_J1 = [2 * states[0] * across, one * 4 * J1.range, zero, zero, zero]
        of_place = [zero, zero, one * e1.range, one * e2.range, zero]
        return [*numbers.slopes(one, states, weight, 0), of_J1, of_place]

    unsigned = "Qp > 0 > M3 is not shown at the starts"
    sought = (0, 2, 3, 4, 5)
    return _Equations(at, sought, residual, slopes, START_BOX, {0: 1, 2: -1}, unsigned)


def solution(
    residual: Sequence[Family], slopes: arb_mat, turned: Mapping[str, arb_mat], room: float
) -> list[arb]:
    """C1: a bound on the distance to the only solution within `room`, and those on derivatives.

    `slopes` encloses the derivatives of the residual in the whole box of that half-width, and
    `turned` their derivatives in u, v and w. Newton's iteration with a fixed matrix contracts the
    box into itself. Undecided if that is not shown.
    """
    n = len(residual)
    # Any matrix near the inverse will do; its midpoint is taken as exact.
    try:
        inverse = slopes.mid().inv().mid()
    except ZeroDivisionError:
        raise Undecided("C1: the derivatives have no inverse where the orbits begin") from None
    off = inverse * slopes
    share = largest(sum((abs(off[i, j] - (i == j)) for j in range(n)), arb(0)) for i in range(n))

    def solved(right: Sequence[arb]) -> arb:
        """Bound on the largest component of x, where slopes x = right in size."""
        rows = (sum((abs(inverse[i, j]) * right[j] for j in range(n)), arb(0)) for i in range(n))
        return largest(rows) / (1 - share)

    values, *along = zip(*(each.bounds(turned) for each in residual), strict=True)
    if not (share < 1 and (near := upper(solved(values))) < room):
        raise Undecided("C1: no points are shown to be where the orbits begin")
    # G(z) = 0, differentiated: the derivative of z - z_P is at most what the matrix makes of that
    # of G at z_P, and of J's derivative times `near`.
    return [near] + [
        upper(solved([
            right[i] + sum((abs(turn[i, j]) for j in range(n)), arb(0)) * near for i in range(n)
        ]))
        for right, turn in zip(along, turned.values(), strict=True)
    ]  # fmt: skip


def phases(numbers: Numbers, line: StartLine, pieces: Sequence[FamilyStep]) -> tuple[float, float]:
    """A lower and an upper bound on theta2 of all starts of a line, radians, up to whole turns."""
    c = numbers.field
    with ctx.workprec(ARB_BITS):
        _, (bound, *_) = beginning(numbers, line, pieces[0])
        begin = [each.range for each in begun(pieces[0])]
        near = zip(begin, numbers.growth.distances(bound), strict=True)
        _, _, M3, g1, g2, _ = (x + arb(0, e) for x, e in near)
        cos, sin = 1 / (2 * numbers.to_M1), 1 / (2 * numbers.to_M2)
        # gamma of the starts, solved for the sine and cosine of theta1/2 + theta2, where theta1 is
        # alpha0 + beta0. J2 = 2 J1 - M3.
        lean = (2 * ball_of(line.J1) - M3) / M3
        angle = arb.atan2(cos * g1 - sin * g2, (sin * g1 + cos * g2) * lean)
        found = angle - arb.atan2(sin, cos) - arb.atan2(c.mu_r2, c.mu_r1)
        if not found.is_finite():
            raise Undecided("C1: theta2 of the starts is not told")
        found = found + 2 * arb.pi() if found < 0 else found
        return double_below(found), double_above(found)


def words_on_phases(low: float, high: float) -> str:
    """Words on phases between two numbers, with nine decimals that are rounded outward."""
    # Products in doubles would be rounded before they are rounded outward.
    ends = math.floor(Fraction(low) * 10**9), math.ceil(Fraction(high) * 10**9)
    return "theta2_0 from {:.9f} to {:.9f}".format(*(x / 1e9 for x in ends))
