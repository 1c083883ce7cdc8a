"""Crossings of orbits beside a reference orbit, by differences in doubles, however small.

While an orbit stays beside the reference, the difference of the two obeys an equation without
cancellation (`reference_orbit`), so that doubles keep all its digits. When the difference has grown
to a sixteenth of the state, the sum of reference and difference is a state like any other, and an
engine follows the orbit from there.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.numbers import Array
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Crossings, Orbits, in_turn, no_crossings, silent_outcome
from rigidpend.orbits.integrate.batch import written
from rigidpend.orbits.integrate.reference_orbit import ReferenceOrbit, summed
from rigidpend.orbits.integrate.step_crossings import TOUCH, UNDECIDED, crossings_of_series

LARGE = 2.0**-4
"""Size of a difference, relative to the state, from which on the orbit is followed alone.

Rounding the state then costs the difference four bits. The series of larger differences converge
more slowly."""
MARGIN_BITS = 16
"""Bits below the last bit of a difference at which its square may be left out."""


@dataclass(eq=False)
class Walk:
    """Orbits that are followed beside a reference orbit."""

    reference: ReferenceOrbit
    differences: Array
    """(6, n), the states at time 0 less that of the reference."""
    shifts: Array
    """(n,), the same to first order, as multiples of the reference's tangent."""
    n_crossings: int
    passage_limit: float
    """Longest wait for the next crossing, t', of an orbit that is followed alone."""
    tolerance: float
    """Local tolerance of the series."""

    def __post_init__(self) -> None:
        n = len(self.shifts)
        self.columns, self.count = np.arange(n), np.zeros(n, dtype=np.intp)
        """Orbits that are still beside; and of all orbits the number of crossings."""
        self.found, self.rows = no_crossings(self.n_crossings, n), list[tuple[int, float, int]]()
        """The record, into which :func:`written` writes the rows: orbit, time, separatrix."""
        self.departed = np.full(n, np.nan)
        """t' at which each orbit has left the reference; NaN while it has not."""
        self.states = np.empty((6, n))

    def crossings(self, jobs: int) -> Crossings:
        """Follow all orbits to their crossings of M3 = 0, in the time unit of the reference.

        `jobs` is the number of orbits, or batches, that are followed alone at a time. An orbit is
        FAILED from where its crossings do not rise and fall in turn.
        """
        self.run()
        written(np.reshape(self.rows, (-1, 3)).T, self.found, math.inf)
        # Orbits with equally many crossings behind them ask for equally many more: one task each.
        alone = np.isfinite(self.departed)
        for count in np.unique(self.count[alone]):
            self._go_on(int(count), np.flatnonzero(alone & (self.count == count)), jobs)
        return in_turn(self.found)

    def run(self) -> None:
        """Follow all orbits until each has left the reference or has all its crossings."""
        # k numbers the reference's points, between which the steps are.
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

    def note(self, time: float, separatrix: int, columns: Any = slice(None)) -> None:
        """Note a crossing of some of the orbits still beside; an undecided touch ends them.

        `time` is t' since the start, `columns` selects among the orbits that are still beside.
        """
        each = np.atleast_1d(self.columns[columns])
        each = each[self.count[each] < self.n_crossings]
        self.rows += [(k, time, separatrix) for k in each.tolist()]
        # `_part` takes orbits with all their crossings for done.
        self.count[each] = self.n_crossings if separatrix == UNDECIDED else self.count[each] + 1

    def skip(self) -> int:
        """Pass over the steps on which the differences are multiples of the tangent.

        The result is the number of the point that is reached.
        """
        # Up to there the squares of the differences are below their rounding by `MARGIN_BITS`, so
        # that all orbits cross with the reference, to the last bit of the times.
        largest = float(np.abs(self.shifts).max(initial=0.0))
        k = self.reference.last_below(2.0 ** -(53 + MARGIN_BITS) / largest) if largest else 0
        if k:
            self.differences = np.outer(self.reference.tangents[k], self.shifts)
        for passed in chain.from_iterable(self.reference.crossings[:k]):
            self.note(*passed)
        return k

    def _step(self, k: int) -> None:
        begin, step = self.reference.points[k].time, self.reference.points[k + 1].step
        series = self.reference.series(k, self.differences, self.tolerance)
        for column, share, separatrix in crossed(series):
            self.note(begin + share * step, separatrix, column)
        # Column 0 is the reference itself, for which `reference` has more digits.
        self.differences = summed(series)[:, 1:]

    def _part(self, k: int) -> None:
        """Take out the orbits whose difference has become large, and those that are done."""
        size = self.reference.size(self.differences)
        # A difference that is not finite is done as well: its outcome stays FAILED.
        done = (self.count[self.columns] == self.n_crossings) | ~np.isfinite(size)
        large = ~done & (size > LARGE)
        leaving = self.columns[large]
        self.departed[leaving] = self.reference.points[k].time
        here = self.reference.points[k].doubles[:, None]
        self.states[:, leaving] = here + self.differences[:, large]
        stays = ~(done | large)
        self.columns, self.differences = self.columns[stays], self.differences[:, stays]

    def _fall_silent(self, k: int) -> None:
        """End the orbits that are still beside the reference when it does not cross again."""
        state = self.reference.points[k].doubles[:, None] + self.differences
        for column, (Qp, Qm) in zip(self.columns, state[:2].T, strict=True):
            self.found.outcome[column] = silent_outcome(Qp, Qm)

    def _go_on(self, count: int, columns: Any, jobs: int) -> None:
        """Follow orbits alone that have `count` crossings behind them, and write the others."""
        c = self.reference.coefficients
        after = integrate.crossings(
            Orbits(
                type(c)(*map(float, c)),
                self.states[:, columns],
                self.n_crossings - count,
                self.passage_limit,
            ),
            engine=self.reference.engine,
            bits=53,
            tolerance=self.tolerance,
            jobs=jobs,
        )
        self.found.time[count:, columns] = after.time + self.departed[columns]
        self.found.separatrix[count:, columns] = after.separatrix
        self.found.outcome[columns] = after.outcome


def crossed(series: Array) -> Iterator[tuple[int, float, int]]:
    """(orbit, share of the step, separatrix) of the crossings of all orbits on a step.

    `series` are those of `ReferenceOrbit.series`.
    """
    depth = TOUCH * float(np.linalg.norm(series[0, :3, 0]))
    # Columns on whose step |c_0| exceeds the sum of the other terms cannot cross; most do not.
    M3 = np.abs(series[:, 2, 1:] + series[:, 2, :1])
    for column in np.flatnonzero(~(M3[0] > depth + M3[1:].sum(axis=0))):
        orbit = series[:, :3, 1 + column] + series[:, :3, 0]
        for share, separatrix in crossings_of_series(orbit.T, depth):
            yield int(column), share, separatrix
