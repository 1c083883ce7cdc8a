"""Arcs at given times in more than doubles: the kernel's pairs, heyoka's numbers, integers."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.orbits.integrate import arcs as module
from rigidpend.orbits.integrate.arcs import _in_integers, arcs
from rigidpend.orbits.integrate.compiled import exactly
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients as reduced_coefficients
from tests.orbits.integrate.problems import GENERIC, fan, needs_heyoka


def given(bits: int, sense: int, n: int = 3) -> tuple[AlignedCoefficients, Any, Any]:
    """Coefficients, states and times of so many bits; the times are no doubles."""
    a = precision(bits)
    exact = aligned_coefficients(GENERIC.angles(bits + 32), context(bits + 32))
    c = AlignedCoefficients(*map(a.number, exact))
    times = sense * a.array([1, 2, 5]) * a.number(7) / a.number(9)
    return c, a.array(fan(n, GENERIC, J1=0.1)) / a.number(3), times


def in_bits(x: Any, bits: int) -> Any:
    return np.vectorize(lambda one: precision(bits).number(exactly(one)), otypes=[object])(x)


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize(("bits", "ulps"), [(106, 200)])
def test_pairs_of_doubles_agree_with_integers(bits: int, ulps: int, sense: int) -> None:
    c, states, times = given(bits, sense)
    found = arcs(c, states, times, bits)
    assert found.shape == (6, 3, 3)
    coefficients = AlignedCoefficients(*in_bits(np.array(c), 200))
    columns = (
        _in_integers(coefficients, state, in_bits(times, 200), 200)
        for state in in_bits(states, 200).T
    )
    expected = np.stack(list(columns), axis=-1)
    gaps = [abs(exactly(x) - exactly(y)) for x, y in zip(found.flat, expected.flat, strict=True)]
    assert max(gaps) < ulps * Fraction(2) ** -bits


def test_a_time_beside_a_double_is_met_by_going_on_from_there() -> None:
    """Half an ulp of 200 is 2^-46: of its square, some 2^-92, nothing is lost."""
    (c, states, _), a = given(106, 1), precision(106)
    double, late = a.number(200), a.number(7 * 2.0**-49)
    found = arcs(c, states, a.array([double + late]), 106)[:, 0]
    there = arcs(c, states, a.array([double]), 106)[:, 0]
    expected = arcs(c, there, a.array([late]), 106)[:, 0]
    assert float(abs(found - there).max()) > 2.0**-49
    assert float(abs(found - expected).max()) < 2.0**-104


def test_states_in_106_bits_end_where_those_in_160_do() -> None:
    c, states, times = given(160, 1, n=1)
    exact = [exactly(x) for x in states[:, 0]], [exactly(t) for t in times]
    coefficients = AlignedCoefficients(*map(exactly, c))
    found = states_at(coefficients, *exact, 106)
    expected = states_at(coefficients, *exact, 160)
    gaps = [
        abs(x - y) for a, b in zip(found, expected, strict=True) for x, y in zip(a, b, strict=True)
    ]
    assert max(gaps) < 200 * Fraction(2) ** -106


BODY = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")


def carried(bits: int, sign: int) -> Any:
    a = precision(bits)
    c = reduced_coefficients(BODY.angles(bits + GUARD_BITS), "1", a)
    d, chi, h = (a.array([x]) for x in (0.001953125, 0.5, 1.25))
    state = section_state(True, d, chi, h, c, a)
    return arcs(c.aligned, state, a.array([sign * 1, sign * 3]), bits)


@needs_heyoka("heyoka's numbers against integers")
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("bits", [128, 160])
def test_arcs_above_113_bits_are_those_of_integers(
    bits: int, sign: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, double = carried(bits, sign), carried(113, sign).astype(float)
    monkeypatch.setattr(module, "default_engine", lambda: "scipy")
    integers = carried(bits, sign)
    assert found.shape == integers.shape == (6, 2, 1)
    # Some hundred roundings, each relative to the largest component, of order 1.
    assert float(abs(found - integers).max()) < 2.0 ** (7 - bits)
    np.testing.assert_allclose(found.astype(float), double, rtol=0, atol=1e-15)
