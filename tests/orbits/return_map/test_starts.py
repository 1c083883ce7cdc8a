"""Starts of orbits in the tables: their places, which rounding takes no further than the ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.return_map.starts import Entry


@pytest.mark.parametrize("kind", [np.asarray, lambda x: PairArray(np.stack((x, 0 * x)))])
def test_starts_have_places_from_end_to_end(kind: Any) -> None:
    Qp = kind(np.array([0.0, 1.0, 2.0, 3.0, 3.0001]))
    table: Any = None
    found = Entry(kind(np.array(2.0)), kind(np.array(1.0)), table).place(Qp)
    np.testing.assert_array_equal(np.asarray(found.astype(float)), [-1, -1, 0, 1, 1])
    at_once = Entry(kind(np.array(2.0)), kind(np.array(0.0)), table).place(Qp)
    assert not np.asarray(at_once.astype(float)).any()
