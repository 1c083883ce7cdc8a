"""Polynomials with integer coefficients, each with a bound on its distance from a function.

A :class:`Model` stands for every function g on [-1, 1] with sup |g - P| <= error, where P is its
polynomial; a :class:`Family` stands for polynomials that also depend on a place u, v and an energy
w. All numbers are integers in units of 2^-bits. The sum, difference and product of two models
contain the sums, differences and products of all their functions, because every rounding is added
to the error. :class:`Values` proves signs of a model's functions on parts of the interval.

P is kept as the coefficients c_k of sum_k c_k z^(k-n), k = 0 .. 2n, which is 2 P(x) at
x = (z + 1/z)/2, since T_j(x) = (z^j + z^-j)/2. The product of two Chebyshev series is then one
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
    """A Chebyshev series P with a bound on sup |g - P| of the functions g that it stands for."""

    def __init__(self, doubled: fmpz_poly, degree: int, error: int, bits: int) -> None:
        self.doubled, self.degree, self.error, self.bits = doubled, degree, error, bits

    @classmethod
    def of_series(cls, series: Sequence[int], bits: int) -> Model:
        """The model of w_0/2 + sum_j w_j T_j with error 0, from w in units of 2^-bits."""
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
        """The coefficients w_0, w_1, ... without trailing zeros."""
        return self.doubled.right_shift(self.degree).coeffs()

    def __neg__(self) -> Model:
        return Model(-self.doubled, self.degree, self.error, self.bits)

    def __add__(self, other: Model) -> Model:
        degree = max(self.degree, other.degree)
        # T_0 stands at place `degree`: the shorter series moves up until both agree there.
        a, b = (x.doubled.left_shift(degree - x.degree) for x in (self, other))
        return Model(a + b, degree, self.error + other.error, self.bits)

    def __sub__(self, other: Model) -> Model:
        return self + -other

    def __mul__(self, other: Model) -> Model:
        """The product, 2P 2Q/2, with each coefficient rounded by less than a unit."""
        # FLINT rounds some quotients down and some towards zero; the bound holds for either.
        doubled = (self.doubled * other.doubled) // fmpz_poly([1 << (self.bits + 1)])
        degree = self.degree + other.degree
        # Twice the product has 2 degree + 1 coefficients, each off by less than a unit: the
        # product itself is off by less than degree + 1. |g h - P Q| <= |g| |h - Q| + |Q| |g - P|,
        # and both sizes include the errors.
        carried = 0
        if self.error or other.error:
            carried = -(-(self.size * other.error + other.size * self.error) >> self.bits)
        return Model(doubled, degree, degree + 1 + carried, self.bits)

    def at(self, x: arb) -> arb:
        """The value of P at a point of [-1, 1], as a ball in units of 2^-bits."""
        # Each term of Clenshaw's recurrence multiplies a ball's radius by less than 1 + sqrt(2),
        # less than two bits: these are added to the working precision.
        with ctx.workprec(self.bits + 2 * self.degree + 64):
            ahead, here, series = arb(0), arb(0), self.series
            for w in series[:0:-1]:
                ahead, here = here, w + 2 * x * here - ahead
            return arb(series[0]) / 2 + x * here - ahead

    def derivative(self) -> Model:
        """The exact derivative of P in x; ValueError for a model with an error."""
        # A function within the error of P may be as steep as it likes.
        if self.error:
            raise ValueError("a model with an error has no derivative")
        sloped = _sloped(self.doubled, self.doubled.derivative(), fmpz_poly([0, 1]), self.degree)
        return Model(sloped, max(self.degree - 1, 0), 0, self.bits)


def _sloped(doubled: Any, by_z: Any, z: Any, degree: int) -> Any:
    """The doubled derivative in x, from a doubled series and its derivative in z.

    Since x = (z + 1/z)/2, d/dx is z d/dz divided by (z - 1/z)/2, and the division is exact.
    """
    # The series is stored times z^degree, whose own derivative is taken off again. The quotient
    # is the doubled derivative times z^(degree - 1), as a series of that degree is stored.
    return 2 * (z * by_z - degree * doubled) // (z * z - 1)


def _units(ball: arb, bits: int) -> tuple[int, int]:
    """The integer in units of 2^-bits below a ball's midpoint, and a bound on the distance to it.

    The bound holds for every point of the ball.
    """
    with ctx.workprec(bits + 64):
        units = ball * arb(2) ** bits
        middle = above(units.mid().floor())
        return middle, above(abs(units - middle))


def above(x: arb) -> int:
    """An integer that is no less than any point of a ball; ArithmeticError for NaN or infinity."""
    found = x.upper().ceil().unique_fmpz()
    if found is None:
        raise ArithmeticError("a bound is no number")
    return int(found)


PART_COUNTS = (32, 256)
"""Numbers of equal parts of a step: the second is tried where the first leaves a sign in doubt."""
GRAIN = 64
"""Numbers of terms of a table are multiples of this, so that few tables are made."""
VALUE_BITS = 62
"""Values are integers in units of 2^-VALUE_BITS."""
RECURRENCE_BITS = 34
"""Further bits in which the recurrence of T_j runs: they absorb its round-off."""


class Values:
    """A model's values at the ends of equal parts of [-1, 1], and its bounds on each part.

    All values and bounds are integers in units of 2^-VALUE_BITS.
    """

    def __init__(self, model: Model, parts: int) -> None:
        # Shifts round down: by less than a unit each, which `rounding` counts.
        series = [_shifted(w, VALUE_BITS - model.bits) for w in model.series]
        # `map` stops at the end of the series, so a longer row does no harm.
        rows = _table(parts, -(-len(series) // GRAIN) * GRAIN)
        self.at = [sum(map(mul, series, row)) >> VALUE_BITS for row in rows]
        # Each coefficient is off by less than a unit, each T_j by at most one, which its
        # coefficient multiplies, and the sum by less than one.
        rounding = len(series) + (sum(map(abs, series)) >> VALUE_BITS) + 2
        self.doubt = rounding + _shifted(model.error, VALUE_BITS - model.bits) + 1
        # P alone has a slope; what the functions differ from it by is in `doubt`.
        slopes = Model.of_series(model.series, model.bits).derivative()
        # Bound on the change of P over a part, whose length in x is 2/parts, rounded up.
        self.change = _shifted(2 * slopes.size, VALUE_BITS - model.bits) // parts + 1

    def lower(self, k: int) -> int:
        """A lower bound on |g| over part k; 0 where the sign of g is in doubt."""
        a, b = self.at[k], self.at[k + 1]
        if (a > 0) != (b > 0):
            return 0
        # For a, b > 0, P(x) is at least a - L(x - x_a) and b - L(x_b - x), L = sup |P'|: their
        # mean is (a + b - L dx)/2. For a, b < 0 the same holds with the signs changed.
        return max(0, (abs(a) + abs(b) - self.change) // 2 - self.doubt)

    def upper(self, k: int) -> int:
        """An upper bound on |g| over part k."""
        return (abs(self.at[k]) + abs(self.at[k + 1]) + self.change) // 2 + 1 + self.doubt


@functools.lru_cache(maxsize=8)
def _table(parts: int, terms: int) -> list[list[int]]:
    """Rows of T_0/2, T_1, T_2, ... at the ends of the parts, within a unit of 2^-VALUE_BITS.

    The number of parts is a power of two.
    """
    # In T_{j+1} = 2 x T_j - T_{j-1} a rounding of at most one unit at term i reaches term n
    # multiplied by |U_{n-i}| <= n - i + 1: all of them add up to at most n^2/2. For 4096 terms
    # that is 2^23 of units that are 2^RECURRENCE_BITS times finer than those of the result.
    rows, half = [], 1 << (RECURRENCE_BITS - 1)
    for k in range(parts + 1):
        # x = (2 k - parts)/parts: multiplication by 2 x is a product and a shift.
        twice, shift = 2 * (2 * k - parts), parts.bit_length() - 1
        before, here = (
            1 << (VALUE_BITS + RECURRENCE_BITS),
            (twice << (VALUE_BITS + RECURRENCE_BITS - 1)) // parts,
        )
        row = []
        for _ in range(terms):
            row.append((before + half) >> RECURRENCE_BITS)
            before, here = here, ((twice * here) >> shift) - before
        # P = w_0/2 + ..., and T_0 is an even number of units: the half is exact.
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
    """A Chebyshev series in x whose coefficients are polynomials in u, v and w, with an error.

    It stands for every polynomial of (x, u, v, w) in [-1, 1]^4 whose coefficients differ from
    the stored ones by at most `error` in total, in units of 2^-bits, and whose degrees are at most
    `orders`. So its derivatives in u, v and w are bounded too. Sums and products are exact, and get
    longer: errors come from rounded constants and from :meth:`widened` alone.
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
        """Bounds on the degrees in u, v and w; None if the functions need not be polynomials."""

    @classmethod
    def of(cls, terms: Mapping[Powers, int], bits: int) -> Family:
        """The sum of terms c T_j(x) u^k v^l w^m, without an error; a term with T_0 counts half.

        `terms` maps (j, k, l) or (j, k, l, m) to c in units of 2^-bits.
        """
        n = max((j for j, *_ in terms), default=0)
        # Every T_j is (z^j + z^-j)/2. For j = 0 the two entries are one key, and c is kept once.
        both: dict[tuple[int, ...], int | fmpz] = {
            (n + side * j, *(*powers, 0)[:3]): c
            for (j, *powers), c in terms.items()
            for side in (-1, 1)
        }
        k, l, m = (max((at[i] for at in both), default=0) for i in (1, 2, 3))
        return cls(_RING.from_dict(both), n, bits, 0, (k, l, m))

    @classmethod
    def of_ball(cls, ball: arb, bits: int) -> Family:
        """A constant family that contains a ball of real numbers."""
        middle, away = _units(ball, bits)
        return cls(_RING.constant(2 * middle), 0, bits, away)

    @classmethod
    def of_fraction(cls, x: Fraction | int, bits: int) -> Family:
        """A constant family that contains a rational number, with error 0 where it is exact."""
        whole, rest = divmod(x.numerator << bits, x.denominator)
        return cls(_RING.constant(2 * whole), 0, bits, 1 if rest else 0)

    @cached_property
    def size(self) -> int:
        """Bound on |g| for every function g, in units of 2^-bits."""
        # |T_j|, |u|, |v|, |w| <= 1, and the stored coefficients are those of 2 P.
        return int(sum(map(abs, self.doubled.coeffs())) + 1) // 2 + self.error

    @property
    def bound(self) -> arb:
        """Bound on |g| for every function g."""
        return arb(self.size) / arb(2) ** self.bits

    @property
    def centre(self) -> int:
        """Twice the constant term, that of T_0 without u, v and w, in units of 2^-bits."""
        return int(self.doubled[self.degree, 0, 0, 0])

    @property
    def range(self) -> arb:
        """A ball that contains all values of every function."""
        twice = self.centre
        # Twice all other terms and twice the error: 2 size includes |twice| once.
        return arb(arb(twice), 2 * self.size - abs(twice)) / arb(2) ** (self.bits + 1)

    def middle(self) -> Model:
        """The series at u = v = w = 0, with an error that covers the functions at all u, v, w."""
        n, terms = self.degree, self.doubled.to_dict()
        series = [int(terms.get((n + j, 0, 0, 0), 0)) for j in range(n + 1)]
        beside = sum(abs(int(c)) for (_, *powers), c in terms.items() if any(powers))
        found = Model.of_series(series, self.bits)
        return Model(found.doubled, found.degree, (beside + 1) // 2 + self.error, self.bits)

    def at(self, name: str, side: int) -> Family:
        """The family on the face where z, u or v is -1 or 1; z = side means x = side."""
        found, degree = self.doubled.subs({name: side}), self.degree
        if name == "z":
            # The series is stored times z^degree; side^-degree is side^degree.
            found, degree = found * side**degree, 0
        return Family(found, degree, self.bits, self.error, self.orders)

    def derivative(self) -> Family:
        """The exact derivative in x; ValueError for a family with an error."""
        if self.error:
            raise ValueError("a family with an error has no derivative")
        sloped = _sloped(self.doubled, self.doubled.derivative("z"), _Z, self.degree)
        return Family(sloped, max(self.degree - 1, 0), self.bits, 0, self.orders)

    def partial(self, name: str) -> Family:
        """The derivative in u, v or w; ValueError if the functions need not be polynomials."""
        if self.orders is None:
            raise ValueError("functions of which only values are bounded have any derivatives")
        # Differentiation multiplies each coefficient by its exponent, also those of what the
        # error allows for: they are at most the degree.
        error = self.error * self.orders[PARAMETERS.index(name)]
        return Family(self.doubled.derivative(name), self.degree, self.bits, error, self.orders)

    def widened(self, by: arb) -> Family:
        """The family of all functions that differ from these by at most `by`."""
        # They need not be polynomials, so no derivative of them is bounded.
        error = self.error + above(by * arb(2) ** self.bits)
        return Family(self.doubled, self.degree, self.bits, error, None)

    def __neg__(self) -> Family:
        return Family(-self.doubled, self.degree, self.bits, self.error, self.orders)

    def __add__(self, other: Family) -> Family:
        bits, degree = max(self.bits, other.bits), max(self.degree, other.degree)
        # Both in the finer units, with T_0 at the same power of z.
        a, b = (
            x.doubled * (_Z ** (degree - x.degree) * (1 << (bits - x.bits))) for x in (self, other)
        )
        error = sum(x.error << (bits - x.bits) for x in (self, other))
        return Family(a + b, degree, bits, error, _each(max, self.orders, other.orders))

    def __sub__(self, other: Family) -> Family:
        return self + -other

    def __mul__(self, other: Family) -> Family:
        # Both sizes include the errors, so the product of the errors is counted twice: enough.
        error = self.size * other.error if other.error else 0
        error += self.error * other.size if self.error else 0
        # 2P 2Q is twice 2PQ: in units half as large it is the doubled product as it stands.
        bits = self.bits + other.bits + 1
        orders = _each(add, self.orders, other.orders)
        degree = self.degree + other.degree
        return Family(self.doubled * other.doubled, degree, bits, 2 * error, orders)


def _each(rule: Callable[[int, int], int], a: Orders | None, b: Orders | None) -> Orders | None:
    """Degrees of a sum (rule max) or a product (rule add); None if either has none."""
    if a is None or b is None:
        return None
    return rule(a[0], b[0]), rule(a[1], b[1]), rule(a[2], b[2])
