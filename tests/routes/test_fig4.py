"""The arrays of Fig. 4, cell by cell, against 113 bits computed without this package."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from rigidpend import RouteCodes, route_codes
from tests.routes.reference import Reference, fig4_left, vertex_theta1

RIGHT = [f"3*pi/40 + {k}/100" for k in range(32)]


class Left(NamedTuple):
    """Columns of the left array, computed and as the reference has them."""

    found: RouteCodes
    reference: Reference


@pytest.fixture(scope="module")
def left() -> Left:
    reference = fig4_left()
    body, phases, h0, J1_0 = reference.body, reference.theta2_0, reference.h0, reference.J1_0
    return Left(route_codes(body, phases, h0=h0, J1_0=J1_0, jobs=2), reference)


def test_agrees_every_cell_of_the_left_array_and_all_are_certain(left: Left) -> None:
    np.testing.assert_array_equal(left.found.codes, left.reference.codes)
    assert left.found.codes.size == 945
    assert left.found.certain.all()


def test_agrees_crossing_times_of_the_left_array(left: Left) -> None:
    error = np.abs(left.found.crossing_time - left.reference.crossing_time)
    doubles = left.found.bits == 53
    assert doubles.mean() > 0.6
    assert error[:, doubles].max() < 1e-3
    # What went up in precision is known to what the threshold there allows, and better.
    assert error[:, ~doubles].max(initial=0) < 1e-3
    # The first passage knows no chaos yet.
    assert error[0].max() < 1e-10


def test_agrees_theta1_of_the_left_array_lies_on_the_separatrix_named(left: Left) -> None:
    distance = left.reference.theta1 - vertex_theta1(left.found.separatrix)
    around = (distance + 2 * np.pi) % (4 * np.pi) - 2 * np.pi
    assert np.abs(around).max() < 0.01


@pytest.mark.slow
def test_agrees_engines_on_the_right_array() -> None:
    reference = fig4_left()
    taylor, scipy = (
        route_codes(
            reference.body,
            RIGHT[:1],
            h0=reference.h0,
            J1_0=reference.J1_0,
            n_symbols=3,
            engine=engine,
        )
        for engine in ("taylor", "scipy")
    )
    np.testing.assert_array_equal(taylor.codes, scipy.codes)
    np.testing.assert_array_equal(taylor.separatrix, scipy.separatrix)
    assert taylor.certain.all()
    assert scipy.certain.all()
    np.testing.assert_allclose(taylor.crossing_time, scipy.crossing_time, rtol=0, atol=1e-3)
    # The right array magnifies: it begins between columns 2 and 3 of the left one, and its
    # first symbols are theirs.
    np.testing.assert_array_equal(taylor.codes[:, 0], reference.codes[:3, 2])
