"""Orbits beside a reference orbit: a crossing that is lost or found twice makes no symbol."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.integrate import neighbours
from rigidpend.integrate.records import Crossings, Outcome


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
    found = neighbours._in_turn(given)
    assert np.count_nonzero(found.separatrix) == kept
    assert np.isnan(found.time[kept:]).all()
    whole = kept == np.count_nonzero(separatrix)
    assert found.outcome[0] == (Outcome.COMPLETE if whole else Outcome.FAILED)
