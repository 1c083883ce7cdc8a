"""The integers: products of whole series, and their precision against more of it."""

from __future__ import annotations

from fractions import Fraction
from itertools import islice

import pytest

from rigidpend.orbits.integrate import bigint
from tests.orbits.integrate.problems import fan, task


def after(time: int, bits: int) -> list[Fraction]:
    """An orbit's state after some time t'."""
    [begin], c = task(fan(1), 113).states.T, task(fan(1), 113).coefficients
    for step in bigint.steps(c, begin, bits):
        if step.time(step.length) >= time:
            return list(step.at(step.since_begin(Fraction(time))))
    raise AssertionError


@pytest.mark.parametrize("bits", [60, 113, 424, 700])
def test_products_of_whole_series_are_the_sums_of_their_terms(
    bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole numbers, of which no digit depends on the way."""
    orbits = task(fan(1), 113)
    given = orbits.coefficients, orbits.states[:, 0], bits
    by_products = list(islice(bigint.steps(*given), 2))
    monkeypatch.setattr(bigint, "SHORT", 10**6)
    assert list(islice(bigint.steps(*given), 2)) == by_products


@pytest.mark.slow
def test_precision_fewer_bits_err_more() -> None:
    """12 bits are a factor of 4,000, give or take what rounding makes of it."""
    coarse, fine, truth = (after(40, bits) for bits in (4, 16, 113))
    errors = [max(abs(float(x - y)) for x, y in zip(z, truth, strict=True)) for z in (coarse, fine)]
    assert 4e1 < errors[0] / errors[1] < 4e5


@pytest.mark.parametrize(
    ("momentum", "expected"),
    [(("1", "-0.5", "0"), "0.5"), (("0", "0.1", "-5"), 2), (("0.2", "0", "0.1"), "0.125")],
)
def test_the_unit_is_half_of_a_power_of_two_next_to_the_largest_momentum(
    momentum: tuple[str, ...], expected: str
) -> None:
    state = [*map(Fraction, momentum), Fraction(1000), Fraction(-2000), Fraction(3000)]
    assert bigint.unit_of(state) == Fraction(expected)
