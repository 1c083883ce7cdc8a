"""Orbits that maps leave open: integrated in more bits at first, then handed over to a map.

An error that a passage makes grows in all passages that follow. Until it has grown by as many bits
as the integration is sharper than the map, the error of the integration dominates at the end; from
there on the map does as well, in less than a hundredth of the time. A map in doubles shows how much
errors grow up to a crossing: its own error there is its distance from the sharper map. It is
compared with one from which its growth counts, so large that an orbit is rather handed over too
late.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigidpend.orbits import columns as columns_of
from rigidpend.orbits import put
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import in_kernel
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.states import at_crossings
from rigidpend.orbits.return_map.build import Design
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Compute, Decided
from rigidpend.routes.ladder import Columns, Rung, kept_bits
from rigidpend.routes.mapped import Maps
from rigidpend.routes.problem import narrower
from rigidpend.routes.run import tolerance_of
from rigidpend.routes.start import Scales

GROWING = 2.0**17
"""Error of a map in doubles, in roundings, from which on its growth counts.

Such errors are some 2^7 roundings at the first crossing and 2^22 at the second one, where that of d
shows for the first time. With 2^13 instead 0.0074, 0.0014 and 0.0005 of 2,169 orbits of five bodies
in 109 bits erred by more than R times the difference from 106 bits, for R of 1, 3 and 10; with 2^17
none did for R of 1, and 0.001 for R of 0.3. They took 1.2 times as long."""
LATEST = 0.7
"""Share of an orbit's crossings up to which a handover is worth while."""
TIME_ERROR_BITS = 8
"""Binary logarithm of the error allowed in the time of a crossing, in units of 2^-bits t'."""


def handed_over(maps: Maps, integrated: Compute, known: Decided, ladder: Sequence[Rung]) -> Compute:
    """Computations, for `certainty.climb`, of orbits that maps leave open.

    `known` is what the maps found, by `maps.last` at last. The first computation on each rung is
    handed over where that pays. The two maps take turns, for a result and the one that it is
    compared with must not come from the same tables. Further computations on the same rung are
    integrations to the end, by `integrated`.
    """
    turns = sorted(maps.designs[:2], key=lambda design: design == maps.last)
    by = dict(zip((rung.bits for rung in ladder), itertools.cycle(turns), strict=False))

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        if scales != certainty.FIRST_SCALES or not in_kernel(maps.run.arithmetic.engine, bits):
            return integrated(bits, scales, columns)
        # All orbits count as failed until a map has carried them to their end.
        found = columns_of(known.crossings, columns)
        found.outcome[:] = Outcome.FAILED
        # Integration in pairs of doubles is only as much sharper than the map as what they keep.
        fewer = narrower(maps.problem)
        more = kept_bits(bits) - maps.built_bits[by[bits]] - fewer
        # Beside a midline errors of maps in doubles too begin as many bits smaller.
        at = handover(maps, more - fewer, columns, known)
        some = np.flatnonzero(at)
        if some.size:
            given = columns[some], columns_of(found, some), at[some], by[bits]
            put(found, some, _continued(maps, bits, *given))
        left = np.flatnonzero(found.outcome != Outcome.COMPLETE)
        if left.size:
            put(found, left, integrated(bits, scales, columns[left]))
        return found

    return compute


def handover(maps: Maps, more: int, columns: Columns, known: Decided) -> NDArray[np.intp]:
    """The number of the crossing, (n,), from which a map may continue each orbit; 0 for nowhere.

    `more` is by how many bits the integration up to there is sharper than the map. 0 stands also
    where the handover would come too late to pay, or at a crossing that is not yet certain.
    """
    before = columns_of(known, columns)
    doubles = maps.crossings(53, certainty.FIRST_SCALES, columns)
    error = maps.run.rate * np.abs(doubles.time - before.crossings.time)
    # From GROWING on the error has grown by 2^more. Negated, so that a missing time (NaN)
    # counts as a large error.
    grown = ~(error <= GROWING * 2.0 ** (more - 53))
    # argmax finds the first crossing with True. Symbol at - 1 is certain only if crossing `at` is.
    at = np.maximum(1, np.argmax(grown, axis=0))
    certain = before.certain[at - 1, np.arange(columns.size)]
    return np.where(grown.any(axis=0) & certain & (at <= LATEST * len(error)), at, 0)


def _continued(
    maps: Maps, bits: int, columns: Columns, known: Crossings, at: NDArray[np.intp], design: Design
) -> Crossings:
    """The crossings of orbits, each integrated up to its known crossing `at`, then by a map.

    An orbit is FAILED if the integration does not meet that crossing or the map's tables end.
    """
    run, scales, every = maps.run, certainty.FIRST_SCALES, np.arange(columns.size)
    expected = known.time[at, every]
    # Orbits with similar times share a vector, whose lanes then end together. The vectors are dealt
    # to the threads in turn, so that each thread has short and long ones.
    groups = np.arange(columns.size) // LANES
    order = np.argsort(expected)[np.argsort(groups % run.jobs, kind="stable")]
    begin, states = run.begin(bits, scales, columns[order])
    time, states, late = at_crossings(
        begin.coefficients,
        states,
        expected[order] / scales.time_unit,
        bits,
        tolerance_of(run.arithmetic, bits, scales),
        2.0 ** (TIME_ERROR_BITS - bits),
        engine=run.arithmetic.engine,
        jobs=run.jobs,
    )
    # Back to the order of the columns, and to t'.
    back = np.argsort(order)
    time, states = time[back].astype(float) * scales.time_unit, states[:, back]
    # The first crossing is upward, and then they alternate. A crossing that is taken for the wrong
    # kind does no harm: it lies far outside of the tables, and the orbit is FAILED.
    rising = at % 2 == 0
    right = np.abs(late[back]) <= 2.0 ** (TIME_ERROR_BITS - bits)
    # Another crossing than the known one would shift all symbols that follow.
    right &= run.rate * np.abs(time - expected) <= certainty.LIMIT_OF_TWO
    known.time[at, every] = time
    for up in (True, False):
        some = np.flatnonzero(rising == up)
        if some.size:
            here, given = at[some], (design, columns[some], states[:, some], time[some])
            # As many crossings as the earliest handover needs; `_written` takes those of each.
            beside, further = maps.onward(*given, len(known.time) - 1 - here.min(), rising=up)
            right[some] &= beside == known.separatrix[here, some]
            mine = columns_of(known, some)
            _written(mine, further, here)
            put(known, some, mine)
    complete = right & (known.separatrix[-1] > 0)
    known.outcome[:] = np.where(complete, Outcome.COMPLETE, Outcome.FAILED)
    return known


def _written(known: Crossings, further: Crossings, at: NDArray[np.intp]) -> None:
    """Write the crossings that follow behind the known crossing `at` of each orbit, in place."""
    # (n_crossings, n): the rows behind each orbit's own, and the rows that they come from.
    row = np.arange(len(known.time))[:, None]
    later, source = row > at, np.maximum(0, row - at - 1)
    known.time[later] = np.take_along_axis(further.time, source, axis=0)[later]
    known.separatrix[later] = np.take_along_axis(further.separatrix, source, axis=0)[later]
