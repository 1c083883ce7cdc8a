"""Crossings of M3 = 0 on Taylor steps, none lost: zeros of polynomials, and touches that are told.

Where M3 is monotone the kernel has found its zero by Newton's method; else the zeros are isolated
by exclusion and bisection.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.generic import Array, Numbers, Scalar
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import kernel_bits
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS
from rigidpend.orbits.integrate.kernel.notes import FIELDS, MOMENTA

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

    Where the polynomial turns so near to zero that its arithmetic cannot tell whether it crosses
    it, comes the turn with False.

    Parameters
    ----------
    c : sequence of float
    depth : float
        A turning point that is no farther from zero is not decided.
    exactly : callable, optional
        The polynomial in its own arithmetic, where that is finer than a double's.
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


UNDECIDED = 5
"""Mark in place of a separatrix: the orbit is not known from here on."""
CONVERGED = 1e-9
"""Size of Newton's last correction, in steps, above which the zeros are isolated instead."""


class Steps(NamedTuple):
    """Taylor steps on which M3 may have been zero: the kernel's notes (see `kernel.notes`)."""

    notes: Array
    """(m, width)."""
    bits: int
    """Precision that was asked for."""

    def field(self, name: str) -> Array:
        """One of the `FIELDS`, of m steps."""
        return self.notes[:, FIELDS.index(name)]

    @property
    def series(self) -> Array:
        """(m, MOMENTA, order + 1, parts), in powers of t' from the beginning; M3 is the third."""
        parts = KINDS[kernel_bits(self.bits)].parts
        terms = (self.notes.shape[1] - len(FIELDS)) // (MOMENTA * parts)
        return self.notes[:, len(FIELDS) :].reshape(-1, MOMENTA, terms, parts)

    def chosen(self, where: NDArray[Any]) -> Steps:
        """Some of the steps, by a mask or by their numbers."""
        return self._replace(notes=self.notes[where])


class Found(NamedTuple):
    """Crossings as they were found, in no order."""

    columns: NDArray[np.int64]
    times: Array
    separatrix: NDArray[np.int64]

    @staticmethod
    def of(rows: Sequence[tuple[int, float, int]]) -> Found:
        """Crossings from a row for each."""
        columns, times, separatrix = np.array(rows, dtype=float).reshape(-1, 3).T
        return Found(columns.astype(np.int64), times, separatrix.astype(np.int64))

    @staticmethod
    def joined(parts: list[Found]) -> Found:
        """All crossings of several records."""
        return Found(*(np.concatenate(x) for x in zip(*parts, strict=True)))

    def write(self, found: Crossings, limit: float) -> None:
        """Write them into a record, each orbit's in order.

        An orbit ends before a touch that is not decided, and before a crossing that came after
        the limit of a passage.
        """
        if not self.columns.size:
            return
        order = np.lexsort((self.times, self.columns))
        columns, times, separatrix = (x[order] for x in self)
        first = np.searchsorted(columns, columns)
        row = np.arange(columns.size) - first
        waited = np.where(row > 0, times - np.roll(times, 1), times)
        kept = row < len(found.time)
        ends = (separatrix == UNDECIDED) | (waited > limit)
        for k in np.flatnonzero(ends & kept):
            if kept[k]:
                undecided = separatrix[k] == UNDECIDED
                found.outcome[columns[k]] = Outcome.FAILED if undecided else Outcome.NO_CROSSING
                kept &= ~((columns == columns[k]) & (row >= row[k]))
        # A pair beside a touch may complete an orbit that seemed to have been silent.
        found.outcome[columns[kept & (row == len(found.time) - 1)]] = Outcome.COMPLETE
        found.time[row[kept], columns[kept]] = times[kept]
        found.separatrix[row[kept], columns[kept]] = separatrix[kept]


def crossings_on(steps: Steps) -> Found:
    """All crossings on steps; a touch that is not decided comes as `UNDECIDED`."""
    changed = (steps.series[:, 2, 0, 0] < 0) != (steps.field("after") < 0)
    steady = steps.field("steady") > 0
    with np.errstate(invalid="ignore"):
        exact = np.abs(steps.field("correction")) <= CONVERGED * steps.field("length")
    single = steady & changed & exact
    doubtful = ~single & (changed | ~steady)
    return Found.joined([_single(steps.chosen(single)), _isolated(steps.chosen(doubtful))])


def _single(steps: Steps) -> Found:
    """The one crossing on each step, as the kernel has found it."""
    up, down = np.where(steps.field("Qp") > 0, 2, 4), np.where(steps.field("Qm") < 0, 1, 3)
    separatrix = np.where(steps.field("after") >= 0, up, down)
    times = steps.field("time") + steps.field("zero")
    return Found(steps.field("lane").astype(np.int64), times, separatrix)


def _isolated(steps: Steps) -> Found:
    """Every crossing on steps in doubt, from the isolated zeros of each series."""
    seen: list[tuple[int, float, int]] = []
    places = zip(*(steps.field(name) for name in ("lane", "time", "length")), strict=True)
    for series, (lane, time, length) in zip(steps.series, places, strict=True):
        shares = series[..., 0] * length ** np.arange(series.shape[1])
        depth = touch(steps.bits) * float(np.sqrt((shares[:, 0] ** 2).sum()))
        exactly = _exactly(series[2], length) if steps.bits > 53 else None
        for share, separatrix in crossings_of_series(shares, depth, exactly):
            seen.append((int(lane), time + share * length, separatrix))
    return Found.of(seen)


def _exactly(series: Array, length: float) -> Callable[[float], float]:
    """A series (order + 1, parts) as a function of the share of the step, without rounding."""
    terms = [sum(map(Fraction, parts)) for parts in series]
    return lambda share: float(value_at(terms, Fraction(share) * Fraction(length)))


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
