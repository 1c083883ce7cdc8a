"""Which engine serves, what is refused, and that no result depends on `jobs`."""

from __future__ import annotations

import pytest

from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import EngineError, engines
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import (
    fan,
    find,
    same,
)


def test_the_kernel_serves_up_to_424_bits() -> None:
    offered = [integrate.in_kernel("taylor", bits) for bits in (53, 64, 106, 113, 424, 425)]
    assert offered == [True] * 5 + [False]
    assert list(map(engines.kernel_bits, (53, 54, 106, 107, 212, 424))) == [
        53,
        106,
        106,
        212,
        212,
        424,
    ]
    assert resolve(None, None, (53, 64, 106)).precisions == (53, 64, 106)


def test_engine_refuses_an_unknown_name() -> None:
    with pytest.raises(EngineError, match="'euler' is not known; choose one of taylor, scipy"):
        states_at(lambda x, m: x, [1.0], [0.0, 1.0], engine="euler")


def test_engine_scipy_has_doubles_only() -> None:
    assert not any(integrate.in_kernel("scipy", bits) for bits in (53, 64, 113))
    assert resolve("scipy", None, (53, 64, 106)).precisions == (53, 106)


def test_jobs_change_no_bit_of_a_batch() -> None:
    """Orbits longer than the passage limit, in other company for each number of jobs."""
    states = fan(21)
    alone = find(states, "taylor", n_crossings=9, passage_limit=40)
    for jobs in (2, 3, 50):
        found = find(states, "taylor", n_crossings=9, passage_limit=40, jobs=jobs)
        assert same(alone, found)


@pytest.mark.slow
def test_jobs_change_no_bit_of_fours_of_doubles() -> None:
    states = fan(19)
    alone = find(states, "taylor", 212, n_crossings=1)
    assert all(
        same(alone, find(states, "taylor", 212, n_crossings=1, jobs=jobs)) for jobs in (2, 3)
    )


@pytest.mark.slow
def test_jobs_change_no_bit_of_scipy() -> None:
    """70 orbits make two parts, which go to two processes."""
    states = fan(70)
    alone = find(states, "scipy", n_crossings=1)
    assert same(alone, find(states, "scipy", n_crossings=1, jobs=2))


@pytest.mark.slow
def test_jobs_change_no_bit_of_the_integers() -> None:
    states = fan(3)
    alone = find(states, "scipy", 80, n_crossings=2)
    assert same(alone, find(states, "scipy", 80, n_crossings=2, jobs=2))
