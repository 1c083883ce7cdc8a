"""Crossings of M3 = 0 on Taylor steps: all zeros of polynomials, and touches that are not decided.

Zeros are isolated by exclusion and bisection, so that none is lost.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers import Numbers, Scalar

UNDECIDED = 5
"""Mark in the place of a separatrix: a touch is not decided, the orbit not known any further."""
FINEST_INTERVAL = 2.0**-20
"""Half of an interval, as a share of the step, below which a turning point is sought in it."""
TOUCH = 1e-5
"""Depth of a touch of M3 = 0, relative to |M|, up to which doubles do not decide it.

Two computations whose crossing times agree well enough for a certain symbol may err by 5e-6
radians (see `rigidpend.routes.certainty`), and by as much in M3."""


def touch(bits: int) -> float:
    """Depth up to which numbers of `bits` bits leave a touch undecided, relative to |M|."""
    # 1e-5 up to 64 bits; every further bit halves it.
    return TOUCH * 2.0 ** min(0, 64 - bits)


def crosses(before: Any, after: Any) -> Any:
    """True where M3 comes to zero or passes it on a step, from its values at both ends.

    A zero at the end belongs to the step. One at its beginning does not: it belongs to the step
    before, or is the orbit's start, which is no crossing.
    """
    return ((before < 0) & (after >= 0)) | ((before > 0) & (after <= 0))


def zeros(
    c: Sequence[float], depth: float, exactly: Callable[[float], Any] | None = None
) -> Iterator[tuple[float, bool]]:
    """The zeros of sum c_k x^k in (0, 1] in ascending order, each with True.

    At a turning point whose value is at most `depth` the arithmetic cannot tell whether the
    polynomial crosses zero: the turning point comes instead, with False. `exactly` is the
    polynomial in its own arithmetic, if that is finer than doubles.
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
    """A polynomial on (0, 1], where a sum of |coefficients| bounds each derivative."""

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
        """The zeros in (a, b], and the turning points that are not decided, as in :func:`zeros`."""
        middle, half = (a + b) / 2, (b - a) / 2
        # Farther from zero at the middle than the slope can carry it over half of the interval.
        if abs(value_at(self.c, middle)) > self.steepest * half + self.depth:
            return
        # The slope cannot vanish: the polynomial is monotone, and the signs at the ends decide.
        if abs(self.slope(middle)) > self.bend * half:
            if crosses(value_at(self.c, a), value_at(self.c, b)):
                # Doubles tell the signs but beside the zero, where Newton's step needs no more.
                yield self._bisected(a, b, lambda x: value_at(self.c, x)), True
            return
        if half < FINEST_INTERVAL:
            yield from self._at_turn(a, b)
            return
        yield from self.between(a, middle)
        yield from self.between(middle, b)

    def _at_turn(self, a: float, b: float) -> Iterator[tuple[float, bool]]:
        """The zeros beside a turning point, if its value is farther from zero than its error."""
        ends = [self.slope(x) for x in (a, b)]
        turn = _sign_change(self.slope, a, b) if ends[0] * ends[1] < 0 else (a + b) / 2
        # The rounding of the slope in doubles, over the bend, is the error of the turning point's
        # place; the value there errs by bend/2 times its square, in any arithmetic.
        bend = abs(value_at(derivative(self.slopes), turn))
        blur = (2.0**-52 * self.steepest) ** 2 / bend if bend else math.inf
        if abs(self.exactly(turn)) <= max(self.depth, blur):
            yield turn, False
            return
        for low, high in ((a, turn), (turn, b)):
            if crosses(self.exactly(low), self.exactly(high)):
                yield self._bisected(low, high, self.exactly), True

    def _bisected(self, a: float, b: float, value: Callable[[float], Any]) -> float:
        found = _sign_change(value, a, b)
        slope = self.slope(found)
        # A Newton step: the bisection stops at an absolute precision, and a zero close to the
        # beginning of the step has a relative one.
        better = found - float(self.exactly(found)) / slope if slope else found
        return better if a < better <= b else found


def _sign_change(value: Callable[[float], Any], a: float, b: float) -> float:
    """The point of [a, b] at which values change their sign, by bisection."""
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
    """The crossings on a step as (share of the step, separatrix), from the series of Qp, Qm, M3.

    The series are in powers of the share of the step. A touch of M3 = 0 that is not decided has
    `UNDECIDED` in the place of the separatrix, and ends the search.
    """
    Qp, Qm, M3 = (x.tolist() for x in series)
    slopes = derivative(M3)
    for share, decided in zeros(M3, depth, exactly):
        if not decided:
            yield share, UNDECIDED
            return
        rising = value_at(slopes, share) > 0
        yield share, separatrix_beside(rising, value_at(Qp, share), value_at(Qm, share))
