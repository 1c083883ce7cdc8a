"""The integer engine: its zeros against numpy.roots, its precision against more of it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rigidpend.orbits.integrate import Outcome, bigint
from rigidpend.orbits.integrate.roots import UndecidedTouch
from tests.orbits.integrate.problems import (
    fan,
    find,
    same,
    task,
)
from tests.strategies import numbers, repeatable

APART = 0.02
P = 120


def zeros(c: list[float]) -> list[float]:
    """The zeros of sum c_k x^k in (0, 1], as the engine finds them in a step's series."""
    series = [int(Fraction(x) * 2**P) for x in c]
    return [at / 2**P for at in bigint.crossings_within(series, 1 << P, P, 0)]


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
    found = zeros(descending[::-1].tolist())
    roots = np.roots(descending)
    expected = np.sort([x.real for x in roots if abs(x.imag) < 1e-6 and 0 < x.real <= 1])
    assert len(expected) == len(inside)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_zeros_take_the_end_and_leave_the_start() -> None:
    at_both_ends = [0.0, -1.0, 1.0]  # x (x - 1)
    assert zeros(at_both_ends) == [1.0]
    assert zeros([-0.5, 1.0]) == [0.5]


@pytest.mark.parametrize("bits", [8, 30, 50])
def test_zeros_beside_a_touch_are_found_and_the_touch_itself_is_not_decided(bits: int) -> None:
    """(x - 1/2)^2 = 4^-bits, to far below what doubles tell from nothing."""
    half, root, depth = 1 << P - 1, 1 << P - bits, 1 << P - 2 * bits
    series = [(1 << P - 2) - depth, -1 << P, 1 << P]
    found = list(bigint.crossings_within(series, 1 << P, P, depth // 2))
    # Horner's rule errs by a unit or two, which the slope at the zeros divides.
    assert found == pytest.approx([half - root, half + root], rel=0, abs=1 << bits)
    with pytest.raises(UndecidedTouch) as told:
        list(bigint.crossings_within(series, 1 << P, P, 2 * depth))
    assert told.value.at == pytest.approx(0.5, abs=2.0**-19)
    series[0] += 2 * depth
    assert list(bigint.crossings_within(series, 1 << P, P, depth // 2)) == []


def test_no_zero_where_there_is_no_touch() -> None:
    assert zeros([1.0, 0.0, 1.0]) == []  # x^2 + 1


@pytest.mark.slow
def test_precision_113_bits_give_the_doubles_of_200() -> None:
    begin = fan(1, J1=1e-6)
    assert same(find(begin, "scipy", 113), find(begin, "scipy", 200))


@pytest.mark.slow
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


@pytest.mark.parametrize(
    ("momentum", "expected"),
    [(("1", "-0.5", "0"), 1), (("0", "0.1", "-5"), 4), (("0.2", "0", "0.1"), "0.25")],
)
def test_the_unit_is_a_power_of_two_next_to_the_largest_momentum(
    momentum: tuple[str, ...], expected: str
) -> None:
    state = [*map(Fraction, momentum), Fraction(1000), Fraction(-2000), Fraction(3000)]
    assert bigint.unit_of(state) == Fraction(expected)
