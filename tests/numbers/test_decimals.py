"""Decimal forms: the same number, as a person would write it."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidpend.numbers.exact import exact
from rigidpend.numbers.expressions import as_written, everywhere


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("3/2", "1.5"),
        ("1/100000000", "1e-8"),
        ("-1/1000", "-0.001"),
        ("239205/100000000000000", "2.39205e-9"),
        ("6671/5000", "1.3342"),
        ("1/3", "1/3"),
        ("0", "0"),
        ("20000", "20000"),
        ("10000000", "1e7"),
        ("3*pi/40", "3*pi/40"),
        ("1/0", "1/0"),
        ("1/00", "1/00"),
        ("route_codes", "route_codes"),
    ],
)
def test_numbers_are_as_a_person_writes_them(text: str, written: str) -> None:
    assert as_written(text) == written


@given(st.fractions(), st.integers(-30, 30))
def test_the_number_is_the_same(x: Fraction, power: int) -> None:
    value = x * Fraction(10) ** power
    assert exact(as_written(str(value))).fraction == value


def test_data_keep_their_shape() -> None:
    data = {"a": ["3/2", 7, None, True], "b": {"c": "1/1000"}}
    assert everywhere(data) == {"a": ["1.5", 7, None, True], "b": {"c": "0.001"}}
