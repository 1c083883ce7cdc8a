"""Taylor series in fixed-point integers, of any precision.

A number x is the integer x 2^P. The operations are those of the traced aligned field, as in the
kernel; the two share no arithmetic, and so check each other. Products of series are online
(relaxed) products by FLINT's polynomials: when half of the coefficients in a range of orders are
known, one product adds all that they contribute to the other half (van der Hoeven, J. Symb. Comput.
34 (2002), 479-542). Short ranges are summed term by term.
"""

import functools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from operator import mul
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits.integrate import in_unit
from rigidpend.orbits.integrate.kernel.tape import ALIGNED
from rigidpend.orbits.integrate.step_crossings import crossings_of_series

NATS_PER_ORDER = 1.2
"""Nats by which an order reduces the error: the cheapest of 1.0 to 2.4, from 448 to 704 bits.

If the cost of a series grew as the square of its orders, two nats would be cheapest; products of
whole series cost less."""
SHRINK = math.exp(-NATS_PER_ORDER)
"""Ratio of a step to the radius of convergence."""
LONGEST = NATS_PER_ORDER
"""Logarithm of the largest radius of convergence that is accepted.

Where the last coefficients are zero in P bits, those left out are below 2^-P on a step of length
one, but not on a longer one. A step twice as long lost two thirds of the digits."""
LENGTH_BITS = 40
"""Fractional bits of a step's length, so few that it is a double too."""
SHORT = 16
"""Orders that are summed term by term: products of fewer take longer below some 300 bits."""


