"""Power series in two variables u and v, found one total degree at a time.

The homogeneous part of degree D is an array (D + 1, n, H): the coefficients of u^j v^(D-j) at n
phases and H energies. A series has parts of one parity only: even or odd degrees. A part is
computed when it is first asked for, and kept. So series may depend on one another in circles, as
long as each part needs only parts that can be computed before it, and the code of the reduced
equations runs on series as it runs on numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.orbits.integrate import sum_arrays
from rigidpend.orbits.integrate.sum_arrays import SumArray


class Jet:
    """A series with parts of degree `first`, `first` + 2, ..., set from outside or by a subclass.

    The `tape` lists all series of a computation, so that their parts can be dropped or rounded.
    """

    def __init__(self, tape: list[Jet], first: int) -> None:
        self.tape, self.first = tape, first
        self.parts: dict[int, Any] = {}
        self.factor_of_others = False
        """True if it is a factor of products, which take its parts of all degrees."""
        tape.append(self)

    def part(self, degree: int) -> Any:
        """The homogeneous part, (degree + 1, n, H); None if the series has none of this degree."""
        if degree < self.first or (degree - self.first) % 2:
            return None
        if degree not in self.parts:
            self.parts[degree] = self.find(degree)
        return self.parts[degree]

    def find(self, degree: int) -> Any:
        """Compute the part of a degree; LookupError if it has to be set from outside."""
        raise LookupError(f"the part of degree {degree} is not told yet")

    def go_on(self, rougher: Callable[[Any], Any]) -> None:
        """Go on with other numbers, or other nodes, which a function gives for known parts."""
        known = self.parts if self.factor_of_others else {}
        self.parts = {degree: rougher(part) for degree, part in known.items()}

    def __add__(self, other: Jet) -> Jet:
        return _JetSum(self, other)

    def __sub__(self, other: Jet) -> Jet:
        return _JetSum(self, -other)

    def __mul__(self, other: Any) -> Jet:
        return _JetProduct(self, other) if isinstance(other, Jet) else _JetScaled(self, other)

    __rmul__ = __mul__

    def __neg__(self) -> Jet:
        return _JetScaled(self, -1)


class _JetSum(Jet):
    """The sum of two series."""

    def __init__(self, a: Jet, b: Jet) -> None:
        super().__init__(a.tape, min(a.first, b.first))
        self.a, self.b = a, b

    def find(self, degree: int) -> Any:
        a, b = self.a.part(degree), self.b.part(degree)
        # A summand has no part of a degree below its first one.
        if b is None:
            return a
        return b if a is None else a + b


class _JetScaled(Jet):
    """A series times a number, or times a function of the phase, (n, 1) or (n, H)."""

    def __init__(self, a: Jet, factor: Any) -> None:
        super().__init__(a.tape, a.first)
        self.a, self.factor = a, factor

    def find(self, degree: int) -> Any:
        return self.factor * self.a.part(degree)

    def go_on(self, rougher: Callable[[Any], Any]) -> None:
        super().go_on(rougher)
        self.factor = rougher(self.factor)


class _JetProduct(Jet):
    """The product of two series."""

    def __init__(self, a: Jet, b: Jet) -> None:
        super().__init__(a.tape, a.first + b.first)
        self.a, self.b = a, b

    def find(self, degree: int) -> Any:
        # All degrees of the first factor at which the second one has a part as well.
        return convolved(self.a, self.b, degree, range(self.a.first, degree - self.b.first + 1, 2))


class Reciprocal(Jet):
    """The reciprocal of a series `of` that has a part of degree 0; `of` may be set later."""

    def __init__(self, tape: list[Jet]) -> None:
        super().__init__(tape, 0)
        self.of: Jet

    def find(self, degree: int) -> Any:
        if degree == 0:
            return 1 / self.of.part(0)
        # The part of this degree of reciprocal times series vanishes; here it is solved for.
        return -self.part(0) * convolved(self, self.of, degree, range(0, degree, 2))


class Deferred(Jet):
    """A placeholder for the series `of`, which is set later."""

    of: Jet

    def find(self, degree: int) -> Any:
        return self.of.part(degree)


def convolved(a: Jet, b: Jet, degree: int, split: range) -> Any:
    """The part of a product a b, summed over the degrees of a in `split`: (degree + 1, n, H)."""
    a.factor_of_others = b.factor_of_others = True
    left, right = [a.part(i) for i in split], [b.part(degree - i) for i in split]
    if isinstance(left[0], SumArray) or left[0].dtype == float:
        return sum_arrays.convolved(left, right)
    found = np.zeros_like(left[0], shape=(degree + 1, *left[0].shape[1:]))
    # Numbers of mpmath: a row of the shorter part at a time, u^k v^(d-k) moves rows by k.
    for x, y in zip(left, right, strict=True):
        few, many = sorted((x, y), key=len)
        for k, row in enumerate(few):
            found[k : k + len(many)] += row * many
    return found
