"""Arrays of numbers of any precision, with their elementary functions.

Doubles and the 64 bits of a `long double` are NumPy's own types, and the 113 bits of `real128`
are heyoka's. Elsewhere a number is mpmath's, in an array of objects, some fifty times slower.
The same lines compute with all of them: ``+ - * /``, ``@``, and the functions of an
:class:`Precision`.
"""

from __future__ import annotations

import functools
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.integrate.compiled import heyoka, typed
from rigidpend.integrate.engines import has_heyoka
from rigidpend.numbers.exact import context
from rigidpend.numbers.generic import Scalar

FUNCTIONS = {"sin": 1, "cos": 1, "exp": 1, "expm1": 1, "log": 1, "sqrt": 1, "atan2": 2}


def native(bits: int) -> Any:
    """NumPy's type of numbers of so many bits; None where there is none."""
    if bits == 53:
        return np.float64
    if bits == 64 and np.finfo(np.longdouble).nmant == 63:
        return np.longdouble
    if bits == 113 and has_heyoka():
        return heyoka().real128
    return None


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
        self.bits = bits
        kind = native(bits)
        self.dtype: Any = np.dtype(kind or object)
        m = context(bits)
        for name, arguments in FUNCTIONS.items():
            mine = getattr(np, name) if kind else np.frompyfunc(getattr(m, name), arguments, 1)
            setattr(self, name, mine)
        self.pi = self.number(+context(max(bits, 113)).pi)
        self.epsilon = 2.0 ** (1 - bits)

    def number(self, x: Scalar) -> Any:
        """A number of this precision from an int, a float, a Fraction or an mpmath number."""
        if self.dtype == object:
            m = context(self.bits)
            return m.mpf(x.numerator) / x.denominator if isinstance(x, Fraction) else m.mpf(x)
        exactly = Fraction(x) if isinstance(x, (int, float)) else x
        return float(x) if self.bits == 53 else typed(exactly, self.dtype.type)

    def array(self, x: Scalar) -> Any:
        """An array of this precision from an array or nested list of such numbers."""
        given = np.asarray(x)
        if given.dtype.kind in "fiu" and self.dtype != object:
            return given.astype(self.dtype, copy=False)
        found = np.empty(given.shape, dtype=self.dtype)
        found.ravel()[:] = [self.number(one) for one in given.astype(object).ravel()]
        return found

    def floats(self, x: Scalar) -> Any:
        """The doubles nearest to an array."""
        return np.asarray(x).astype(float)

    def largest(self, x: Scalar) -> float:
        """The largest modulus in an array, as a float; infinite where there is a NaN."""
        sizes = np.abs(np.asarray(x)).astype(float)
        return float(sizes.max(initial=0.0)) if np.isfinite(sizes).all() else float("inf")


@functools.cache
def precision(bits: int) -> Precision:
    """The numbers of so many bits; it holds no state, so threads may share it."""
    return Precision(bits)
