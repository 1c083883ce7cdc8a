"""Initial phases stay exact, and come as numbers, lists or arrays."""

from __future__ import annotations

import itertools
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.numbers.exact import ExactError, context, exact
from rigidpend.routes.phases import FAR, Grid, Phases, turned

TENTHS = [f"{k}/10" for k in range(63)]
HALVES, TWO = [Fraction(1, 2), Fraction(5, 4)], [Fraction(2)]
PI = Fraction("3.14159265358979323846264338327950288")
"""To 35 digits, from tables."""


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (TENTHS, [Fraction(k, 10) for k in range(63)]),
        (["31/10", 3.1], [Fraction(31, 10), Fraction(3.1)]),
        ("3*pi/40 + 1/100", [3 * PI / 40 + Fraction(1, 100)]),
        (np.array([0.5, 1.25]), HALVES),
        (np.array([0.5, 1.25], dtype=np.float32), HALVES),
        (np.array(["1/2", "5/4"], dtype=object), HALVES),
        ((0.5, "1.25"), HALVES),
        ([Fraction(1, 2), Decimal("1.25")], HALVES),
        ((x / 4 for x in (2, 5)), HALVES),
        # A number alone is a sequence of one.
        *((value, TWO) for value in (2, 2.0, "4/2", np.float64(2), np.int64(2), np.array(2.0))),
    ],
)
def test_a_phase_is_a_double_with_its_rest_whatever_it_is_given_as(
    values: Any, expected: list[Fraction]
) -> None:
    phases = Phases(values)
    assert phases.high.tolist() == [float(x) for x in expected]
    assert phases.rest.tolist() == [float(x - Fraction(float(x))) for x in expected]
    exactly = [x.fraction for x in phases.exactly(range(len(phases)))]
    assert exactly in (expected, [None])


def test_phases_stay_as_they_are_given_when_the_caller_changes_his() -> None:
    assert [str(x) for x in Phases(TENTHS).exactly([31, 0, 5])] == ["31/10", "0/10", "5/10"]
    given = np.array([1.0, 2.0])
    phases = Phases(given)
    given[:] = 0.0
    assert phases.high.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("turns", [10**5, 10**6, 10**17, -(10**40), 10**300])
def test_far_phases_are_computed_without_their_whole_turns(turns: int) -> None:
    far = f"1/3 + 2*pi*{turns}"
    phases, double = Phases([far, "1/3", float(10**30)]), Fraction(10**30 * 1.0)
    assert phases.high.tolist() == [float(exact(far)), 1 / 3, 1e30]
    m = context(400 + 1000)
    for k, phase in enumerate([m.mpf(1) / 3, m.mpf(1) / 3, m.mpf(int(double))]):
        missing = phase - m.mpf(phases.near[k]) - m.mpf(phases.rest[k])
        missing -= 2 * m.pi * m.nint(missing / (2 * m.pi))
        assert abs(missing) < 2.0**-85


def test_an_angle_is_turned_by_a_rest_to_the_roundings_of_pairs_of_doubles() -> None:
    """The largest rest is that of a phase just below those that are far."""
    m = context(200)
    a, rest = m.mpf("1.3"), m.mpf(FAR) * 2.0**-53
    found = turned(m.cos(a), m.sin(a), rest)
    for near, true in zip(found, (m.cos(a + rest), m.sin(a + rest)), strict=True):
        assert abs(near - true) < 2.0**-98


def test_grid_is_exact_where_sums_of_doubles_are_not() -> None:
    grid = Grid(exact("3*pi/40"), exact("1/100"), 32)
    last = grid[31]
    assert abs(last.at(113) - exact("3*pi/40 + 31/100").at(113)) < 2.0**-110
    assert Grid(exact(0), exact("1/10"), 63)[31].fraction == Fraction(31, 10)
    assert len(list(grid)) == len(grid) == 32
    for outside in (-1, 32):
        with pytest.raises(IndexError):
            grid[outside]


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (np.array([1.0, np.nan]), "theta2_0 must be finite.*nan"),
        (np.array([np.inf]), "theta2_0 must be finite.*inf"),
        ([1.0, float("inf")], "inf is not finite"),
        (["1", "-1e400"], "theta2_0 must be finite doubles, got -inf"),
        (np.zeros((2, 2)), "got 2 dimensions"),
        (np.ma.masked_array([0.1, 0.2], mask=[False, True]), "masked"),
        (["1", "one"], "'one'"),
        (None, "None is not a real number"),
        (range(10**9), "theta2_0 has 1000000000 phases; 10000000 are the most"),
        (itertools.repeat(0), "theta2_0 has 10000001 phases; 10000000 are the most"),
        (np.array(1), "not a real number"),
        ([1, [2]], r"^theta2_0: \[2\] is not a real number"),
        (b"12", "b'12' is not a real number"),
    ],
)
def test_refuses_what_is_no_finite_number(values: Any, told: str) -> None:
    with pytest.raises(ExactError, match=told):
        Phases(values)
