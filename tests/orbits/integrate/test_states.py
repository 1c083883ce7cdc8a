"""States of orbits at times of their own, in 106 bits."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from rigidpend.orbits.integrate import DEFAULT_TOLERANCE, batch_samples
from rigidpend.orbits.integrate.states import states_after, states_at
from tests.orbits.integrate.problems import GENERIC, fan, task

TASK = task(fan(3, GENERIC, J1=0.1), 106, body=GENERIC)
DURATIONS = [0.5, 7.25, 3.0]


def test_each_orbit_is_carried_on_for_its_own_time() -> None:
    found = states_after(TASK.coefficients, TASK.states, DURATIONS)
    for state, begin, time in zip(found, TASK.states, DURATIONS, strict=True):
        [expected] = states_at(TASK.coefficients, begin, [Fraction(time)], 425)
        gap = max(abs(x - y) for x, y in zip(state, expected, strict=True))
        assert gap < 200 * Fraction(2) ** -106
    assert states_after(TASK.coefficients, [], []) == []


def test_every_bit_above_53_halves_the_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    sampled = batch_samples.sample_aligned

    def noted(*given: Any) -> Any:
        asked.append(given[3:])
        return sampled(*given)

    monkeypatch.setattr("rigidpend.orbits.integrate.states.sample_aligned", noted)
    states_after(TASK.coefficients, TASK.states, DURATIONS)
    assert asked == [(106, DEFAULT_TOLERANCE["taylor"] * 2.0**-53)]
