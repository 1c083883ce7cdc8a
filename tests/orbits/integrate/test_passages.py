"""What becomes of crossings that were found: beside what they lie, and where an orbit ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidpend.mechanics.equations import aligned, aligned_coefficients
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.orbits.integrate import (
    Crossings,
    Outcome,
    in_turn,
    joined,
    neighbours,
    no_crossings,
)
from rigidpend.orbits.integrate.passages import UNDECIDED, Found
from rigidpend.orbits.integrate.reference_orbit import Passed
from tests.orbits.integrate.problems import FREE, on_separatrix

LIMIT = 10.0


def written(*crossings: tuple[int, float, int], rows: int = 3, before: int) -> Crossings:
    """A record of two orbits into which crossings (orbit, time, separatrix) are written."""
    found = no_crossings(rows, 2)
    found.outcome[:] = before
    Found.of(crossings).write(found, LIMIT)
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
    Found.of([]).write(found, LIMIT)
    assert found.outcome.tolist() == [Outcome.FAILED]


@pytest.mark.parametrize(
    ("separatrix", "kept"),
    [
        ([2, 1, 4, 3, 2], 5),
        ([2, 3, 1, 2, 3], 2),
        ([4, 2, 1, 2, 0], 1),
        ([2, 1, 0, 0, 0], 2),
    ],
)
def test_crossings_that_do_not_rise_and_sink_in_turn_end_an_orbit(
    separatrix: list[int], kept: int
) -> None:
    column = np.array(separatrix, dtype=np.uint8)[:, None]
    time = np.where(column > 0, np.arange(5.0)[:, None], np.nan)
    given = Crossings(time, column, np.array([Outcome.COMPLETE], dtype=np.uint8))
    found = in_turn(given)
    assert np.count_nonzero(found.separatrix) == kept
    assert np.isnan(found.time[kept:]).all()
    whole = kept == np.count_nonzero(separatrix)
    assert found.outcome[0] == (Outcome.COMPLETE if whole else Outcome.FAILED)


def test_an_orbit_is_complete_with_its_last_crossing_and_not_with_a_touch() -> None:
    """Three orbits are noted: whole, on their way, and ended by a touch that is not decided."""
    beside = neighbours.Neighbours(np.zeros((6, 3)), np.zeros(3), 2, 10.0)
    walk = neighbours.Walk(None, beside, 53, 20)  # type: ignore[arg-type]
    walk.note(iter([Passed(1.0, 2)]))
    walk.note(iter([Passed(2.0, 1)]), 0)
    walk.note(iter([Passed(2.0, UNDECIDED)]), 2)
    assert walk.found.outcome.tolist() == [Outcome.COMPLETE, Outcome.FAILED, Outcome.FAILED]
    assert walk.found.separatrix.T.tolist() == [[2, 1], [2, 0], [2, 0]]
    walk.note(iter([Passed(3.0, 3)]))
    assert walk.found.separatrix.T.tolist() == [[2, 1], [2, 3], [2, 0]]


@pytest.mark.parametrize(("gap", "expected"), [(1e-3, []), (1e-7, [UNDECIDED])])
def test_the_depth_of_a_touch_is_relative_to_the_momentum_alone(
    gap: float, expected: list[int]
) -> None:
    """M3 of the reference turns at a gap from zero, and its neighbour's with it."""
    series = np.zeros((3, 6, 2))
    series[:, 2, 0] = 0.25 + gap, -1.0, 1.0
    series[0, :2, 0] = 0.6, 0.8
    state = np.array([0.6, 0.8, 0.25, 1e4, 1e4, 1e4])
    found = [separatrix for _, _, separatrix in neighbours.crossed(series, state, 53)]
    assert found == expected


@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
@pytest.mark.parametrize("nudge", [0.0, 1e-3, -1e-3, 1e-200, -1e-200])
def test_separatrix_beside_knows_the_unperturbed_ones_and_their_neighbours(
    separatrix: int, nudge: float
) -> None:
    state = on_separatrix(separatrix, FREE, 0.5, 0.3)
    assert state[2] == pytest.approx(0, abs=1e-15), "halfway up M3 = 0"
    rising = aligned(state, aligned_coefficients(FREE.angles(), math))[2] > 0
    Qp, Qm = np.where(state[:2] == 0, nudge, state[:2])
    assert separatrix_beside(rising, Qp, Qm) == separatrix


def test_joined_keeps_the_order_of_the_orbits() -> None:
    parts = []
    for width, first in ((2, 0.0), (1, 2.0), (3, 3.0)):
        part = no_crossings(2, width)
        part.time[:] = first + np.arange(width)
        part.separatrix[:] = 1 + first
        part.outcome[:] = first
        parts.append(part)
    whole = joined(parts)
    assert whole.time.tolist() == [[0, 1, 2, 3, 4, 5]] * 2
    assert whole.separatrix.tolist() == [[1, 1, 3, 4, 4, 4]] * 2
    assert whole.outcome.tolist() == [0, 0, 2, 3, 3, 3]
    assert whole.separatrix.dtype == whole.outcome.dtype == np.uint8
