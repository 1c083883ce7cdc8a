"""Orbits that maps leave in doubt: integrated until the doubt has begun, then by maps again.

A passage multiplies the error of a map by 2.4 in the median with the body of Fig. 4, but by 10 or
so in the few orbits that two maps leave open. Such an orbit is integrated in pairs of doubles up
to where they differ by `HANDOVER`. What a map adds from there is thousands of times less than
what it has accumulated in all, at half of the cost of integrating all of the orbit.

Such a computation counts as one of higher precision, by the same rule as an integration: it is
compared with the map before, or with a second one whose integration has other units and whose
map has another design. So neither spoilt tables nor a wrong integration is called certain.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.integrate.batch_sections import Reached
from rigidpend.integrate.records import Crossings, Outcome
from rigidpend.return_map.rapid import Followed
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Decided
from rigidpend.routes.cycle import MIRRORED
from rigidpend.routes.start import Scales

if TYPE_CHECKING:
    from rigidpend.routes.mapped import Integration, Maps

HANDOVER = 1e-10
"""Phase difference of two maps, radians, at which integration hands over.

`certainty.LINEAR` asks for errors two thousand times smaller. Of 134 orbits of 30 symbols of
Fig. 4 they were 12,000 times smaller at least than those of two maps, and twenty million times
in the median."""


def decide(
    maps: Maps, integrated: Integration, known: Decided, open_: certainty.Columns, rate: float
) -> None:
    """Decide columns that maps of long doubles leave open, those that it can; others stay.

    Parameters
    ----------
    maps : Maps
    integrated : Integration
        With pairs of doubles.
    known : Decided
        Of all columns; what is certain now replaces what is there.
    open_ : array of int
    rate : float
        Radians per unit of t'.
    """
    wanted = crossings_in_common(maps, open_, rate)

    def compute(_: int, scales: Scales, some: Any) -> Crossings:
        columns = open_[some]
        if not maps.serve(maps.table_bits, scales):
            return integrated.crossings(106, scales, columns)
        begun = integrated.reached(scales, columns, wanted[some])
        return continued(maps, scales, columns, begun, wanted[some])

    found = certainty.part(known, open_)
    certainty.climb(compute, found, np.arange(open_.size), rate, (106,))
    # What is still open begins anew elsewhere: an integration shares its first passages.
    settled = np.flatnonzero(found.certain.all(axis=0))
    certainty.replace(known, open_[settled], certainty.part(found, settled))


def crossings_in_common(maps: Maps, columns: Any, rate: float) -> NDArray[np.int64]:
    """Number of crossings that two maps tell alike to `HANDOVER`, and one more, (n,)."""
    one, other = (
        maps.crossings(maps.table_bits, scales, columns)
        for scales in (certainty.FIRST, certainty.SECOND)
    )
    alike = certainty.agreement(one, other, rate, HANDOVER)
    # `agreement` has no row for the first crossing.
    return np.minimum(alike.sum(axis=0) + 2, len(one.time))


def continued(
    maps: Maps, scales: Scales, columns: Any, begun: Reached, wanted: NDArray[np.int64]
) -> Crossings:
    """The crossings of integrated orbits, with those that a map finds behind them."""
    n = maps.problem.n_symbols + 1
    time, separatrix = np.full((n, columns.size), np.nan), np.zeros((n, columns.size), np.uint8)
    time[: len(begun.time)], separatrix[: len(begun.time)] = begun.time, begun.separatrix
    for count in np.unique(wanted):
        here = np.flatnonzero(wanted == count)
        last = int(count) - 1
        after: Followed = maps.onward(scales, columns[here], last, begun.state[:, here])
        # Beside 4 and 1 the map follows the image.
        image = np.isin(separatrix[last, here], (4, 1))
        beside = np.where(image, MIRRORED[after.separatrix], after.separatrix)
        time[count:, here], separatrix[count:, here] = time[last, here] + after.time, beside
    outcome = np.where(separatrix[-1] != 0, Outcome.COMPLETE, Outcome.FAILED)
    return Crossings(time, separatrix, outcome.astype(np.uint8))
