"""Chebyshev models: polynomials with integer coefficients and a bound on what they leave out.

A model stands for every function g on [-1, 1] with sup |g - P| <= error, P its polynomial. All
numbers are integers in units of 2^-bits. The sum, difference and product of two models contain
the sums, differences and products of all their functions: each rounding is added to the error.
:class:`Values` tells the signs of these functions on parts of the interval, without doubt.

P is kept as the coefficients c_k of sum_k c_k z^(k-n), k = 0 .. 2n, which is 2 P(x) at
x = (z + 1/z)/2, as T_j(x) = (z^j + z^-j)/2. The product of two Chebyshev series is then one
product of polynomials over the integers.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from functools import cached_property
from operator import mul

from flint import arb, fmpz, fmpz_poly

from rigidpend.routes.certified.balls import precision


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
        (centre, exponent), (radius, finer) = ball.mid().man_exp(), ball.rad().man_exp()
        # Both are rounded down, so each may be off by a unit: 2 more in the error.
        units, away = _scaled(centre, exponent + bits), _scaled(radius, finer + bits)
        return cls(fmpz_poly([2 * units]), 0, away + 2, bits)

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
        with precision(self.bits + 2 * self.degree + 64):
            ahead, here, series = arb(0), arb(0), self.series
            for w in series[:0:-1]:
                ahead, here = here, w + 2 * x * here - ahead
            return arb(series[0]) / 2 + x * here - ahead

    def derivative(self) -> Model:
        """Derivative of P in x, exact, for a model without error.

        Raises
        ------
        ValueError
            The model has an error, of which nothing says how steep it is.
        """
        if self.error:
            raise ValueError("a model with an error has no derivative")
        # By the recurrence w'_{j-1} = w'_{j+1} + 2 j w_j, which stays among whole numbers.
        w, slopes = self.series, [0] * (self.degree + 2)
        for j in range(self.degree, 0, -1):
            slopes[j - 1] = slopes[j + 1] + 2 * j * w[j]
        return Model.of_series(slopes[: max(self.degree, 1)], self.bits)


def _scaled(mantissa: object, exponent: object) -> int:
    """The whole number next below mantissa 2^exponent."""
    whole, shift = int(mantissa), int(exponent)  # type: ignore[call-overload]
    return whole << shift if shift >= 0 else whole >> -shift


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
