"""C1 of docs/full-shift.md: sets of a section and lines of starts, and the orbits that begin there.

Points of a set or a line are solutions of equations near given polynomials. The constants of the
body are here too.
"""

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

from scripts.check_certificate import (
    Fails,
    Interval,
    arctangent,
    constants_of,
    hypotenuse,
    number,
    pi,
    shape_of,
    sqrt,
    unit_of,
)
from scripts.check_series import ALONG, DIGITS, ENERGY, Series, above, orders, size

Bounds: TypeAlias = list[Fraction]
"""Bounds on the norm of a difference, and on those of its derivatives in the variables `along`."""
ALONE, THIN = Fraction(1, 32), Fraction(1, 2**40)
"""Half-widths of boxes with one point of the section, or of a line; of momenta in their unit."""


class Problem(NamedTuple):
    """Constants of docs/full-shift.md, intervals."""

    lam: Interval
    a: Interval
    b: Interval
    mu: tuple[Interval, Interval]
    """mu rho_1 and mu rho_2."""
    omega: tuple[Interval, Interval, Interval]
    to_M: tuple[Interval, Interval]
    """From Qp + Qm to M1 and from Qp - Qm to M2."""
    h: Interval
    spread: Fraction
    """The energies are h + spread w."""
    h0: Interval | None
    """kappa J2_0^2/2 of starts of one J2_0; None of those of one energy."""
    sigma: Interval
    F: Interval
    """Its upper end is that of the lemma on growth; so is that of Omega."""
    Omega: Interval
    w: Interval
    """The weight of gamma, an exact number."""
    unit: Fraction
    """That of momenta, a power of two next to |M|."""
    along: tuple[int, ...] = ALONG
    """Variables in which derivatives are bounded: none where no theorem asks for C7."""

    @property
    def units(self) -> list[Fraction]:
        """Units of the components of a state: gamma has none."""
        return [*[self.unit] * 3, *[Fraction(1)] * 3]

    @property
    def energies(self) -> Series:
        """The energies of all w."""
        return ENERGY * self.spread + self.h

    def field(self, y: Sequence[Any]) -> list[Any]:
        """The derivatives of Qp, Qm, M3, gamma1, gamma2, gamma3 in t'."""
        Qp, Qm, M3, g1, g2, g3 = y
        S, D = Qp + Qm, Qp - Qm
        o1, o2, kappa = self.omega
        product = {(i, j): y[3 + i] * (S, D, M3)[j] for i in range(3) for j in range(3) if i != j}
        # Constants stand on the right: an Interval on the left would not know a Series.
        return [
            g3 * self.a - M3 * Qp * self.lam,
            M3 * Qm * self.lam - g3 * self.b,
            S * D * (1 / (4 * self.lam)) + g1 * self.mu[1] - g2 * self.mu[0],
            product[1, 2] * kappa - product[2, 1] * o2,
            product[2, 0] * o1 - product[0, 2] * kappa,
            product[0, 1] * o2 - product[1, 0] * o1,
        ]

    def momenta(self, Q: Any, d: Any, side: int = 1) -> tuple[Any, Any]:
        """M1 and M2 of the large Q and the small one: Qp and Qm, or Qm and Qp for side -1."""
        m1, m2 = self.to_M
        return (Q + d) * m1, (Q - d) * m2 * side

    def norms(self, bounds: Sequence[Sequence[Fraction]]) -> Bounds:
        """Upper bounds on the norms of a state and its derivatives, by those on each component."""
        return [self.norm(*each) for each in zip(*bounds, strict=True)]

    @property
    def bending(self) -> Fraction:
        """Bound beta on the norm of the field's second derivative (C7)."""
        return hypotenuse(1, self.Omega).above

    def steepness(self, size: Fraction) -> Fraction:
        """Bound L on the norm of the field's first derivative at states of norm `size` (C7)."""
        return self.bending * size + above(self.w * self.F)

    def norm(self, p: Any, q: Any, s: Any, *g: Any) -> Fraction:
        """Upper bound on the norm of a difference."""
        return hypotenuse(p, q, self.sigma * s, *(Interval.of(x) / self.w for x in g)).above

    def apart(self, bound: Fraction) -> list[Fraction]:
        """Bounds on each component of a difference whose norm is at most `bound`."""
        return [bound, bound, above(bound / self.sigma)] + 3 * [above(bound * self.w)]


