"""Crossings of M3 = 0 on stretches of orbits: found by a jump, or step by step where in doubt."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.equations import AlignedCoefficients
from rigidpend.integrate.bounds import (
    TOUCH,
    Bounds,
    bounds,
    leaving_zero,
    slopes,
    with_one_zero,
    without_zero,
)
from rigidpend.integrate.records import Crossings, Outcome, separatrix_beside
from rigidpend.integrate.roots import UndecidedTouch, derivative, value_at, zeros
from rigidpend.numbers.generic import Numbers
from rigidpend.run.workers import check_stop

Array = NDArray[np.float64]

UNDECIDED = 5
"""Mark in place of a separatrix: the orbit is not known from here on."""
REACH = 0.5
"""To how many mean steps of its stretch a series is used."""
NEWTON = 3
"""Iterations from the end of a jump, which is mostly a hundredth of t' off."""
CONVERGED = 1e-8
"""Size of the last of them, in units of the time in which M3 can change; the next is its square."""
CLEAR = 0.1
"""Least share of |M| of the Q that tells the separatrix at the end of a jump."""


class Stretches(NamedTuple):
    """Pieces of orbits between two calls."""

    before: Array
    """(6, m), states at the beginning."""
    after: Array
    times: Array
    """(m,), t' at the beginning."""
    durations: Array
    columns: NDArray[np.int64]
    """(m,), which orbit it is."""

    def chosen(self, where: Any) -> Stretches:
        """Some of the stretches."""
        every: Any = self
        return Stretches(*(x[..., where] for x in every))


class Found(NamedTuple):
    """Crossings as they were found, in no order."""

    columns: NDArray[np.int64]
    times: Array
    separatrix: NDArray[np.int64]

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


def no_crossing_found() -> Found:
    """A record without any."""
    none = np.zeros(0, dtype=np.int64)
    return Found(none, np.zeros(0), none)


class _Jumped(NamedTuple):
    """Ends of m jumps."""

    Qp: Array
    Qm: Array
    M3: Array
    """(order + 1, m), the series about the end."""


