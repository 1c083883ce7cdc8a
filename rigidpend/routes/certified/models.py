"""Polynomials with integer coefficients, and a bound on what they leave out.

A :class:`Model` stands for every function g on [-1, 1] with sup |g - P| <= error, P its polynomial;
a :class:`Family` for polynomials in a place u, v and an energy w too. All numbers are integers in
units of 2^-bits. The sum, difference and product of two of them contain the sums, differences and
products of all their functions: each rounding is added to the error. :class:`Values` tells the
signs of a model's functions on parts of the interval, without doubt.

P is kept as the coefficients c_k of sum_k c_k z^(k-n), k = 0 .. 2n, which is 2 P(x) at
x = (z + 1/z)/2, as T_j(x) = (z^j + z^-j)/2. The product of two Chebyshev series is then one
product of polynomials over the integers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from operator import add, mul
from typing import Any, TypeAlias

from flint import arb, ctx, fmpz, fmpz_mpoly, fmpz_mpoly_ctx, fmpz_poly

from rigidpend.routes.certified.pieces import Powers


class Model:
    """A Chebyshev series with a bound on its distance from the functions that it stands for."""

    def __init__(self, doubled: fmpz_poly, degree: int, error: int, bits: int) -> None:
        self.doubled, self.degree, self.error, self.bits = doubled, degree, error, bits

    @classmethod
    def of_series(cls, series: Sequence[int], bits: int) -> Model:
        """Model of w_0/2 + sum_j w_j T_j with error 0, from w in units of 2^-bits."""
        return cls(fmpz_poly([*series[:0:-1], *series]), len(series) - 1, 0, bits)

    @classmethod
    def of_ball(cls, ball: arb, bits: int) -> Model:
        """Constant model that contains a ball of real numbers."""
        middle, away = _units(ball, bits)
        return cls(fmpz_poly([2 * middle]), 0, away, bits)

    @property
    def series(self) -> list[int]:
        """Coefficients w of P = w_0/2 + sum_j w_j T_j, in units of 2^-bits."""
        half = list(map(int, self._half()))
        return half + [0] * (self.degree + 1 - len(half))

    @cached_property
    def size(self) -> int:
        """Bound on |g| over [-1, 1] for every function of the model, in units of 2^-bits."""
        # |T_j| <= 1 on [-1, 1]; w_0 counts half, rounded up.
        first, *further = self._half() or [fmpz(0)]
        return int((abs(first) + 1) // 2 + sum(map(abs, further))) + self.error

    def _half(self) -> list[fmpz]:
        """The coefficients from that of T_0 on, without zeros at the end."""
        return self.doubled.right_shift(self.degree).coeffs()

    def __neg__(self) -> Model:
        return Model(-self.doubled, self.degree, self.error, self.bits)

    def __add__(self, other: Model) -> Model:
        degree = max(self.degree, other.degree)
        a, b = (x.doubled.left_shift(degree - x.degree) for x in (self, other))
        return Model(a + b, degree, self.error + other.error, self.bits)

    def __sub__(self, other: Model) -> Model:
        return self + -other

    def __mul__(self, other: Model) -> Model:
        """Product: 2P 2Q/2, of which each coefficient is rounded down by less than a unit."""
        doubled = (self.doubled * other.doubled) // fmpz_poly([1 << (self.bits + 1)])
        degree = self.degree + other.degree
        # Twice the product has 2 degree + 1 coefficients, each off by less than a unit. Sizes
        # include the errors, so that the product of both errors is contained in what is carried.
        carried = 0
        if self.error or other.error:
            carried = -(-(self.size * other.error + other.size * self.error) >> self.bits)
        return Model(doubled, degree, degree + 1 + carried, self.bits)

    def at(self, x: arb) -> arb:
        """Value of P at a point of [-1, 1], as a ball in units of 2^-bits."""
        # A ball grows by less than 1 + sqrt(2) with each term of Clenshaw's recurrence.
        with ctx.workprec(self.bits + 2 * self.degree + 64):
            ahead, here, series = arb(0), arb(0), self.series
            for w in series[:0:-1]:
                ahead, here = here, w + 2 * x * here - ahead
            return arb(series[0]) / 2 + x * here - ahead

    def derivative(self) -> Model:
        """Derivative of P in x, exact, for a model without error."""
        # Nothing says how steep an error is.
        if self.error:
            raise ValueError("a model with an error has no derivative")
        sloped = _sloped(self.doubled, self.doubled.derivative(), fmpz_poly([0, 1]), self.degree)
        return Model(sloped, max(self.degree - 1, 0), 0, self.bits)


def _sloped(doubled: Any, by_z: Any, z: Any, degree: int) -> Any:
    """The doubled derivative in x, from a doubled series and its derivative in z.

    As x = (z + 1/z)/2 it is z d/dz over (z - 1/z)/2, which divides it.
    """
    return 2 * (z * by_z - degree * doubled) // (z * z - 1)


def _units(ball: arb, bits: int) -> tuple[int, int]:
    """The whole number of units of 2^-bits next below a ball's middle, and how far it goes."""
    with ctx.workprec(bits + 64):
        units = ball * arb(2) ** bits
        middle = above(units.mid().floor())
        return middle, above(abs(units - middle))


