"""Engine `taylor` at 53 bits: orbits in batches as wide as the processor's vectors.

Nothing is called back while heyoka works: lanes go `STRIDE` steps of their own at a time, and
what they pass is looked at afterwards, for all of them together. Where M3 has changed its sign
one more jump finds the crossing; where it has not, a bound on M3' (see `bounds`) says that it
was never zero; what neither settles is integrated again, step by step, and every zero of the
Taylor series is isolated. A lane whose orbit is done takes the next one, so none waits for the
slowest, and no step depends on what the neighbours do.

Measured on the 63 orbits of Fig. 4 to the left (processor time, best of many, AMD EPYC): 11.0 ms,
of which some 7.5 are heyoka's steps and 3 the search for crossings. Events cost 5 for their
callbacks; dense output would compile 1.6 ms of code at each call. Plain heyoka with events of its
own, in principal axes and in batches of eight, takes 0.75 to 1.1 times as long, by the run: see
docs/measured.md. Two threads hardly gain in doubles, 1.0 to 1.3 where two processes gain 1.9: a
call takes 40 us, and threads wait for the interpreter in between. A grid of times, which is a
call of 2 ms, lets them gain, but costs a quarter more on one thread.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.integrate.compiled import aligned_system, borrowed, heyoka
from rigidpend.integrate.passages import Found, Refiner, no_crossing_found
from rigidpend.integrate.records import Crossings, Orbits, Outcome, no_crossings, silent_outcome
from rigidpend.numbers.generic import Numbers
from rigidpend.run.workers import check_stop

MAX_STEPS = 1_000_000
"""Steps without a crossing after which an orbit counts as failed; a passage takes some hundred."""
VECTORS = 2
"""Number of the processor's vectors in a batch: calls and looks serve twice the orbits."""
STRIDE = 12
"""Steps in a call. With 8 it is as fast; with 16 most passages have to be integrated again."""
KEPT = 512
"""Calls whose ends are kept until they are looked at; they take 0.5 MB."""
AT_ONCE = 64
"""Calls between two looks at the lanes at most: some 0.5 ms."""
FAR = 1e300
"""A time that is never reached, so that every step has its natural length."""
NEVER = -(2**62)
"""The count of a lane that nobody waits for."""
FEWEST = 6
"""Calls between two looks at least."""
CAUTION = 0.75
"""Share of the mean time of a passage after which an orbit is looked at again."""


def crossings_batch(orbits: Orbits, tolerance: float) -> Crossings:
    """Crossings of orbits in double precision, by SIMD batches.

    Parameters
    ----------
    orbits : Orbits
        With states (6, n).
    tolerance : float
        Of the Taylor series.
    """
    with borrowed(_Integrator, tolerance) as integrator:
        return _Batch(integrator, orbits).run()


class _Integrator:
    """heyoka's batch integrator of the aligned field, without events."""

    def __init__(self, tolerance: float) -> None:
        hy = heyoka()
        self.width: int = VECTORS * hy.recommended_simd_size()
        field, _ = aligned_system(hy)
        self.heyoka = hy.taylor_adaptive_batch(
            field, np.zeros((6, self.width)), pars=np.zeros((9, self.width)), tol=tolerance
        )
        self.state, self.time = self.heyoka.state, self.heyoka.time


class _Log:
    """Record of the lanes after each call, row by row, and of the orbits between."""

    def __init__(self, width: int) -> None:
        rows = KEPT + 2 * AT_ONCE
        self.states, self.times = np.empty((rows, 6, width)), np.empty((rows, width))
        self.columns = np.empty((rows, width), dtype=np.int64)
        """Columns of the stretch that ends in the row."""
        self.row = -1

    def rows(self) -> tuple[Any, Any, Any]:
        """All that was noted, as `Refiner.crossings` wants it."""
        end = self.row + 1
        return self.states[:end], self.times[:end], self.columns[1:end]

    def clear(self) -> None:
        """Begin again with the last row."""
        self.states[0], self.times[0] = self.states[self.row], self.times[self.row]
        self.row = 0

    def begin_anew(self, state: NDArray[np.float64], time: NDArray[np.float64]) -> None:
        """Add a row that ends no stretch: some lanes have changed their orbits."""
        self.row += 1
        self.states[self.row], self.times[self.row] = state, time
        self.columns[self.row] = -1


