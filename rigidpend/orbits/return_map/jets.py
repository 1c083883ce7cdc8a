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
from rigidpend.orbits.return_map.precision import Precision


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

    def go_on_in_doubles(self, a: Precision) -> None:
        """Round what is known, numbers of a precision: further parts are found in doubles."""
        self.parts = {degree: a.floats(part) for degree, part in self.parts.items()}

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

    def go_on_in_doubles(self, a: Precision) -> None:
        super().go_on_in_doubles(a)
        self.factor = a.floats(self.factor)


class _JetProduct(Jet):
    def __init__(self, a: Jet, b: Jet) -> None:
        super().__init__(a.tape, a.first + b.first)
        self.a, self.b = a, b

    def find(self, degree: int) -> Any:
        return convolved(self.a, self.b, degree, range(self.a.first, degree - self.b.first + 1, 2))


class Reciprocal(Jet):
    """1/a for a series with a part of degree 0, which may be named later."""

    def __init__(self, tape: list[Jet]) -> None:
        super().__init__(tape, 0)
        self.of: Jet

    def find(self, degree: int) -> Any:
        if degree == 0:
            return 1 / self.of.part(0)
        return -self.part(0) * convolved(self, self.of, degree, range(0, degree, 2))


class Deferred(Jet):
    """A series that another one is, once that is named."""

    of: Jet

    def find(self, degree: int) -> Any:
        return self.of.part(degree)


def convolved(a: Jet, b: Jet, degree: int, split: range) -> Any:
    """The sum of products of parts of two series, of those of the first series that are named."""
    left, right = [a.part(i) for i in split], [b.part(degree - i) for i in split]
    if isinstance(left[0], PairArray) or left[0].dtype == float:
        return pair_arrays.convolved(left, right)
    found = np.zeros_like(left[0], shape=(degree + 1, *left[0].shape[1:]))
    for x, y in zip(left, right, strict=True):
        few, many = sorted((x, y), key=len)
        for k, row in enumerate(few):
            found[k : k + len(many)] += row * many
    return found
