"""Arrays of numbers of any precision, with their elementary functions.

Doubles are NumPy's own type, up to 96 bits are carried in pairs of doubles by the kernel. Beyond,
a number is mpmath's, in an array of objects. The same lines compute with all of them:
``+ - * /``, ``@``, and the functions of a :class:`Precision`.
"""

from __future__ import annotations

import functools
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.numbers.exact import GUARD_BITS, Exact, context, fraction
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate import pair_arrays
from rigidpend.orbits.integrate.pair_arrays import PairArray

FUNCTIONS = {"sin": 1, "cos": 1, "exp": 1, "expm1": 1, "log": 1, "sqrt": 1, "atan2": 2}
UNDIVIDED, LEAST_ROWS = 2**18, 16
"""Multiplications of a product for which OpenBLAS starts no thread yet; least rows of its parts.

OpenBLAS as NumPy brings it: a larger product is done in parts."""
MOST_IN_PAIRS = 96
"""Bits that pairs of doubles keep after some hundred operations that each err by 2^-104."""


def in_pairs(bits: int) -> bool:
    """True if numbers of so many bits are pairs of doubles, of the kernel."""
    return 53 < bits <= MOST_IN_PAIRS


class Precision:
    """Numbers of `bits` bits: how they are made, and the functions of arrays of them."""

    sin: Any
    cos: Any
    exp: Any
    expm1: Any
    log: Any
    sqrt: Any
    atan2: Any

    def __init__(self, bits: int) -> None:
        self.bits, self.in_pairs = bits, in_pairs(bits)
        doubles = bits == 53
        self.dtype: Any = np.dtype(float if doubles else object)
        m = context(bits)
        for name, arguments in FUNCTIONS.items():
            if self.in_pairs or doubles:
                mine = getattr(np if doubles else pair_arrays, name)
            else:
                mine = np.frompyfunc(getattr(m, name), arguments, 1)
            setattr(self, name, mine)
        self.pi = self.number(+context(max(bits, 113)).pi)
        self.epsilon = 2.0 ** (1 - bits)

    def number(self, x: Scalar) -> Any:
        """A number of this precision from an int, a float, a Fraction, an Exact or mpmath's."""
        if isinstance(x, Exact):
            x = x.at(self.bits + GUARD_BITS)
        if self.in_pairs:
            known = isinstance(x, (int, float, Fraction))
            return PairArray.number(Fraction(x) if known else fraction(x))
        if self.dtype == object:
            m = context(self.bits)
            return m.mpf(x.numerator) / x.denominator if isinstance(x, Fraction) else m.mpf(x)
        return float(x)

    def array(self, x: Scalar) -> Any:
        """An array of this precision from an array or nested list of such numbers."""
        if isinstance(x, PairArray):
            return x if self.in_pairs else self.array(self.floats(x))
        if self.in_pairs:
            return self._pairs(x)
        given = np.asarray(x)
        if given.dtype.kind in "fiu" and self.dtype != object:
            return given.astype(self.dtype, copy=False)
        found = np.empty(given.shape, dtype=self.dtype)
        found.ravel()[:] = [self.number(one) for one in given.astype(object).ravel()]
        return found

    def _pairs(self, x: Scalar) -> PairArray:
        if isinstance(x, (list, tuple)):
            rows = [self.array(one).parts for one in x]
            return PairArray(np.stack(rows, axis=1))
        given = np.asarray(x)
        if given.dtype.kind in "fiu":
            return PairArray.of(given)
        numbers = [self.number(one).parts for one in given.astype(object).ravel()]
        return PairArray(np.stack(numbers, axis=1)).reshape(given.shape)

    def zeros(self, shape: tuple[int, ...]) -> Any:
        """An array of zeros."""
        return PairArray.of(np.zeros(shape)) if self.in_pairs else np.zeros(shape, self.dtype)

    def floats(self, x: Scalar) -> Any:
        """The doubles nearest to an array."""
        return x.parts[0] if isinstance(x, PairArray) else np.asarray(x).astype(float)

    def largest(self, x: Scalar) -> float:
        """The largest modulus in an array, as a float; infinite where there is a NaN."""
        sizes = np.abs(self.floats(x))
        return float(sizes.max(initial=0.0)) if np.isfinite(sizes).all() else float("inf")


@functools.cache
def precision(bits: int) -> Precision:
    """The numbers of so many bits; it holds no state, so threads may share it."""
    return Precision(bits)


def product(x: Scalar, y: Scalar) -> Any:
    """x @ y of matrices, in the thread that asks for it.

    BLAS would start others for large ones in doubles, which go on waiting busily for some
    hundredths of a second: the time of another thread's tables. So it is given some rows at a time.
    """
    if not isinstance(x, np.ndarray) or x.dtype != float:
        return np.matmul(x, y)
    rows, (terms, width) = x.shape[-2], y.shape[-2:]
    if 1 in (rows, width):
        return np.einsum("...ij,...jk->...ik", x, y)
    few = max(1, UNDIVIDED // LEAST_ROWS // terms)
    if width > few:
        parts = [product(x, y[..., k : k + few]) for k in range(0, width, few)]
        return np.concatenate(parts, axis=-1)
    few = UNDIVIDED // terms // width
    # Of no rows the product is one part too.
    parts = [np.matmul(x[..., k : k + few, :], y) for k in range(0, max(rows, 1), few)]
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-2)


def correction(by_x: Any, by_y: Any, off: Any) -> tuple[Any, Any]:
    """Newton's correction of x and y, where two functions of slopes `by_x`, `by_y` are `off`."""
    determinant = by_x[0] * by_y[1] - by_y[0] * by_x[1]
    x = (off[0] * by_y[1] - by_y[0] * off[1]) / determinant
    return x, (by_x[0] * off[1] - off[0] * by_x[1]) / determinant
