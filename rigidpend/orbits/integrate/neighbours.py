"""Crossings of orbits beside a reference orbit: differences in doubles, however small.

While an orbit stays beside the reference, their difference is carried by an equation without
cancellation (`differences`), so that doubles keep all its digits. When it has grown to a
sixteenth, reference and difference together are a state like any other, and the orbit goes on as
one of the engines' own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    in_turn,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.differences import scaled, series_order, summed
from rigidpend.orbits.integrate.passages import UNDECIDED, crossings_of_series, touch
from rigidpend.orbits.integrate.reference_orbit import Passed, ReferenceOrbit

LARGE = 2.0**-4
"""Size of a difference, relative to the state, from which on the orbit goes alone.

Rounding the state then costs it four bits; the series of larger ones converge more slowly."""
MARGIN = 16
"""Bits below a difference's last one: smaller squares of it are left out."""


class Neighbours(NamedTuple):
    """Orbits beside a reference orbit."""

    differences: Any
    """(6, n), states at time 0 less that of the reference."""
    shifts: Any
    """(n,), the same as multiples of the reference's tangent, to first order."""
    n_crossings: int
    passage_limit: float
    """Longest wait for the next crossing, t', of an orbit that goes alone."""


def crossings(
    reference: ReferenceOrbit,
    neighbours: Neighbours,
    *,
    bits: int,
    tolerance: float,
    jobs: int,
) -> Crossings:
    """Follow orbits beside a reference orbit to their crossings of M3 = 0.

    Parameters
    ----------
    reference : ReferenceOrbit
    neighbours : Neighbours
        In numbers of `bits` bits.
    bits : int
        Relative precision of the differences, 53 or 64.
    tolerance : float
        Local tolerance at 53 bits.
    jobs : int
        How many of those that go alone are integrated at a time.

    Returns
    -------
    Crossings
        In the time unit of the reference; FAILED where crossings in turn do not rise and sink.
    """
    walk = Walk(reference, neighbours, bits, series_order(bits, tolerance))
    walk.run()
    for count, alone in enumerate(walk.alone):
        if alone:
            walk.go_on(count, alone, tolerance, jobs)
    return in_turn(walk.found)


class _Departed(NamedTuple):
    """Orbits that have left the reference at one of its points."""

    columns: Any
    time: float
    states: Any


