"""Check the proof of a full shift once more, without a line of the package.

    .venv/bin/python -m scripts.check_full_shift FILE [--config FULL_SHIFT.yaml]

It follows docs/full-shift.md from the definitions to C9, in Python's integers and fractions, with
the intervals of scripts/check_certificate.py. Polynomials are dictionaries, multiplied as
integers. The exit code is 0 only if all covering relations of the sets, and those of the line of
starts and of its approach, are proven of the config's body. The printed line also says if it is
proven that each sequence has one orbit (C7), what orbits do beside the sets (C8), and how the
surfaces of the periodic orbits cross (C9).
"""

from __future__ import annotations

import functools
import json
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from scripts.check_certificate import (
    Fails,
    Interval,
    Refused,
    answered,
    arctangent,
    bounded,
    check_against,
    exponential,
    hypotenuse,
    larger,
    number,
    pi,
    sqrt,
    stated_by,
)

DIGITS = 200
"""Binary digits of intervals."""
CLOCK = 50
"""Binary digits behind the point of a half-length of a step."""
PARTS = 32
"""Parts of a step on which signs and rates are told."""
ALONE, THIN, WIDEST = Fraction(1, 32), Fraction(1, 2**20), Fraction(1, 4096)
"""Half-widths of boxes with one point of the section, or of a line; largest radius of a tube."""
MOST = {"sets": 32, "steps": 4000, "work": 25 * 10**8, "degree": 100, "bits": 124, "curve": 20}
"""Largest sizes of a proof; work is that of multiplying term by term, minutes."""
STEEP = 64
"""Largest exponent of a bound's growth over a step."""
LIGHT = 64
"""Weight of w in a difference of two orbits of different energies."""
CONSTANT, ALONG = (0, 0, 0, 0), (1, 2, 3)
"""Exponents of x, u, v and w in a constant; the places of u, v and w among them."""


class Series:
    """A sum of terms c T_j(x) u^k v^l w^m in units of 2^-digits, with an error.

    It stands for every polynomial whose coefficients differ from these by at most `error` in total,
    and whose degrees in u, v and w are at most those of `most_of`; if that is None, for every
    function that differs by at most `error`. All of x, u, v and w are in [-1, 1].
    """

    def __init__(
        self, terms: dict[Any, int], digits: int, error: int = 0, most_of: Any = (0, 0, 0)
    ) -> None:
        self.terms, self.digits, self.error, self.most_of = terms, digits, error, most_of

    @classmethod
    def made(cls, terms: dict[Any, int], digits: int) -> Series:
        """A series without error; exponents that are left out are 0."""
        terms = {(*at, 0)[:4]: c for at, c in terms.items()}
        most_of = tuple(max((at[i] for at in terms), default=0) for i in (1, 2, 3))
        return cls(terms, digits, 0, most_of)

    @classmethod
    def of(cls, x: Any) -> Series:
        """A constant that contains a number or an interval, or a series itself."""
        if isinstance(x, Series):
            return x
        ends = Interval.of(x)
        middle = (ends.low + ends.high) // 2
        # The middle is rounded down, so that it is nearer to the lower end.
        return cls({CONSTANT: middle}, Interval.digits, ends.high - middle)

    @property
    def most(self) -> Fraction:
        """A bound on the size of every function."""
        return Fraction(sum(map(abs, self.terms.values())) + self.error, 1 << self.digits)

    def ball(self, more: Any = 0) -> Interval:
        """An interval with all numbers within `more` of any value, for all x, u, v and w."""
        centre = Fraction(self.terms.get(CONSTANT, 0), 1 << self.digits)
        return around(centre, self.most - abs(centre) + above(more))

    def raised(self, digits: int) -> Series:
        """The same in finer units, exactly."""
        by = digits - self.digits
        terms = {at: w << by for at, w in self.terms.items()}
        return Series(terms, digits, self.error << by, self.most_of)

    def __neg__(self) -> Series:
        terms = {at: -w for at, w in self.terms.items()}
        return Series(terms, self.digits, self.error, self.most_of)

    def __add__(self, other: Any) -> Series:
        other = Series.of(other)
        digits = max(self.digits, other.digits)
        a, b = self.raised(digits), other.raised(digits)
        for at, w in b.terms.items():
            a.terms[at] = a.terms.get(at, 0) + w
        return Series(a.terms, digits, a.error + b.error, self.joined(other, max))

    def joined(self, other: Series, rule: Callable[[int, int], int]) -> Any:
        """Degrees of a sum (rule max) or of a product (their sum); None if either has none."""
        if self.most_of is None or other.most_of is None:
            return None
        return tuple(map(rule, self.most_of, other.most_of))

    def __sub__(self, other: Any) -> Series:
        return self + -Series.of(other)

    def __rsub__(self, other: Any) -> Series:
        return Series.of(other) - self

    def __mul__(self, other: Any) -> Series:
        other = Series.of(other)
        sizes = [sum(map(abs, each.terms.values())) for each in (self, other)]
        error = sizes[0] * other.error + sizes[1] * self.error + self.error * other.error
        most_of = self.joined(other, int.__add__)
        found = self.doubled_product(other, sizes)
        return Series(found, self.digits + other.digits + 1, 2 * error, most_of)

    def doubled_product(self, other: Series, sizes: Sequence[int]) -> dict[Any, int]:
        """Terms of twice the product of two polynomials; `sizes` sum up their coefficients."""
        # A constant factor needs no long numbers.
        for one, by in ((self, other), (other, self)):
            if by.terms.keys() <= {CONSTANT}:
                c = 2 * by.terms.get(CONSTANT, 0)
                return {at: c * w for at, w in one.terms.items() if c and w}
        # Bytes that hold, with a sign, any coefficient of the product of what is twice each.
        wide = (4 * max(sizes[0], 1) * max(sizes[1], 1)).bit_length() // 8 + 1
        rows, others = self.rows(wide), other.rows(wide)
        products: dict[Any, int] = {}
        for at, x in rows.items():
            for there, y in others.items():
                powers = tuple(map(int.__add__, at, there))
                products[powers] = products.get(powers, 0) + x * y
        n = self.degree + other.degree
        # Half of a digit's range is added to each, so that none is negative, and taken off again.
        lift, half = lifted(wide, n), 1 << (8 * wide - 1)
        found: dict[Any, int] = {}
        for powers, product in products.items():
            digits = (product + lift).to_bytes(wide * (2 * n + 1), "little")
            for j in range(n + 1):
                here = digits[wide * (n + j) : wide * (n + j + 1)]
                if c := int.from_bytes(here, "little") - half:
                    # This is 4 P Q, where c stands at z^j and at z^-j: 2 P Q has the term c T_j.
                    # At z^0 it stands once, and the term is c/2.
                    found[j, *powers] = c if j else c // 2
        return found

    __radd__, __rmul__ = __add__, __mul__

    @property
    def degree(self) -> int:
        """Degree in x."""
        return max((at[0] for at in self.terms), default=0)

    def rows(self, wide: int) -> dict[Any, int]:
        """For each u^k v^l w^m twice its series, 2 T_j = z^j + z^-j, as a number: at z = 256^wide.

        It is multiplied by z^degree, so that the product of two numbers is that of two polynomials.
        """
        n, columns = self.degree, dict[Any, list[int]]()
        for (j, *powers), c in self.terms.items():
            column = columns.setdefault((*powers,), [0] * (2 * n + 1))
            column[n + j] += c
            column[n - j] += c
        lift, half = lifted(wide, n), 1 << (8 * wide - 1)
        return {
            at: int.from_bytes(
                b"".join([(c + half).to_bytes(wide, "little") for c in column]), "little"
            )
            - lift
            for at, column in columns.items()
        }

    def slope(self) -> Series:
        """The derivative in x, of a series without error."""
        found: dict[Any, int] = {}
        # T_j' = 2 j (T_{j-1} + T_{j-3} + ...), of which T_0 counts half.
        for (j, *powers), c in self.terms.items():
            for i in range(j - 1, -1, -2):
                at = i, *powers
                found[at] = found.get(at, 0) + (1 if i == 0 else 2) * j * c
        return Series.made(found, self.digits)

    def partial(self, variable: int) -> Series:
        """The derivative in u, v or w (1, 2, 3)."""
        if self.most_of is None:
            raise Fails("C7: a function of which only values are bounded has no derivative")
        found = {
            (*at[:variable], n - 1, *at[variable + 1 :]): w * n
            for at, w in self.terms.items()
            if (n := at[variable])
        }
        return Series(found, self.digits, self.error * self.most_of[variable - 1], self.most_of)

    def wider(self, by: Fraction) -> Series:
        """The series of all functions that differ from these by at most `by`."""
        error = self.error + math.ceil(by * 2**self.digits)
        return Series(self.terms, self.digits, error, None)

    def at(self, variable: int, side: int) -> Series:
        """The series on the face where x, u or v (0, 1, 2) is -1 or 1; T_j is x^j there."""
        found: dict[Any, int] = {}
        for at, w in self.terms.items():
            left = tuple(0 if i == variable else n for i, n in enumerate(at))
            found[left] = found.get(left, 0) + w * side ** at[variable]
        return Series(found, self.digits, self.error, self.most_of)

    def on_parts(self) -> list[Interval]:
        """Intervals with the values on equal parts in x, for all u, v and w."""
        rows = {j: c for (j, *powers), c in self.terms.items() if not any(powers)}
        beside = self.most - Fraction(sum(map(abs, rows.values())), 1 << self.digits)
        # |T_j'| <= j^2, and from the middle of a part it is 1/PARTS to its end.
        beside += Fraction(sum(j * j * abs(w) for j, w in rows.items()), PARTS << self.digits)
        n, found = self.degree, []
        for part in range(PARTS):
            values = middles(part, n)
            total = sum(c * values[j] * PARTS ** (n - j) for j, c in rows.items())
            found.append(around(Fraction(total, PARTS**n << self.digits), beside))
        return found


