"""Polynomials with integer coefficients, each with a bound on its distance from a function.

A :class:`Family` stands for functions of x in [-1, 1] that also depend on a place u, v and an
energy w, a :class:`Path` for functions of x alone. All numbers are integers in units of 2^-bits.
Sums and products contain those of all functions. :func:`on_parts` bounds values.

P is kept as the coefficients c_k of sum_k c_k z^(k-n), k = 0 .. 2n, which is 2 P(x) at
x = (z + 1/z)/2, since T_j(x) = (z^j + z^-j)/2. The product of two Chebyshev series is then one
product of polynomials over the integers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from operator import add, sub
from typing import Any, Self, TypeAlias

from flint import arb, arb_mat, ctx, fmpz, fmpz_mpoly_ctx, fmpz_poly

from rigidpend.routes.certified.proof_data import Powers


def above(x: arb) -> int:
    """An integer that is no less than any point of a ball; ArithmeticError for NaN or infinity."""
    found = x.upper().ceil().unique_fmpz()
    if found is None:
        raise ArithmeticError("a bound is no number")
    return int(found)


INPUT_BITS = 160
"""Bits in which the numbers of a problem are enclosed."""
PARAMETERS = "uvw"
"""The place in a set, and the energy."""
_RING = fmpz_mpoly_ctx.get(("z", *PARAMETERS), "lex")
_Z, *_ = _RING.gens()

UNIT = 1 << 61
"""Limit of the size of a coefficient that FLINT keeps in a word."""
FEW_BITS = 60
"""Bits of a family in which few of the coefficients are larger: functions are about one."""

Orders: TypeAlias = tuple[int, int, int]


def _words(p: Any, bits: int) -> list[Any]:
    """Polynomials with coefficients below UNIT, of which p is the sum of the k-th times UNIT^k.

    For a family of few bits p alone, for to look at coefficients takes a tenth of its products.
    """
    found = []
    while bits > FEW_BITS and max(map(abs, p.coeffs()), default=0) >= UNIT:
        # However the quotient is rounded, less than UNIT is left. It has few terms, of low degree.
        high = p // UNIT
        found.append(p - high * UNIT)
        p = high
    return [*found, p]


class Family:
    """A Chebyshev series in x whose coefficients are polynomials in u, v and w, with an error.

    It stands for every polynomial of (x, u, v, w) in [-1, 1]^4 whose coefficients differ from
    the stored ones by at most `error` in total, in units of 2^-bits, and whose degrees are at most
    `orders`. So its derivatives in u, v and w are bounded too. Sums and products are exact, and get
    longer: errors come from constants, from :meth:`rounded` and from :meth:`widened` alone.
    """

    def __init__(
        self,
        doubled: Any,
        degree: int,
        bits: int,
        error: int = 0,
        orders: Orders | None = (0, 0, 0),
    ) -> None:
        self.doubled, self.degree, self.bits, self.error = doubled, degree, bits, error
        self.orders = orders
        """Bounds on the degrees in u, v and w; None if the functions need not be polynomials."""

    _z: Any = _Z
    _constant: Any = staticmethod(_RING.constant)

    def _lifted(self, bits: int, by: int) -> Any:
        """The stored polynomial in units finer by so many bits, times z^by."""
        found = self.doubled * (1 << bits) if bits else self.doubled
        return found * _Z**by if by else found

    def _sloped(self) -> Any:
        """The derivative of the stored polynomial in z."""
        return self.doubled.derivative("z")

    def _product(self, other: Self) -> Any:
        """The product of the stored polynomials."""
        # FLINT takes ten times as long where a coefficient does not fit a word. Most of a step's
        # do, but not once they are multiplied by a constant of the body: so common factors are
        # taken out before.
        (f, p), (g, q) = self.doubled.primitive(), other.doubled.primitive()
        low, high = _words(p, self.bits), _words(q, other.bits)
        return horner([horner([x * y for y in high], UNIT) for x in low], UNIT) * (f * g)

    @classmethod
    def of(cls, terms: Mapping[Powers, int], bits: int) -> Self:
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
        doubled = _RING.from_dict(both)
        # Of the polynomial 0 all degrees are -1.
        _, k, l, m = (max(0, int(degree)) for degree in doubled.degrees())
        return cls(doubled, n, bits, 0, (k, l, m))

    @classmethod
    def of_ball(cls, ball: arb, bits: int) -> Self:
        """A constant family that contains a ball of real numbers."""
        with ctx.workprec(bits + 64):
            units = ball * arb(2) ** bits
            middle = above(units.mid().floor())
            # The bound holds for every point of the ball.
            return cls(cls._constant(2 * middle), 0, bits, above(abs(units - middle)))

    def constant(self, ball: arb) -> Self:
        """A constant family by which this one is multiplied."""
        return self.of_ball(ball, INPUT_BITS)

    @classmethod
    def of_fraction(cls, x: Fraction | int, bits: int) -> Self:
        """A constant family that contains a rational number, with error 0 where it is exact."""
        whole, rest = divmod(x.numerator << bits, x.denominator)
        return cls(cls._constant(2 * whole), 0, bits, 1 if rest else 0)

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
    def range(self) -> arb:
        """A ball that contains all values of every function."""
        # Twice the constant term, that of T_0 without u, v and w, and twice all others and the
        # error: 2 size includes |twice| once.
        twice = int(self.doubled[self.degree, 0, 0, 0])
        return arb(arb(twice), 2 * self.size - abs(twice)) / arb(2) ** (self.bits + 1)

    def middle(self) -> Path:
        """The series at u = v = w = 0, with an error that covers the functions at all u, v, w."""
        n, terms = self.degree, self.doubled.subs(dict.fromkeys(PARAMETERS, 0)).to_dict()
        series = [int(terms.get((n + j, 0, 0, 0), 0)) for j in range(n + 1)]
        found = Path.of_series(series, self.bits)
        # The other terms are what is left of the size, which is rounded up to a whole number.
        return Path(found.doubled, n, self.bits, self.size - found.size + 1)

    def at(self, name: str, side: int) -> Self:
        """The family on the face where z, u or v is -1 or 1; z = side means x = side."""
        found, degree = self.doubled.subs({name: side}), self.degree
        if name == "z":
            # The series is stored times z^degree; side^-degree is side^degree.
            found, degree = found * side**degree, 0
        return type(self)(found, degree, self.bits, self.error, self.orders)

    def derivative(self) -> Self:
        """The exact derivative in x; ValueError for a family with an error."""
        # A function within the error of P may be as steep as it likes.
        if self.error:
            raise ValueError("a family with an error has no derivative")
        # Since x = (z + 1/z)/2, d/dx is z d/dz divided by (z - 1/z)/2, and the division is exact.
        # The series is stored times z^degree, whose own derivative is taken off again. The quotient
        # is the doubled derivative times z^(degree - 1), as a series of that degree is stored.
        z = self._z
        sloped = 2 * (z * self._sloped() - self.degree * self.doubled) // (z * z - 1)
        return type(self)(sloped, max(self.degree - 1, 0), self.bits, 0, self.orders)

    def partial(self, name: str) -> Self:
        """The derivative in u, v or w; ValueError if the functions need not be polynomials."""
        if self.orders is None:
            raise ValueError("functions of which only values are bounded have any derivatives")
        # Differentiation multiplies each coefficient by its exponent, also those of what the
        # error allows for: they are at most the degree.
        error = self.error * self.orders[PARAMETERS.index(name)]
        return type(self)(self.doubled.derivative(name), self.degree, self.bits, error, self.orders)

    def bounds(self, along: Iterable[str]) -> list[arb]:
        """Bounds on the functions and on their derivatives in the variables `along`."""
        return [self.bound, *(self.partial(name).bound for name in along)]

    def widened(self, by: arb) -> Self:
        """The family of all functions that differ from these by at most `by`."""
        # They need not be polynomials, so no derivative of them is bounded.
        error = self.error + above(by * arb(2) ** self.bits)
        return type(self)(self.doubled, self.degree, self.bits, error, None)

    def __neg__(self) -> Self:
        return type(self)(-self.doubled, self.degree, self.bits, self.error, self.orders)

    def __add__(self, other: Self) -> Self:
        return self._combined(add, other)

    def __sub__(self, other: Self) -> Self:
        return self._combined(sub, other)

    def _combined(self, rule: Callable[[Any, Any], Any], other: Self) -> Self:
        """The sum or the difference of functions, whose errors add up in both."""
        bits, degree = max(self.bits, other.bits), max(self.degree, other.degree)
        # Both in the finer units, with T_0 at the same power of z.
        a, b = (x._lifted(bits - x.bits, degree - x.degree) for x in (self, other))
        error = sum(x.error << (bits - x.bits) for x in (self, other))
        return type(self)(rule(a, b), degree, bits, error, _each(max, self.orders, other.orders))

    def __mul__(self, other: Self) -> Self:
        # 2P 2Q is twice 2PQ: in units half as large it is the doubled product as it stands.
        bits = self.bits + other.bits + 1
        orders = _each(add, self.orders, other.orders)
        # Both sizes include the errors, so the product of the errors is counted twice: enough.
        error = self.size * other.error if other.error else 0
        error += self.error * other.size if self.error else 0
        degree = self.degree + other.degree
        return type(self)(self._product(other), degree, bits, 2 * error, orders)

    def rounded(self, bits: int) -> Self:
        """A family that contains these functions, in units of 2^-bits if its own are finer.

        Terms of less than a unit may vanish.
        """
        if (down := self.bits - bits) <= 0:
            return self
        # Each coefficient of 2 P is rounded by less than a unit: FLINT rounds some quotients down
        # and some towards zero. So P is off by less than half as many units as there are terms.
        error = (len(self.doubled) + 1) // 2 - (-self.error >> down)
        return type(self)(self.doubled // (1 << down), self.degree, bits, error, self.orders)


def horner(p: Sequence[Any], x: Any) -> Any:
    """The sum of p_k x^k, of numbers or functions of any kind; there is one at least."""
    found = p[-1]
    for each in p[-2::-1]:
        found = found * x + each
    return found


def _each(rule: Callable[[int, int], int], a: Orders | None, b: Orders | None) -> Orders | None:
    """Degrees of a sum (rule max) or a product (rule add); None if either has none."""
    if a is None or b is None:
        return None
    return rule(a[0], b[0]), rule(a[1], b[1]), rule(a[2], b[2])


class Path(Family):
    """A family of functions of x alone, in polynomials of one variable, which are faster.

    Products are rounded, and so stay as short.
    """

    _z = fmpz_poly([0, 1])
    _constant = staticmethod(lambda x: fmpz_poly([x]))

    @classmethod
    def of_series(cls, series: Sequence[int], bits: int) -> Self:
        """The path of w_0/2 + sum_j w_j T_j with error 0, from w in units of 2^-bits."""
        return cls(fmpz_poly([*series[:0:-1], *series]), len(series) - 1, bits)

    @property
    def series(self) -> list[int]:
        """Coefficients w of P = w_0/2 + sum_j w_j T_j, in units of 2^-bits."""
        half = list(map(int, self.doubled.right_shift(self.degree).coeffs()))
        return half + [0] * (self.degree + 1 - len(half))

    def value(self, x: arb) -> arb:
        """A ball that contains P at a point of [-1, 1], but for the error."""
        with ctx.workprec(self.bits + ROUNDING_BITS):
            return self.values(arb_mat([_chebyshev(x, self.degree + 1)]))[0]

    def values(self, table: arb_mat) -> list[arb]:
        """Balls that contain P, but for the error, by a table of T_0/2, T_1, ... at some points."""
        series, terms = self.series, table.ncols()
        column = arb_mat(terms, 1, [*series, *[0] * (terms - len(series))])
        return [x / arb(2) ** self.bits for x in (table * column).entries()]

    def middle(self) -> Path:
        return self

    def constant(self, ball: arb) -> Self:
        return self.of_ball(ball, self.bits)

    def at(self, name: str, side: int) -> Self:
        # In units half as large the value is whole.
        found = 2 * self._constant(self.doubled(side) * side**self.degree)
        return type(self)(found, 0, self.bits + 1, 2 * self.error, self.orders)

    def __mul__(self, other: Self) -> Self:
        return super().__mul__(other).rounded(max(self.bits, other.bits))

    def _product(self, other: Self) -> Any:
        return self.doubled * other.doubled

    def _lifted(self, bits: int, by: int) -> Any:
        return (self.doubled * (1 << bits) if bits else self.doubled).left_shift(by)

    def _sloped(self) -> Any:
        return self.doubled.derivative()


ROUNDING_BITS = 64
"""Bits beyond those of a path in which a single value is computed."""
GRAIN = 64
"""Numbers of terms of a table are multiples of this, so that few tables are made."""


def on_parts(of: Family, parts: int) -> list[arb]:
    """Balls that contain the values of every function over each of some equal parts of [-1, 1]."""
    values, beside = at_ends(of, parts)
    return [(a + b) / 2 + arb(0, beside) for a, b in pairwise(values)]


def at_ends(of: Family, parts: int) -> tuple[list[arb], arb]:
    """Values of P at the ends of equal parts of [-1, 1], and a bound on what is beside them.

    On a part every function is within that of the mean of the values at both ends.
    """
    path, ends = of.middle(), functools.partial(_table, parts, ctx.prec)
    values = path.values(ends(-(-(path.degree + 1) // GRAIN) * GRAIN))
    # P alone has a slope; what the functions differ from it by is in the error. Over a part of the
    # length 2/parts P differs from the mean of its values at both ends by half of its largest
    # change at most.
    slope = Path(path.doubled, path.degree, path.bits).derivative()
    return values, slope.bound / parts + arb(path.error) / arb(2) ** path.bits


@functools.lru_cache(maxsize=8)
def _table(parts: int, bits: int, terms: int) -> arb_mat:
    """Rows of T_0/2, T_1, T_2, ... at the ends of the parts, in the working precision `bits`."""
    points = [arb(2 * k - parts) / parts for k in range(parts + 1)]
    return arb_mat([_chebyshev(x, terms) for x in points])


def _chebyshev(x: arb, terms: int) -> list[arb]:
    """T_0/2, T_1, T_2, ... at a point, as a series is summed."""
    return [arb("0.5"), *(x.chebyshev_t(j) for j in range(1, terms))]
