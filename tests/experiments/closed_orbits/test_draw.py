"""The figure of closed orbits: crossings and exponents are the file's."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np

from rigidpend.experiments.closed_orbits.draw import draw
from rigidpend.results import store
from tests.experiments.figures import styled

REFERENCE = Path(__file__).parents[3] / "results" / "reference" / "closed_orbits.h5"


def test_crossings_and_exponents_are_drawn() -> None:
    result = copy.deepcopy(store.load(REFERENCE))
    data = result["data"]
    left, right, *_ = styled(draw, result).axes
    offsets = np.asarray(left.collections[0].get_offsets())
    np.testing.assert_allclose(offsets, np.stack((data["places"]["chi"], data["places"]["d"]), 1))
    single, mean = right.lines[:2]
    np.testing.assert_allclose(np.asarray(single.get_ydata()), data["orbits"]["exponent"])
    np.testing.assert_allclose(np.asarray(mean.get_ydata()), data["averages"]["mean"])
