"""Engine `scipy`: orbits as one system, which leave it when they are done."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.orbits.integrate import Outcome
from rigidpend.orbits.integrate.dop853 import Group
from tests.orbits.integrate.problems import fan, find, task


@pytest.mark.slow
def test_group_finds_each_orbit_whatever_the_company() -> None:
    """Steps are shared, so times differ by the tolerance; the separatrices do not."""
    states = fan(7)
    together = find(states, "scipy")
    assert together.outcome.tolist() == [Outcome.COMPLETE] * 7
    for k in (0, 3, 6):
        alone = find(states[:, k : k + 1], "scipy")
        np.testing.assert_array_equal(together.separatrix[:, k], alone.separatrix[:, 0])
        np.testing.assert_allclose(together.time[:, k], alone.time[:, 0], rtol=0, atol=1e-9)


def test_groups_follow_each_other_in_order() -> None:
    """65 orbits are two groups, of 33 and 32."""
    states = fan(65)
    found = find(states, "scipy", n_crossings=1, tolerance=1e-6)
    last = find(states[:, 33:], "scipy", n_crossings=1, tolerance=1e-6)
    assert found.time.shape == (1, 65)
    np.testing.assert_array_equal(found.time[:, 33:], last.time)


@pytest.mark.slow
def test_order_a_coarser_tolerance_errs_more() -> None:
    truth = find(fan(1), "scipy", 113).time
    errors = [
        float(np.abs(find(fan(1), "scipy", tolerance=tolerance).time - truth).max())
        for tolerance in (1e-5, 1e-8, 1e-11)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-7


@pytest.mark.slow
def test_small_components_keep_their_relative_precision() -> None:
    """Qp grows from 1e-12 to one; what it errs, relatively, the crossing time errs."""
    begin = fan(1, J1=1e-24)
    found, truth = (find(begin, "scipy", bits, n_crossings=1) for bits in (53, 113))
    np.testing.assert_allclose(found.time, truth.time, rtol=1e-11)


def test_errors_of_Q_count_by_the_smallest_orbit_and_others_by_one() -> None:
    states = np.concatenate((fan(2, J1=1e-4), fan(1, J1=1e-24), fan(1, J1=1e-8)), axis=1)
    states[1] = states[0] / 1024
    smallest = abs(states[0, 2])
    assert smallest < 1e-11
    floor = Group(task(states), 2.0**-30).floor
    np.testing.assert_array_equal(floor.T * 2.0**30, [[smallest, smallest, 1, 1, 1, 1]])


def test_an_orbit_without_Q_is_measured_by_one() -> None:
    states = fan(1)
    states[:2] = 0
    np.testing.assert_array_equal(Group(task(states), 0.5).floor, np.full((6, 1), 0.5))
