"""Orbits that maps leave open: integrated in more bits at first, then handed over to a map.

An error that a passage makes grows in all that follow. Up to where it has grown by as many bits as
the integration is sharper than the map, the integration alone decides how good the whole is; from
there on the map does as well, in less than a hundredth of the time. By how much errors grow up to
a crossing a map in doubles tells: its own are seen there. They are taken for the largest that a map
may have, so that the orbit is handed over rather too late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import in_kernel
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.states import at_crossings
from rigidpend.orbits.records import columns as columns_of
from rigidpend.orbits.records import put
from rigidpend.orbits.return_map.build import SLACK
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Columns, Compute, Decided
from rigidpend.routes.mapped import Maps
from rigidpend.routes.run import tolerance_of
from rigidpend.routes.start import Scales

LATEST = 0.7
"""Share of an orbit's crossings up to which it is worth handing it over."""
SETTLED = 8
"""Binary logarithm of how late a crossing may be, t', in roundings of the integration."""


def handed_over(maps: Maps, integrated: Compute, known: Decided, ladder: Sequence[int]) -> Compute:
    """Computations of orbits of which so much is known by the second of two maps.

    The first one in each precision of the ladder is handed over where that pays, to the maps in
    turn, for what it is held against must share no table with it. Those that confirm it in the same
    precision are integrations to the end.
    """

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        if scales != certainty.FIRST or not in_kernel(maps.run.arithmetic.engine, bits):
            return integrated(bits, scales, columns)
        found = columns_of(known.crossings, columns)
        found.outcome[:] = Outcome.FAILED
        which = ladder.index(bits) % 2
        at = handover(maps, bits - maps.pair[which], columns, known)
        some = np.flatnonzero(at)
        if some.size:
            given = columns[some], columns_of(found, some), at[some], which
            put(found, some, _continued(maps, bits, *given))
        left = np.flatnonzero(found.outcome != Outcome.COMPLETE)
        if left.size:
            put(found, left, integrated(bits, scales, columns[left]))
        return found

    return compute


def handover(maps: Maps, more: int, columns: Columns, known: Decided) -> NDArray[np.intp]:
    """The crossing of each orbit where a map takes over from so many bits more than it has.

    0 where that does not pay.
    """
    before = columns_of(known, columns)
    doubles = maps.crossings(53, certainty.FIRST, columns)
    error = maps.run.rate * np.abs(doubles.time - before.crossings.time)
    grown = ~(error <= SLACK * 2.0 ** (more - 53))
    at = np.maximum(1, np.argmax(grown, axis=0))
    certain = before.certain[at - 1, np.arange(columns.size)]
    return np.where(grown.any(axis=0) & certain & (at <= LATEST * len(error)), at, 0)


def _continued(
    maps: Maps, bits: int, columns: Columns, known: Crossings, at: NDArray[np.intp], which: int
) -> Crossings:
    """The crossings of orbits that are handed over to a map at some of their known ones.

    Orbits are FAILED that are not where these say, or leave the tables.
    """
    run, scales, every = maps.run, certainty.FIRST, np.arange(columns.size)
    expected = known.time[at, every]
    # Lanes end together where their times are alike, and threads where each has some of all.
    groups = np.arange(columns.size) // LANES
    order = np.argsort(expected)[np.argsort(groups % run.jobs, kind="stable")]
    begin, states = run.begin(bits, scales, columns[order])
    time, states, late = at_crossings(
        begin.coefficients,
        states,
        expected[order] / scales.time_unit,
        bits,
        tolerance_of(run.arithmetic, bits, scales),
        2.0 ** (SETTLED - bits),
        engine=run.arithmetic.engine,
        jobs=run.jobs,
    )
    back = np.argsort(order)
    time, states = time[back].astype(float) * scales.time_unit, states[:, back]
    # The first crossing is upward. Taken for the other kind one lies far outside of the tables.
    rising = at % 2 == 0
    right = np.abs(late[back]) <= 2.0 ** (SETTLED - bits)
    right &= run.rate * np.abs(time - expected) <= certainty.CLOSE
    known.time[at, every] = time
    for up in (True, False):
        some = np.flatnonzero(rising == up)
        if some.size:
            here, given = at[some], (which, columns[some], states[:, some], time[some])
            beside, further = maps.onward(*given, len(known.time) - here.min(), rising=up)
            right[some] &= beside == known.separatrix[here, some]
            mine = columns_of(known, some)
            _written(mine, further, here)
            put(known, some, mine)
    complete = right & (known.separatrix[-1] > 0)
    known.outcome[:] = np.where(complete, Outcome.COMPLETE, Outcome.FAILED)
    return known


def _written(known: Crossings, further: Crossings, at: NDArray[np.intp]) -> None:
    """Write further crossings behind some known one of each orbit."""
    row = np.arange(len(known.time))[:, None]
    later, source = row > at, np.maximum(0, row - at - 1)
    known.time[later] = np.take_along_axis(further.time, source, axis=0)[later]
    known.separatrix[later] = np.take_along_axis(further.separatrix, source, axis=0)[later]
