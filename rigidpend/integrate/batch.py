"""Engine `taylor` at 53 bits: many orbits at once, by the kernel of `step_code`.

A call carries up to `TOGETHER` orbits some steps on and notes the steps on which M3 may have
been zero, with their series; `passages` finds the crossings there. Then orbits that are done
make room for the next. Nothing is called back, and other threads have the interpreter while the
kernel works: it is away for a fifth of the time.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.integrate import machine_code, step_code
from rigidpend.integrate.bounds import TOUCH
from rigidpend.integrate.passages import UNDECIDED, Found, Steps, crossings_on, no_crossing_found
from rigidpend.integrate.records import (
    Crossings,
    Orbits,
    Outcome,
    no_crossings,
    silent_outcome,
)
from rigidpend.run.workers import check_stop

Array = NDArray[np.float64]

MAX_STEPS = 1_000_000
"""Steps without a crossing after which an orbit counts as failed; a passage takes some fifty."""
TOGETHER = 256
"""Orbits that are carried at a time: enough for the kernel to work for a millisecond."""
STEPS = 64
"""Steps in a call; an orbit that is done sooner goes on to no purpose, on the average for half."""
EXPECTED = 50
"""Steps that a passage takes."""


def crossings_batch(orbits: Orbits, tolerance: float) -> Crossings:
    """Crossings of orbits in double precision, by vectors of lanes.

    Parameters
    ----------
    orbits : Orbits
        With states (6, n).
    tolerance : float
        Of the Taylor series.

    Returns
    -------
    Crossings
        An orbit's are the same to the last bit whatever the other orbits.
    """
    return _Batch(orbits, step_code.order_of(tolerance)).run()


@functools.cache
def kernel(order: int) -> Any:
    """The compiled kernel for series of an order (see `step_code.text`)."""
    pointer, count, number = ctypes.c_void_p, ctypes.c_int64, ctypes.c_double
    kinds = (pointer, count, pointer, pointer, number, count, count, pointer)
    return machine_code.function(step_code.text(order), "carry", *kinds)


class _Batch:
    """Orbits of one body on their way: each column is one that is not yet done."""

    def __init__(self, orbits: Orbits, order: int) -> None:
        self.orbits, self.order, self.kernel = orbits, order, kernel(order)
        self.n = orbits.states.shape[1]
        self.width = min(TOGETHER, -(-self.n // step_code.LANES) * step_code.LANES)
        self.found, self.seen = no_crossings(orbits.n_crossings, self.n), [no_crossing_found()]
        self.coefficients = np.array(orbits.coefficients, dtype=float)
        self.states, self.times = np.zeros((6, self.width)), np.zeros((2, self.width))
        self.notes = np.empty((STEPS * self.width, step_code.width_of_note(order)))
        none = np.zeros(0, dtype=np.int64)
        self.columns, self.counts, self.silence = none, none.copy(), none.copy()
        """Of each column: which orbit, its crossings so far, steps since the last of them."""
        self.last = np.zeros(0)
        """t' of the last crossing."""
        self.next = 0

    def run(self) -> Crossings:
        """Follow all orbits."""
        self._load()
        while self.columns.size:
            check_stop()
            steps = self._steps()
            self._take(self._carried(steps), steps)
            self._load(~self._ended())
        Found.joined(self.seen).write(self.found, self.orbits.passage_limit)
        return self.found

    def _steps(self) -> int:
        """Number of steps of the next call: few where all orbits are nearly done."""
        left = self.orbits.n_crossings - int(self.counts.min())
        return max(8, min(STEPS, MAX_STEPS, left * EXPECTED // 2))

    def _carried(self, steps: int) -> Steps:
        """All columns some steps further: those on which M3 may have been zero."""
        m = self.columns.size
        groups = -(-m // step_code.LANES)
        # Lanes without an orbit repeat the first: their steps are not looked at.
        self.states[:, m:], self.times[:, m:] = self.states[:, :1], self.times[:, :1]
        depth = TOUCH * float(np.sqrt((self.states[:3, :m] ** 2).sum(axis=0).max()))
        count = self.kernel(
            self.states.ctypes.data,
            self.width,
            self.times.ctypes.data,
            self.coefficients.ctypes.data,
            2 * depth,
            groups,
            steps,
            self.notes.ctypes.data,
        )
        notes = self.notes[:count]
        return Steps.of_notes(notes[notes[:, 0] < m])

    def _take(self, steps: Steps, number: int) -> None:
        """Take in the crossings on the steps."""
        found = crossings_on(steps)
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

    def _load(self, kept: Any = slice(None)) -> None:
        """Close the gaps of orbits that are done, and put the next ones behind."""
        m, states, times = self.columns.size, self.states[:, :0], self.times[:, :0]
        states, times = self.states[:, :m][:, kept], self.times[:, :m][:, kept]
        columns = self.columns[kept]
        new = np.arange(self.next, min(self.n, self.next + self.width - columns.size))
        self.next += new.size
        m = columns.size + new.size
        self.states[:, :m] = np.concatenate((states, self.orbits.states[:, new]), axis=1)
        self.times[:, :m] = np.concatenate((times, np.zeros((2, new.size))), axis=1)
        self.columns = np.concatenate((columns, new))
        self.counts, self.silence, self.last = (
            np.concatenate((x[kept], np.zeros(new.size, x.dtype)))
            for x in (self.counts, self.silence, self.last)
        )
