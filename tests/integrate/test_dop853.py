"""Engine `scipy`: orbits as one system, which leave it when they are done."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend.integrate import Outcome
from tests.integrate.problems import fan, find


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
