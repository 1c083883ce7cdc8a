"""Orbits far from unit energy: the same, bit for bit, as in a unit of their own."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.orbits.integrate import FASTEST, SLOWEST, Orbits, crossings, own_unit
from rigidpend.orbits.integrate.batch import advance
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.precision import precision
from tests.orbits.integrate.problems import fan, same, task

# kappa |M3| is 0.7: nothing is to be changed.
STATES = fan(3) * np.array([[0.5], [0.5], [0.5], [1], [1], [1]])
exponents = pytest.mark.parametrize("exponent", [165, 20, -20, -165])


def enlarged(orbits: Orbits, unit: Any) -> Orbits:
    """The same orbits with M multiplied by a power of two, and t' divided by it."""
    c = orbits.coefficients
    forces = {x: getattr(c, x) * unit * unit for x in ("force_p", "force_m", "mu_r1", "mu_r2")}
    states = orbits.states.copy()
    states[:3] = states[:3] * unit
    limit = orbits.passage_limit / float(unit)
    return Orbits(c._replace(**forces), states, orbits.n_crossings, limit)


@pytest.mark.slow
@exponents
@pytest.mark.parametrize(("engine", "bits"), [("taylor", 53), ("taylor", 212), ("scipy", 53)])
def test_crossings_do_not_hang_on_the_unit(engine: str, bits: int, exponent: int) -> None:
    few = task(STATES, bits, n_crossings=2)
    unit = Fraction(2) ** exponent if bits > 53 else 2.0**exponent
    given: Any = {"engine": engine, "bits": bits, "tolerance": 1e-13, "jobs": 1}
    here, far = crossings(few, **given), crossings(enlarged(few, unit), **given)
    assert here.separatrix.all()
    assert same(far._replace(time=far.time * float(unit)), here)


@pytest.mark.slow
@exponents
@pytest.mark.parametrize("bits", [53, 64, 106, 113])
def test_states_do_not_hang_on_the_unit(bits: int, exponent: int) -> None:
    # Doubles, pairs of them, Fractions and mpmath's numbers.
    few = task(STATES, 106 if bits == 106 else 53)
    unit: Any = Fraction(2) ** exponent if bits == 106 else 2.0**exponent
    far = enlarged(few, unit)
    grid = np.array([[Fraction(1, 2)], [Fraction(29, 4)]]) + 0 * task(STATES, 106).states[:1]
    found = []
    for orbits, times in ((few, grid), (far, grid / Fraction(unit))):
        field, states = orbits.coefficients, orbits.states
        if bits != 106:
            a = precision(bits)
            field, states = type(field)(*map(a.number, field)), a.array(states)
            times = a.array(times.astype(float))
        found.append(states_at(field, states, times, bits))
    found[1][:3] = found[1][:3] / unit
    one, other = (getattr(x, "parts", x) for x in found)
    assert np.array_equal(one, other)
    assert not np.array_equal(one[..., 0, :], one[..., 1, :])


@exponents
def test_steps_of_a_reference_orbit_do_not_hang_on_the_unit(exponent: int) -> None:
    one, unit = task(STATES[:, :1], 212), Fraction(2) ** exponent
    far = enlarged(one, unit)
    given = 2, 212, 1e-13
    here = advance(one.coefficients, one.states[:, 0], *given)
    there = advance(far.coefficients, far.states[:, 0], *given)
    assert [time * unit for time, _ in there] == [time for time, _ in here]
    scaled = [[x / unit for x in state[:3]] + list(state[3:]) for _, state in there]
    assert scaled == [list(state) for _, state in here]


def test_a_unit_is_taken_for_rates_that_are_far_from_one() -> None:
    coefficients = task(STATES).coefficients
    for factor, unit in [
        (SLOWEST, 1.0),
        (FASTEST, 1.0),
        (FASTEST * 1.001, 64.0),
        (SLOWEST * 0.999, 2.0**-5),
        (0.0, 1.0),
        (float("nan"), 1.0),
    ]:
        M = np.array([[0.0], [0.5], [-1.0]]) * factor / float(coefficients.kappa)
        assert own_unit(coefficients, M) == unit
