"""Every engine on the same orbits, from bit for bit the same numbers."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from rigidpend.orbits.integrate import Crossings, Outcome
from tests.orbits.integrate.problems import (
    FIG4,
    FREE,
    GENERIC,
    WAYS,
    fan,
    find,
    on_separatrix,
    same,
)

BOUND = {("taylor", 53): 1e-11, ("taylor", 64): 2e-14, ("scipy", 53): 1e-9}
"""How far crossing times may err after three passages; each multiplies an error by about 3.
Beyond 64 bits every time is the double nearest to it."""


@functools.cache
def truth() -> Crossings:
    """Plain integers of 240 bits, which share no arithmetic with the kernel."""
    return find(fan(2, GENERIC), "scipy", 240, body=GENERIC)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_every_engine_with_integers_of_240_bits(engine: str, bits: int) -> None:
    found, expected = find(fan(2, GENERIC), engine, bits, body=GENERIC), truth()
    np.testing.assert_array_equal(found.separatrix, expected.separatrix)
    assert found.outcome.tolist() == [Outcome.COMPLETE] * 2
    bound = BOUND.get((engine, bits), 0.0)
    np.testing.assert_allclose(found.time, expected.time, rtol=0, atol=bound)
    assert (np.diff(found.time, axis=0) > 10).all(), "each passage takes its time"


@functools.cache
def truth_of_a_small_J1() -> Crossings:
    return find(fan(1, J1=1e-12), "scipy", 240)


@pytest.mark.slow
@pytest.mark.parametrize("bits", [106, 113, 160, 212])
def test_agrees_integers_with_sums_of_doubles_to_the_last_bit_of_a_double(bits: int) -> None:
    """From J1 = 1e-12: the small component has its own leading zeros."""
    found = find(fan(1, J1=1e-12), "taylor", bits)
    # The time on a step is found in doubles, and the sum rounded.
    np.testing.assert_allclose(found.time, truth_of_a_small_J1().time, rtol=3e-16)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_outcome_too_short_a_limit_is_no_crossing(engine: str, bits: int) -> None:
    # The first crossing comes at 9.8, the second 20 later.
    found = find(fan(2), engine, bits, passage_limit=5)
    assert found.outcome.tolist() == [Outcome.NO_CROSSING] * 2
    assert np.isnan(found.time).all()
    assert not found.separatrix.any()
    found = find(fan(2), engine, bits, passage_limit=15)
    assert found.outcome.tolist() == [Outcome.NO_CROSSING] * 2
    assert np.isfinite(found.time).sum(axis=0).tolist() == [1, 1]
    assert found.separatrix.tolist() == [[2, 2], [0, 0], [0, 0], [0, 0]]


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_outcome_a_crossing_just_before_the_limit_is_found(engine: str, bits: int) -> None:
    """Wherever between two looks at the orbit the crossings lie."""
    for J1 in (1e-4, 2e-4, 5e-4, 1e-3, 2e-3):
        begin = fan(1, J1=J1)
        expected = find(begin, engine, bits, n_crossings=2)
        waited = float(np.diff(expected.time, axis=0)[0, 0])
        assert waited > 10
        found = find(begin, engine, bits, n_crossings=2, passage_limit=waited * (1 + 1e-9))
        assert same(found, expected), J1


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_outcome_orbits_that_end_differently_share_a_call(engine: str, bits: int) -> None:
    """gamma = 0 takes the weight away: such an orbit is asymptotic beside others that go on."""
    states = fan(3)
    states[3:, 1] = 0
    found = find(states, engine, bits, n_crossings=2, passage_limit=30)
    assert found.outcome.tolist() == [Outcome.COMPLETE, Outcome.ASYMPTOTIC, Outcome.COMPLETE]
    alone = find(fan(3), engine, bits, n_crossings=2, passage_limit=30)
    np.testing.assert_allclose(found.time[:, [0, 2]], alone.time[:, [0, 2]], rtol=1e-12)
    assert found.separatrix[:, 1].tolist() == [2, 0]


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_an_orbit_that_starts_near_the_top(engine: str, bits: int) -> None:
    """On separatrix 2 above M3 = 0 the first crossing lies beside 1 or 3."""
    begin = on_separatrix(2, FIG4, 0.99, 0.3)[:, None]
    found = find(begin, engine, bits, n_crossings=2)
    assert found.separatrix[0, 0] in (1, 3)
    assert found.separatrix[1, 0] in (2, 4)
    # Back in time the free orbit crosses M3 = 0 at ln(99)/u: it never does so again.
    free = find(begin, engine, bits, body=FREE, n_crossings=2, passage_limit=20)
    assert free.outcome.tolist() == [Outcome.ASYMPTOTIC]
    assert np.isnan(free.time).all()


@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_a_crossing_right_after_the_start(engine: str, bits: int) -> None:
    """Where the lane, or the integrator, has just stopped at the crossing of another orbit."""
    states = fan(20 if bits == 53 else 2)
    last_bit = 2.0 ** (1 - bits)
    states[0], states[2] = 1.0, -500 * last_bit
    found = find(states, engine, bits, n_crossings=1)
    # M3' is near 1/(2 sin(alpha0)).
    expected = 500 * last_bit * 2 * math.sin(FIG4.alpha0)
    np.testing.assert_allclose(found.time[0], expected, rtol=0.1)