class Walk:
    """Orbits on their way beside the reference."""

    def __init__(
        self, reference: ReferenceOrbit, neighbours: Neighbours, bits: int, order: int
    ) -> None:
        self.reference, self.neighbours = reference, neighbours
        self.bits, self.order = bits, order
        n = len(neighbours.shifts)
        self.found = no_crossings(neighbours.n_crossings, n)
        self.count, self.last = np.zeros(n, dtype=np.intp), np.zeros(n)
        self.alone: list[list[_Departed]] = [[] for _ in range(neighbours.n_crossings)]
        self.columns, self.differences = np.arange(n), neighbours.differences

    def run(self) -> None:
        """Follow all until each has left the reference, or has all its crossings."""
        k = self.skip()
        self._part(k)
        while self.columns.size:
            check_stop()
            if not self.reference.reaches(k + 1):
                self._fall_silent(k)
                break
            self._step(k)
            k += 1
            self._part(k)

    def note(self, passed: Iterator[Passed], columns: Any = slice(None)) -> None:
        """Write crossings of some of the orbits still beside; an undecided touch ends them."""
        for time, separatrix in passed:
            each = np.atleast_1d(self.columns[columns])
            each = each[self.count[each] < self.neighbours.n_crossings]
            if separatrix == UNDECIDED:
                self.count[each] = self.neighbours.n_crossings
                continue
            self.found.time[self.count[each], each] = time
            self.found.separatrix[self.count[each], each] = separatrix
            self.count[each] += 1
            whole = self.count[each] == self.neighbours.n_crossings
            self.found.outcome[each[whole]] = Outcome.COMPLETE

    def skip(self) -> int:
        """Pass over the steps on which the differences are multiples of the tangent."""
        largest = float(np.abs(self.neighbours.shifts).max(initial=0.0))
        k = self.reference.last_below(2.0 ** -(self.bits + MARGIN) / largest) if largest else 0
        if k:
            kind = self.differences.dtype
            tangent = self.reference.tangents[k].astype(kind)
            self.differences = np.outer(tangent, self.neighbours.shifts.astype(kind))
        self.note(self.reference.crossed_before(k))
        return k

    def _step(self, k: int) -> None:
        here, end = self.reference.state(k, self.bits), self.reference.points[k + 1]
        series = self.reference.field(self.bits).series(here, self.differences, self.order)
        series = scaled(series, end.step)
        for column, share, separatrix in crossed(series, here, self.bits):
            time = self.reference.points[k].time + share * end.step
            self.note(iter([Passed(time, separatrix)]), column)
        self.differences = summed(series)[:, 1:]

    def _part(self, k: int) -> None:
        """Let those go alone whose difference is large, and end those that are done."""
        count, size = self.count[self.columns], self.reference.size(self.differences)
        done = (count == self.neighbours.n_crossings) | ~np.isfinite(size)
        large = ~done & (size > LARGE)
        for n in np.unique(count[large]):
            leaving = large & (count == n)
            states = self._states(k, self.differences[:, leaving])
            time = self.reference.points[k].time
            self.alone[n].append(_Departed(self.columns[leaving], time, states))
        if done.any() or large.any():
            stays = ~(done | large)
            self.columns, self.differences = self.columns[stays], self.differences[:, stays]

    def _fall_silent(self, k: int) -> None:
        """End the orbits that are still beside a reference that does not cross again."""
        state = self.reference.state(k, self.bits)[:, None] + self.differences
        for column, (Qp, Qm) in zip(self.columns, state[:2].T, strict=True):
            self.found.outcome[column] = silent_outcome(Qp, Qm)

    def _states(self, k: int, differences: Numbers) -> Any:
        """The orbits' own states: an array of doubles, or a list of Fractions each."""
        if self.bits == 53:
            return self.reference.state(k, 53)[:, None] + differences
        at = self.reference.points[k].state
        return [
            [x + Fraction(*d.as_integer_ratio()) for x, d in zip(at, column, strict=True)]
            for column in differences.T
        ]

    def go_on(self, count: int, alone: Sequence[_Departed], tolerance: float, jobs: int) -> None:
        """Integrate orbits that have `count` crossings behind them."""
        columns = np.concatenate([each.columns for each in alone])
        times = np.concatenate([np.full(each.columns.size, each.time) for each in alone])
        coefficients = self.reference.coefficients
        if self.bits == 53:
            states: Any = np.concatenate([each.states for each in alone], axis=1)
            coefficients = type(coefficients)(*map(float, coefficients))
        else:
            states = [state for each in alone for state in each.states]
        left = self.neighbours.n_crossings - count
        after = integrate.crossings(
            Orbits(coefficients, states, left, self.neighbours.passage_limit),
            engine=self.reference.engine,
            bits=self.bits,
            tolerance=tolerance,
            jobs=jobs,
        )
        self.found.time[count:, columns] = after.time + times
        self.found.separatrix[count:, columns] = after.separatrix
        self.found.outcome[columns] = after.outcome


def crossed(series: Numbers, state: Numbers, bits: int) -> Iterator[tuple[int, float, int]]:
    """(orbit, share of the step, separatrix) of the crossings of all orbits on a step."""
    depth = touch(bits) * float(np.linalg.norm(state[:3].astype(float)))
    M3 = np.abs(series[:, 2, 1:] + series[:, 2, :1])
    for column in np.flatnonzero(~(M3[0] > depth + M3[1:].sum(axis=0))):
        orbit = (series[:, :3, 1 + column] + series[:, :3, 0]).astype(float)
        for share, separatrix in crossings_of_series(orbit.T, depth):
            yield int(column), share, separatrix
