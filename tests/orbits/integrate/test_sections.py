"""First crossings of the section: one orbit in every type, and against `crossings`."""

from __future__ import annotations

import functools
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate import states
from rigidpend.orbits.integrate.states import first_crossings
from tests.orbits.integrate.problems import WAYS, fan, find, task

ORBITS = task(fan(3), 212)
STATES = ORBITS.states


def first(engine: str, bits: int, limit: float = 200.0, jobs: int = 1) -> Any:
    """Of Fractions, or of doubles."""
    given: dict[str, Any] = {"engine": engine, "tolerance": 2.0**-52, "jobs": jobs}
    if (engine, bits) == ("taylor", 53):
        doubles = AlignedCoefficients(*map(float, ORBITS.coefficients)), STATES.astype(float)
        return first_crossings(*doubles, limit, bits=53, **given)
    return first_crossings(ORBITS.coefficients, STATES, limit, bits=bits, **given)


@functools.cache
def crossed(engine: str, bits: int, jobs: int = 1) -> list[tuple[Any, Any]]:
    """Time and state of each crossing, in rational numbers."""
    times, states = first(engine, bits, jobs=jobs)
    rows = np.array([times, *states]).T.tolist()
    return [(Fraction(time), [Fraction(x) for x in state]) for time, *state in rows]


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_with_260_bit_integers_and_the_first_of_all_crossings(
    engine: str, bits: int
) -> None:
    unit, found = Fraction(1, 2**bits), crossed(engine, bits)
    for (time, state), (then, there), start in zip(
        found, crossed("scipy", 260), ORBITS.states.T, strict=True
    ):
        assert max(abs(a - b) for a, b in zip(state, there, strict=True)) < 200 * unit
        assert abs(time - then) < 20_000 * unit
        # The distance from the separatrix keeps its relative precision.
        assert abs(state[1] - there[1]) < 2 * unit < abs(there[1]) < Fraction(1, 200)
        assert abs(state[2]) < 8 * unit, "M3 vanishes"
        before, after = (sum(x * x for x in gamma[3:]) for gamma in (start, state))
        assert abs(after - before) < 200 * unit
    times = find(fan(3), engine, bits, n_crossings=1).time[0]
    assert [float(time) for time, _ in found] == pytest.approx(list(times), rel=1e-13)


@pytest.mark.parametrize("engine", ["taylor", "scipy"])
def test_the_number_of_jobs_changes_nothing(engine: str) -> None:
    assert crossed(engine, 53, jobs=2) == crossed(engine, 53)


@pytest.mark.parametrize(("engine", "bits"), WAYS[:3] + WAYS[-1:])
def test_an_orbit_that_does_not_cross_in_time_is_none(engine: str, bits: int) -> None:
    assert first(engine, bits, 3.0) is None


def test_one_orbit_that_comes_too_late_is_enough() -> None:
    early, *_, late = sorted(float(time) for time, _ in crossed("taylor", 53))
    assert late - early > 1e-6
    assert first("taylor", 53, (early + late) / 2) is None


def test_engine_scipy_computes_in_integers(monkeypatch: pytest.MonkeyPatch) -> None:
    # The kernel alone takes numbers in parts.
    monkeypatch.setattr(states, "in_parts", None)
    assert first("scipy", 80) is not None
    with pytest.raises(TypeError):
        first("taylor", 80)