class Refiner:
    """Finds crossings on stretches with a batch integrator, whose state it leaves changed."""

    def __init__(self, integrator: Any, coefficients: AlignedCoefficients, stride: int) -> None:
        self.heyoka, self.coefficients, self.reach = integrator, coefficients, REACH / stride
        self.width = integrator.state.shape[1]

    def crossings(self, states: Array, times: Array, columns: NDArray[np.int64]) -> Found:
        """All crossings on the stretches from row to row of a log.

        Parameters
        ----------
        states, times : (k + 1, 6, lanes) and (k + 1, lanes) arrays
        columns : (k, lanes) array
            Which orbit it is, -1 for none.
        """
        s, b = self._open(states.transpose(1, 0, 2), times, columns)
        ends = s.before[2], s.after[2]
        steep = slopes(s.before, self.coefficients), slopes(s.after, self.coefficients)
        s, b = _left(s, b, ~leaving_zero(b, ends, steep, s.durations))
        changed = (s.before[2] < 0) != (s.after[2] < 0)
        single, sure = self._by_jump(*_left(s, b, changed))
        doubtful = ~changed
        doubtful[np.flatnonzero(changed)[~sure]] = True
        return Found.joined([single, self._by_steps(s.chosen(doubtful))])

    def _open(self, states: Array, times: Array, columns: Any) -> tuple[Stretches, Bounds]:
        """The stretches that the simplest bound does not close."""
        before, after, durations = states[:, :-1], states[:, 1:], np.diff(times, axis=0)
        # Where a lane failed, or changed its orbit, anything may stand.
        with np.errstate(all="ignore"):
            b = bounds(before, durations, self.coefficients)
            whole = (durations > 0) & np.isfinite(after.sum(axis=0))
            wanted = (columns >= 0) & whole & ~without_zero(b, before[2], after[2], durations)
        every: Any = before, after, times[:-1], durations, columns
        return Stretches(*(x[..., wanted] for x in every)), Bounds(*(x[wanted] for x in b))

    def _by_jump(self, s: Stretches, b: Bounds) -> tuple[Found, NDArray[np.bool_]]:
        """Crossings where M3 changes its sign, and which of the stretches have just the one."""
        near, far = b.time_to_zero(s.before[2]), b.time_to_zero(s.after[2])
        guess = s.durations * near / (near + far)
        jump = np.where(guess <= s.durations / 2, guess, guess - s.durations)
        Qp, Qm, series = self._jumped(s, jump)
        x, slope, correction = _newton(series)
        zero = x + np.where(jump < 0, s.durations + jump, jump)
        rising = s.before[2] < 0
        large = np.where(rising, Qp, Qm)
        sure = (
            with_one_zero(b, s.before[2], s.after[2], s.durations, zero, slope)
            & (np.abs(correction) * b.a <= CONVERGED)
            & (np.abs(x) <= self.reach * s.durations)
            & (np.abs(large) > CLEAR * b.a)
            & ((slope > 0) == rising)
        )
        separatrix = np.where(rising, np.where(Qp > 0, 2, 4), np.where(Qm < 0, 1, 3))
        found = Found(s.columns[sure], (s.times + zero)[sure], separatrix[sure])
        return found, sure

    def _jumped(self, s: Stretches, jump: Array) -> _Jumped:
        """Jumps from the nearer end of each stretch, batches of nearly equal lengths."""
        order, m, integrator = np.argsort(np.abs(jump)), jump.size, self.heyoka
        # The last batch is filled up with jumps that are made again.
        batches = np.resize(order, -(-m // self.width) * self.width)
        to = jump[batches].reshape(-1, self.width)
        begin = np.where(jump < 0, s.after, s.before)[:, batches].reshape(6, *to.shape)
        series = np.empty((len(to), integrator.order + 1, self.width))
        ends = np.empty((len(to), 2, self.width))
        state, go, set_time = integrator.state, integrator.propagate_until, integrator.set_time
        large, M3 = state[:2], integrator.tc[2]
        for k, lengths in enumerate(to):
            state[:] = begin[:, k]
            set_time(0.0)
            go(lengths)
            ends[k] = large
            # From here, for a lane that waited for others has the series of an empty step.
            integrator.step(write_tc=True)
            series[k] = M3
        found = np.empty((3 + integrator.order, m))
        found[:, batches] = np.concatenate(
            (ends.transpose(1, 0, 2), series.transpose(1, 0, 2))
        ).reshape(len(found), -1)
        return _Jumped(found[0], found[1], found[2:])

    def _by_steps(self, s: Stretches) -> Found:
        """Every crossing on stretches in doubt, from the zeros of each step's series."""
        seen: list[tuple[int, float, int]] = []
        for first in range(0, s.times.size, self.width):
            part = s.chosen(slice(first, first + self.width))
            for lane, time, separatrix in self._stepped(part):
                seen.append((part.columns[lane], part.times[lane] + time, separatrix))
        if not seen:
            return no_crossing_found()
        told: Any = zip(*seen, strict=True)
        columns, times, beside = told
        return Found(np.array(columns), np.array(times, dtype=float), np.array(beside))

    def _stepped(self, s: Stretches) -> Iterator[tuple[int, float, int]]:
        """(lane, time, separatrix) of each crossing of at most a batch of stretches."""
        integrator, n = self.heyoka, s.times.size
        to = np.zeros(self.width)
        to[:n] = s.durations
        integrator.state[:, :n] = s.before
        integrator.set_time(0.0)
        size = np.sqrt((s.before[:3] ** 2).sum(axis=0))
        moving = np.ones(n, dtype=bool)
        while moving.any():
            check_stop()
            begin = integrator.time[:n].copy()
            integrator.propagate_until(to, max_steps=1, write_tc=True)
            moving = (integrator.time[:n] > begin) & moving
            for lane in np.flatnonzero(moving):
                step = float(integrator.last_h[lane])
                series = integrator.tc[:3, :, lane] * step ** np.arange(integrator.order + 1)
                for share, separatrix in crossings_of_series(series, TOUCH * size[lane]):
                    yield int(lane), begin[lane] + share * step, separatrix


def crossings_of_series(
    series: Numbers, depth: float, exactly: Callable[[float], float] | None = None
) -> Iterator[tuple[float, int]]:
    """The crossings on a step as (share of the step, separatrix), from Qp, Qm, M3 as series.

    A touch of M3 = 0 that is not decided comes as `UNDECIDED`, after which nothing is sought.
    """
    Qp, Qm, M3 = (x.tolist() for x in series)
    slopes = derivative(M3)
    try:
        for share in zeros(M3, depth, exactly):
            rising = value_at(slopes, share) > 0
            yield share, separatrix_beside(rising, value_at(Qp, share), value_at(Qm, share))
    except UndecidedTouch as touch:
        yield touch.at, UNDECIDED


def _left(s: Stretches, b: Bounds, where: Any) -> tuple[Stretches, Bounds]:
    return s.chosen(where), Bounds(*(x[where] for x in b))


def _newton(series: Array) -> tuple[Array, Array, Array]:
    """Zeros of the series (order + 1, m) near 0, with the slopes and the last corrections."""
    slopes = series[1:] * np.arange(1.0, len(series))[:, None]
    x = np.zeros(series.shape[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(NEWTON):
            slope = value_at(slopes, x)
            correction = value_at(series, x) / slope
            x = x - correction
    return x, slope, correction
