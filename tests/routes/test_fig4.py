"""The arrays of Fig. 4, cell by cell, against 113 bits computed without this package."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend import RouteCodes, route_codes
from tests.routes.reference import fig4_left, vertex_theta1

LEFT = fig4_left()


def computed(phases: Any, **more: Any) -> RouteCodes:
    return route_codes(LEFT.body, phases, h0=LEFT.h0, J1_0=LEFT.J1_0, **more)


def test_agrees_every_cell_of_the_left_array_and_all_are_certain() -> None:
    found = computed(LEFT.theta2_0, jobs=2)
    np.testing.assert_array_equal(found.codes, LEFT.codes)
    assert found.codes.size == 945
    assert found.certain.all()
    error, doubles = np.abs(found.crossing_time - LEFT.crossing_time), found.bits == 53
    assert doubles.mean() > 0.6
    # What went up in precision is known to what the threshold there allows, and better.
    assert error.max() < 1e-3
    # The first passage knows no chaos yet.
    assert error[0].max() < 1e-10
    # theta1 lies on the separatrix that is named.
    distance = LEFT.theta1 - vertex_theta1(found.separatrix)
    assert np.abs((distance + 2 * np.pi) % (4 * np.pi) - 2 * np.pi).max() < 0.01
