"""States at given times in more than doubles: the kernel's numbers against integers."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.precision import precision
from tests.orbits.integrate.problems import GENERIC, fan, task

TASK = task(fan(3, GENERIC, J1=0.1), 106, body=GENERIC)
DURATIONS = np.array([[Fraction("0.5"), Fraction("7.25"), Fraction(3)]])


def given(bits: int, sense: int, n: int = 3) -> tuple[AlignedCoefficients, Any, Any]:
    """Coefficients, states and times of so many bits; the times are no doubles."""
    a = precision(bits)
    exact = aligned_coefficients(GENERIC.angles(bits + 32), context(bits + 32))
    c = AlignedCoefficients(*map(a.number, exact))
    times = sense * a.array([1, 2, 5]) * a.number(7) / a.number(9)
    return c, a.array(fan(n, GENERIC, J1=0.1)) / a.number(3), times


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("bits", [106, 160, 212, 300])
def test_sums_of_doubles_agree_with_integers(bits: int, sense: int) -> None:
    c, states, times = given(bits, sense)
    found = states_at(c, states, times, bits)
    assert found.shape == (6, 3, 3)
    exactly = np.frompyfunc(fraction, 1, 1)
    # Beyond 424 bits integers serve.
    numbers = AlignedCoefficients(*map(fraction, c)), exactly(states), exactly(times)
    expected = states_at(*numbers, 430 + bits)
    assert np.abs(exactly(found) - expected).max() < 200 * Fraction(2) ** -bits


@pytest.mark.parametrize("bits", [106, 212])
def test_a_time_beside_a_double_is_met_as_if_one_went_on_from_there(bits: int) -> None:
    """Half an ulp of 200 is 2^-46: nothing of it is lost, nor of its powers."""
    (c, states, _), a = given(bits, 1), precision(bits)
    double, late = a.number(200), a.number(7 * 2.0**-49)
    found = states_at(c, states, a.array([double + late]), bits)[:, 0]
    there = states_at(c, states, a.array([double]), bits)[:, 0]
    expected = states_at(c, there, a.array([late]), bits)[:, 0]
    assert float(abs(found - there).max()) > 2.0**-49
    assert float(abs(found - expected).max()) < 2.0 ** (2 - bits)


@pytest.mark.parametrize("bits", [106, 430])
def test_each_orbit_is_carried_on_for_its_own_time(bits: int) -> None:
    """By any number of threads."""
    states = np.array(TASK.states).T
    found = states_at(TASK.coefficients, states, DURATIONS, bits, jobs=2)
    assert (found == states_at(TASK.coefficients, states, DURATIONS, bits)).all()
    for k, time in enumerate(DURATIONS[0]):
        expected = states_at(TASK.coefficients, states[:, [k]], [time], 500)
        assert np.abs(found[..., [k]] - expected).max() < 200 * Fraction(2) ** -bits