@functools.cache
def lifted(wide: int, n: int) -> int:
    """The number that, added, makes each of 2 n + 1 coefficients of `wide` bytes positive."""
    return (1 << (8 * wide - 1)) * (
        ((1 << (8 * wide * (2 * n + 1))) - 1) // ((1 << (8 * wide)) - 1)
    )


@functools.cache
def middles(part: int, n: int) -> list[int]:
    """The numbers PARTS^j T_j in the middle of a part, for j from 0 to n: integers."""
    x = 2 * part + 1 - PARTS
    found = [1, x]
    while len(found) <= n:
        found.append(2 * x * found[-1] - PARTS**2 * found[-2])
    return found


ENERGY = Series.made({(0, 0, 0, 1): 1}, 0)
"""The variable w, by which energies differ."""


def orders(x: Series, along: Iterable[int]) -> list[Fraction]:
    """Bounds on a series, and on its derivatives in some of u, v and w."""
    return [x.most, *(x.partial(i).most for i in along)]


def around(centre: Any, radius: Any) -> Interval:
    """An interval with all numbers within a radius of a number."""
    middle, away = Interval.of(centre), Interval.of(radius)
    return Interval(middle.low - away.high, middle.high + away.high)


def above(x: Any) -> Fraction:
    """An upper bound on a number."""
    return Interval.of(x).above


