"""Crossings of orbits beside a reference orbit: differences in doubles, however small.

While an orbit stays beside the reference, their difference is carried by an equation without
cancellation (`differences`), so that doubles keep all its digits. When it has grown to a
sixteenth, reference and difference together are a state like any other, and the orbit goes on as
one of the engines' own.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidpend import integrate
from rigidpend.integrate.bounds import touch
from rigidpend.integrate.compiled import exactly
from rigidpend.integrate.differences import DifferenceField
from rigidpend.integrate.passages import UNDECIDED, crossings_of_series
from rigidpend.integrate.records import Crossings, Orbits, Outcome, no_crossings, silent_outcome
from rigidpend.integrate.reference_orbit import (
    ReferenceOrbit,
    relative_size,
    scaled,
    series_order,
    summed,
)
from rigidpend.numbers.generic import Numbers
from rigidpend.run.workers import check_stop

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
    longest: float,
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
    longest : float
        Longest wait for the next crossing, t', beside the reference.
    jobs : int

    Returns
    -------
    Crossings
        In the time unit of the reference; FAILED where crossings in turn do not rise and sink.
    """
    walk = _Walk(reference, neighbours, bits, tolerance, longest)
    walk.run()
    for count, alone in enumerate(walk.alone):
        if alone:
            walk.go_on(count, alone, tolerance, jobs)
    return _in_turn(walk.found)


class _Alone(NamedTuple):
    """Orbits that have left the reference at one of its points."""

    columns: Any
    time: float
    states: Any


class _Walk:
    """Orbits on their way beside the reference."""

    def __init__(
        self,
        reference: ReferenceOrbit,
        neighbours: Neighbours,
        bits: int,
        tolerance: float,
        longest: float,
    ) -> None:
        self.reference, self.neighbours, self.bits = reference, neighbours, bits
        self.order, self.longest = series_order(bits, tolerance), longest
        n = len(neighbours.shifts)
        self.field = DifferenceField(reference.coefficients, bits)
        self.found = no_crossings(neighbours.n_crossings, n)
        self.count, self.last = np.zeros(n, dtype=np.intp), np.zeros(n)
        self.alone: list[list[_Alone]] = [[] for _ in range(neighbours.n_crossings)]
        self.columns, self.differences = np.arange(n), neighbours.differences

    def run(self) -> None:
        """Follow all until each has left the reference, or has all its crossings."""
        k = self._skip()
        self._part(k)
        while self.columns.size:
            check_stop()
            self._step(k)
            k += 1
            self._part(k)

    def _skip(self) -> int:
        """Pass over the steps on which the differences are multiples of the tangent."""
        largest = float(np.abs(self.neighbours.shifts).max(initial=0.0))
        k = self.reference.last_below(2.0 ** -(self.bits + MARGIN) / largest) if largest else 0
        if k:
            kind = self.differences.dtype
            tangent = self.reference.tangents[k].astype(kind)
            self.differences = np.outer(tangent, self.neighbours.shifts.astype(kind))
        for passed in (one for step in self.reference.crossings[:k] for one in step):
            self._note(self.columns, passed.time, passed.separatrix)
        return k

    def _step(self, k: int) -> None:
        here, length = self.reference.state(k, self.bits), self.reference.step(k)
        series = scaled(self.field.series(here, self.differences, self.order), length)
        began = float(self.reference.point(k).time)
        for column, share, separatrix in _crossed(series, here, self.bits):
            self._note(self.columns[column], began + share * length, separatrix)
        self.differences = summed(series)[:, 1:]

    def _note(self, columns: Any, time: float, separatrix: int) -> None:
        """Write a crossing of some orbits; an undecided touch ends them."""
        each = np.atleast_1d(columns)
        each = each[self.count[each] < self.neighbours.n_crossings]
        if separatrix == UNDECIDED:
            self.count[each] = self.neighbours.n_crossings
            return
        self.found.time[self.count[each], each] = time
        self.found.separatrix[self.count[each], each] = separatrix
        self.count[each] += 1
        self.last[each] = time
        self.found.outcome[each[self.count[each] == self.neighbours.n_crossings]] = Outcome.COMPLETE

    def _part(self, k: int) -> None:
        """Let those go alone whose difference is large, and end those that are done."""
        here, time = self.reference.state(k, self.bits), float(self.reference.point(k).time)
        size, count = relative_size(self.differences, here), self.count[self.columns]
        done = (count == self.neighbours.n_crossings) | ~np.isfinite(size)
        silent = ~done & (time - self.last[self.columns] > self.longest)
        for column, (Qp, Qm) in zip(
            self.columns[silent], (here[:2, None] + self.differences[:2, silent]).T, strict=True
        ):
            self.found.outcome[column] = silent_outcome(Qp, Qm)
        large = ~done & ~silent & (size > LARGE)
        for n in np.unique(count[large]):
            leaving = large & (count == n)
            states = self._states(k, self.differences[:, leaving])
            self.alone[n].append(_Alone(self.columns[leaving], time, states))
        stays = ~(done | silent | large)
        self.columns, self.differences = self.columns[stays], self.differences[:, stays]

    def _states(self, k: int, differences: Numbers) -> Any:
        """The orbits' own states: an array of doubles, or a list of Fractions each."""
        if self.bits == 53:
            return self.reference.state(k, 53)[:, None] + differences
        at = self.reference.point(k).state
        return [
            [x + exactly(d) for x, d in zip(at, column, strict=True)] for column in differences.T
        ]

    def go_on(self, count: int, alone: list[_Alone], tolerance: float, jobs: int) -> None:
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


def _crossed(series: Numbers, state: Numbers, bits: int) -> Iterator[tuple[int, float, int]]:
    """(orbit, share of the step, separatrix) of the crossings of all orbits on a step."""
    orbits = (series[:, :3, 1:] + series[:, :3, :1]).astype(float)
    depth = touch(bits) * float(np.linalg.norm(state[:3].astype(float)))
    M3 = np.abs(orbits[:, 2])
    for column in np.flatnonzero(~(M3[0] > depth + M3[1:].sum(axis=0))):
        for share, separatrix in crossings_of_series(orbits[:, :, column].T, depth):
            yield int(column), share, separatrix


def _in_turn(found: Crossings) -> Crossings:
    """Mark orbits as failed, from there on, whose crossings do not rise and sink in turn.

    So a crossing that is lost or found twice where two steps meet makes no symbol.
    """
    rising = np.isin(found.separatrix, (2, 4))
    twice = (found.separatrix[1:] > 0) & (rising[1:] == rising[:-1])
    bad = np.vstack((np.zeros((1, twice.shape[1]), dtype=bool), np.logical_or.accumulate(twice)))
    found.time[bad], found.separatrix[bad] = np.nan, 0
    found.outcome[bad.any(axis=0)] = Outcome.FAILED
    return found
