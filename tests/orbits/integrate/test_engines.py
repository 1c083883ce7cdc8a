"""Which engine serves, what is refused, that `jobs` changes nothing; DOP853 as one system."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import dop853
from rigidpend.orbits.integrate.arithmetic import in_kernel, kernel_bits, resolve
from tests.orbits.integrate.problems import fan, find, same, task


def test_the_kernel_serves_up_to_424_bits() -> None:
    asked = (53, 54, 64, 106, 107, 212, 424)
    assert [in_kernel("taylor", bits) for bits in (*asked, 425)] == [True] * 7 + [False]
    assert list(map(kernel_bits, asked)) == [53, 106, 106, 106, 212, 212, 424]
    assert resolve(None, None, (53, 64, 106)).precisions == (53, 64, 106)
    assert not any(in_kernel("scipy", bits) for bits in (53, 64, 113))
    assert resolve("scipy", None, (53, 64, 106)).precisions == (53, 106)
    assert resolve("scipy", None, (64,)).precisions == (64,)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "bits", "n", "n_crossings"),
    # Orbits longer than the limit, in other company; fours of doubles; two parts.
    [("taylor", 53, 21, 9), ("taylor", 212, 19, 1), ("scipy", 53, 3, 1)],
)
def test_jobs_change_no_bit(
    engine: str, bits: int, n: int, n_crossings: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dop853, "SIDE_BY_SIDE", 2)
    given: Any = {"n_crossings": n_crossings, "passage_limit": 40.0}
    if engine == "scipy":
        # Processes are looked at elsewhere: here it is the parts that count.
        in_turn = lambda work, further, _, parts, jobs: [work(x, *further) for x in parts]  # noqa: E731
        monkeypatch.setattr(integrate, "side_by_side", in_turn)
    alone = find(fan(n), engine, bits, **given)
    for jobs in (2, 3, 50) if engine == "taylor" else (2,):
        assert same(alone, find(fan(n), engine, bits, **given, jobs=jobs))


def test_groups_follow_each_other_in_order() -> None:
    """65 orbits are two groups, of 33 and 32."""
    states = fan(65)
    found = find(states, "scipy", n_crossings=1, tolerance=1e-6)
    last = find(states[:, 33:], "scipy", n_crossings=1, tolerance=1e-6)
    assert found.time.shape == (1, 65)
    np.testing.assert_array_equal(found.time[:, 33:], last.time)


@pytest.mark.slow
def test_small_components_keep_their_relative_precision_and_follow_the_tolerance() -> None:
    """Qp grows from 1e-12 to one; what it errs, relatively, the crossing time errs."""
    begin = fan(1, J1=1e-24)
    truth = find(begin, "taylor", 106, n_crossings=1).time
    fine, coarse = (
        abs(find(begin, "scipy", tolerance=x, n_crossings=1).time / truth - 1).max()
        for x in (1e-13, 1e-5)
    )
    assert fine < 1e-11 < 1e-10 < coarse < 1e-7


def test_errors_of_Q_count_by_the_smallest_orbit_and_others_by_one() -> None:
    states = np.concatenate((fan(2, J1=1e-4), fan(1, J1=1e-24), fan(1, J1=1e-8)), axis=1)
    states[1] = states[0] / 1024
    smallest = abs(states[0, 2])
    assert smallest < 1e-11
    floor = dop853.floor(task(states), 2.0**-30)
    np.testing.assert_array_equal(floor.T * 2.0**30, [[smallest, smallest, 1, 1, 1, 1]])
    states[:2] = 0
    np.testing.assert_array_equal(dop853.floor(task(states), 0.5), np.full((6, 1), 0.5))
