"""Engine `taylor`: many orbits at once, by a kernel (see `kernel`).

A call carries many orbits some steps on and notes the steps on which M3 may have been zero, with
their series; the crossings there are found afterwards. Where M3 is monotone the kernel has found
its zero by Newton's method. Then orbits that are done make room for the next. Nothing is called
back, and other threads have the interpreter while the kernel works: 4,000 orbits take two threads
0.56 of the time of one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import check_stop, note
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.arithmetic import PAIRS, kernel_bits
from rigidpend.orbits.integrate.kernel import notes, taylor_step
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, exactly, in_parts
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.kernel.tape import COMPONENTS
from rigidpend.orbits.integrate.passages import UNDECIDED, crossings_of_series, touch, value_at

MAX_STEPS = 1_000_000
"""Steps without a crossing after which an orbit counts as failed; a passage takes some fifty."""
TOGETHER = {53: 512, 106: 64, 159: 16, 212: 8, 424: 8}
"""Orbits, by bits, that are carried at a time: the kernel then works for 4 ms or more."""
WORTH = {53: 256, 106: 16, 159: 8, 212: 8, 424: 8}
"""Orbits, by bits, that are worth a thread: 20 ms of work."""
STEPS = {53: 128, 106: 32, 159: 16, 212: 8, 424: 2}
"""Steps in a call, by bits; who is done sooner goes on to no purpose, on the average for half."""
EXPECTED = 50
"""Steps that a passage takes."""
TRIPLES = 160
"""Bits up to which crossings are found in sums of three doubles: those keep 161 with their signs.

Errors are some roundings, as those of pairs are at 106 bits. It takes 0.65 of the time of four."""
CONVERGED = 1e-9
"""Size of Newton's last correction, in steps, above which the zeros are isolated instead."""


def crossings(orbits: Orbits, bits: int, tolerance: float) -> Crossings:
    """Crossings of orbits: the same to the last bit whatever the other orbits.

    `tolerance` is that of the Taylor series in 53 bits; every bit more halves it.
    """
    return Batch(orbits, bits, tolerance * 2.0 ** (53 - bits)).run()


def bits_of_numbers(bits: int) -> int:
    """The bits of the kernel's numbers in which crossings are found, by those asked for."""
    return 3 * PAIRS // 2 if PAIRS < bits <= TRIPLES else kernel_bits(bits)