def problem_of(given: dict[str, Any]) -> Problem:
    """The constants of a config's numbers, with `shift` and `spread` of its energies."""
    body = c, s, kappa, _ = shape_of(given)
    held, shift, spread = "h" not in given, given.get("shift", 0), given.get("spread", 0)
    mu, h = (Interval.of(number(given[name])) for name in ("mu", "h0" if held else "h"))
    unit = unit_of(sqrt(2 * (h + shift) / kappa))
    return Problem(
        **constants_of(body, mu, unit),
        to_M=(1 / (2 * c), 1 / (2 * s)),
        h=h + shift,
        spread=spread,
        h0=h if held else None,
        unit=unit,
    )


class Quad(NamedTuple):
    """A set: U = (d - p(g))/a and V = (d - p(g) - l0 - l1 g)/b, both from -1 to 1."""

    rising: bool
    a: Fraction
    b: Fraction
    l0: Fraction
    l1: Fraction
    p: list[Fraction]
    moves: Sequence[list[Fraction]] = ()
    """Polynomials by which w, w^2 and so on are multiplied in p."""

    def curve(self, g: Series, w: Series, in_g: bool = False, in_w: bool = False) -> Series:
        """The curve p at g and w, or its derivative in g or in w."""
        # Horner's rule, in w and within it in g; False and True count as 0 and 1.
        total = Series.of(0)
        for m in range(len(self.moves), in_w - 1, -1):
            p = self.moves[m - 1] if m else self.p
            found = Series.of(0)
            for k in range(len(p) - 1, in_g - 1, -1):
                found = found * g + p[k] * ((k if in_g else 1) * (m if in_w else 1))
            total = total * w + found
        return total

    def place(self) -> tuple[Series, Series]:
        """The components d and g of its points, as polynomials in u, v and w."""
        u, v = Series.made({(0, 1, 0): 1}, 0), Series.made({(0, 0, 1): 1}, 0)
        g = u * (self.a / self.l1) - v * (self.b / self.l1) - self.l0 / self.l1
        return self.curve(g, ENERGY) + u * self.a, g

    def coordinates(self, d: Series, g: Series, w: Series) -> tuple[Series, Series]:
        """The coordinates U and V of points of the section."""
        off = d - self.curve(g, w)
        return off * (1 / self.a), (off - self.l0 - g * self.l1) * (1 / self.b)

    def directions(self, g: Series, w: Series, *by: Series) -> tuple[Series, Series]:
        """The derivatives of U and V from those of d, g and w."""
        by_d, by_g, by_w = by
        off = by_d - self.curve(g, w, in_g=True) * by_g - self.curve(g, w, in_w=True) * by_w
        return off * (1 / self.a), (off - by_g * self.l1) * (1 / self.b)


class Line(NamedTuple):
    """Starts with Qm = 0 < Qp and a given J1, where e1 gamma1 + e2 gamma2 = centre + half u.

    A strip about the line has the points with Qm = wide v, and Qp as on the line.
    """

    J1: Any
    e1: Fraction
    e2: Fraction
    centre: Fraction
    half: Fraction
    moves: Sequence[Fraction] = ()
    """Numbers by which w, w^2 and so on are multiplied in centre."""
    wide: Fraction = Fraction(0)


class Step(NamedTuple):
    """A step of a family of approximate orbits."""

    half: Series
    """Half of its length in time, t'."""
    states: list[Series]
    """Q+, Q-, M3, gamma1, gamma2, gamma3 over x in [-1, 1]."""