class _Batch:
    """One call: the orbits, and which lane has which."""

    def __init__(self, integrator: _Integrator, orbits: Orbits) -> None:
        self.orbits, self.on, self.heyoka = orbits, integrator, integrator.heyoka
        n, width = orbits.states.shape[1], integrator.width
        self.stride = min(STRIDE, MAX_STEPS)
        self.found = no_crossings(orbits.n_crossings, n)
        self.waiting: Iterator[int] = iter(range(n))
        self.column = np.full(width, -1)
        self.count = np.zeros(width, dtype=np.int64)
        self.alarm, self.last = np.zeros(width), np.zeros(width)
        self.patience = [(0, 0)] * width
        """Count for each lane that its orbit has to exceed, until so many calls are made."""
        self.begun = [0] * width
        self.log, self.seen = _Log(width), [no_crossing_found()]
        self.busy, self.calls, self.pace = 0, 0, 0.0

    def run(self) -> Crossings:
        """Follow all orbits."""
        self.heyoka.pars[:] = np.asarray(self.orbits.coefficients)[:, None]
        self._load(range(self.on.width))
        while self.busy:
            check_stop()
            foremost = self._follow(self._calls(int(self.count.max())))
            if foremost >= self.orbits.n_crossings or self._wants_attention():
                self._load(self._ended())
            if self.log.row >= KEPT:
                self._refine()
        self._refine()
        Found.joined(self.seen).write(self.found, self.orbits.passage_limit)
        return self.found

    def _calls(self, foremost: int) -> int:
        """Number of calls until the next look, from what the foremost orbit has still to cross.

        An orbit that is done sooner goes on to no purpose, which costs time alone.
        """
        left = self.orbits.n_crossings - foremost
        return max(FEWEST, min(AT_ONCE, int(CAUTION * self.pace * left)))

    def _follow(self, calls: int) -> int:
        """Let all lanes go on, note where they are after each call, and count crossings."""
        log, first = self.log, self.log.row
        states, times = log.states, log.times
        go, stride = self.heyoka.propagate_until, self.stride
        state, time = self.on.state, self.on.time
        last = log.row = first + calls
        for row in range(first + 1, last + 1):
            go(FAR, max_steps=stride)
            states[row], times[row] = state, time
        log.columns[first + 1 : last + 1] = self.column
        below = states[first : last + 1, 2] < 0
        changes = np.add.reduce(below[1:] != below[:-1], axis=0, dtype=np.int64)
        self.count += changes
        # No sooner than the last crossing itself, from which `Found.write` counts.
        self.last = np.where(changes, time, self.last)
        self.calls += calls
        return int(self.count.max())

    def _wants_attention(self) -> bool:
        """True if an orbit may have ended without all of its crossings."""
        slow = self.calls >= min(calls for _, calls in self.patience)
        return (
            slow
            or bool((self.on.time >= self.alarm).any())
            or not math.isfinite(self.on.state.sum())
        )

    def _ended(self) -> list[int]:
        """The lanes whose orbits are done; their outcomes are noted."""
        late = self.on.time >= self.alarm
        if late.any():
            self.alarm = np.where(late, self.last + self.orbits.passage_limit, self.alarm)
            late = self.on.time >= self.alarm
        complete = self.count >= self.orbits.n_crossings
        failed = ~np.isfinite(self.on.state.sum(axis=0)) & (self.column >= 0)
        for lane in range(self.on.width):
            if self.calls >= self.patience[lane][1]:
                failed[lane] = self._is_stuck(lane)
        ended = np.flatnonzero(complete | failed | late).tolist()
        for lane in ended:
            column = self.column[lane]
            if complete[lane]:
                self.found.outcome[column] = Outcome.COMPLETE
                self.pace = (self.calls - self.begun[lane]) / self.orbits.n_crossings
            elif not failed[lane]:
                self.found.outcome[column] = silent_outcome(*self.on.state[:2, lane])
        return ended

    def _is_stuck(self, lane: int) -> bool:
        """True if the orbit has taken too many steps without a crossing."""
        count, _ = self.patience[lane]
        self.patience[lane] = int(self.count[lane]), self.calls + MAX_STEPS // self.stride
        return bool(self.column[lane] >= 0 and self.count[lane] <= count)

    def _load(self, lanes: Iterable[int]) -> None:
        """Put the next orbits into lanes that are free; without one a lane goes on unheeded."""
        lanes = list(lanes)
        for lane in lanes:
            column = next(self.waiting, -1)
            heeded = column >= 0
            self.busy += int(heeded) - int(self.column[lane] >= 0)
            self.column[lane], self.last[lane] = column, 0.0
            self.count[lane] = 0 if heeded else NEVER
            self.alarm[lane] = self.orbits.passage_limit if heeded else np.inf
            # A number that is not finite would stop the lanes that still work.
            self.on.state[:, lane] = self.orbits.states[:, max(column, 0)]
            self.begun[lane] = self.calls
            self.patience[lane] = 0, self.calls + MAX_STEPS // self.stride
        if lanes:
            _set_time(self.heyoka, lanes)
            self.log.begin_anew(self.on.state, self.on.time)

    def _refine(self) -> None:
        """Find the crossings of what is kept, with the lanes put aside meanwhile."""
        aside = self.on.state.copy(), tuple(part.copy() for part in self.heyoka.dtime)
        refiner = Refiner(self.heyoka, self.orbits.coefficients, self.stride)
        self.seen.append(refiner.crossings(*self.log.rows()))
        self.log.clear()
        self.on.state[:] = aside[0]
        self.heyoka.set_dtime(*aside[1])


def _set_time(integrator: Any, lanes: Numbers) -> None:
    """Set some lanes' time to 0; the others keep theirs to the last bit, low words included."""
    high, low = (part.copy() for part in integrator.dtime)
    high[lanes] = low[lanes] = 0.0
    if not math.isfinite(high.sum()):
        # Another lane has failed and waits for its next orbit.
        high[~np.isfinite(high)] = 0.0
        low[~np.isfinite(low)] = 0.0
    integrator.set_dtime(high, low)
