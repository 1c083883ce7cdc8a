"""Check a certificate of route codes once more, without a line of the package.

    .venv/bin/python scripts/check_certificate.py FILE [--config FIG.yaml] [-j PROCESSES]

It follows docs/certified.md from the definitions to H5, in Python's integers and fractions. Besides
Python one has to believe h5py, which reads the file, and PyYAML for `--config`. For every orbit it
says what is proven, or, where a claimed symbol is not, which hypothesis fails at which step. The
exit code is 0 only if the steps prove every symbol that the certificate claims, of the orbits that
its config names.
"""

from __future__ import annotations

import argparse
import ast
import functools
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

CLOCK = 32
"""Binary digits behind the point of a step's half-length."""
WIDEST = Fraction(1, 64)
"""Largest radius of a tube."""
PARTS = (32, 256)
"""Numbers of parts of a step on which signs are told: the second if the first do not suffice."""
FINE = 96
"""Binary digits of M3, Q and their slopes on a part."""
BITS, TERMS, STEPS, ORBITS, SYMBOLS = 4096, 4096, 20_000, 2000, 100_000
"""Limits: bits and terms of a step, steps of an orbit, orbits, and symbols of an orbit."""
EACH, RATIO, SPARE = 128, 8, 2**26
"""Least bytes of the file for each step; most bytes of arrays for each of the file, and further."""
NONE = 255
"""The code of a symbol of which nothing is claimed."""


class Refused(Exception):
    """Error: a file or its config is unusable, or claims what is not proven; the text says why."""


class Fails(Exception):
    """Error: a hypothesis is not shown; the text begins with its name."""


# ---- Numbers: intervals whose ends are integers in units of 2^-digits.