def beginning(p: Problem, quad: Quad, step: Step) -> tuple[list[Interval], Bounds]:
    """C1: the points of a set near given polynomials, each the only one nearby.

    Returns Q, gamma1 and gamma2 of the polynomials, Q in its unit, and how far they are from the
    points.
    """
    y = [state.at(0, -1) for state in step.states]
    d, g = quad.place()
    large, side = (0, 1) if quad.rising else (1, -1)
    Q, g1, g2 = y[large], y[3], y[4]
    (m1, m2), kappa = p.to_M, p.omega[2]
    M1, M2 = p.momenta(Q, d, side)
    # M . gamma, |gamma|^2 - 1 and the energy less its value; M3 = 0 here.
    residual = [
        M1 * g1 + M2 * g2,
        g1 * g1 + g2 * g2 + g * g - 1,
        (M1 * M1 + M2 * M2) * (kappa / 2)
        - Q * d * Fraction(1, 2)
        + g1 * p.mu[0]
        + g2 * p.mu[1]
        - p.energies,
    ]

    def matrix(one: int, *at: Interval) -> list[list[Any]]:
        """Derivatives of the residual in Q, gamma1 and gamma2 in their units.

        They are linear in `one` and in `at`: with one = 0 and derivatives of states they are their
        derivatives.
        """
        q, y1, y2, away = at
        n1, n2 = p.momenta(q, away, side)
        by = m1, m2 * side
        return [
            [(y1 * by[0] + y2 * by[1]) * p.unit, n1, n2],
            [Interval.of(0), 2 * y1, 2 * y2],
            [
                (kappa * (n1 * by[0] + n2 * by[1]) - away / 2) * p.unit,
                *(one * x for x in p.mu),
            ],
        ]

    alone = ALONE * p.unit
    J = matrix(1, Q.ball(alone), g1.ball(ALONE), g2.ball(ALONE), d.ball())
    turned = {i: matrix(0, *(x.partial(i).ball() for x in (Q, g1, g2, d))) for i in p.along}
    near = solution(residual, J, turned, ALONE)
    if Q.ball(alone).low <= 0:
        raise Fails("C1: the large Q is not shown to be positive at the points of a set")
    off = {1 - large: y[1 - large] - d, 2: y[2], 5: y[5] - g}
    apart = {j: orders(x, p.along) for j, x in off.items()}
    apart |= {large: [x * p.unit for x in near], 3: near, 4: near}
    return [Q.ball() / p.unit, g1.ball(), g2.ball()], p.norms([apart[j] for j in range(6)])


def line_beginning(p: Problem, line: Line, step: Step) -> Bounds:
    """C1 of a line of starts or its strip: how far the polynomials are from its points."""
    Qp, Qm, M3, g1, g2, g3 = (state.at(0, -1) for state in step.states)
    (m1, m2), kappa, J1 = p.to_M, p.omega[2], Interval.of(line.J1)
    square, zero = m1 * m1 + m2 * m2, Interval.of(0)
    u, aside = Series.made({(0, 1, 0): 1}, 0), Series.made({(0, 0, 1): 1}, 0) * line.wide
    M1, M2 = p.momenta(Qp, aside)
    centre = Series.of(0)
    for x in [*line.moves[::-1], line.centre]:
        centre = centre * ENERGY + x
    # If J2 is given, so is the energy without the weight's.
    weight, level = (p.mu, p.energies) if p.h0 is None else ((zero, zero), p.h0)
    residual = [
        M1 * g1 + M2 * g2 + M3 * g3,
        g1 * g1 + g2 * g2 + g3 * g3 - 1,
        (M1 * M1 + M2 * M2 + M3 * M3) * (kappa / 2)
        - Qp * aside * Fraction(1, 2)
        + g1 * weight[0]
        + g2 * weight[1]
        - level,
        # Where Qm = 0 this says |M| = 2 J1 - M3.
        Qp * Qp * square + (M3 - J1) * (4 * J1),
        g1 * line.e1 + g2 * line.e2 - centre - u * line.half,
    ]

    def matrix(one: int, *at: Interval) -> list[list[Any]]:
        """Derivatives of the residual in Qp, M3 and gamma in their units, as those of a set's."""
        q, m, y1, y2, y3, d = at
        n1, n2 = p.momenta(q, d)
        mu1, mu2, action, e1, e2 = (
            one * Interval.of(x) for x in (*weight, 4 * J1, line.e1, line.e2)
        )
        rows = [
            [m1 * y1 + m2 * y2, y3, n1, n2, m],
            [zero, zero, 2 * y1, 2 * y2, 2 * y3],
            [kappa * (n1 * m1 + n2 * m2) - d / 2, kappa * m, mu1, mu2, zero],
            [2 * q * square, action, zero, zero, zero],
            [zero, zero, e1, e2, zero],
        ]
        return [[x * p.unit, y * p.unit, *others] for x, y, *others in rows]

    unknown = (Qp, M3, g1, g2, g3)
    turned = {i: matrix(0, *(x.partial(i).ball() for x in (*unknown, aside))) for i in p.along}
    thin = THIN * p.unit
    begin = Qp.ball(thin), M3.ball(thin)
    J = matrix(1, *begin, *(x.ball(THIN) for x in unknown[2:]), aside.ball())
    near = solution(residual, J, turned, THIN)
    if begin[0].low <= 0 or begin[1].high >= 0:
        raise Fails("C1: Qp > 0 > M3 is not shown at the starts")
    of_momenta = [x * p.unit for x in near]
    off = of_momenta, orders(Qm - aside, p.along), of_momenta, near, near, near
    return p.norms(off)


