"""Taylor series in fixed-point integers, of any precision.

A number x is the integer x 2^P. What is done is the tape of the aligned field, as in the kernel,
with which the integers share no arithmetic, so that the two check each other. A product of two
series takes FLINT's products of polynomials: where half of the coefficients in a range are known,
one product adds all that they contribute to the other half (van der Hoeven, J. Symb. Comput. 34
(2002), 479-542). Short ranges are summed term by term.
"""

from __future__ import annotations

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
from rigidpend.orbits.integrate.passages import crossings_of_series

GAIN = 1.2
"""Nats that an order gains: the cheapest choice of 1.0 to 2.4 from 448 to 704 bits.

Two would be, did an order cost as much as all before it; products of whole series cost less."""
SHRINK = math.exp(-GAIN)
"""Step over radius of convergence."""
LONGEST = 2.0
"""The logarithm of the largest radius that is believed: a series may end in zeros."""
LENGTH_BITS = 40
"""Bits of a step's length behind the point: it is a double too."""
SHORT = 16
"""Orders that are summed term by term: below some 300 bits products of fewer take longer."""

State = tuple[Fraction, ...]


class IntegerStep(NamedTuple):
    """A step of an orbit, with M in units of `unit` and time in units of its inverse."""

    series: list[list[int]]
    """Series of the six components, in powers of the time from the beginning, FLINT's integers."""
    begin: int
    length: int
    P: int
    """Fractional bits of all these."""
    unit: Fraction

    def time(self, since: int) -> Fraction:
        """Time t' since the orbit's start, from one since the step's beginning."""
        return Fraction(self.begin + since, 1 << self.P) / self.unit

    def parts(self, count: int) -> list[int]:
        """Times from the beginning to the ends of so many parts, which are doubles too."""
        coarse = self.P - LENGTH_BITS
        return [self.length * k // count >> coarse << coarse for k in range(1, count + 1)]

    def since_begin(self, time: Fraction) -> int:
        """The inverse of :meth:`time`."""
        return fixed(time * self.unit, self.P) - self.begin

    def at(self, since: int) -> State:
        """The six aligned components at a time from the beginning."""
        there = [Fraction(value_at(one, since, self.P), 1 << self.P) for one in self.series]
        return (*(x * self.unit for x in there[:3]), *there[3:])

    def crossings(self, length: int, depth: float) -> Iterator[tuple[float, int]]:
        """`passages.crossings_of_series` on a part of the step, decided in integers.

        `depth` is that of a touch of M3 = 0 that is not decided, relative to |M|.
        """
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
    """Follow an orbit of the aligned field, step by step of natural length, for ever.

    All numbers are Fractions; `bits` are relative to the smallest component of the state.
    """
    unit, c, here = in_unit(coefficients, state)
    smallest = min(abs(x) for x in (*here, *c) if x)
    leading_zeros = smallest.denominator.bit_length() - smallest.numerator.bit_length()
    P = bits + GUARD_BITS + max(0, leading_zeros)
    flow, now, time = _Flow([fixed(x, P) for x in c], P), [fixed(x, P) for x in here], 0
    while True:
        series, length = flow.expand(now)
        yield IntegerStep(series, time, length, P, unit)
        now, time = [value_at(one, length, P) for one in series], time + length


def fixed(x: Fraction, P: int) -> int:
    """The integer that stands for a number."""
    return (x.numerator << P) // x.denominator


def value_at(series: Sequence[int], at: int, P: int) -> int:
    """A series at a place, all with P fractional bits, by Horner's rule."""
    total, at = 0, type(series[0])(at)
    for term in reversed(series):
        total = (total * at >> P) + term
    return int(total)


class _Flow:
    """The aligned field over series of one precision."""

    def __init__(self, coefficients: Sequence[int], P: int) -> None:
        # Imported where integers serve.
        from flint import fmpz, fmpz_poly

        self.integer, self.polynomial = fmpz, fmpz_poly
        self.P, self.order = P, math.ceil(P * math.log(2) / GAIN) + 1
        lines = [(i, *line) for i, line in enumerate(ALIGNED.lines)]
        self.components = [i for i, name, _ in lines if name == "component"]
        self.sums = [(i, *ALIGNED.lines[i].operands) for i in ALIGNED.sums]
        self.numbers = {i: fmpz(coefficients[x[0]]) for i, name, x in lines if name == "parameter"}
        self.others = [line for line in lines if line[1] in ("plus", "minus", "times")]

    def expand(self, state: Sequence[int]) -> tuple[list[list[int]], int]:
        """The Taylor series of the orbit from a state, and the step that they carry.

        It is inside the radius of convergence, which the last two orders tell.
        """
        self.terms: list[list[Any]] = [[] for _ in ALIGNED.lines]
        for line, value in zip(self.components, state, strict=True):
            self.terms[line].append(self.integer(value))
        self.known = {i: [0] * (self.order + 1) for i, *_ in self.sums}
        """Parts of the coefficients of products that are already added up."""
        self.heads: dict[tuple[int, int], Any] = {}
        """Beginnings of series as polynomials, which several products need."""
        self._solve(0, self.order)
        series = [self.terms[line] for line in self.components]
        radius = min(
            math.exp(min(LONGEST, -_log(max(abs(int(s[k])) for s in series), self.P) / k))
            for k in (self.order - 1, self.order)
        )
        return series, int(radius * SHRINK * 2**LENGTH_BITS) << (self.P - LENGTH_BITS)

    def _solve(self, first: int, end: int) -> None:
        """Find the coefficients of all lines of these orders, and components' of the next."""
        if end - first <= SHORT:
            check_stop()
            for k in range(first, end):
                self._next_order(k, first)
            return
        middle = (first + end + 1) // 2
        self._solve(first, middle)
        count = end - first if first else middle
        parts: dict[int, Any] = {}
        for i, a, b in self.sums:
            for x in (a, b):
                if x not in parts:
                    parts[x] = self.polynomial(self.terms[x][first:middle])
            # What these orders add to the later ones, with the beginning of the other factor.
            total = parts[a].mul_low(self._head(b, count), end - first)
            if first:
                total += self._head(a, count).mul_low(parts[b], end - first)
            here = self.known[i]
            for k, more in enumerate(total.coeffs()[middle - first :], middle):
                here[k] += more
        self._solve(middle, end)

    def _head(self, i: int, count: int) -> Any:
        """The first coefficients of a line as a polynomial."""
        if (i, count) not in self.heads:
            self.heads[i, count] = self.polynomial(self.terms[i][:count])
        return self.heads[i, count]

    def _next_order(self, k: int, first: int) -> None:
        """The coefficients of order k, those of orders before `first` being in `known`."""
        terms, P = self.terms, self.P
        for i, name, (x, y) in self.others:
            b = terms[y]
            if i in self.known:
                a = terms[x]
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