def size(x: Interval) -> Fraction:
    """An upper bound on the size of a number."""
    return x.size.above


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
    along: tuple[int, ...] = ALONG
    """Variables in which derivatives are bounded: none where no theorem asks for C7."""

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

    def norms(self, bounds: Sequence[Sequence[Fraction]]) -> list[Fraction]:
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
    if not len(given["A"]) == len(given["r"]) == 3:
        raise Refused("A or r is not three numbers")
    (A1, A2, A3), (r1, r2, r3) = (map(number, given[key]) for key in ("A", "r"))
    held, shift, spread = "h" not in given, given.get("shift", 0), given.get("spread", 0)
    mu, h = (Interval.of(number(given[name])) for name in ("mu", "h0" if held else "h"))
    ordered = Interval.of(A1 - A3).low > 0 and Interval.of(A3 - A2).low > 0
    if not (ordered and Interval.of(A2).low > 0 and r3 == 0 and r1 >= 0 and r2 >= 0):
        raise Refused("A1 > A3 > A2 > 0 or r1, r2 >= 0 = r3 is broken, or cannot be told")
    c = sqrt(Interval.of(A2 * (A1 - A3) / (A3 * (A1 - A2))))
    s = sqrt(Interval.of(A1 * (A3 - A2) / (A3 * (A1 - A2))))
    length, kappa = sqrt(Interval.of(r1 * r1 + r2 * r2)), Interval.of(A1 * A2 / (A3 * (A1 - A2)))
    rho1, rho2, lam, two = r1 / length, r2 / length, s * c, sqrt(Interval.of(2))
    a, b, sigma = mu * (s * rho1 - c * rho2), mu * (s * rho1 + c * rho2), lam * two
    omega = (kappa - c * c) / (2 * c), (kappa + s * s) / (2 * s), kappa
    F = larger(hypotenuse(a, b), sigma * mu.size)
    Omega = larger(two * larger(omega[0].size, omega[1].size), kappa.size / sigma)
    w = sqrt(Omega / F) if F.low << 32 > Omega.high else Interval.of(2**16)
    return Problem(
        *(lam, a, b, (mu * rho1, mu * rho2), omega, (1 / (2 * c), 1 / (2 * s))),
        *(h + shift, spread, h if held else None),
        *(sigma, F, Omega, Interval(w.low, w.low)),
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


class Arrival(NamedTuple):
    """The next crossings of the orbits of a set, taken by the symmetry beside separatrix 2 or 3."""

    d: Series
    g: Series
    symbol: int
    box: list[Interval]
    """Q, gamma1 and gamma2 of all of them."""
    begin: list[Interval]
    """Q, gamma1 and gamma2 of the polynomials at the beginning; empty for a line."""
    time: Interval
    """The time of the passage, t'."""
    slopes: Sequence[tuple[Series, ...]]
    """The derivatives of d, g and w in u, those in v, and those in w, if they are asked for."""
    w: Series = ENERGY


def beginning(p: Problem, quad: Quad, step: Step) -> tuple[list[Interval], list[Fraction]]:
    """C1: the points of a set near given polynomials, each the only one nearby.

    Returns Q, gamma1 and gamma2 of the polynomials, and bounds on the distance of the polynomials
    from the points and on that of derivatives.
    """
    y = [state.at(0, -1) for state in step.states]
    d, g = quad.place()
    large, side = (0, 1) if quad.rising else (1, -1)
    Q, g1, g2 = y[large], y[3], y[4]
    (m1, m2), kappa = p.to_M, p.omega[2]

    def momenta(Q: Any, d: Any) -> tuple[Any, Any]:
        # Qp - Qm is Q - d or, beside 1 and 3, its negative.
        return (Q + d) * m1, (Q - d) * m2 * side

    M1, M2 = momenta(Q, d)
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
        """Derivatives of the residual in Q, gamma1 and gamma2, linear in `one` and in `at`.

        With one = 0 and derivatives of states they are their derivatives.
        """
        q, y1, y2, away = at
        n1, n2 = momenta(q, away)
        by = m1, m2 * side
        return [
            [y1 * by[0] + y2 * by[1], n1, n2],
            [Interval.of(0), 2 * y1, 2 * y2],
            [kappa * (n1 * by[0] + n2 * by[1]) - away / 2, *(one * x for x in p.mu)],
        ]

    J = matrix(1, Q.ball(ALONE), g1.ball(ALONE), g2.ball(ALONE), d.ball())
    turned = {i: matrix(0, *(x.partial(i).ball() for x in (Q, g1, g2, d))) for i in p.along}
    near = solution(residual, J, turned, ALONE)
    if Q.ball(ALONE).low <= 0:
        raise Fails("C1: the large Q is not shown to be positive at the points of a set")
    off = {1 - large: y[1 - large] - d, 2: y[2], 5: y[5] - g}
    apart = [orders(off[j], p.along) if j in off else near for j in range(6)]
    return [Q.ball(), g1.ball(), g2.ball()], p.norms(apart)


def line_beginning(p: Problem, line: Line, step: Step) -> list[Fraction]:
    """C1 of a line of starts or its strip: bounds on the polynomials' distance from its points.

    All but the first are of derivatives.
    """
    Qp, Qm, M3, g1, g2, g3 = (state.at(0, -1) for state in step.states)
    (m1, m2), kappa, J1 = p.to_M, p.omega[2], Interval.of(line.J1)
    square, zero = m1 * m1 + m2 * m2, Interval.of(0)
    u, aside = Series.made({(0, 1, 0): 1}, 0), Series.made({(0, 0, 1): 1}, 0) * line.wide
    M1, M2 = (Qp + aside) * m1, (Qp - aside) * m2
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
        q, m, y1, y2, y3, d = at
        n1, n2 = (q + d) * m1, (q - d) * m2
        mu1, mu2, action, e1, e2 = (
            one * Interval.of(x) for x in (*weight, 4 * J1, line.e1, line.e2)
        )
        return [
            [m1 * y1 + m2 * y2, y3, n1, n2, m],
            [zero, zero, 2 * y1, 2 * y2, 2 * y3],
            [kappa * (n1 * m1 + n2 * m2) - d / 2, kappa * m, mu1, mu2, zero],
            [2 * q * square, action, zero, zero, zero],
            [zero, zero, e1, e2, zero],
        ]

    unknown = (Qp, M3, g1, g2, g3)
    turned = {i: matrix(0, *(x.partial(i).ball() for x in (*unknown, aside))) for i in p.along}
    J = matrix(1, *(x.ball(THIN) for x in unknown), aside.ball())
    near = solution(residual, J, turned, THIN)
    if Qp.ball(THIN).low <= 0 or M3.ball(THIN).high >= 0:
        raise Fails("C1: Qp > 0 > M3 is not shown at the starts")
    return p.norms([near, orders(Qm - aside, p.along), near, near, near, near])


def solution(
    residual: list[Series], J: list[list[Any]], turned: dict[int, list[list[Any]]], room: Fraction
) -> list[Fraction]:
    """C1: a bound on the distance to the only solution within `room`, and those of derivatives.

    J encloses the derivatives of the residual in the box of that half-width, and `turned` their
    derivatives. Newton's iteration with a fixed matrix contracts the box into itself.
    """
    n = range(len(residual))
    C = inverse([[Fraction(x.low + x.high, 2 << Interval.digits) for x in row] for row in J])
    # The largest sum of a row of |1 - C J|.
    share = Fraction(0)
    for i in n:
        row = [sum((C[i][k] * J[k][j] for k in n), Interval.of(0)) for j in n]
        share = max(share, sum((size(x - (i == j)) for j, x in enumerate(row)), Fraction(0)))

    def moved(right: Sequence[Fraction]) -> Fraction:
        """Bound on the largest component of x, where J x = right in size."""
        return max(sum((abs(C[i][k]) * right[k] for k in n), Fraction(0)) for i in n) / (1 - share)

    values, *along = zip(*(orders(x, turned) for x in residual), strict=True)
    if share >= 1 or (near := moved(values)) > room:
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


def tube(
    p: Problem, step: Step, begin: Fraction, away: Fraction, name: str, widest: Fraction
) -> tuple[Fraction, Fraction]:
    """The bound on the distance over a step, less than a tube's radius, and the factor of growth.

    `begin` is epsilon + 2 delta, and growth is bounded at `away` times the radius from the
    polynomials: 1 at the orbits themselves. Fails under `name` if no tube up to `widest` holds.
    """
    sizes, radius = [x.size for x in step.states[2].on_parts()], min(4 * begin, widest)
    while True:
        E = away * Interval.of(radius)
        k = p.w * p.F + (1 + p.w * E) * (p.Omega / p.w)
        # Twice the rates, and half of the duration of a part.
        rates, beside = Interval.of(0), E / p.sigma
        for m in sizes:
            steep = p.lam * (m + beside)
            rates += steep + hypotenuse(steep, k)
        growth = rates * (step.half.most / PARTS)
        if growth.above > STEEP:
            raise Fails(f"{name}: a bound that grows by more than exp({STEEP}) on a step is none")
        factor = exponential(growth)
        grown = (factor * begin).above
        if grown < radius:
            return grown, factor.above
        if radius == widest:
            said = f"{float(grown):.3g} at the end, and {float(widest):.3g} is the most"
            raise Fails(f"{name}: {said}")
        radius = min(2 * grown, widest)


def defects(p: Problem, step: Step) -> list[Fraction]:
    """C2: bounds on the defect of a step and on its derivatives."""
    pairs = zip(step.states, p.field(step.states), strict=True)
    return p.norms([orders(y.slope() - step.half * f, p.along) for y, f in pairs])


def carried(p: Problem, step: Step, begin: list[Fraction], leaps: list[Fraction]) -> list[Fraction]:
    """C3: the bounds at the end of a step on the distance and on its derivatives."""
    # A defect is bounded over x from -1 to 1, a length of 2.
    first, *along = (a + 2 * b for a, b in zip(begin, leaps, strict=True))
    bound, growth = tube(p, step, first, Fraction(1), "C3", WIDEST)
    size, *slopes = p.norms([orders(y, p.along) for y in step.states])
    length, *lengths = orders(step.half, p.along)
    found = [bound]
    for x, slope, changed in zip(along, slopes, lengths, strict=True):
        # The derivative of f differs between orbits and polynomials, by the second derivative times
        # their distance; where the length depends on the variable, so does f itself.
        bent = p.bending * length * slope + p.steepness(size + WIDEST) * changed
        found.append(growth * (x + 2 * bent * first))
    # Rounded upward to fewer digits: fractions that are multiplied over and over grow long.
    return [above(x) for x in found]


def signs(p: Problem, step: Step, bound: Fraction, side: int) -> Iterator[int]:
    """C4: for each part 0 if M3 has the sign of the passage, `side`, else the sign of side M3'."""
    apart = p.apart(bound)
    parts = [state.on_parts() for state in step.states]
    for k, M3 in enumerate(parts[2]):
        if (side * M3 - apart[2]).low > 0:
            yield 0
            continue
        rate = side * p.field([around_all(x[k], e) for x, e in zip(parts, apart, strict=True)])[2]
        if rate.low <= 0 <= rate.high:
            raise Fails("C4: neither the sign of M3 nor that of its rate is told on a part")
        yield 1 if rate.low > 0 else -1


def around_all(x: Interval, radius: Fraction) -> Interval:
    """An interval with all numbers within a radius of those of another one."""
    away = Interval.of(radius).high
    return Interval(x.low - away, x.high + away)


def arrival(p: Problem, start: Quad | Line, steps: Sequence[Step]) -> Arrival:
    """C1 to C5 of the orbits of a set, or of a line of starts, up to their next crossing."""
    # `side` is the sign of M3 during the passage; a line begins at M3 < 0, not at M3 = 0.
    begin: list[Interval] = []
    if isinstance(start, Line):
        side, order, bounds = -1, [0, -1], line_beginning(p, start, steps[0])
    else:
        side, order = 1 if start.rising else -1, [1, 0, -1]
        begin, bounds = beginning(p, start, steps[0])
    told: list[int] = []
    passed, starts = Interval.of(0), bounds
    for k, step in enumerate(steps):
        if k:
            before = [state.at(0, 1) for state in steps[k - 1].states]
            joint = zip(step.states, before, strict=True)
            gap = p.norms([orders(a.at(0, -1) - b, p.along) for a, b in joint])
            bounds = [a + b for a, b in zip(bounds, gap, strict=True)]
        passed += 2 * step.half.ball()
        if step.half.ball().low <= 0:
            raise Fails("C2: the length of a step is not shown to be positive")
        bounds = carried(p, step, bounds, defects(p, step))
        told += signs(p, step, bounds[0], side)
    if [x for k, x in enumerate(told) if not k or told[k - 1] != x] != order:
        raise Fails("C4: M3 is not shown to leave zero at once and to return at the end")
    end = [state.at(0, 1) for state in steps[-1].states]
    found = crossing(p, end, bounds, side, begin)
    found = found._replace(time=passed + found.time)
    if isinstance(start, Line) and p.h0 is not None:
        w, by_w = energies_along(p, p.h0, steps[0], starts)
        slopes = [(d, g, each) for (d, g, _), each in zip(found.slopes, by_w, strict=True)]
        return found._replace(w=w, slopes=slopes)
    return found


def energies_along(
    p: Problem, h0: Interval, step: Step, bounds: Sequence[Fraction]
) -> tuple[Series, list[Series]]:
    """C6: w along a line of starts of one J2, and its derivatives.

    The energy is h0 and that of the weight, which gamma tells.
    """
    g1, g2 = (step.states[k].at(0, -1) for k in (3, 4))
    per = 1 / p.spread
    w = (g1 * p.mu[0] + g2 * p.mu[1] + (h0 - p.h)) * per
    unsure = above((p.mu[0].size + p.mu[1].size) * p.w * per)
    found = w.wider(unsure * bounds[0])
    if found.most > 1:
        raise Fails("C6: energies along the line are others than those of the sets")
    apart = zip(p.along, bounds[1:], strict=True)
    return found, [w.partial(i).wider(unsure * bound) for i, bound in apart]


def crossing(
    p: Problem, end: list[Series], bounds: list[Fraction], side: int, begin: list[Interval]
) -> Arrival:
    """C5: the crossings beside the end of the last step, from which their time counts."""
    apart = p.apart(bounds[0])
    M3 = end[2].most + apart[2]
    late = M3 + apart[2]
    for _ in range(4):
        # In this box |M3| falls at the rate `slowest` at least: an orbit that stays in it crosses
        # within `time`. It does stay, if `time` times the largest rate is at most `late`.
        box = [state.ball(e + late) for state, e in zip(end, apart, strict=True)]
        found = p.field(box)
        fastest, slowest = max(map(size, found)), (-side * found[2]).low
        if slowest <= 0:
            break
        time = M3 / Fraction(slowest, 1 << Interval.digits)
        if time * fastest <= late:
            # Derivatives change on the way to the crossing, and with the time of the crossing,
            # whose derivative is that of M3 over the rate of M3.
            steep = p.steepness(p.norm(*map(size, box)))
            more = exponential(Interval.of(steep * time)).above - 1
            slopes = []
            for i in p.along:
                moved = [state.partial(i) for state in end]
                most = p.norm(*(x.most for x in moved)) + bounds[i]
                off = p.apart(bounds[i] + more * most)
                timed = (moved[2].most + off[2]) * fastest * (1 << Interval.digits) / slowest
                slopes.append([x.wider(e + timed) for x, e in zip(moved, off, strict=True)])
            away = [e + time * size(rate) for e, rate in zip(apart, found, strict=True)]
            places = [x.wider(e) for x, e in zip(end, away, strict=True)]
            crossed = reached([places, *slopes], box, side, begin)
            return crossed._replace(time=around(0, time))
        late = 2 * time * fastest
    raise Fails("C5: M3 crosses zero too slowly")


def reached(
    places: list[list[Series]], box: list[Interval], side: int, begin: list[Interval]
) -> Arrival:
    """C5: the side on which the orbits cross, by the sign of the large Q, and where they do."""
    large = 1 if side > 0 else 0
    if box[large].low <= 0 <= box[large].high:
        raise Fails("C5: the side on which the orbits leave is not told")
    sign = 1 if box[large].low > 0 else -1
    (d, g), *along = ((x[1 - large] * sign, x[5] * sign) for x in places)
    # Derivatives in all of u, v and w are asked for, or none; that of w itself is 0, 0 and 1.
    slopes = [(*each, Series.of(int(i == 3))) for i, each in zip(ALONG, along, strict=False)]
    there = [sign * box[large], box[3], box[4]]
    return Arrival(d, g, int(sign == side), there, begin, Interval.of(0), slopes)


def check_relation(source: Arrival, quad: Quad, begin: Sequence[Interval]) -> None:
    """C6: check that the image of a set lies across another one; Fails where it is not shown."""
    # So near to its polynomials the target has one point only with given d and gamma3 (C1).
    if any(size(a - b) > ALONE for a, b in zip(source.box, begin, strict=True)):
        raise Fails("C6: the crossings are on another sheet of the section")
    U, V = quad.coordinates(source.d, source.g, source.w)
    low, high = (U.at(1, side).ball() for side in (-1, 1))
    ends = [(low.high, high.low), (high.high, low.low)]
    one = 1 << Interval.digits
    if not any(a < -one and b > one for a, b in ends):
        raise Fails("C6: an edge does not lie beyond the end of the set")
    if V.most >= 1:
        raise Fails("C6: the image is not between the sides of the set")


def check_apart(one: Quad, other: Quad) -> None:
    """Check that two sets of the same symbol have no point in common (Theorem 10)."""
    d, g = one.place()
    U = other.coordinates(d, g, ENERGY)[0].ball()
    if max(U.low, -U.high) <= 1 << Interval.digits:
        raise Fails("it has the symbol of another set, and is not shown to be apart from it")


def prove_link(p: Problem, link: tuple[Any, list[Step]], after: tuple[Any, list[Step]]) -> int:
    """Check that a set, or a line, covers the next one, if there is one: its passage's symbol.

    Raises Fails with what is not shown.
    """
    (source, steps), (target, following) = link, after
    if not steps:
        raise Fails("C2: a set has no steps")
    # A chain claims existence only: C7 and its derivatives are not needed.
    p = p._replace(along=())
    found = arrival(p, source, steps)
    if target is not None:
        if target.rising != crosses_upward(source) or not following:
            raise Fails("C6: the next set is not one of the section that is crossed")
        begin, _ = beginning(p, target, following[0])
        check_relation(found, target, begin)
    return found.symbol


def crosses_upward(source: Quad | Line) -> bool:
    """True if the next crossings of a set, or of a line, are upward."""
    return isinstance(source, Line) or not source.rising


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


def check_cone(source: Arrival, quad: Quad) -> None:
    """C7: check that differences of orbits grow along u or shrink along v; Fails if not shown."""
    (U_u, V_u), *others = (quad.directions(source.g, source.w, *x) for x in source.slopes)
    ends = U_u.ball()
    least = Fraction(max(ends.low, -ends.high), 1 << Interval.digits)
    (U_v, V_v), (U_w, V_w) = others
    turned = U_v.most + U_w.most / LIGHT + LIGHT * source.slopes[0][2].most
    if least - turned <= 1 or V_u.most + V_v.most + V_w.most / LIGHT >= 1:
        raise Fails("C7: the passage is not shown to stretch along u and to shrink along v")


class Middle(NamedTuple):
    """Numbers of C8 that C9 needs as well."""

    d0: Fraction
    """The largest |d| of sets and images."""
    level: Interval
    """h - mu."""
    mu: Interval
    kappa: Interval
    k: Interval
    K: Interval
    lean: Interval
    """1/(sqrt(2) chi)."""
    thin: Interval
    """1/2 over the larger of c and s."""
    m0: Interval
    m1: Interval
    time: Interval
    """m0/v: in which M3 passes from -m0 to 0."""
    N: Interval
    follow: Interval
    """Bound on |d| where |M3| <= m1, beside the sets."""

    def ratio(self, p: Problem) -> Interval:
        """The number r0 of C9."""
        return p.F * self.lean / (p.lam * self.m0 * self.m0)


def check_middle(p: Problem, small: Fraction) -> Middle:
    """C8: check that orbits with |d| <= small on M3 = 0 cross it on one of two sides, or never do.

    Interval ends are compared so that what is not certain Fails.
    """
    mu, h, kappa = hypotenuse(*p.mu), p.energies.ball(), p.omega[2]
    spins = [omega * m for omega, m in zip(p.omega, p.to_M, strict=False)]
    most, least = larger(*spins), -larger(-spins[0], -spins[1])
    if least.low <= 0:
        raise Fails("C8: the energy is not shown to be positive")
    # Any m0, m1 and q are valid; these leave room in all of the tests below.
    m1, q = 2 * sqrt(2 * h / kappa) / 3, sqrt(h / most) / 5
    m0, lean = m1 / 2, larger(*p.to_M) * sqrt(Interval.of(2))
    square = (h - mu - kappa * m1 * m1 / 2) / most
    rise = (square - 2 * q * q) / (4 * p.lam) - mu
    if rise.low <= 0:
        raise Fails("C8: M3 is not shown to rise beside the sets")
    rate = p.lam * m0 - p.F * lean / m0
    if rate.low <= 0:
        raise Fails("C8: the middle is not shown to be a saddle")
    time = m1 / rise
    steep = p.lam * m1 * time
    follow = exponential(steep) * (p.F * time + small) if steep.above <= STEEP else q
    if (q - follow).low <= 0:
        raise Fails("C8: orbits beside the sets are not shown to follow the separatrix")
    apart = 2 * sqrt(2 * p.lam * rate * square * (m1 - m0)) - 4 * p.lam * mu
    fall = apart / (8 * p.lam) - mu
    widest = sqrt((h + mu) / least)
    if fall.low <= 0 or (apart - 4 * p.F * widest * m0 / fall).low <= 0:
        raise Fails("C8: M3 is not shown to fall to zero where it leaves the middle")
    thin = -larger(-p.to_M[0], -p.to_M[1])
    bodily = mu, kappa, least, most, lean, thin
    return Middle(small, h - mu, *bodily, m0, m1, m0 / rise, widest, follow)


def slant(p: Problem, upright: Interval, aside: Any) -> tuple[Interval, Interval]:
    """C9: the bound zeta on the unstable surface's slope, and the rate c(aside) that drives it."""
    l = larger(p.w * p.F, p.Omega / p.w)
    driven, rate = l + aside / sqrt(Interval.of(2)), p.lam * upright - l
    if rate.low <= 0 or (rate - 2 * driven).low <= 0:
        raise Fails("C9: the unstable surface is not shown to be a graph")
    return 2 * driven / rate, driven


def check_graph(p: Problem, of: Middle) -> None:
    """C9: check that the unstable surface, where it crosses M3 = 0, is a graph over gamma3."""
    begin, driven = slant(p, of.m0, larger(of.follow, of.ratio(p) * of.N))
    square, passed = of.level / of.K, driven * of.time
    turned = of.lean / (of.thin * sqrt(2 * square))
    pushed = of.mu / (2 * of.k * sqrt(square - of.d0 * of.d0))
    left = 1 - turned * pushed
    if left.low <= 0:
        raise Fails("C9: the weight is too large beside the energy")
    lean = 1 + 2 * turned * (pushed + 1 / p.w) / left
    if passed.above > STEEP or (1 - exponential(2 * passed) * (begin + passed) * lean).low <= 0:
        raise Fails("C9: the unstable surface is not shown to be a graph over gamma3")


def check_strip(p: Problem, of: Middle, line: Line, step: Step) -> None:
    """C9: check that the unstable surface is a curve from end to end in a strip of starts."""
    bounds = line_beginning(p, line, step)
    states = [state.at(0, -1) for state in step.states]
    momentum = states[0].most + bounds[0]
    if (states[2].ball(above(bounds[0] / p.sigma)) + of.m1).high >= 0:
        raise Fails("C9: the strip is not shown to be beside the periodic orbit")
    r0 = of.ratio(p)
    if (line.wide - r0 * momentum).low <= 0:
        raise Fails("C9: the unstable surface is not shown to pass between the strip's sides")
    square = momentum * momentum * ((1 + r0 * r0) / (1 - r0 * r0))
    left = of.level - of.K * square
    if left.low <= 0:
        raise Fails("C9: the strip is not shown to be beside the periodic orbit")
    kappa, _ = slant(p, sqrt(2 * left / of.kappa), r0 * sqrt(square))
    # A_u and A_v bound the derivatives of all components but Qm = wide v.
    sizes = [
        p.norm(*(Fraction(0) if j == 1 else x.partial(i).most for j, x in enumerate(states)))
        for i in (1, 2)
    ]
    if (line.wide - kappa * (sum(sizes) + bounds[1] + bounds[2])).low <= 0:
        raise Fails("C9: the unstable surface is not shown to lie along the strip")


def check_crossings(
    start: Arrival, reach: Fraction, sheets: Sequence[Interval], images: Sequence[Arrival]
) -> None:
    """C9: check that the images of the strip and of sets cross the surface's mirror image.

    `reach` is G of C9, and `sheets` are intervals of gamma2.
    """
    if not (all(x.low > 0 for x in sheets) or all(x.high < 0 for x in sheets)):
        raise Fails("C9: the sets and images are not shown to be on one sheet of the section")
    ends = sorted(((start.g.at(1, side).ball()) for side in (-1, 1)), key=lambda x: x.low)
    far = Interval.of(reach)
    if ends[0].high >= -far.high or ends[1].low <= far.high:
        raise Fails("C9: the strip's image is not shown to reach as far as all sets and images")
    (d_u, g_u, _), (d_v, g_v, _), _ = start.slopes
    along = g_u.ball(g_v.most)
    slope = d_u.ball(d_v.most) / along if along.low > 0 or along.high < 0 else Interval(-1, 1)
    if slope.low <= 0 <= slope.high:
        raise Fails("C9: the surfaces are not shown to cross each other at an angle")
    for found in images:
        by_u, by_v = (d + g * slope for d, g, _ in found.slopes[:2])
        ends_u = by_u.ball()
        if max(ends_u.low, -ends_u.high) <= Interval.of(by_v.most).high:
            raise Fails("C9: an image is not shown to cross the stable surface at an angle")


def check_transversal(
    p: Problem,
    line: tuple[Line, Step, Arrival | None],
    quads: Sequence[Quad],
    found: Sequence[Arrival],
) -> None:
    """C9, with C8: check that S1- and S2+ cross transversally, once for each even word."""
    strip, step, start = line
    if p.h0 is not None:
        raise Fails("C9: the starts are of several energies")
    if start is None:
        raise Fails("C9: the starts come to the sets by an approach")
    of = check_middle(p, farthest(quads, [*found, start]))
    check_strip(p, of, strip, step)
    check_graph(p, of)
    both = list(zip(quads, found, strict=True))
    images = [x for quad, x in both if not quad.rising]
    # The points of a set are within ALONE of its polynomials (C1).
    sheets = [around_all(x.begin[2], ALONE) for quad, x in both if quad.rising]
    sheets += [x.box[2] for x in (start, *images)]
    extent = [quad.place()[1].most for quad in quads if quad.rising] + [x.g.most for x in images]
    check_crossings(start, max(extent), sheets, images)


def farthest(quads: Sequence[Quad], found: Sequence[Arrival]) -> Fraction:
    """The largest |d| of sets and images."""
    return max(x.most for x in (*(q.place()[0] for q in quads), *(y.d for y in found)))


class Proven(NamedTuple):
    """Proven facts of a full shift and its line of starts."""

    times: list[Interval]
    """Times of the passages from each set, t'."""
    word: str
    """Symbols of the approach from the line to the sets."""
    theta2: Interval
    """The phases of the line, radians."""
    doubts: list[str]
    """Reasons for which Theorems 3, 4 and 8 are undecided; empty texts where they are proven."""


def prove(
    problem: dict[str, Any],
    quads: Sequence[Quad],
    line: Line,
    orbits: Sequence[list[Step]],
    approach: Sequence[Quad] = (),
) -> Proven:
    """Check all that a full shift and its line of starts need.

    `orbits` are the steps of the sets, then those of the line, then those of the approach. Raises
    Fails with what is not shown.
    """
    n = len(quads)
    if (
        not all(quad.a and quad.b and quad.l1 for quad in (*quads, *approach))
        or not all(orbits)
        or len(orbits) != n + 1 + len(approach)
    ):
        raise Fails("a set has no extent, or no steps")
    p = problem_of(problem)
    found = [_named(k, arrival, p, *of) for k, of in enumerate(zip(quads, orbits, strict=False))]
    letters = [(q.rising, x.symbol) for q, x in zip(quads, found, strict=True)]
    if set(letters) != {(up, symbol) for up in (False, True) for symbol in (0, 1)}:
        raise Fails("a section has no sets of both symbols")
    for k in range(n):
        for j in range(k):
            # A point has one symbol: sets of different symbols have no point in common.
            if letters[j] == letters[k]:
                _named(k, check_apart, quads[j], quads[k])
    for k, source in enumerate(found):
        for quad, other in zip(quads, found, strict=True):
            if quad.rising != quads[k].rising:
                _named(k, check_relation, source, quad, other.begin)
    links: list[Any] = list(zip((line, *approach), orbits[n:], strict=True))
    names = ["line", *(f"{k} of the approach" for k in range(1, len(links)))]
    pairs = zip(names, links, links[1:], strict=False)
    word = [_named(name, prove_link, p, *pair) for name, *pair in pairs][1:]
    start = _named(names[-1], arrival, p, *links[-1])
    crossed = [
        each for each in zip(quads, found, strict=True)
        if each[0].rising == crosses_upward(links[-1][0])
    ]  # fmt: skip
    for quad, other in crossed:
        _named(names[-1], check_relation, start, quad, other.begin)
    # The line has no symbol.
    word += [start.symbol] if approach else []
    cones: list[tuple[int | str, Arrival, Quad]] = [
        *((k, x, q) for k, x in enumerate(found) for q in quads if q.rising != quads[k].rising),
        # With an approach nothing is claimed of how many starts have a code: no C7 of the line.
        *(("line", start, quad) for quad, _ in crossed if not approach),
    ]
    # C9 is about the strip's own image: behind an approach `start` is that of another set.
    of_line = line, orbits[n][0], None if approach else start
    doubts = [
        _doubt(lambda: [_named(k, check_cone, x, quad) for k, x, quad in cones]),
        _doubt(lambda: check_middle(p, farthest(quads, found))),
        _doubt(lambda: check_transversal(p, of_line, quads, found)),
    ]
    # Theorem 8 needs C7 and C8 as well.
    doubts[2] = doubts[0] or doubts[1] or doubts[2]
    where = phases(p, line, orbits[n][0])
    return Proven([x.time for x in found], "".join(map(str, word)), where, doubts)


def _doubt(check: Callable[[], Any]) -> str:
    """The reason for which something is undecided; empty where it is proven."""
    try:
        check()
    except Fails as doubt:
        return str(doubt)
    return ""


def _named(k: int | str, check: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a check, or Fails with the name of the set."""
    try:
        return check(*arguments)
    except Fails as doubt:
        raise Fails(f"set {k}: {doubt}") from None


FURTHER = (
    "each sequence of sets has one orbit in them",
    "every finite one has an orbit from T1 or T2 to T1 or T2",
    "S1- and S2+ cross transversally, in one orbit for each one of even length",
)
"""Words on Theorems 3, 4 and 8, which may be undecided where Theorems 1 and 2 are proven."""

# ---- The file.

QUAD = ("rising", "a", "b", "l0", "l1", "p")
LINE = ("e1", "e2", "centre", "half")
PROOF = {"family": 1, "bits": 1, "terms": 1, "powers": 2, "coefficients": 2}
"""Names of arrays of sets, of a line of starts, and of steps, the last with their dimensions."""
ENERGIES = ("shift", "spread", "moves", "line")
"""Names of arrays where there are several energies: the config's and shift + spread w."""


class Read(NamedTuple):
    """The content of a file."""

    config: dict[str, Any]
    quads: list[Quad]
    approach: list[Quad]
    line: list[Any]
    """All of a Line but J1."""
    orbits: list[list[Step]]
    shift: Fraction
    spread: Fraction


def read(path: Path) -> Read:
    """The config of a result, its sets and energies, the numbers of its line, and all steps."""
    import h5py

    try:
        with h5py.File(path) as file:
            bounded(file, path.stat().st_size)
            config = json.loads(file["config"].asstr()[()])
            sets, starts = (
                {k: file[f"data/{group}/{k}"][()] for k in names}
                for group, names in (("sets", QUAD), ("line", LINE))
            )
            proof = whole(file["data/proof"], PROOF)
            several = {
                k: file[f"data/energies/{k}"][()] for k in ENERGIES if "energies" in file["data"]
            }
            if "wide" in file["data/line"]:
                starts["wide"] = file["data/line/wide"][()]
            before = {k: file[f"data/approach/{k}"][()] for k in QUAD if "approach" in file["data"]}
        moves = several.get("moves", [[]] * len(sets["a"]))
        shift, spread = (Fraction(float(several.get(k, 0))) for k in ("shift", "spread"))
        if len(moves[0]) > MOST["curve"] or spread < 0:
            raise Refused(
                f"sets move by more than {MOST['curve']} powers of w, or by less than none"
            )
        quads = list(quads_of(sets, moves))
        approach = list(quads_of(before, [[]] * len(before["a"]))) if before else []
        line = [Fraction(float(starts[name])) for name in LINE]
        wide = Fraction(float(starts.get("wide", 0)))
        line_moves = [Fraction(float(x)) for x in several.get("line", [])]
        orbits = steps_of_sets(proof, len(quads) + 1 + len(approach))
        return Read(config, quads, approach, [*line, line_moves, wide], orbits, shift, spread)
    except (OSError, KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError,
            RuntimeError) as error:  # fmt: skip
        raise Refused(f"it cannot be read: {str(error)[:200]}") from None


def whole(group: Any, dimensions: dict[str, int]) -> dict[str, Any]:
    """Arrays of integers as a file holds them; raises Refused for any others."""
    for name, n in dimensions.items():
        if group[name].ndim != n or group[name].dtype.kind not in "iu":
            raise Refused(f"{name} has another shape or kind")
    return {name: group[name][()] for name in dimensions}


def quads_of(sets: dict[str, Any], moves: Any) -> Iterator[Quad]:
    """The sets of a file, whose numbers are doubles, taken exactly."""
    if not 0 < sets["p"].shape[1] <= MOST["curve"]:
        raise Refused(f"a curve has no coefficients, or more than {MOST['curve']}")
    rows = (sets[name] for name in QUAD)
    for (up, *numbers, p), curves in zip(zip(*rows, strict=True), moves, strict=True):
        a, b, l0, l1 = (Fraction(float(x)) for x in numbers)
        of = [[Fraction(float(x)) for x in curve] for curve in (p, *curves)]
        yield Quad(bool(up), a, b, l0, l1, of[0], of[1:])


def steps_of_sets(proof: dict[str, Any], n: int) -> list[list[Step]]:
    """The steps of each of n sets or lines of a file; their sizes are checked before."""
    if n > MOST["sets"]:
        raise Refused(f"there are more than {MOST['sets']} sets")
    counts, bits = [int(x) for x in proof["terms"]], [int(x) for x in proof["bits"]]
    powers = [tuple(int(x) for x in row) for row in proof["powers"]]
    values = [[int(x) for x in row] for row in proof["coefficients"]]
    orbits: list[list[Step]] = [[] for _ in range(n)]
    of = [int(x) for x in proof["family"]]
    if not len(counts) == len(bits) == len(of) <= MOST["steps"] or min(counts) < 1:
        raise Refused("steps are not as many as they say")
    if sum(counts) != len(powers) or len(powers) != len(values):
        raise Refused("terms are not as many as they say")
    if not all(1 <= x <= MOST["bits"] for x in bits) or not set(of) <= set(range(2 * len(orbits))):
        raise Refused("a step has too many bits, or is of no set")
    if any(len(at) not in (3, 4) or not all(0 <= n <= MOST["degree"] for n in at) for at in powers):
        raise Refused("a term is of no degree, or of one too high")
    first, left = 0, MOST["work"]
    for k, count, fine in zip(of, counts, bits, strict=True):
        here = range(first, first + count)
        if len({powers[i] for i in here}) < count or any(len(values[i]) != 7 for i in here):
            raise Refused("a step has a term twice, or one that is not of seven numbers")
        # Stored coefficients of T_0 are twice what they stand for: with one digit more, all others
        # are doubled instead.
        columns = [
            {
                powers[i]: values[i][c] * (1 if powers[i][0] == 0 else 2)
                for i in here
                if values[i][c]
            }
            for c in range(7)
        ]
        states = [Series.made(terms, fine + 1) for terms in columns[:6]]
        left -= count * count * (1 + len(columns[6]))
        if left < 0:
            raise Refused("there are more terms than can be multiplied in minutes")
        if any(at[0] for at in columns[6]):
            raise Refused("the length of a step depends on time")
        first += count
        if k < len(orbits):
            orbits[k].append(Step(Series.made(columns[6], CLOCK + 1), states))
            continue
        # Digits that did not fit a word are added to the last step of their set.
        steps = orbits[k - len(orbits)]
        if not steps or columns[6]:
            raise Refused("what is added to a step is of no step, or has a length")
        coarse = steps.pop()
        both = [x + y for x, y in zip(coarse.states, states, strict=True)]
        steps.append(Step(coarse.half, both))
    return orbits


def _stated(config: dict[str, Any]) -> dict[str, Any]:
    """The part of a config that a proof is about: not how many half rotations were asked for."""
    given = {"around": "0"} | dict(config["problem"].items())
    left_out = (None, "null")
    searched = ("half_turns", "lengths")
    problem = {name: x for name, x in given.items() if name not in searched and x not in left_out}
    return {"experiment": config["experiment"], "problem": problem}


def word_of(address: str) -> str:
    """The symbols of an address such as a 0^8 1^9 (1^15)*2."""
    repeated = re.compile(r"\(([01])\^[0-9]+\)\*([0-9]{1,3})(?![0-9])")
    each = repeated.sub(lambda found: found[1] * int(found[2]), address)
    return re.sub(r"\^[0-9]+|[ab ]", "", each)


def energies_of(found: Read) -> dict[str, Fraction]:
    """The energies of a proof, shift and spread; refused if its config asks for others."""
    given = found.config["problem"]
    if given.get("h") is None:
        if not found.spread:
            raise Refused("starts of one J2_0 have other energies than one")
    else:
        wide = Interval.of(number(given.get("around", "0")) * number(given["h"]))
        if wide.low < 0:
            raise Refused("around >= 0 is broken, or cannot be told")
        if found.shift or found.spread < wide.above:
            raise Refused("its config asks for other energies than it is of")
    return {"shift": found.shift, "spread": found.spread}


def check(path: Path, given: Path | None = None) -> str:
    """The sentence that a result proves, with its numbers; raises Refused or Fails."""
    Interval.digits = DIGITS
    found = read(path)
    config = found.config
    try:
        if given:
            check_against(_stated(config), _stated(stated_by(given)))
            Interval.digits = DIGITS
        name = "h" if config["problem"].get("h") is not None else "h0"
        problem = {key: config["problem"][key] for key in ("A", "r", "mu", name)}
        action = config["problem"]["J1_0"]
        triples = [", ".join(problem[key]) for key in ("A", "r") if len(problem[key]) == 3]
        of = f"A = {triples[0]}; r = {triples[1]}; mu = {problem['mu']}; {name} = {problem[name]}"
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise Refused(f"its config, or the one given, lacks something: {error!r}") from None
    problem |= energies_of(found)
    if found.spread:
        of += f" + {float(found.shift)!r}" if found.shift else ""
        of += f", energies that differ from it by at most {float(found.spread)!r}"
    J1 = number(action)
    if Interval.of(J1).low <= 0:
        raise Refused("J1_0 > 0 is broken, or cannot be told")
    asked = config["problem"].get("approach")
    proven = prove(problem, found.quads, Line(J1, *found.line), found.orbits, found.approach)
    if proven.word != (word_of(asked) if isinstance(asked, str) else ""):
        raise Fails(
            f"the symbols of the approach are {proven.word}, and its config asks for others"
        )
    unit = Fraction(10**4, 1 << DIGITS)
    # Rounded outward.
    least = math.floor(min(x.low for x in proven.times) * unit) / 10**4
    most = math.ceil(max(x.high for x in proven.times) * unit) / 10**4
    further = (
        f"; undecided: {doubt}" if doubt else f"; {theorem}"
        for doubt, theorem in zip(proven.doubts, FURTHER, strict=True)
    )
    up = sum(quad.rising for quad in found.quads)
    count = 2 * up * (len(found.quads) - up)
    behind = f", behind the symbols {proven.word}" if proven.word else ""
    return (
        f"proven of {of}: {count} covering relations, so every sequence is the code of an orbit,"
        f" with {least} to {most} t' a passage, and the entropy at least"
        f" ln({count // 2})/2 a passage; and of a line of starts of J1_0 = {action} with"
        f" theta2_0 {words_on_phases(proven.theta2)}{behind}" + "".join(further)
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a result; the exit code is 0 where the full shift is proven."""
    return answered(arguments, __doc__, lambda *given: [check(*given)], alone=True)


if __name__ == "__main__":
    sys.exit(main())
