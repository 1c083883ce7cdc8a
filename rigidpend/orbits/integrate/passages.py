"""Crossings of M3 = 0 on Taylor steps, none lost: zeros of polynomials, and touches that are told.

Zeros are isolated by exclusion and bisection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.generic import Numbers, Scalar

UNDECIDED = 5
"""Mark in place of a separatrix: the orbit is not known from here on."""
FINEST = 2.0**-20
"""Share of a step below which a turning point beside zero is looked at closely."""
TOUCH = 1e-5
"""Depth of a touch of M3 = 0, relative to |M|, up to which doubles do not decide it.

Two computations whose crossing times agree well enough for a certain symbol may err by 5e-6
radians (see `rigidpend.routes.certainty`), and by as much in M3."""


def touch(bits: int) -> float:
    """The depth of a touch that numbers of so many bits leave undecided, relative to |M|."""
    return TOUCH * 2.0 ** min(0, 64 - bits)


def zeros(
    c: Sequence[float], depth: float, exactly: Callable[[float], Any] | None = None
) -> Iterator[tuple[float, bool]]:
    """The zeros of sum c_k x^k in (0, 1], in order, each with True.

    Where the polynomial turns no farther from zero than `depth`, so that its arithmetic cannot tell
    whether it crosses it, comes the turn with False. `exactly` is the polynomial in its own
    arithmetic, where that is finer than a double's.
    """
    if abs(c[0]) > depth + sum(map(abs, c[1:])):
        return
    yield from _Polynomial(c, depth, exactly).between(0.0, 1.0)


def value_at(c: Any, x: Scalar) -> Any:
    """The polynomial sum c_k x^k by Horner's rule, in any arithmetic."""
    total = c[-1]
    for term in c[-2::-1]:
        total = total * x + term
    return total


def derivative(c: Sequence[Any]) -> list[Any]:
    """The coefficients of the derivative."""
    return [k * x for k, x in enumerate(c)][1:]


class _Polynomial:
    """A polynomial on (0, 1]; over it a derivative is bounded by its coefficients' sizes."""

    def __init__(
        self, c: Sequence[float], depth: float, exactly: Callable[[float], Any] | None
    ) -> None:
        self.c, self.slopes, self.depth = c, derivative(c), depth
        self.steepest = sum(map(abs, self.slopes))
        self.bend = sum(map(abs, derivative(self.slopes)))
        self.exactly = exactly or (lambda x: value_at(c, x))

    def slope(self, x: float) -> float:
        """The derivative."""
        return float(value_at(self.slopes, x))

    def between(self, a: float, b: float) -> Iterator[tuple[float, bool]]:
        middle, half = (a + b) / 2, (b - a) / 2
        if abs(value_at(self.c, middle)) > self.steepest * half + self.depth:
            return
        if abs(self.slope(middle)) > self.bend * half:
            left, right = value_at(self.c, a), value_at(self.c, b)
            if left * right < 0 or right == 0:
                yield self._bisected(a, b), True
            return
        if half < FINEST:
            yield from self._at_turn(a, b)
            return
        yield from self.between(a, middle)
        yield from self.between(middle, b)

    def _at_turn(self, a: float, b: float) -> Iterator[tuple[float, bool]]:
        """The zeros beside a turning point, if its depth can be told."""
        ends = [self.slope(x) for x in (a, b)]
        turn = _sign_change(self.slope, a, b) if ends[0] * ends[1] < 0 else (a + b) / 2
        # The place of the turn is known to the rounding of the slope, whatever the arithmetic.
        bend = abs(value_at(derivative(self.slopes), turn))
        blur = (2.0**-52 * self.steepest) ** 2 / bend if bend else math.inf
        if abs(self.exactly(turn)) <= max(self.depth, blur):
            yield turn, False
            return
        for low, high in ((a, turn), (turn, b)):
            if (self.exactly(low) > 0) != (self.exactly(high) > 0):
                yield self._bisected(low, high), True

    def _bisected(self, a: float, b: float) -> float:
        found = _sign_change(self.exactly, a, b)
        slope = self.slope(found)
        # One step of Newton's: a zero beside the beginning has a relative precision of its own.
        better = found - float(self.exactly(found)) / slope if slope else found
        return better if a < better <= b else found


def _sign_change(value: Callable[[float], Any], a: float, b: float) -> float:
    """The place where values change their sign, by bisection."""
    rising = value(b) > value(a)
    for _ in range(60):
        middle = (a + b) / 2
        if not a < middle < b:
            break
        if (value(middle) > 0) == rising:
            b = middle
        else:
            a = middle
    return b


def crossings_of_series(
    series: Numbers, depth: float, exactly: Callable[[float], float] | None = None
) -> Iterator[tuple[float, int]]:
    """The crossings on a step as (share of the step, separatrix), from Qp, Qm, M3 as series.

    A touch of M3 = 0 that is not decided comes as `UNDECIDED`, after which nothing is sought.
    """
    Qp, Qm, M3 = (x.tolist() for x in series)
    slopes = derivative(M3)
    for share, decided in zeros(M3, depth, exactly):
        if not decided:
            yield share, UNDECIDED
            return
        rising = value_at(slopes, share) > 0
        yield share, separatrix_beside(rising, value_at(Qp, share), value_at(Qm, share))