class Batch:
    """Orbits of one body on their way: each column is one that is not yet done."""

    def __init__(self, orbits: Orbits, bits: int, tolerance: float) -> None:
        self.orbits, self.bits, order = orbits, bits, taylor_step.order_of(tolerance)
        self.kind = bits = bits_of_numbers(bits)
        self.kernel = notes.function(order, bits)
        self.initial = np.concatenate(in_parts(orbits.states, bits))
        """The parts of the states one below the other, (6 parts, n)."""
        self.n = self.initial.shape[1]
        self.width = min(TOGETHER[bits], -(-self.n // LANES) * LANES)
        self.found, self.seen = no_crossings(orbits.n_crossings, self.n), [Found.of([])]
        self.parameters = in_parts(orbits.coefficients, bits)
        self.states = np.zeros((len(self.initial), self.width))
        self.times = np.zeros((2, self.width))
        self.notes = np.empty((STEPS[bits] * self.width, notes.width_of_note(order, bits)))
        none = np.zeros(0, dtype=np.int64)
        self.columns, self.counts, self.silence = none, none.copy(), none.copy()
        """Number of the orbit in each column, its crossings so far, and steps since the last."""
        self.last = np.zeros(0)
        """t' of the last crossing."""
        self.next = 0

    def run(self) -> Crossings:
        """Follow all orbits."""
        self.load()
        while self.columns.size:
            check_stop()
            note(self._told)
            left = int(self.orbits.n_crossings - self.counts.min())
            # Few where all orbits are nearly done.
            number = max(8, min(STEPS[self.kind], MAX_STEPS, left * EXPECTED // 2))
            self._take(self.carried(number), number)
            self.load(~self._ended())
        Found.joined(self.seen).write(self.found, self.orbits.passage_limit)
        return self.found

    def _told(self) -> str:
        """Progress of these orbits, in words."""
        open_ = self.n - self.next + self.columns.size
        reached = float(self.times[0, : self.columns.size].max())
        said = f"{open_} of {self.n} orbits under way in {self.bits} bits, at t' = {reached:.4g}"
        return f"{said} of {self.orbits.passage_limit:.4g} at most for each passage"

    def carried(self, number: int) -> Found:
        """All columns some steps further: the crossings on the way, by columns."""
        m = self.columns.size
        groups = -(-m // LANES)
        # Lanes without an orbit repeat the first: their steps are not looked at.
        self.states[:, m:], self.times[:, m:] = self.states[:, :1], self.times[:, :1]
        depth = touch(self.bits) * float(np.sqrt((self.states[:3, :m] ** 2).sum(axis=0).max()))
        given = self.states, self.width, self.times, self.parameters
        count = self.kernel(*given, 2 * depth, groups, number, self.notes)
        taken = self.notes[:count]
        return crossings_on(Steps(taken[taken[:, 0] < m], self.bits))

    def _take(self, found: Found, number: int) -> None:
        """Take in the crossings on so many steps."""
        lanes = found.columns
        self.seen.append(found._replace(columns=self.columns[lanes]))
        crossed = np.bincount(lanes, minlength=self.columns.size)
        self.counts = self.counts + crossed
        self.silence = np.where(crossed > 0, 0, self.silence + number)
        np.maximum.at(self.last, lanes, found.times)
        lost = lanes[found.separatrix == UNDECIDED]
        self.counts[lost] = self.orbits.n_crossings

    def _ended(self) -> NDArray[np.bool_]:
        """The columns whose orbits are done; their outcomes are noted."""
        m = self.columns.size
        complete = self.counts >= self.orbits.n_crossings
        finite = np.isfinite(self.states[:, :m].sum(axis=0))
        late = finite & (self.times[0, :m] > self.last + self.orbits.passage_limit)
        self.found.outcome[self.columns[complete]] = Outcome.COMPLETE
        for k in np.flatnonzero(late & ~complete):
            self.found.outcome[self.columns[k]] = silent_outcome(*self.states[:2, k])
        return complete | late | ~finite | (self.silence >= MAX_STEPS)

    def load(self, kept: Any = slice(None)) -> None:
        """Close the gaps of orbits that are done, and put the next ones behind."""
        m = self.columns.size
        states, times = self.states[:, :m][:, kept], self.times[:, :m][:, kept]
        columns = self.columns[kept]
        new = np.arange(self.next, min(self.n, self.next + self.width - columns.size))
        self.next += new.size
        m = columns.size + new.size
        self.states[:, :m] = np.concatenate((states, self.initial[:, new]), axis=1)
        self.times[:, :m] = np.concatenate((times, np.zeros((2, new.size))), axis=1)
        self.columns = np.concatenate((columns, new))
        self.counts, self.silence, self.last = (
            np.concatenate((x[kept], np.zeros(new.size, x.dtype)))
            for x in (self.counts, self.silence, self.last)
        )


class Steps(NamedTuple):
    """Taylor steps on which M3 may have been zero."""

    notes: Array
    """(m, width), the kernel's (see `kernel.notes`)."""
    bits: int
    """Precision that was asked for."""

    def field(self, name: str) -> Array:
        """One of the `FIELDS`, of m steps."""
        return self.notes[:, notes.FIELDS.index(name)]

    @property
    def series(self) -> Array:
        """(m, MOMENTA, order + 1, parts), in powers of t' from the beginning; M3 is the third."""
        parts, begin = KINDS[bits_of_numbers(self.bits)].parts, len(notes.FIELDS)
        terms = (self.notes.shape[1] - begin) // (notes.MOMENTA * parts)
        return self.notes[:, begin:].reshape(-1, notes.MOMENTA, terms, parts)

    def chosen(self, where: NDArray[Any]) -> Steps:
        """Some of the steps, by a mask."""
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
        order = np.lexsort((self.times, self.columns))
        columns, times, separatrix = (x[order] for x in self)
        row = np.arange(columns.size) - np.searchsorted(columns, columns)
        waited = np.where(row > 0, times - np.roll(times, 1), times)
        ends = (separatrix == UNDECIDED) | (waited > limit)
        rows, n = found.time.shape
        stop = np.full(n, rows)
        np.minimum.at(stop, columns[ends], row[ends])
        kept, last = row < stop[columns], ends & (row == stop[columns])
        undecided = separatrix[last] == UNDECIDED
        found.outcome[columns[last]] = np.where(undecided, Outcome.FAILED, Outcome.NO_CROSSING)
        # A pair beside a touch may complete an orbit that seemed to have been silent.
        found.outcome[columns[kept & (row == rows - 1)]] = Outcome.COMPLETE
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
        exactly_ = _without_rounding(series[2], length) if steps.bits > 53 else None
        for share, separatrix in crossings_of_series(shares, depth, exactly_):
            seen.append((int(lane), time + share * length, separatrix))
    return Found.of(seen)


def _without_rounding(series: Array, length: float) -> Callable[[float], float]:
    """A series (order + 1, parts) as a function of the share of the step, without rounding."""
    terms = [sum(map(Fraction, parts)) for parts in series]
    return lambda share: float(value_at(terms, Fraction(share) * Fraction(length)))


def advance(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    count: int,
    bits: int,
    tolerance: float,
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit of Fractions so many steps: times since the start, and states.

    The kernel's numbers that have as many `bits` serve; `tolerance` is that of 53 bits.
    """
    kind, size = kernel_bits(bits), len(COMPONENTS)
    order = taylor_step.order_of(tolerance * 2.0 ** (53 - kind))
    kernel, parameters = notes.function(order, kind), in_parts(coefficients, kind)
    begin = in_parts(np.array(state, dtype=object), kind).reshape(-1, 1)
    # All lanes carry the orbit; what is noted of its crossings is not looked at.
    lanes, time = np.repeat(begin, LANES, axis=1), np.zeros((2, LANES))
    room = np.empty((LANES, notes.width_of_note(order, kind)))
    found = []
    for _ in range(count):
        check_stop()
        kernel(lanes, LANES, time, parameters, 0.0, 1, 1, room)
        here = tuple(exactly(lanes[:, 0].reshape(-1, size)))
        found.append((exactly(time[:, :1])[0], here))
    return found
