"""Differences of orbits: the field's polarised form, and series beside a reference."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_coefficients
from rigidpend.orbits.integrate import bigint
from rigidpend.orbits.integrate.reference_orbit import (
    DifferenceField,
    array,
    polarised,
    scaled,
    summed,
)
from rigidpend.orbits.integrate.states import states_at

HEAVY = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.3")
FLOATS = aligned_coefficients(HEAVY.angles(), math)
EXACT = AlignedCoefficients(*map(Fraction, FLOATS))
STATE = (0.31, -0.72, 0.44, 0.2, -0.5, 0.9)


def test_the_polarised_field_is_the_field() -> None:
    """In rational numbers, so without a rounding that could hide a term."""
    linear, products = polarised(FLOATS)
    state = [Fraction(x) for x in STATE]
    for k, rate in enumerate(aligned(state, EXACT)):
        total = sum((a * x for a, x in zip(linear[k], state, strict=True)), Fraction(0))
        for (i, j), weight in products.items():
            total += weight[k] * state[i] * state[j]
        assert total == rate


def test_agrees_with_two_integrations_where_the_difference_is_large() -> None:
    apart = np.array([[0.05], [-0.02], [0.01], [0.03], [0.04], [-0.06]])
    start = np.array(STATE)[:, None]
    series = scaled(DifferenceField(FLOATS, 53).series(start[:, 0], apart, 24), 0.2)
    found = summed(series)
    ends = states_at(FLOATS, np.hstack((start, start + apart)), [0, 0.2])[:, 1]
    assert np.allclose(found[:, 0], ends[:, 0], rtol=0, atol=1e-15)
    assert np.allclose(found[:, 1], ends[:, 1] - ends[:, 0], rtol=0, atol=1e-15)


@pytest.mark.parametrize(("bits", "within"), [(53, 1e-14), (64, 1e-17)])
@pytest.mark.parametrize("size", [Fraction(1, 10**3), Fraction(1, 10**40)])
def test_agrees_with_integers_whatever_the_size(bits: int, within: float, size: Fraction) -> None:
    """The difference keeps its relative precision at 1e-40, where doubles know no difference."""
    if bits == 64 and np.finfo(np.longdouble).nmant < 63:
        pytest.skip("this platform's long double is a double")
    state = [Fraction(x) for x in STATE]
    other = [x + size * (k + 1) for k, x in enumerate(state)]
    step = next(bigint.steps(EXACT, state, 250))
    # A third of a step in integers, as reference orbits take it.
    time = Fraction(float(step.time(step.length // 3)))
    end = step.at(step.since_begin(time))
    there = _carried(other, time)
    apart = array([[size * (k + 1)] for k in range(6)], bits)
    field = DifferenceField(EXACT, bits)
    found = summed(scaled(field.series(array(state, bits), apart, 30), float(time)))
    true = array([x - y for x, y in zip(there, end, strict=True)], bits)
    assert float(np.abs(found[:, 1] - true).max() / np.abs(true).max()) < within


def _carried(state: list[Fraction], time: Fraction) -> list[Fraction]:
    """Carry an orbit to a time by the series of integers."""
    step = next(bigint.steps(EXACT, state, 360))
    assert step.since_begin(time) < 3 * step.length
    return list(step.at(step.since_begin(time)))
