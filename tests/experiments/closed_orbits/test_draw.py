"""The figure of closed orbits: crossings and exponents are the file's."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.closed_orbits.draw import draw
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def test_crossings_and_exponents_are_drawn() -> None:
    result = reference("closed_orbits")
    data = result["data"]
    left, right, *_ = styled(draw, result).axes
    offsets = np.asarray(left.collections[0].get_offsets())
    np.testing.assert_allclose(offsets, np.stack((data["places"]["chi"], data["places"]["d"]), 1))
    single, mean = right.lines[:2]
    np.testing.assert_allclose(np.asarray(single.get_ydata()), data["orbits"]["exponent"])
    np.testing.assert_allclose(np.asarray(mean.get_ydata()), data["averages"]["mean"])
