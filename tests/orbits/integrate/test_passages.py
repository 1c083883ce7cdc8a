"""What becomes of crossings that were found: the record of an orbit, and where it ends."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.orbits.integrate.passages import UNDECIDED, Found
from rigidpend.orbits.integrate.records import Crossings, Outcome, no_crossings

LIMIT = 10.0


def written(*crossings: tuple[int, float, int], rows: int = 3, before: int) -> Crossings:
    """A record of two orbits into which crossings (orbit, time, separatrix) are written."""
    found = no_crossings(rows, 2)
    found.outcome[:] = before
    columns, times, separatrix = zip(*crossings, strict=True)
    Found(np.array(columns), np.array(times), np.array(separatrix)).write(found, LIMIT)
    return found


def test_crossings_are_written_in_their_order_and_fill_an_orbit() -> None:
    given = (1, 5.0, 3), (0, 1.0, 2), (1, 2.0, 4), (0, 9.0, 1), (0, 4.0, 3)
    found = written(*given, before=Outcome.NO_CROSSING)
    np.testing.assert_array_equal(found.time, [[1, 2], [4, 5], [9, np.nan]])
    assert found.separatrix.tolist() == [[2, 4], [3, 3], [1, 0]]
    assert found.outcome.tolist() == [Outcome.COMPLETE, Outcome.NO_CROSSING]


def test_crossings_beyond_the_record_are_left_out() -> None:
    found = written(*((0, float(k), 1 + k % 4) for k in range(5)), before=Outcome.FAILED)
    assert found.time[:, 0].tolist() == [0, 1, 2]
    assert found.outcome.tolist() == [Outcome.COMPLETE, Outcome.FAILED]


@pytest.mark.parametrize("at", [0, 1, 2])
def test_an_undecided_touch_ends_an_orbit_as_failed(at: int) -> None:
    given = [(0, 1.0 + k, UNDECIDED if k == at else 2) for k in range(4)]
    found = written(*given, (1, 1.0, 1), before=Outcome.NO_CROSSING)
    assert found.outcome.tolist() == [Outcome.FAILED, Outcome.NO_CROSSING]
    assert np.isfinite(found.time[:, 0]).tolist() == [k < at for k in range(3)]
    assert found.separatrix[:, 0].tolist() == [2] * at + [0] * (3 - at)
    assert found.separatrix[:, 1].tolist() == [1, 0, 0]


@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_crossing_that_came_after_the_limit_ends_an_orbit(at: int) -> None:
    waits = [LIMIT + 0.5 * (k == at) for k in range(4)]
    given = [(0, float(time), 2) for time in np.cumsum(waits)]
    found = written(*given, (1, 1.0, 1), before=Outcome.COMPLETE)
    assert found.outcome.tolist() == [Outcome.NO_CROSSING, Outcome.COMPLETE]
    assert np.isfinite(found.time[:, 0]).tolist() == [k < at for k in range(3)]


def test_the_wait_of_one_orbit_is_not_counted_from_another() -> None:
    found = written((0, 30.0, 2), (1, 35.0, 2), before=Outcome.FAILED, rows=1)
    assert found.outcome.tolist() == [Outcome.NO_CROSSING] * 2
    assert np.isnan(found.time).all()


def test_no_crossings_change_nothing() -> None:
    found = no_crossings(2, 1)
    none = np.zeros(0, dtype=np.int64)
    Found(none, np.zeros(0), none).write(found, LIMIT)
    assert found.outcome.tolist() == [Outcome.FAILED]
