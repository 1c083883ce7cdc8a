"""First crossings of the section: one orbit in every type, and against `crossings`."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from rigidpend.orbits.integrate.sections import Crossing, first_crossings
from tests.orbits.integrate.problems import (
    WAYS,
    fan,
    find,
    task,
)

ORBITS = task(fan(5), 212)


def crossed(engine: str, bits: int, **how: Any) -> list[Crossing]:
    given = {"limit": 200.0, "tolerance": 2.0**-52, "jobs": 1, **how}
    found = first_crossings(
        ORBITS.coefficients, ORBITS.states, given.pop("limit"), engine=engine, bits=bits, **given
    )
    assert all(crossing is not None for crossing in found)
    return [crossing for crossing in found if crossing is not None]


@pytest.fixture(scope="module")
def truth() -> list[Crossing]:
    """In integers, far beyond the other types."""
    return crossed("scipy", 260)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_with_260_bit_integers_to_the_precision_asked_for(
    truth: list[Crossing], engine: str, bits: int
) -> None:
    for found, expected in zip(crossed(engine, bits), truth, strict=True):
        pairs = zip(found.state, expected.state, strict=True)
        assert max(abs(a - b) for a, b in pairs) < Fraction(200, 2**bits)
        assert abs(found.time - expected.time) < 100 * Fraction(200, 2**bits)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_the_distance_from_the_separatrix_keeps_its_relative_precision(
    truth: list[Crossing], engine: str, bits: int
) -> None:
    for found, expected in zip(crossed(engine, bits), truth, strict=True):
        Qm, exact = found.state[1], expected.state[1]
        assert abs(exact) < Fraction(1, 200)
        assert abs(Qm - exact) < Fraction(1, 100) * Fraction(200, 2**bits)


@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_invariant_M3_vanishes_and_gamma_keeps_its_length(engine: str, bits: int) -> None:
    for (_, state), start in zip(crossed(engine, bits), ORBITS.states, strict=True):
        assert abs(state[2]) < Fraction(8, 2**bits)
        before, after = (sum(x * x for x in gamma[3:]) for gamma in (start, state))
        assert abs(after - before) < Fraction(200, 2**bits)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_with_the_first_of_all_crossings(engine: str, bits: int) -> None:
    times = find(fan(5), engine, bits, n_crossings=1).time[0]
    found = [float(crossing.time) for crossing in crossed(engine, bits)]
    assert found == pytest.approx(list(times), rel=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["taylor", "scipy"])
def test_the_number_of_jobs_changes_nothing(engine: str) -> None:
    assert crossed(engine, 53, jobs=3) == crossed(engine, 53, jobs=1)


@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_an_orbit_that_does_not_cross_in_time_is_none(engine: str, bits: int) -> None:
    found = first_crossings(
        ORBITS.coefficients,
        ORBITS.states[:2],
        3.0,
        engine=engine,
        bits=bits,
        tolerance=1e-13,
        jobs=1,
    )
    assert found == [None, None]
