"""Families of functions of time: series in x with coefficients that are polynomials in u, v and w.

A family stands for every polynomial of (x, u, v, w) in [-1, 1]^4, a Chebyshev series in x and
powers of the others, whose coefficients differ from those that it has by at most its error, all
together. So derivatives in u, v and w are known too. Nothing is rounded: products get longer, and
only irrational numbers bring an error.

As in :mod:`rigidpend.routes.certified.models` what is kept is 2 P(x) at x = (z + 1/z)/2, multiplied
by z^degree, so that a product of families is one product of polynomials over the integers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cached_property
from operator import add
from typing import TypeAlias

from flint import arb, fmpz, fmpz_mpoly, fmpz_mpoly_ctx

from rigidpend.routes.certified.balls import precision
from rigidpend.routes.certified.models import Model
from rigidpend.routes.certified.pieces import Powers

PARAMETERS = "uvw"
"""The place in a set, and the energy."""
_RING = fmpz_mpoly_ctx.get(("z", *PARAMETERS), "lex")
_Z = _RING.gens()[0]

Orders: TypeAlias = tuple[int, int, int]


class Family:
    """A polynomial in units of 2^-bits, with an error in the same units."""

    def __init__(
        self,
        doubled: fmpz_mpoly,
        degree: int,
        bits: int,
        error: int = 0,
        orders: Orders | None = (0, 0, 0),
    ) -> None:
        self.doubled, self.degree, self.bits, self.error = doubled, degree, bits, error
        self.orders = orders
        """Degrees in u, v and w at most; None of other functions than polynomials."""

    @classmethod
    def of(cls, terms: Mapping[Powers, int], bits: int) -> Family:
        """The sum of terms c T_j(x) u^k v^l w^m, without an error; those of T_0 count half."""
        n = max((j for j, *_ in terms), default=0)
        both: dict[tuple[int, ...], int | fmpz] = {
            (n + side * j, *(*powers, 0)[:3]): c
            for (j, *powers), c in terms.items()
            for side in (-1, 1)
        }
        k, l, m = (max((at[i] for at in both), default=0) for i in (1, 2, 3))
        return cls(_RING.from_dict(both), n, bits, 0, (k, l, m))

    @classmethod
    def of_ball(cls, ball: arb, bits: int) -> Family:
        """A constant that contains a ball of real numbers."""
        with precision(bits + 64):
            units = ball * arb(2) ** bits
            middle = _whole(units.mid().floor())
            return cls(_RING.constant(2 * middle), 0, bits, _above(abs(units - middle)))

    @classmethod
    def of_fraction(cls, x: Fraction | int, bits: int) -> Family:
        """A constant within a unit of a rational number, and with an error where it is not it."""
        whole, rest = divmod(x.numerator << bits, x.denominator)
        return cls(_RING.constant(2 * whole), 0, bits, 1 if rest else 0)

    @cached_property
    def size(self) -> int:
        """Bound on every function, in units."""
        # |T_j| <= 1, and each but T_0 stands twice in what is doubled.
        return int(sum(map(abs, self.doubled.coeffs())) + 1) // 2 + self.error

    @property
    def bound(self) -> arb:
        """Bound on every function."""
        return arb(self.size) / arb(2) ** self.bits

    @property
    def centre(self) -> int:
        """Twice the coefficient of T_0 alone, in units."""
        return int(self.doubled[self.degree, 0, 0, 0])

    @property
    def range(self) -> arb:
        """A ball that contains all values of every function."""
        twice = self.centre
        return arb(arb(twice), 2 * self.size - abs(twice)) / arb(2) ** (self.bits + 1)

    def middle(self) -> Model:
        """The series at u = v = w = 0, which all functions are within its error of."""
        n, terms = self.degree, self.doubled.to_dict()
        series = [int(terms.get((n + j, 0, 0, 0), 0)) for j in range(n + 1)]
        beside = sum(abs(int(c)) for (_, *powers), c in terms.items() if any(powers))
        found = Model.of_series(series, self.bits)
        return Model(found.doubled, found.degree, (beside + 1) // 2 + self.error, self.bits)

    def at(self, name: str, side: int) -> Family:
        """The family on the side where z (which is x there), u or v is -1 or 1."""
        found = self.doubled.subs({name: side})
        if name != "z":
            return Family(found, self.degree, self.bits, self.error, self.orders)
        return Family(found * side**self.degree, 0, self.bits, self.error, self.orders)

    def derivative(self) -> Family:
        """Derivative in x, of a family without error."""
        if self.error:
            raise ValueError("a family with an error has no derivative")
        n, slopes = self.degree, dict[Powers, int]()
        terms = self.doubled.to_dict()
        # By the recurrence w'_{j-1} = w'_{j+1} + 2 j w_j.
        for powers in {at[1:] for at in terms}:
            ahead = [0, 0]
            for j in range(n, 0, -1):
                ahead.append(ahead[-2] + 2 * j * int(terms.get((n + j, *powers), 0)))
                slopes[j - 1, *powers] = ahead[-1]
        return Family.of(slopes, self.bits)

    def partial(self, name: str) -> Family:
        """Derivative in u, v or w."""
        if self.orders is None:
            raise ValueError("functions of which only values are bounded have any derivatives")
        # A power takes its exponent before it, in what is within the error as in all else.
        error = self.error * self.orders[PARAMETERS.index(name)]
        return Family(self.doubled.derivative(name), self.degree, self.bits, error, self.orders)

    def widened(self, by: arb) -> Family:
        """All functions that differ from these by so much."""
        error = self.error + _above(by * arb(2) ** self.bits)
        return Family(self.doubled, self.degree, self.bits, error, None)

    def __neg__(self) -> Family:
        return Family(-self.doubled, self.degree, self.bits, self.error, self.orders)

    def __add__(self, other: Family) -> Family:
        bits, degree = max(self.bits, other.bits), max(self.degree, other.degree)
        a, b = (
            x.doubled * (_Z ** (degree - x.degree) * (1 << (bits - x.bits))) for x in (self, other)
        )
        error = sum(x.error << (bits - x.bits) for x in (self, other))
        return Family(a + b, degree, bits, error, _each(max, self.orders, other.orders))

    def __sub__(self, other: Family) -> Family:
        return self + -other

    def __mul__(self, other: Family) -> Family:
        # Sizes include the errors, so that their product is contained in this.
        error = self.size * other.error if other.error else 0
        error += self.error * other.size if self.error else 0
        # Both are doubled, and so is their product: half a unit for the other two.
        bits = self.bits + other.bits + 1
        orders = _each(add, self.orders, other.orders)
        degree = self.degree + other.degree
        return Family(self.doubled * other.doubled, degree, bits, 2 * error, orders)


def _each(rule: Callable[[int, int], int], a: Orders | None, b: Orders | None) -> Orders | None:
    """Degrees of a sum or a product."""
    if a is None or b is None:
        return None
    return rule(a[0], b[0]), rule(a[1], b[1]), rule(a[2], b[2])


def _above(x: arb) -> int:
    """A whole number above a ball."""
    return _whole(x.upper().ceil())


def _whole(x: arb) -> int:
    """A ball that is a whole number."""
    found = x.unique_fmpz()
    if found is None:
        raise ArithmeticError("a bound is no number")
    return int(found)
