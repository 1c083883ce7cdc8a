"""Arrays of numbers of any precision, with their elementary functions.

Doubles are NumPy's own type. Numbers of up to 96 bits are pairs of doubles, computed by the kernel.
Numbers of more bits are mpmath's, in arrays of objects, or sums of three doubles where these are
asked for. The same code computes with all of them, by
``+ - * /``, ``@``, and the functions of a :class:`Precision`.
"""

import functools
import math
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.numbers.exact import GUARD_BITS, Exact, context, fraction
from rigidpend.orbits.integrate import sum_arrays
from rigidpend.orbits.integrate.arithmetic import PAIRS
from rigidpend.orbits.integrate.kernel.lane_numbers import in_parts
from rigidpend.orbits.integrate.sum_arrays import SumArray

FUNCTIONS = {"sin": 1, "cos": 1, "exp": 1, "log": 1, "sqrt": 1, "atan2": 2}
"""Names of the elementary functions, with the number of their arguments."""
UNDIVIDED, LEAST_ROWS = 2**18, 16
"""Multiplications of a product up to which OpenBLAS starts no thread; least rows of its parts.

That holds for OpenBLAS as NumPy brings it. A larger product is done in parts."""
MOST_IN_PAIRS = 96
"""Bits that pairs of doubles keep after some hundred operations, each with an error of 2^-104."""
MOST_IN_TRIPLES = 148
"""Bits that sums of three doubles keep likewise."""


class Precision:
    """Numbers of `bits` bits: their constructors, and functions of arrays of them."""

    sin: Any
    cos: Any
    exp: Any
    log: Any
    sqrt: Any
    atan2: Any

    def __init__(self, bits: int, parts: int) -> None:
        self.bits, self.parts = bits, parts
        """Number of doubles that add up to a number; 0 for numbers of mpmath."""
        doubles = parts == 1
        self.dtype: Any = np.dtype(float if doubles else object)
        m = context(bits)
        for name, arguments in FUNCTIONS.items():
            if self.parts:
                mine = getattr(np if doubles else sum_arrays, name)
            else:
                mine = np.frompyfunc(getattr(m, name), arguments, 1)
            setattr(self, name, mine)
        # The unary plus rounds mpmath's constant to a number; sums keep more bits than they count.
        self.pi = self.number(+context(max(bits, 53 * parts + 7)).pi)
        self.epsilon = 2.0 ** (1 - bits)

    def number(self, x: Scalar) -> Any:
        """A number of this precision from an int, float, Fraction, Exact or number of mpmath."""
        if self.parts > 1:
            return SumArray(in_parts(self._fraction(x), 53 * self.parts))
        if isinstance(x, Exact):
            x = x.at(self.bits + GUARD_BITS)
        if self.dtype == object:
            # mpmath takes no fractions. A numerator of up to `bits` bits is exact, so that only the
            # quotient is rounded.
            m = context(self.bits)
            return m.mpf(x.numerator) / x.denominator if isinstance(x, Fraction) else m.mpf(x)
        return float(x)

    def array(self, x: Scalar) -> Any:
        """An array of this precision from an array or nested list of such numbers."""
        if isinstance(x, SumArray):
            if self.parts > 1:
                return SumArray.of(x, self.parts)
            return self.floats(x) if self.bits == 53 else self.array(x.exactly())
        if self.parts > 1:
            return self._sums(x)
        given = np.asarray(x)
        if given.dtype.kind in "fiu" and self.dtype != object:
            return given.astype(self.dtype, copy=False)
        # As objects the numbers of NumPy become Python's own, which `number` takes.
        found = np.empty(given.shape, dtype=self.dtype)
        found.ravel()[:] = [self.number(one) for one in given.astype(object).ravel()]
        return found

    def _sums(self, x: Scalar) -> SumArray:
        """An array of sums; in lists the elements may be arrays of sums themselves."""
        if isinstance(x, (list, tuple)):
            rows = [self.array(one).parts for one in x]
            return SumArray(np.stack(rows, axis=1))
        given = np.asarray(x)
        if given.dtype.kind in "fiu":
            return SumArray.of(given, self.parts)
        numbers = [self._fraction(one) for one in given.astype(object).ravel()]
        return SumArray(in_parts(numbers, 53 * self.parts)).reshape(given.shape)

    def _fraction(self, x: Scalar) -> Fraction:
        """The exact value of a number, or that of one with guard bits for an Exact."""
        if isinstance(x, Exact):
            x = x.at(self.bits + GUARD_BITS)
        return Fraction(x) if isinstance(x, (int, float, Fraction)) else fraction(x)

    def zeros(self, shape: tuple[int, ...]) -> Any:
        """An array of zeros."""
        if self.parts > 1:
            return SumArray.of(np.zeros(shape), self.parts)
        return np.zeros(shape, self.dtype)

    def floats(self, x: Scalar) -> Any:
        """The doubles nearest to the numbers of an array."""
        # The first part of a sum is its nearest double.
        return x.parts[0] if isinstance(x, SumArray) else np.asarray(x).astype(float)

    def largest(self, x: Scalar) -> float:
        """The largest modulus in an array, as a float; infinite if any number is not finite."""
        sizes = np.abs(self.floats(x))
        return float(sizes.max(initial=0.0)) if np.isfinite(sizes).all() else float("inf")


