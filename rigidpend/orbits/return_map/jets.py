"""Power series in two variables u and v, found one total degree at a time.

The homogeneous part of degree D is an array (D + 1, n, H): the coefficients of u^j v^(D-j) at n
phases and H energies. A series has parts of one parity only. Parts are computed when they are
asked for, so that series may depend on one another in circles, as long as each part rests on
earlier ones: the reduced equations are run over series as they stand.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.orbits.integrate import pair_arrays
from rigidpend.orbits.integrate.pair_arrays import PairArray


class Jet:
    """A series whose parts of degree `first`, `first` + 2, ... are told, or found by a subclass."""

    def __init__(self, tape: list[Jet], first: int) -> None:
        self.tape, self.first = tape, first
        self.parts: dict[int, Any] = {}
        tape.append(self)

    def part(self, degree: int) -> Any:
        """The homogeneous part, (degree + 1, n, H); None where parity or size forbid one."""
        if degree < self.first or (degree - self.first) % 2:
            return None
        if degree not in self.parts:
            self.parts[degree] = self.find(degree)
        return self.parts[degree]

    def find(self, degree: int) -> Any:
        raise LookupError(f"the part of degree {degree} is not told yet")

    def __add__(self, other: Jet) -> Jet:
        return _JetSum(self, other, 1)

    def __sub__(self, other: Jet) -> Jet:
        return _JetSum(self, other, -1)

    def __mul__(self, other: Any) -> Jet:
        return _JetProduct(self, other) if isinstance(other, Jet) else _JetScaled(self, other)

    __rmul__ = __mul__

    def __neg__(self) -> Jet:
        return _JetScaled(self, -1)


class _JetSum(Jet):
    def __init__(self, a: Jet, b: Jet, sign: int) -> None:
        super().__init__(a.tape, min(a.first, b.first))
        self.a, self.b, self.sign = a, b, sign

    def find(self, degree: int) -> Any:
        a, b = self.a.part(degree), self.b.part(degree)
        if b is None:
            return a
        return self.sign * b if a is None else a + self.sign * b


class _JetScaled(Jet):
    """A series times a number, or times a function of the phase, (n, 1) or (n, H)."""

    def __init__(self, a: Jet, factor: Any) -> None:
        super().__init__(a.tape, a.first)
        self.a, self.factor = a, factor

    def find(self, degree: int) -> Any:
        return self.factor * self.a.part(degree)


class _JetProduct(Jet):
    def __init__(self, a: Jet, b: Jet) -> None:
        super().__init__(a.tape, a.first + b.first)
        self.a, self.b = a, b

    def find(self, degree: int) -> Any:
        a, b = self.a, self.b
        split = range(a.first, degree - b.first + 1, 2)
        return sum(convolved(a.part(i), b.part(degree - i)) for i in split)


class Reciprocal(Jet):
    """1/a for a series with a part of degree 0, which may be named later."""

    def __init__(self, tape: list[Jet]) -> None:
        super().__init__(tape, 0)
        self.of: Jet

    def find(self, degree: int) -> Any:
        if degree == 0:
            return 1 / self.of.part(0)
        earlier = range(0, degree, 2)
        rest = sum(convolved(self.part(i), self.of.part(degree - i)) for i in earlier)
        return -rest * self.part(0)


class Deferred(Jet):
    """A series that another one is, once that is named."""

    of: Jet

    def find(self, degree: int) -> Any:
        return self.of.part(degree)


def convolved(a: Any, b: Any) -> Any:
    """The product of two homogeneous parts: a convolution over the powers of u."""
    if isinstance(a, PairArray):
        return pair_arrays.convolved(a, b)
    if len(a) > len(b):
        a, b = b, a
    shape = (len(a) + len(b) - 1, *np.broadcast_shapes(a.shape[1:], b.shape[1:]))
    found = np.zeros(shape, dtype=np.result_type(a, b))
    for k, row in enumerate(a):
        found[k : k + len(b)] += row * b
    return found
