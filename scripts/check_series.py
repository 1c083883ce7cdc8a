"""Polynomials with an error, in whole numbers of Python, for the checkers of docs/full-shift.md.

Polynomials are dictionaries, multiplied as integers.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from typing import Any

from scripts.check_certificate import Fails, Interval

DIGITS = 200
"""Binary digits of intervals."""
PARTS = 32
"""Parts of a step on which signs and rates are told."""
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
        rows, others = self.as_numbers(wide), other.as_numbers(wide)
        products: dict[Any, int] = {}
        for at, x in rows.items():
            for there, y in others.items():
                powers = tuple(map(int.__add__, at, there))
                products[powers] = products.get(powers, 0) + x * y
        n = self.degree + other.degree
        found: dict[Any, int] = {}
        for powers, product in products.items():
            for j, c in enumerate(places(product, wide, n)):
                if c:
                    # This is 4 P Q, where c stands at z^j and at z^-j: 2 P Q has the term c T_j.
                    # At z^0 it stands once, and the term is c/2.
                    found[j, *powers] = c if j else c // 2
        return found

    __radd__, __rmul__ = __add__, __mul__

    @property
    def degree(self) -> int:
        """Degree in x."""
        return max((at[0] for at in self.terms), default=0)

    def as_numbers(self, wide: int) -> dict[Any, int]:
        """For each u^k v^l w^m twice its series, 2 T_j = z^j + z^-j, as a number: at z = 256^wide.

        It is multiplied by z^degree, so that the product of two numbers is that of two polynomials,
        whose coefficients are `places` of it.
        """
        n, columns = self.degree, dict[Any, list[int]]()
        for (j, *powers), c in self.terms.items():
            column = columns.setdefault((*powers,), [0] * (2 * n + 1))
            column[n + j] += c
            column[n - j] += c
        lift, half = lifted(wide, n), 1 << (8 * wide - 1)
        found = {}
        for at, column in columns.items():
            digits = b"".join([(c + half).to_bytes(wide, "little") for c in column])
            found[at] = int.from_bytes(digits, "little") - lift
        return found

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


def places(number: int, wide: int, n: int) -> list[int]:
    """Coefficients of z^n to z^2n of a polynomial of which a number is the value at 256^wide."""
    # Half of a place's range is added to each, so that none is negative, and taken off again.
    digits, half = (
        (number + lifted(wide, n)).to_bytes(wide * (2 * n + 1), "little"),
        1 << (8 * wide - 1),
    )
    each = range(n * wide, len(digits), wide)
    return [int.from_bytes(digits[k : k + wide], "little") - half for k in each]


@functools.cache
def lifted(wide: int, n: int) -> int:
    """The number that, added, makes each of 2 n + 1 coefficients of `wide` bytes positive."""
    every = ((1 << (8 * wide * (2 * n + 1))) - 1) // ((1 << (8 * wide)) - 1)
    return every << (8 * wide - 1)


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
    """An interval with all numbers within a radius of a number, or of those of another one."""
    middle, away = Interval.of(centre), Interval.of(radius)
    return Interval(middle.low - away.high, middle.high + away.high)


def above(x: Any) -> Fraction:
    """An upper bound on a number."""
    return Interval.of(x).above


def size(x: Interval) -> Fraction:
    """An upper bound on the size of a number."""
    return x.size.above


def below(x: Interval) -> Fraction:
    """A lower bound on a number."""
    return Fraction(x.low, 1 << Interval.digits)


def least(x: Interval) -> Fraction:
    """A lower bound on the size of a number; negative where it may be zero."""
    return Fraction(max(x.low, -x.high), 1 << Interval.digits)