def above(x: arb) -> int:
    """A whole number above a ball, or that which the ball is."""
    found = x.upper().ceil().unique_fmpz()
    if found is None:
        raise ArithmeticError("a bound is no number")
    return int(found)


PARTS = (32, 256)
"""Numbers of equal parts of a step: the second where the first leave a sign in doubt."""
GRAIN = 64
"""Numbers of terms of a table are multiples of it."""
VALUE_BITS = 62
"""Values are integers in units of 2^-VALUE_BITS."""
SPARE = 34
"""Bits of the recurrence of T_j beyond these."""


class Values:
    """Values of a model at the ends of equal parts of [-1, 1], and its bounds on each part."""

    def __init__(self, model: Model, parts: int) -> None:
        series = [_shifted(w, VALUE_BITS - model.bits) for w in model.series]
        # A longer row than the series does no harm, and few tables are made.
        rows = _table(parts, -(-len(series) // GRAIN) * GRAIN)
        self.at = [sum(map(mul, series, row)) >> VALUE_BITS for row in rows]
        # A coefficient, a T_j and the sum are each rounded by a unit at most.
        rounding = len(series) + (sum(map(abs, series)) >> VALUE_BITS) + 2
        self.doubt = rounding + _shifted(model.error, VALUE_BITS - model.bits) + 1
        slopes = Model.of_series(model.series, model.bits).derivative()
        # From one end of a part to the other it changes by this at most, rounded up.
        self.change = _shifted(2 * slopes.size, VALUE_BITS - model.bits) // parts + 1

    def least(self, k: int) -> int:
        """Lower bound on |g| over part k; 0 where its sign is in doubt."""
        a, b = self.at[k], self.at[k + 1]
        if (a > 0) != (b > 0):
            return 0
        # Between values of one sign g stays above (|a| + |b| - sup |g'| dx)/2.
        return max(0, (abs(a) + abs(b) - self.change) // 2 - self.doubt)

    def most(self, k: int) -> int:
        """Upper bound on |g| over part k."""
        return (abs(self.at[k]) + abs(self.at[k + 1]) + self.change) // 2 + 1 + self.doubt


@functools.lru_cache(maxsize=8)
def _table(parts: int, terms: int) -> list[list[int]]:
    """T_j at the ends of the parts, a power of two of them, within a unit of 2^-VALUE_BITS."""
    # By the recurrence with bits to spare: n terms lose n^2/2 of its units, and half of one of
    # ours when they are rounded.
    rows, half = [], 1 << (SPARE - 1)
    for k in range(parts + 1):
        # x = (2 k - parts)/parts, and so 2 x here is a shift of a product.
        twice, shift = 2 * (2 * k - parts), parts.bit_length() - 1
        before, here = 1 << (VALUE_BITS + SPARE), (twice << (VALUE_BITS + SPARE - 1)) // parts
        row = []
        for _ in range(terms):
            row.append((before + half) >> SPARE)
            before, here = here, ((twice * here) >> shift) - before
        # P = w_0/2 + ...
        rows.append([row[0] // 2, *row[1:]])
    return rows


def _shifted(x: int, by: int) -> int:
    return x << by if by >= 0 else x >> -by


PARAMETERS = "uvw"
"""The place in a set, and the energy."""
_RING = fmpz_mpoly_ctx.get(("z", *PARAMETERS), "lex")
_Z = _RING.gens()[0]

Orders: TypeAlias = tuple[int, int, int]


class Family:
    """A series in x with coefficients that are polynomials in u, v and w, and an error.

    It stands for every polynomial of (x, u, v, w) in [-1, 1]^4 whose coefficients differ from
    those that it has by at most its error, all together, in units of 2^-bits. So derivatives in
    u, v and w are known too. Nothing is rounded: products get longer, and only irrational numbers
    bring an error.
    """

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
        middle, away = _units(ball, bits)
        return cls(_RING.constant(2 * middle), 0, bits, away)

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
        found, degree = self.doubled.subs({name: side}), self.degree
        if name == "z":
            found, degree = found * side**degree, 0
        return Family(found, degree, self.bits, self.error, self.orders)

    def derivative(self) -> Family:
        """Derivative in x, of a family without error."""
        if self.error:
            raise ValueError("a family with an error has no derivative")
        sloped = _sloped(self.doubled, self.doubled.derivative("z"), _Z, self.degree)
        return Family(sloped, max(self.degree - 1, 0), self.bits, 0, self.orders)

    def partial(self, name: str) -> Family:
        """Derivative in u, v or w."""
        if self.orders is None:
            raise ValueError("functions of which only values are bounded have any derivatives")
        # A power takes its exponent before it, in what is within the error as in all else.
        error = self.error * self.orders[PARAMETERS.index(name)]
        return Family(self.doubled.derivative(name), self.degree, self.bits, error, self.orders)

    def widened(self, by: arb) -> Family:
        """All functions that differ from these by so much."""
        error = self.error + above(by * arb(2) ** self.bits)
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