def solution(
    residual: list[Series], J: list[list[Any]], turned: dict[int, list[list[Any]]], room: Fraction
) -> Bounds:
    """C1: bounds on the components of the way to the only solution within `room`.

    J encloses the derivatives of the residual in the box of that half-width, and `turned` their
    derivatives. Newton's iteration with a fixed matrix contracts the box into itself.
    """
    n = range(len(residual))
    C = inverse([[Fraction(x.low + x.high, 2 << Interval.digits) for x in row] for row in J])
    CJ = [[sum((C[i][k] * J[k][j] for k in n), Interval.of(0)) for j in n] for i in n]
    # By so much, at most, an iteration leaves of a distance: the largest sum of a row of |1 - C J|.
    left = max(sum((size(CJ[i][j] - (i == j)) for j in n), Fraction(0)) for i in n)
    if left >= 1:
        raise Fails("C1: no points are shown to be where the orbits begin")

    def moved(right: Sequence[Fraction]) -> Fraction:
        """Bound on the largest component of x, where J x = right in size."""
        return max(sum((abs(C[i][k]) * right[k] for k in n), Fraction(0)) for i in n) / (1 - left)

    values, *along = zip(*(orders(x, turned) for x in residual), strict=True)
    near = moved(values)
    if near > room:
        raise Fails("C1: no points are shown to be where the orbits begin")
    return [near] + [
        moved([x + near * sum(map(size, row)) for x, row in zip(right, turn, strict=True)])
        for right, turn in zip(along, turned.values(), strict=True)
    ]


def inverse(J: list[list[Fraction]]) -> list[list[Fraction]]:
    """The inverse of a matrix by elimination, rounded: any matrix near it is valid."""
    n = len(J)
    rows = [[*row, *(Fraction(i == j) for j in range(n))] for i, row in enumerate(J)]
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        if not rows[best][k]:
            raise Fails("C1: the derivatives have no inverse where the orbits begin")
        rows[k], rows[best] = rows[best], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(n):
            if i != k:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [[Fraction(round(x * 2**60), 2**60) for x in row[n:]] for row in rows]


def phases(p: Problem, line: Line, step: Step) -> Interval:
    """An interval with theta2 of all starts of a line, radians, up to whole turns."""
    bound, *_ = line_beginning(p, line, step)
    near = zip(step.states, p.apart(bound), strict=True)
    _, _, M3, g1, g2, _ = (state.at(0, -1).ball(e) for state, e in near)
    c, s = (1 / (2 * m) for m in p.to_M)
    # The sine and cosine of theta1/2 + theta2, times a positive number; the loop then turns them
    # back by alpha0/2 and by beta0/2.
    sin, cos = c * g1 - s * g2, (s * g1 + c * g2) * ((2 * Interval.of(line.J1) - M3) / M3)
    for x, y in ((c, s), p.mu):
        sin, cos = sin * x - cos * y, cos * x + sin * y
    turns = 0
    # Turned back by quarters until the cosine is positive and not small, for a quotient.
    while cos.low <= 0 or 2 * cos.low < sin.size.high:
        sin, cos, turns = -cos, sin, turns + 1
        if turns == 4:
            raise Fails("C1: theta2 of the starts is not told")
    found = arctangent(sin / cos) + turns * pi() / 2
    return found if found.high > 0 else found + 2 * pi()


def words_on_phases(where: Interval) -> str:
    """Words on an interval: nine decimals of both ends, rounded outward."""
    ends = math.floor(Fraction(where.low, 1 << DIGITS) * 10**9), math.ceil(where.above * 10**9)
    low, high = (Decimal(x).scaleb(-9) for x in ends)
    return f"from {low} to {high}"