class Interval:
    """All numbers from low to high, integers in units of 2^-digits; operations round outward."""

    digits = 512
    """One for all intervals, set for each orbit before anything is computed of it."""

    def __init__(self, low: int, high: int) -> None:
        self.low, self.high = low, high

    @classmethod
    def of(cls, x: Any) -> Interval:
        """The narrowest interval that contains a number, or an interval itself."""
        if isinstance(x, Interval):
            return x
        if isinstance(x, int):
            return cls(x << cls.digits, x << cls.digits)
        top, bottom = Fraction(x).as_integer_ratio()
        # Floor division rounds down; of the negative, negated, it rounds up. So below as well.
        return cls((top << cls.digits) // bottom, -((-top << cls.digits) // bottom))

    @property
    def above(self) -> Fraction:
        """The upper end."""
        return Fraction(self.high, 1 << self.digits)

    @property
    def size(self) -> Interval:
        """An upper bound on the absolute value, as an interval of one point."""
        most = max(abs(self.low), abs(self.high))
        return Interval(most, most)

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __add__(self, other: Any) -> Interval:
        other = Interval.of(other)
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Any) -> Interval:
        return self + -Interval.of(other)

    def __mul__(self, other: Any) -> Interval:
        other = Interval.of(other)
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        return Interval(min(ends) >> self.digits, -(-max(ends) >> self.digits))

    def __truediv__(self, other: Any) -> Interval:
        other = Interval.of(other)
        if other.low <= 0 <= other.high:
            raise Refused("a division by what may be zero")
        pairs = [
            (a << self.digits, b) for a in (self.low, self.high) for b in (other.low, other.high)
        ]
        return Interval(min(a // b for a, b in pairs), max(-(-a // b) for a, b in pairs))

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: Any) -> Interval:
        return Interval.of(other) - self

    def __rtruediv__(self, other: Any) -> Interval:
        return Interval.of(other) / self

    def __pow__(self, n: int) -> Interval:
        found = self if n else Interval.of(1)
        for _ in range(abs(n) - 1):
            found = found * self
        return found if n >= 0 else 1 / found


def sqrt(x: Interval) -> Interval:
    """The root of an interval without negative numbers."""
    if x.low < 0:
        raise Refused("a root of what may be negative")
    low, high = (math.isqrt(end << Interval.digits) for end in (x.low, x.high))
    return Interval(low, high + 1)


def hypotenuse(*sides: Any) -> Interval:
    """An upper bound on the root of a sum of squares, the upper end: sides have their largest size.

    The lower end is no bound of anything.
    """
    return sqrt(sum((Interval.of(x).size ** 2 for x in sides), Interval.of(0)))


def larger(a: Interval, b: Interval) -> Interval:
    """The larger one of two numbers."""
    return Interval(max(a.low, b.low), max(a.high, b.high))


def power_series(first: Interval, next_term: Callable[[Interval, int], Interval]) -> Interval:
    """The sum of a series whose terms are each at most half as large as the one before."""
    total, term, k = first, first, 0
    while term.size.high > 1:
        k += 1
        term = next_term(term, k)
        total = total + term
    # What follows adds up to no more than the last term, which is a unit at most.
    return total + Interval(-2, 2)


def arctangent(x: Interval) -> Interval:
    """The arctangent, which rises: from that of the lower end to that of the upper end."""
    low, high = (_arctangent(Interval(end, end)) for end in (x.low, x.high))
    return Interval(low.low, high.high)


def _arctangent(x: Interval) -> Interval:
    """That of a few units: halved twice by atan(x) = 2 atan(x/(1 + sqrt(1 + x^2))), a series."""
    # After two halvings |x| < tan(pi/8), so that terms shrink to a fifth each time. Of a wide
    # interval quotients would be wider than that, and its terms might grow.
    for _ in range(2):
        x = x / (1 + sqrt(1 + x * x))
    square = x * x
    odd = power_series(x, lambda power, k: power * square * Fraction(1 - 2 * k, 2 * k + 1))
    return 4 * odd


def pi() -> Interval:
    """The number pi, as 16 atan(1/5) - 4 atan(1/239)."""
    return _pi(Interval.digits)


@functools.cache
def _pi(_: int) -> Interval:
    # The argument is `Interval.digits`, by which the cache tells one pi from another.
    fifth, other = (_arctangent(Interval.of(Fraction(1, n))) for n in (5, 239))
    return 16 * fifth - 4 * other


def cosine(x: Interval) -> Interval:
    """The cosine: the angle is brought into one turn, divided by 8, and doubled three times.

    Refused where the angle is not known to a turn or so: terms of the series might grow.
    """
    turn = 2 * pi()
    # Any whole number of turns may be taken off; it is one that leaves half a turn at most.
    x = (x - turn * ((x.low + x.high + turn.low) // (2 * turn.low))) / 8
    if x.size.above > 1:
        raise Refused("an angle is too large, or known too coarsely, for its cosine")
    found = power_series(
        Interval.of(1), lambda term, k: -term * (x * x) * Fraction(1, 2 * k * (2 * k - 1))
    )
    # cos(2 x) = 2 cos^2(x) - 1.
    for _ in range(3):
        found = 2 * (found * found) - 1
    return found


def exponential(x: Interval) -> Interval:
    """The exponential of x >= 0: that of x/2^k, which is below 1/2, squared k times."""
    k = max(0, math.ceil(x.above)).bit_length() + 1
    small = x * Fraction(1, 1 << k)
    found = power_series(Interval.of(1), lambda term, j: term * small * Fraction(1, j))
    for _ in range(k):
        found = found * found
    return found


def number(text: str) -> Any:
    """A number as a config writes it: a Fraction if no function or pi is in it, else an Interval.

    Refused for any other text, and for one that would take long to evaluate.
    """
    if not isinstance(text, str) or len(text) > 5000:
        raise Refused("a number is no text, or one of more than 5000 characters")
    try:
        return _value(ast.parse(text.strip(), mode="eval").body, text.strip())
    except (SyntaxError, ValueError, KeyError, ZeroDivisionError, RecursionError, MemoryError):
        raise Refused(f"{text[:60]!r} is no number") from None


def _value(node: Any, text: str) -> Any:
    """The value of a part of an expression, which stands in a text."""
    if isinstance(node, ast.Constant):
        # Digits as written: the float that Python makes of 0.1 is another number than 1/10.
        written = (ast.get_source_segment(text, node) or "").lower()
        if abs(int(written.partition("e")[2] or 0)) > 5000:
            raise Refused("an exponent beyond 5000")
        return Fraction(written)
    if isinstance(node, ast.Name) and node.id == "pi":
        return pi()
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        inner = _value(node.operand, text)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
        return FUNCTIONS[node.func.id](Interval.of(_value(node.args[0], text)))
    if isinstance(node, ast.BinOp):
        a, b = _value(node.left, text), _value(node.right, text)
        if isinstance(node.op, ast.Pow):
            if not isinstance(b, Fraction) or b.denominator != 1 or abs(b) > 5000:
                raise Refused("a power that is not whole, or beyond 5000")
            if _bits(a) * abs(b) > 2**17:
                raise Refused("a power that is too large")
            return a ** int(b)
        return OPERATORS[type(node.op)](a, b)
    raise Refused("an expression of another kind than numbers have")


def _bits(x: Fraction | Interval) -> int:
    """The length of a fraction in bits; of an interval that before the point, which may grow."""
    if isinstance(x, Interval):
        return max(0, x.size.high.bit_length() - Interval.digits)
    return x.numerator.bit_length() + x.denominator.bit_length()


OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}
FUNCTIONS: dict[str, Callable[[Interval], Interval]] = {
    "sqrt": sqrt,
    "atan": arctangent,
    "cos": cosine,
    "sin": lambda x: cosine(x - pi() / 2),
    "tan": lambda x: cosine(x - pi() / 2) / cosine(x),
}


# ---- The problem: constants of the field and the start, as docs/certified.md defines them.


class Problem(NamedTuple):
    """Constants of the field and the start, intervals: M in units of `unit`, t' in those of 1/unit.

    The unit is a power of two.
    """

    lam: Interval
    a: Interval
    b: Interval
    twist: Interval
    """1/(4 lambda)."""
    mu: tuple[Interval, Interval]
    """mu rho_1 and mu rho_2."""
    omega: tuple[Interval, Interval, Interval]
    """omega_1, omega_2 and kappa."""
    start: Sequence[Interval]
    """Q+, Q-, M3, gamma1, gamma2, gamma3 at t' = 0."""
    sigma: Interval
    F: Interval
    """Its upper end is that of the lemma; so is that of Omega."""
    Omega: Interval
    w: Interval
    """The weight, an exact number."""


class Shape(NamedTuple):
    """A body but for its weight."""

    c: Interval
    """cos(alpha0/2), and sin(alpha0/2): of the body's angles only these are needed, roots."""
    s: Interval
    kappa: Interval
    rho: tuple[Interval, Interval]


def shape_of(given: Mapping[str, Any]) -> Shape:
    """The shape that a config's A and r say."""
    if not all(isinstance(given[k], list | tuple) and len(given[k]) == 3 for k in ("A", "r")):
        raise Refused("A or r is not three numbers")
    (A1, A2, A3), (r1, r2, r3) = (map(number, given[key]) for key in ("A", "r"))
    ordered = Interval.of(A1 - A3).low > 0 and Interval.of(A3 - A2).low > 0
    # A cosine that is 0 may be a little less, as far as is known: the formulas hold there too.
    positive = all(Interval.of(x).high >= 0 for x in (r1, r2))
    if not (ordered and Interval.of(A2).low > 0 and r3 == 0 and positive):
        raise Refused("A1 > A3 > A2 > 0 or r1, r2 >= 0 = r3 is broken, or cannot be told")
    c = sqrt(Interval.of(A2 * (A1 - A3) / (A3 * (A1 - A2))))
    s = sqrt(Interval.of(A1 * (A3 - A2) / (A3 * (A1 - A2))))
    length, kappa = sqrt(Interval.of(r1 * r1 + r2 * r2)), Interval.of(A1 * A2 / (A3 * (A1 - A2)))
    return Shape(c, s, kappa, (r1 / length, r2 / length))


def unit_of(J2: Interval) -> Fraction:
    """The largest power of two that is no larger than the upper end, hardly lifted."""
    lifted = J2 * (1 + Fraction(1, 1 << 20))
    return Fraction(1 << lifted.high.bit_length() - 1, 1 << Interval.digits)


def constants_of(body: Shape, mu: Interval, unit: Fraction) -> dict[str, Any]:
    """Constants of the field and of the norm, by their names in a problem, where M is of `unit`."""
    # Of another sign phases would take r for its opposite.
    if mu.low < 0:
        raise Refused("mu >= 0 is broken, or cannot be told")
    c, s, kappa, (rho1, rho2) = body
    lam, two = s * c, sqrt(Interval.of(2))
    a, b, sigma = mu * (s * rho1 - c * rho2), mu * (s * rho1 + c * rho2), lam * two
    omega = (kappa - c * c) / (2 * c), (kappa + s * s) / (2 * s), kappa
    F = larger(hypotenuse(a, b), sigma * mu.size)
    Omega = larger(two * larger(omega[0].size, omega[1].size), kappa.size / sigma)
    # Any weight is valid; without a torque the best one would be infinite.
    lightest = Omega * (unit / 2**16) ** 2
    w = sqrt(Omega / F) if F.low > lightest.high else Interval.of(2**16 / unit)
    found = {"lam": lam, "a": a, "b": b, "mu": (mu * rho1, mu * rho2), "omega": omega}
    return found | {"sigma": sigma, "F": F, "Omega": Omega, "w": Interval(w.low, w.low)}


def start_of(body: Shape, J1: Interval, J2: Interval, theta2_0: Interval, *more: Any) -> list[Any]:
    """The start of two actions and a phase, radians: Q+, Q-, M3, gamma1, gamma2, gamma3.

    `more` are the cosine and the sine of an angle by which the phase is larger.
    """
    c, s, _, (rho1, rho2) = body
    if J1.low <= 0 or (J2 - J1).low <= 0:
        raise Refused("0 < J1_0 < J2_0 is broken, or cannot be told")
    # |M| = J2, and p is its angle above the plane M3 = 0: M3 = J2 sin p. `across` is J2 cos p.
    across = 2 * sqrt(J1 * (J2 - J1))
    sinp, cosp = (2 * J1 - J2) / J2, across / J2
    # The sine and the cosine of (alpha0 + beta0)/2, then of that angle plus theta2.
    sin, cos = s * rho1 + c * rho2, c * rho1 - s * rho2
    for cosu, sinu in ((cosine(theta2_0), FUNCTIONS["sin"](theta2_0)), *([more] if more else [])):
        sin, cos = cosu * sin + sinu * cos, cosu * cos - sinu * sin
    gamma = cos * (sinp * s) + sin * c, cos * (sinp * c) - sin * s, cos * -cosp
    return [across * (2 * s * c), Interval.of(0), 2 * J1 - J2, *gamma]


def problem_of(given: dict[str, Any], theta2_0: Any) -> Problem:
    """The problem of a config's numbers and of a phase, radians."""
    body = shape_of(given)
    mu, h0, J1 = (number(given[key]) for key in ("mu", "h0", "J1_0"))
    J2 = sqrt(Interval.of(2 * h0 / body.kappa))
    unit = unit_of(J2)
    found = constants_of(body, Interval.of(mu / unit**2), Fraction(1))
    start = start_of(body, Interval.of(J1 / unit), J2 / unit, Interval.of(theta2_0))
    return Problem(**found, twist=1 / (4 * found["lam"]), start=start)


# ---- Chebyshev series: lists w of w_0/2 + sum_j w_j T_j, whole numbers.


def slope(w: Sequence[int]) -> list[int]:
    """The series of the derivative, by w'_{j-1} = w'_{j+1} + 2 j w_j."""
    found = [0] * (len(w) + 1)
    for j in range(len(w) - 1, 0, -1):
        found[j - 1] = found[j + 1] + 2 * j * w[j]
    return found[: max(1, len(w) - 1)]


def most(w: Sequence[int]) -> int:
    """A bound on the size over [-1, 1], since |T_j| <= 1; w_0 counts half, rounded up."""
    return (abs(w[0]) + 1) // 2 + sum(map(abs, w[1:]))


def at_end(w: Sequence[int], x: int) -> int:
    """Twice the value at x = -1 or 1, where T_j(x) = x^j."""
    return w[0] + 2 * (sum(w[2::2]) + x * sum(w[1::2]))


def packed(w: Sequence[int], width: int) -> int:
    """Twice the series, as the number that its coefficients of z^-n .. z^n have as digits.

    T_j = (z^j + z^-j)/2, and a digit has `width` bytes.
    """
    both = [*w[:0:-1], *w]
    plus, minus = (
        int.from_bytes(b"".join(max(sign * x, 0).to_bytes(width, "little") for x in both), "little")
        for sign in (1, -1)
    )
    return plus - minus


def unpacked(product: int, degree: int, width: int) -> list[int]:
    """The coefficients of z^0 .. z^degree, from the number that is a product of that degree."""
    places, half = 2 * degree + 1, 1 << (8 * width - 1)
    # Half of a digit's range is added to each, so that none is negative.
    raised = product + int.from_bytes(half.to_bytes(width, "little") * places, "little")
    digits = raised.to_bytes(width * places + 1, "little")
    return [
        int.from_bytes(digits[k * width : (k + 1) * width], "little") - half
        for k in range(degree, places)
    ]


def values(w: Sequence[int], bits: int, parts: int) -> list[int]:
    """Values at the middles of equal parts, rounded down once, to units of 2^-FINE.

    The number of parts is a power of two.
    """
    n, shift, found = len(w) - 1, parts.bit_length() - 1, []
    for k in range(parts):
        # Clenshaw's recurrence at x = p/parts, multiplied by a power of `parts` at each term.
        p, ahead, here = 2 * k + 1 - parts, 0, 0
        for j in range(n, 0, -1):
            ahead, here = here, (w[j] << shift * (n - j)) + 2 * p * here - (ahead << 2 * shift)
        twice = (w[0] << shift * n) + 2 * (p * here - (ahead << 2 * shift))
        found.append((twice << FINE) >> (bits + 1 + shift * n))
    return found


def on_parts(w: Sequence[int], bits: int, parts: int) -> Callable[[int], tuple[int, int]]:
    """A function of a part: lower and upper bound on the values there, in units of 2^-FINE."""
    middles = values(w, bits, parts)
    # From the middle of a part to its end x goes by 1/parts, and the value by the slope times it.
    away = -((-most(slope(w)) << FINE) // (parts << bits)) + 1
    return lambda k: (middles[k] - away, middles[k] + 1 + away)


# ---- The hypotheses.


class Step(NamedTuple):
    """A step: half its length in units of 2^-CLOCK, bits, and six series of whole numbers."""

    half: int
    bits: int
    series: Sequence[Sequence[int]]


def norm(problem: Problem, difference: Sequence[Any]) -> Interval:
    """The norm of a difference of states; its upper end is a bound."""
    p, q, s, *g = (Interval.of(x) for x in difference)
    return hypotenuse(p, q, problem.sigma * s, *(x / problem.w for x in g))


def defect(problem: Problem, step: Step) -> list[Fraction]:
    """H2: bounds on the size of each component of D = P' - tau f(P)."""
    bits, degree = step.bits, 2 * (len(step.series[0]) - 1)
    # A digit holds any coefficient of a product: degree + 1 products of numbers that are at most
    # twice the largest each, and a sign.
    largest = max(abs(x) for w in step.series for x in w) or 1
    width = (2 * largest.bit_length() + (degree + 1).bit_length() + 12) // 8 + 1
    Qp, Qm, M3, g1, g2, g3 = (packed(w, width) for w in step.series)
    S, D = Qp + Qm, Qp - Qm

    def product(x: int, y: int) -> list[int]:
        return unpacked(x * y, degree, width)

    # Products of doubled series are those of 2 P Q, in units of 2^-(2 bits): P Q itself is in units
    # of 2^-(2 bits + 1), in which the single components are written as well.
    alone = [[x << (bits + 1) for x in w] for w in step.series[3:]]
    turned = {
        (i, j): product(g, M)
        for i, g in enumerate((g1, g2, g3))
        for j, M in enumerate((S, D, M3))
        if i != j
    }
    o1, o2, kappa = problem.omega
    # f as sums of constants times series, component by component.
    field = (
        [(-problem.lam, product(M3, Qp)), (problem.a, alone[2])],
        [(problem.lam, product(M3, Qm)), (-problem.b, alone[2])],
        [
            (problem.twist, product(S, D)),
            (problem.mu[1], alone[0]),
            (-problem.mu[0], alone[1]),
        ],
        [(kappa, turned[1, 2]), (-o2, turned[2, 1])],
        [(o1, turned[2, 0]), (-kappa, turned[0, 2])],
        [(o2, turned[0, 1]), (-o1, turned[1, 0])],
    )
    # All is formed exactly in units of 2^-scale, with the lower end of each constant; what a
    # constant may be more is bounded apart.
    scale = 2 * bits + 1 + Interval.digits + CLOCK
    sizes = []
    for w, terms in zip(step.series, field, strict=True):
        found = [x << (scale - bits) for x in slope(w)] + [0] * (degree + 2 - len(w))
        doubt = 0
        for factor, series in terms:
            for j, x in enumerate(series):
                found[j] -= step.half * factor.low * x
            doubt += step.half * (factor.high - factor.low) * most(series)
        sizes.append(Fraction(most(found) + doubt, 1 << scale))
    return sizes


def grown(
    p: Any,
    sizes: Sequence[Interval],
    half: Fraction,
    begin: Fraction,
    away: Fraction,
    widest: Fraction,
    name: str,
) -> tuple[Fraction, Fraction]:
    """A bound on the distance over a step, less than the radius of a tube, and its growth's factor.

    `sizes` bound |M3| on equal parts, and `half` half of the length. Growth from `begin` on is
    bounded at `away` times the radius from the polynomials: 1 at the orbits themselves. Radii are
    tried until one holds; Fails under `name` if the widest does not.
    """
    radius = min(4 * begin, widest)
    while True:
        E = away * Interval.of(radius)
        k = p.w * p.F + (1 + p.w * E) * (p.Omega / p.w)
        # Twice the rates, and half of the duration of a part.
        rates, beside = Interval.of(0), E / p.sigma
        for m in sizes:
            steep = p.lam * (m + beside)
            rates += steep + hypotenuse(steep, k)
        growth = rates * (half / len(sizes))
        # No bound is less than 2^-digits: what grows so far would exceed any tube.
        if growth.above > Interval.digits:
            raise Fails(f"{name}: a bound that grows by more than exp({Interval.digits})")
        factor = exponential(growth)
        found = (factor * begin).above
        if found < radius:
            return found, factor.above
        if radius == widest:
            raise Fails(f"{name}: {about(found)} at the end, and {about(widest)} is the most")
        radius = min(2 * found, widest)


class Walk:
    """The proof of an orbit, step by step: the crossings, and the bound on the distance."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.separatrices = problem, list[int]()
        self.bound = Interval.of(0)
        self.end: Sequence[Any] = problem.start

    def take(self, step: Step) -> None:
        """Check H1 to H5 on the next step; Fails where one is not shown."""
        if step.half <= 0:
            raise Fails("H2: the length of a step is not positive")
        bits = step.bits
        begin, end = ([Fraction(at_end(w, x), 2 << bits) for w in step.series] for x in (-1, 1))
        gap = [x - y for x, y in zip(begin, self.end, strict=True)]
        epsilon = (self.bound + norm(self.problem, gap)).above
        if epsilon >= WIDEST:
            raise Fails(f"H1: {about(epsilon)} where two steps join, and {WIDEST} is the most")
        delta = norm(self.problem, defect(self.problem, step)).above
        if epsilon + 2 * delta >= WIDEST:
            raise Fails(f"H2: a defect of {about(delta)} is too large")
        # Finer parts cost more: they are tried only where coarse ones leave a sign in doubt.
        for parts in PARTS:
            M3 = on_parts(step.series[2], bits, parts)
            bound = self.tube(step, epsilon + 2 * delta, M3, parts)
            try:
                crossed = list(self.signs(step, M3, bound, parts))
                break
            except Fails:
                if parts == PARTS[-1]:
                    raise
        self.bound, self.end = Interval.of(bound), end
        self.separatrices += crossed

    def tube(
        self, step: Step, begin: Fraction, M3: Callable[[int], tuple[int, int]], parts: int
    ) -> Fraction:
        """H3: the bound B on the distance over the step; `begin` is epsilon + 2 delta."""
        ends = map(M3, range(parts))
        sizes = [Interval.of(Fraction(max(-low, high), 1 << FINE)) for low, high in ends]
        of = sizes, Fraction(step.half, 1 << CLOCK), begin
        return grown(self.problem, *of, Fraction(1, 2), WIDEST, "H3")[0]

    def signs(
        self, step: Step, M3: Callable[[int], tuple[int, int]], bound: Fraction, parts: int
    ) -> Iterator[int]:
        """H4 and H5: the separatrices beside which the orbit crosses on the step, in order."""
        away = math.ceil((bound / self.problem.sigma).above * (1 << FINE))
        sides = [(low > away) - (high < -away) for low, high in map(M3, range(parts))]
        if not (sides[0] and sides[-1]):
            raise Fails("H4: the sign of M3 is not told at an end of the step")
        known = [k for k, side in enumerate(sides) if side]
        for before, after in pairwise(known):
            if after - before > 1 and sides[before] == sides[after]:
                raise Fails("H4: M3 comes too near zero without crossing it")
            if sides[before] != sides[after]:
                yield self.crossing(step, range(before + 1, after), bound, parts, sides[after])

    def crossing(self, step: Step, run: range, bound: Fraction, parts: int, rising: int) -> int:
        """H5: the separatrix of the one crossing on a run of parts."""
        p, bits = self.problem, step.bits
        wide = Fraction(sum(most(w) for w in step.series[:2]), 1 << bits) + bound
        rate = 2 * wide * p.twist + hypotenuse(*p.mu) * p.w
        apart = rate * bound * Fraction(step.half, 1 << CLOCK) + bound / p.sigma
        slopes = on_parts(slope(step.series[2]), bits, parts)
        if min(_least(slopes(k), rising) for k in run) <= math.ceil(apart.above * (1 << FINE)):
            raise Fails("H5: M3 crosses zero too slowly for it to be one crossing")
        Q, near = step.series[0 if rising > 0 else 1], math.ceil(bound * (1 << FINE))
        large = on_parts(Q, bits, parts)
        for sign in (1, -1):
            if min(_least(large(k), sign) for k in run) > near:
                return {(1, 1): 2, (1, -1): 4, (-1, -1): 1, (-1, 1): 3}[rising, sign]
        raise Fails("H5: Q is too near zero at a crossing to tell its separatrix")


def about(bound: Fraction) -> str:
    """Three digits of a bound; of a large one, which no double may hold, that it is large."""
    return f"{float(bound):.3g}" if bound < 10**6 else "more than 1e+06"


def _least(ends: tuple[int, int], sign: int) -> int:
    return ends[0] if sign > 0 else -ends[1]


def symbol(before: int, after: int) -> int:
    """The symbol: 0 if the next separatrix is one less in the circle 1 2 3 4, 1 if one more."""
    return {3: 0, 1: 1}.get((after - before) % 4, NONE)


class Proof(NamedTuple):
    """The symbols that steps prove of an orbit."""

    symbols: list[int]
    reason: str
    """The step and the hypothesis that fails; empty where none does."""


def prove(given: dict[str, Any], theta2_0: str, steps: Sequence[Step]) -> Proof:
    """Check the steps of the orbit of a config's numbers, from a phase as a text.

    Everything is enclosed anew, in digits that are enough for the finest step.
    """
    Interval.digits = 2 * max((step.bits for step in steps), default=64) + 256
    walk, reason = Walk(problem_of(given, number(theta2_0))), ""
    for k, step in enumerate(steps, 1):
        try:
            walk.take(step)
        except Fails as error:
            reason = f"step {k}: {error}"
            break
    beside = walk.separatrices
    return Proof([symbol(a, b) for a, b in pairwise(beside)], reason)


# ---- The file: the orbits it is about, and its sizes, which its length bounds.


def phases_of(config: dict[str, Any], stated: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """The phases of each array as expressions, which the config alone tells.

    Only the centre of a zoom, which a computation finds, is taken as the file states it.
    """
    problem: Any = config["problem"]
    found: dict[str, list[str]] = {}
    if config["experiment"] == "route_codes":
        for name, grid in problem["arrays"].items():
            start, step = _quoted(grid["start"]), _quoted(grid["step"])
            _check_few(found)
            found[name] = [f"{start} + {step}*{k}" for k in _counted(grid["count"])]
    elif config["experiment"] == "herpolhodes":
        found = {name: [case["theta2_0"]] for name, case in problem["cases"].items()}
    elif config["experiment"] == "route_zoom":
        names = [f"level{k:02d}" for k in _counted(problem["levels"])]
        for level, name in enumerate(names):
            step = f"{_quoted(problem['step'])}/{_quoted(problem['factor'])}**{level}"
            _check_few(found)
            first = _quoted(stated[name][0] if len(stated.get(name, ())) else "0")
            found[name] = [f"{first} + {step}*{k}" for k in _counted(problem["count"])]
    else:
        raise Refused(f"its config: no route codes in {str(config['experiment'])[:60]!r}")
    return found


def _quoted(text: str) -> str:
    """A number in brackets, for an expression; refused if it is none without them.

    A text such as "1) + (2" would be one within them.
    """
    number(text)
    return f"({text})"


def _count(value: Any) -> int:
    """A positive integer of a config, of a million at most; refused if it is none."""
    # To Python True is an integer.
    if isinstance(value, bool) or not isinstance(value, int) or not 0 < value <= 10**6:
        raise Refused("its config: a count is no whole number, or too large")
    return value


def _check_few(found: Mapping[str, Sequence[str]]) -> None:
    """Refuse more orbits than a certificate has, before phases of a further array are made."""
    if sum(map(len, found.values())) > ORBITS:
        raise Refused(f"its config asks for more than {ORBITS} orbits")


def _counted(value: Any) -> range:
    """The numbers from 0 up to a count of orbits of a config."""
    if _count(value) > ORBITS:
        raise Refused(f"its config asks for more than {ORBITS} orbits")
    return range(value)


FIELDS = {
    "theta2_0": ("rad", 1, "S"),
    "codes": ("1", 2, "iu"),
    "steps": ("1", 1, "iu"),
    "half_lengths": ("2^-32", 1, "iu"),
    "step_bits": ("bit", 1, "iu"),
    "terms": ("1", 1, "iu"),
    "widths": ("byte", 1, "iu"),
    "digits": ("1", 1, "iu"),
}
"""Unit, number of dimensions and kind of the fields of an array."""


def read(path: Path) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """The config of a certificate and the fields of its arrays; refused if they are none."""
    import h5py

    length = path.stat().st_size
    try:
        with h5py.File(path) as file:
            bounded(file, length)
            config = json.loads(file["config"].asstr()[()])
            arrays = {name: _fields(group, name) for name, group in file["data"].items()}
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        raise Refused(f"it cannot be read: {str(error)[:200]}") from None
    count = sum(fields["half_lengths"].size for fields in arrays.values())
    if count * EACH > length:
        raise Refused(f"{count} steps are more than {length} bytes can prove")
    if set(config) != {"experiment", "problem"} or not isinstance(config["problem"], dict):
        raise Refused("its config does not say an experiment and a problem, and no more")
    return config, arrays


def bounded(file: Any, length: int) -> None:
    """Refuse another format, arrays in other files, and too many bytes, before any is read."""
    import h5py

    version = file.attrs.get("format_version")
    if isinstance(version, str) or str(version) != "1":
        raise Refused(f"its format version is {str(version)[:60]!r}, and the number 1 is read")
    waiting, left = [("", file)], RATIO * length + SPARE
    while waiting:
        place, group = waiting.pop()
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise Refused(f"{place}/{name} is a link to somewhere else")
            node = group[name]
            if isinstance(node, h5py.Group) and place.count("/") < 2:
                waiting.append((f"{place}/{name}", node))
            elif not isinstance(node, h5py.Dataset) or node.external or node.is_virtual:
                raise Refused(f"{place}/{name} is no array of this file")
            else:
                left -= node.size * node.dtype.itemsize
                if left < 0:
                    raise Refused(f"{place}/{name} is too large for the length of the file")


def _fields(group: Any, name: str) -> dict[str, Any]:
    """The fields of an array, as they are stored, if they have the units, shapes and kinds."""
    if set(group) != set(FIELDS):
        odd = min(set(group) ^ set(FIELDS))
        raise Refused(f"{name}: {odd} is absent, or no part of a certificate")
    found = {}
    for field, (unit, dimensions, kinds) in FIELDS.items():
        node = group[field]
        if (
            node.attrs.get("units") != unit
            or node.ndim != dimensions
            or node.dtype.kind not in kinds
        ):
            raise Refused(f"{name}: {field} has another unit, shape or kind")
        found[field] = node[()]
    return found


def steps_of(fields: dict[str, Any]) -> list[list[Step]]:
    """The steps of each orbit of an array; refused where its numbers do not fit each other."""
    names = ("steps", "half_lengths", "step_bits", "terms", "widths")
    counts, halves, bits, terms, widths = (list(map(int, fields[x])) for x in names)
    # Numbers less 1 are those that must not be 0.
    for what, found, top in (
        ("steps", counts, STEPS),
        ("half_lengths", [x - 1 for x in halves], 2**62),
        ("step_bits", [x - 1 for x in bits], BITS),
        ("terms", [x - 1 for x in terms], TERMS),
        ("widths", [x - 1 for x in widths], BITS // 4),
    ):
        if found and not 0 <= min(found) <= max(found) <= top:
            raise Refused(f"{what} are out of range")
    sizes = (len(bits), len(terms), sum(counts), len(widths), len(fields["digits"]))
    if sizes != (len(halves), len(halves), len(halves), 6 * sum(terms), sum(widths)):
        raise Refused("steps, widths and digits are not as many as they say")
    content, at = bytes(fields["digits"].astype("u1")), 0
    numbers = []
    for width in widths:
        numbers.append(int.from_bytes(content[at : at + width], "little", signed=True))
        at += width
    rest = iter(numbers)
    steps = (
        Step(half, fine, [[next(rest) for _ in range(n)] for _ in range(6)])
        for half, fine, n in zip(halves, bits, terms, strict=True)
    )
    return [[next(steps) for _ in range(n)] for n in counts]


def same(a: str, b: str) -> bool:
    """True if two texts say one number; where one is not rational, they agree to 2 BITS digits."""
    # An action may be as small as 1e-500, and a phase decide by as many digits as steps have.
    Interval.digits = 2 * BITS + 256
    try:
        x, y = number(a), number(b)
    except Refused:
        # Words, such as the name of an experiment.
        return False
    if isinstance(x, Fraction) and isinstance(y, Fraction):
        return x == y
    apart = Interval.of(x - y)
    return apart.size.high < 1 << 256


def stated_by(path: Path) -> dict[str, Any]:
    """The experiment and the problem of a YAML config, numbers as texts; refused if it is none."""
    import yaml

    try:
        config = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)
        return {key: config[key] for key in ("experiment", "problem")}
    except (yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError):
        raise Refused(f"{path} is no config of an experiment and a problem") from None


def check_against(config: Any, other: Any, place: str = "") -> None:
    """Refuse a config that has other numbers or keys than a given one; `place` is said in words."""
    if isinstance(config, dict) and isinstance(other, dict):
        if set(config) != set(other):
            odd = min(set(config) ^ set(other))
            raise Refused(f"{place}{odd} is in one of the two configs only")
        for key in config:
            check_against(config[key], other[key], f"{place}{key}.")
    elif isinstance(config, list) and isinstance(other, list) and len(config) == len(other):
        for k, (a, b) in enumerate(zip(config, other, strict=True)):
            check_against(a, b, f"{place}{k}.")
    elif str(config) != str(other) and not same(str(config), str(other)):
        raise Refused(f"{place[:-1]} is {config}, and {other} in the config given")


def check(path: Path, given: Path | None = None, processes: int = 1) -> Iterator[str]:
    """Say of each orbit what is proven.

    Raises
    ------
    Refused
        Something that the certificate claims is not proven by it.
    """
    config, arrays = read(path)
    if given:
        check_against(config, stated_by(given))
    # The bytes may be anybody's: what is no phase is refused where it is compared.
    stated = {
        name: [x.decode("ascii", "replace") for x in fields["theta2_0"]]
        for name, fields in arrays.items()
    }
    try:
        expected = phases_of(config, stated)
        problem = {key: config["problem"][key] for key in ("A", "r", "mu", "h0", "J1_0")}
        symbols = _count(config["problem"]["n_symbols"])
    except (KeyError, TypeError, AttributeError) as error:
        raise Refused(f"its config lacks something: {error!r}") from None
    if set(expected) != set(arrays):
        odd = min(set(expected) ^ set(arrays))
        raise Refused(f"{odd}: the config and the file do not have the same arrays")
    claims = 0
    for name, phases in expected.items():
        codes = arrays[name]["codes"]
        if codes.shape != (symbols, len(phases)) or symbols > SYMBOLS:
            raise Refused(f"{name}: its config asks for {symbols} symbols of {len(phases)} orbits")
        if {len(stated[name]), len(arrays[name]["steps"])} != {len(phases)}:
            raise Refused(f"{name}: theta2_0 or steps are not of {len(phases)} orbits")
        for column, (text, phase) in enumerate(zip(stated[name], phases, strict=True)):
            if not same(text, phase):
                raise Refused(f"{name}: theta2_0 of column {column} is {text[:60]}, not {phase}")
        steps = steps_of(arrays[name])
        work = _each(prove, [problem] * len(phases), phases, steps, processes)
        # Strict: if a proof were missing, the symbols claimed of its column would not be compared.
        for column, proof in zip(range(len(phases)), work, strict=True):
            claimed = [int(x) for x in codes[:, column]]
            claims += sum(x != NONE for x in claimed)
            for k, code in enumerate(claimed):
                if code != NONE and proof.symbols[k : k + 1] != [code]:
                    why = proof.reason or "the steps prove another one, or end before it"
                    raise Refused(f"{name}: column {column}: symbol {k + 1} is not proven: {why}")
            told = sum(x != NONE for x in claimed)
            yield f"{name}: theta2_0 = {stated[name][column]}: {told} of {symbols} symbols proven"
    yield f"proven: {claims} symbols, all that the certificate claims"


def _each(
    work: Callable[..., Proof], a: Sequence[Any], b: Sequence[Any], c: Sequence[Any], processes: int
) -> Iterator[Proof]:
    """The results of work on each triple, in order, as soon as they are there."""
    if processes == 1:
        yield from map(work, a, b, c)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(work, a, b, c)


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a certificate; the exit code is 0 where all that it claims is proven."""
    return answered(arguments, __doc__, check)


def answered(
    arguments: Sequence[str] | None,
    document: str | None,
    check: Callable[..., Iterable[str]],
    *,
    alone: bool = False,
) -> int:
    """Check a file as a command line asks, and print what it proves; the exit code is 0 if it does.

    `check` takes the file, a config or None and, unless `alone`, the number of processes.
    """
    parser = argparse.ArgumentParser(description=(document or "").partition("\n")[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--config", type=Path, help="a YAML config that it is to be of")
    if not alone:
        parser.add_argument("-j", "--processes", type=int, default=1)
    given = vars(parser.parse_args(arguments))
    try:
        for line in check(*given.values()):
            print(line, flush=True)
    except (Refused, Fails, OSError) as error:
        print(f"{given['file']}: not proven: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