class IntegerStep(NamedTuple):
    """A step of an orbit, with M in units of `unit` and time in units of its inverse.

    Times from the step's beginning are integers with P fractional bits.
    """

    series: list[list[int]]
    """Series of the six components in the time from the beginning, integers of FLINT."""
    begin: int
    length: int
    P: int
    """Fractional bits of all of these integers."""
    unit: Fraction

    def time(self, since: int) -> Fraction:
        """Time t' since the orbit's start, from a time since the step's beginning."""
        return Fraction(self.begin + since, 1 << self.P) / self.unit

    def parts(self, count: int) -> list[int]:
        """Times from the beginning to the ends of `count` parts of the step.

        They have `LENGTH_BITS` fractional bits, so that each is a double too.
        """
        coarse = self.P - LENGTH_BITS
        return [self.length * k // count >> coarse << coarse for k in range(1, count + 1)]

    def since_begin(self, time: Fraction) -> int:
        """The inverse of :meth:`time`."""
        return fixed(time * self.unit, self.P) - self.begin

    def at(self, since: int) -> tuple[Fraction, ...]:
        """The six aligned components, Fractions, at a time from the beginning."""
        there = [Fraction(value_at(one, since, self.P), 1 << self.P) for one in self.series]
        return (*(x * self.unit for x in there[:3]), *there[3:])

    def crossings(self, length: int, depth: float) -> Iterator[tuple[float, int]]:
        """`step_crossings.crossings_of_series` on the step up to `length`, decided in integers.

        `depth` is the depth up to which a touch of M3 = 0 is not decided, relative to |M|.
        """
        # Doubles isolate the zeros; integers find each of them by bisection, and decide touches.
        size, one = length / (1 << self.P), 1 << self.P
        shares = [[int(x) / one * size**k for k, x in enumerate(row)] for row in self.series[:3]]
        M3 = self.series[2]
        return crossings_of_series(
            np.array(shares),
            depth * math.hypot(*(row[0] for row in shares)),
            lambda share: value_at(M3, int(Fraction(share) * length), self.P) / one,
        )


def steps(
    coefficients: AlignedCoefficients, state: Sequence[Fraction], bits: int
) -> Iterator[IntegerStep]:
    """Follow an orbit of the aligned field without end, in steps that the series decide.

    Coefficients and state are Fractions. `bits` are relative to the smallest component of the state
    and to the smallest coefficient.
    """
    unit, c, here = in_unit(coefficients, state)
    # Fixed point has an absolute error, so that the smallest number decides the fractional bits.
    smallest = min(abs(x) for x in (*here, *c) if x)
    leading_zeros = smallest.denominator.bit_length() - smallest.numerator.bit_length()
    P = bits + GUARD_BITS + max(0, leading_zeros)
    flow, now, time = _Flow([fixed(x, P) for x in c], P), [fixed(x, P) for x in here], 0
    while True:
        series, length = flow.expand(now)
        yield IntegerStep(series, time, length, P, unit)
        now, time = [value_at(one, length, P) for one in series], time + length


def fixed(x: Fraction, P: int) -> int:
    """The integer that stands for a number, with P fractional bits, rounded down."""
    return (x.numerator << P) // x.denominator


def value_at(series: Sequence[int], at: int, P: int) -> int:
    """Value of a series at a point by Horner's rule, all with P fractional bits."""
    # Converted to FLINT's type once, and not at each product.
    total, at = 0, type(series[0])(at)
    for term in reversed(series):
        total = (total * at >> P) + term
    return int(total)


class _Flow:
    """Solver of the aligned field in series of one precision."""

    def __init__(self, coefficients: Sequence[int], P: int) -> None:
        # Imported here, for most computations need no integers.
        from flint import fmpz, fmpz_poly

        self.integer, self.polynomial = fmpz, fmpz_poly
        # So many orders reduce the truncation error by P bits.
        self.P, self.order = P, math.ceil(P * math.log(2) / NATS_PER_ORDER) + 1
        lines = [(i, *line) for i, line in enumerate(ALIGNED.lines)]
        self.components = [i for i, name, _ in lines if name == "component"]
        self.sums = [(i, *ALIGNED.lines[i].operands) for i in ALIGNED.sums]
        self.numbers = {i: fmpz(coefficients[x[0]]) for i, name, x in lines if name == "parameter"}
        self.others = [line for line in lines if line[1] in ("plus", "minus", "times")]

    def expand(self, state: Sequence[int]) -> tuple[list[list[int]], int]:
        """The Taylor series of the orbit from a state, and the length of the step.

        The length is `SHRINK` times the radius of convergence that the last two orders tell.
        """
        self.terms: list[list[Any]] = [[] for _ in ALIGNED.lines]
        for line, value in zip(self.components, state, strict=True):
            self.terms[line].append(self.integer(value))
        self.known: dict[int, list[Any]] = {i: [0] * (self.order + 1) for i, *_ in self.sums}
        """Contributions to the coefficients of products that are already added up, 2 P bits."""
        self.head = functools.cache(lambda i, count: self.polynomial(self.terms[i][:count]))
        """Beginnings of series as polynomials, by line and length: several products need them."""
        self._solve(0, self.order)
        # What it holds refers to this object, so that nothing would free it before long.
        self.head.cache_clear()
        series = [self.terms[line] for line in self.components]
        radius = min(
            math.exp(min(LONGEST, -_log(max(abs(int(s[k])) for s in series), self.P) / k))
            for k in (self.order - 1, self.order)
        )
        return series, int(radius * SHRINK * 2**LENGTH_BITS) << (self.P - LENGTH_BITS)

    def _solve(self, first: int, end: int) -> None:
        """Find all lines' coefficients of orders first to end - 1, and the components' of `end`.

        At the call `known` holds, for each order of the range, those terms of the products whose
        factors are both of orders below `first`.
        """
        if end - first <= SHORT:
            check_stop()
            for k in range(first, end):
                self._next_order(k, first)
            return
        middle = (first + end + 1) // 2
        self._solve(first, middle)
        # The new coefficients, of orders from `first` to middle - 1, contribute to the orders from
        # `middle` to end - 1 with those of the other factor below order end - first. These are
        # known, for end - first <= first, except where first = 0: there those below `middle` are.
        count = end - first if first else middle
        new = functools.cache(lambda i: self.polynomial(self.terms[i][first:middle]))
        for i, a, b in self.sums:
            # Coefficient n of these products belongs to order first + n.
            total = new(a).mul_low(self.head(b, count), end - first)
            if first:
                # New orders of a with the beginning of b, and conversely. Two new ones belong to
                # the order 2 first or more, which is not below `end`.
                total += self.head(a, count).mul_low(new(b), end - first)
            here = self.known[i]
            for k, more in enumerate(total.coeffs()[middle - first :], middle):
                here[k] += more
        self._solve(middle, end)

    def _next_order(self, k: int, first: int) -> None:
        """Find the coefficients of order k; terms with both factors before `first` are `known`."""
        terms, P = self.terms, self.P
        for i, name, (x, y) in self.others:
            b = terms[y]
            if i in self.known:
                a = terms[x]
                # The terms in which one factor is of an order from `first` to k: a's, then b's.
                total = self.known[i][k] + sum(map(mul, a[first:], b[k - first :: -1]))
                if first:
                    total += sum(map(mul, b[first:], a[k - first :: -1]))
                terms[i].append(total >> P)
            elif name == "times":
                terms[i].append(self.numbers[x] * b[k] >> P)
            else:
                terms[i].append(terms[x][k] + b[k] if name == "plus" else terms[x][k] - b[k])
        for line, rate in zip(self.components, ALIGNED.rates, strict=True):
            terms[line].append(terms[rate][k] // (k + 1))


def _log(x: int, P: int) -> float:
    """ln(x 2^-P), very small for 0."""
    return math.log(x) - P * math.log(2) if x else -math.inf
