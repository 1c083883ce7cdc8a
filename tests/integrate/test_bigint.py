"""The integer engine: its zeros against numpy.roots, its precision against more of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rigidpend.integrate import Outcome, bigint
from tests.integrate.problems import fan, find, same, task
from tests.strategies import numbers, repeatable

APART = 0.02


@pytest.mark.slow
@given(
    inside=st.lists(numbers(0.01, 0.99), max_size=3),
    outside=st.lists(st.one_of(numbers(-9, -2), numbers(2, 9)), max_size=4),
    pairs=st.lists(st.tuples(numbers(-5, 5), numbers(2, 9)), max_size=3),
    size=numbers(1e-3, 1e3),
)
@repeatable(200)
def test_zeros_are_those_that_numpy_finds(
    inside: list[float], outside: list[float], pairs: list[tuple[float, float]], size: float
) -> None:
    # As in a step's series, the other zeros are further away than the step is long.
    assume(all(abs(a - b) > APART for i, a in enumerate(inside) for b in inside[:i]))
    complex_roots = [x + sign * 1j * y for x, y in pairs for sign in (1, -1)]
    descending = size * np.atleast_1d(np.poly([*inside, *outside, *complex_roots]).real)
    found = list(bigint._zeros(descending[::-1].tolist(), 0.0, 1.0))
    roots = np.roots(descending)
    expected = np.sort([x.real for x in roots if abs(x.imag) < 1e-6 and 0 < x.real <= 1])
    assert len(expected) == len(inside)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_zeros_take_the_end_and_leave_the_start() -> None:
    at_both_ends = [0.0, -1.0, 1.0]  # x (x - 1)
    assert list(bigint._zeros(at_both_ends, 0.0, 1.0)) == pytest.approx([1.0])
    assert list(bigint._zeros([-0.5, 1.0], 0.0, 1.0)) == pytest.approx([0.5])


def test_zeros_skip_a_touch() -> None:
    assert list(bigint._zeros([0.25, -1.0, 1.0], 0.0, 1.0)) == []  # (x - 1/2)^2
    assert list(bigint._zeros([1.0, 0.0, 1.0], 0.0, 1.0)) == []  # x^2 + 1


@pytest.mark.slow
def test_precision_113_bits_give_the_doubles_of_200() -> None:
    begin = fan(1, J1=1e-6)
    assert same(find(begin, "scipy", 113), find(begin, "scipy", 200))


def test_precision_fewer_bits_err_more() -> None:
    """12 bits are a factor of 4,000, give or take what rounding makes of it."""
    orbits = task(fan(1), 113)
    coarse, fine, truth = (bigint.crossings(orbits, bits).time for bits in (4, 16, 113))
    errors = [float(np.abs(times - truth).max()) for times in (coarse, fine)]
    assert 4e1 < errors[0] / errors[1] < 4e5


def test_outcome_out_of_steps_is_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bigint, "MAX_STEPS", 3)
    found = find(fan(1), "scipy", 80)
    assert found.outcome.tolist() == [Outcome.FAILED]
    assert np.isnan(found.time).all()