@functools.cache
def precision(bits: int) -> Precision:
    """The precision of `bits` bits; it is never changed, so that threads may share it."""
    return Precision(bits, 1 if bits == 53 else 2 if 53 < bits <= MOST_IN_PAIRS else 0)


@functools.cache
def in_triples(bits: int) -> Precision:
    """The precision of `bits` bits, up to `MOST_IN_TRIPLES`, in sums of three doubles."""
    return Precision(bits, 3)


def in_sums(bits: float) -> Precision:
    """The precision of so many bits, above 53, in pairs or, up to what these hold, in triples."""
    if bits <= MOST_IN_PAIRS:
        return precision(math.ceil(bits))
    # Up to `PAIRS` bits orbits would be integrated in pairs all the same.
    return in_triples(min(max(math.ceil(bits), PAIRS + 1), MOST_IN_TRIPLES))


def rounded(x: Scalar, a: Precision) -> Any:
    """A number, an array or a record of them, rounded to a precision; doubles stay as they are."""
    if isinstance(x, tuple):
        return type(x)(*(rounded(one, a) for one in x))
    return x if x is None or isinstance(x, (int, float)) else a.array(x)[()]


def product(x: Scalar, y: Scalar) -> Any:
    """The product x @ y of matrices, computed in the calling thread alone.

    For large matrices of doubles BLAS would start threads of its own, which wait busily for some
    hundredths of a second after the product: time that other threads need for their tables. So BLAS
    is given some rows at a time.
    """
    if not isinstance(x, np.ndarray) or x.dtype != float:
        return np.matmul(x, y)
    rows, (terms, width) = x.shape[-2], y.shape[-2:]
    if 1 in (rows, width):
        # With one row or column einsum sums by itself, and no BLAS is asked.
        return np.einsum("...ij,...jk->...ik", x, y)
    # Wide matrices are divided by columns first, so that parts need not have too few rows.
    most = max(1, UNDIVIDED // LEAST_ROWS // terms)
    if width > most:
        parts = [product(x, y[..., k : k + most]) for k in range(0, width, most)]
        return np.concatenate(parts, axis=-1)
    most = UNDIVIDED // terms // width
    # Without any row there is one part, an empty one.
    parts = [np.matmul(x[..., k : k + most, :], y) for k in range(0, max(rows, 1), most)]
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-2)


def correction(by_x: Any, by_y: Any, off: Any) -> tuple[Any, Any]:
    """Newton's corrections of x and y, to be subtracted, from errors `off` of two functions.

    `by_x` and `by_y` are the derivatives of the two functions, by which Cramer's rule solves.
    """
    determinant = by_x[0] * by_y[1] - by_y[0] * by_x[1]
    x = (off[0] * by_y[1] - by_y[0] * off[1]) / determinant
    return x, (by_x[0] * off[1] - off[0] * by_x[1]) / determinant
