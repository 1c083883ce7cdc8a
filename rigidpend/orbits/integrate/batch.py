"""Engine `taylor`: many orbits at once, by a kernel (see `kernel`).

A call carries many orbits some steps on and notes the steps on which M3 may have
been zero, with their series; `passages` finds the crossings there. Then orbits that are done
make room for the next. Nothing is called back, and other threads have the interpreter while the
kernel works: 4,000 orbits take two threads 0.56 of the time of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

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
from rigidpend.orbits.integrate.arithmetic import kernel_bits
from rigidpend.orbits.integrate.kernel import notes, taylor_step
from rigidpend.orbits.integrate.kernel.lane_numbers import exactly, in_parts
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.kernel.tape import COMPONENTS
from rigidpend.orbits.integrate.passages import (
    UNDECIDED,
    Found,
    Steps,
    crossings_on,
    touch,
)

MAX_STEPS = 1_000_000
"""Steps without a crossing after which an orbit counts as failed; a passage takes some fifty."""
TOGETHER = {53: 512, 106: 64, 212: 8, 424: 8}
"""Orbits, by bits, that are carried at a time: the kernel then works for 4 ms or more."""
WORTH = {53: 256, 106: 16, 212: 8, 424: 8}
"""Orbits, by bits, that are worth a thread: 20 ms of work."""
STEPS = {53: 128, 106: 32, 212: 8, 424: 2}
"""Steps in a call, by bits; who is done sooner goes on to no purpose, on the average for half."""
EXPECTED = 50
"""Steps that a passage takes."""


def crossings_batch(orbits: Orbits, bits: int, tolerance: float) -> Crossings:
    """Crossings of orbits by vectors of lanes.

    Parameters
    ----------
    orbits : Orbits
        With states (6, n) at 53 bits, else lists of Fractions.
    bits : int
        53, or up to the last of `arithmetic.LADDER`.
    tolerance : float
        Of the Taylor series in 53 bits; every bit more halves it.

    Returns
    -------
    Crossings
        An orbit's are the same to the last bit whatever the other orbits.
    """
    return Batch(orbits, bits, tolerance * 2.0 ** (53 - bits)).run()


class Batch:
    """Orbits of one body on their way: each column is one that is not yet done."""

    def __init__(self, orbits: Orbits, bits: int, tolerance: float) -> None:
        self.orbits, self.bits, order = orbits, bits, taylor_step.order_of(tolerance)
        self.kind = bits = kernel_bits(bits)
        self.kernel = notes.function(order, bits)
        self.initial = _initial(orbits, bits)
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
            number = self._number()
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

    def _number(self) -> int:
        """Number of steps of the next call: few where all orbits are nearly done."""
        left = int(self.orbits.n_crossings - self.counts.min())
        return max(8, min(STEPS[self.kind], MAX_STEPS, left * EXPECTED // 2))

    def carried(self, number: int) -> Steps:
        """All columns some steps further: those on which M3 may have been zero."""
        m = self.columns.size
        groups = -(-m // LANES)
        # Lanes without an orbit repeat the first: their steps are not looked at.
        self.states[:, m:], self.times[:, m:] = self.states[:, :1], self.times[:, :1]
        depth = touch(self.bits) * float(np.sqrt((self.states[:3, :m] ** 2).sum(axis=0).max()))
        given = self.states, self.width, self.times, self.parameters
        count = self.kernel(*given, 2 * depth, groups, number, self.notes)
        taken = self.notes[:count]
        return Steps(taken[taken[:, 0] < m], self.bits)

    def _take(self, taken: Steps, number: int) -> None:
        """Take in the crossings on the steps."""
        found = crossings_on(taken)
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
        m, states, times = self.columns.size, self.states[:, :0], self.times[:, :0]
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


def _initial(orbits: Orbits, bits: int) -> Array:
    """Initial states, their parts one below the other: (6 parts, n)."""
    if bits == 53:
        return np.asarray(orbits.states, dtype=float)
    return np.concatenate(in_parts(np.array(orbits.states, dtype=object).T, bits))


def advance(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    count: int,
    bits: int,
    tolerance: float,
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit some steps of natural length: times since the start, and states.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions, as the six components of `state`.
    count : int
        Number of steps.
    bits : int
        Those of `arithmetic.LADDER` that have as many serve.
    tolerance : float
        Of the Taylor series in 53 bits.
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
