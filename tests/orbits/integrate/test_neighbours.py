"""Orbits beside a reference orbit: a crossing that is lost or found twice makes no symbol."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.orbits.integrate import neighbours
from rigidpend.orbits.integrate.passages import UNDECIDED
from rigidpend.orbits.integrate.records import Crossings, Outcome, in_turn
from rigidpend.orbits.integrate.reference_orbit import Passed


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
