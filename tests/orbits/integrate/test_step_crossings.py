"""Crossings: beside what they lie, where an orbit ends, and passages that nearly touch M3 = 0.

For a touch an orbit is placed beside one, M3 = depth and M3' = 0, and carried back by integers of
220 bits, from where every engine has to find what it does there.
"""

import functools
import itertools
from fractions import Fraction
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    crossings,
    in_turn,
    neighbours,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.batch import written
from rigidpend.orbits.integrate.states import first_crossings, states_at
from rigidpend.orbits.integrate.step_crossings import UNDECIDED, value_at, zeros
from tests.orbits.integrate.problems import by

LIMIT, TINY = 10.0, 2.0**-21


@pytest.mark.parametrize(
    ("given", "times", "outcomes"),
    [
        # In their order, two orbits: one whole, one on its way.
        (
            [(1, 5.0, 3), (0, 1.0, 2), (1, 2.0, 4), (0, 9.0, 1), (0, 4.0, 3)],
            [[1, 4, 9], [2, 5]],
            [Outcome.COMPLETE, None],
        ),
        # What lies beyond the record is left out.
        ([(0, float(k), 1 + k % 4) for k in range(5)], [[0, 1, 2], []], [Outcome.COMPLETE, None]),
        ([(0, 1.0 + k, UNDECIDED if k == 3 else 2) for k in range(4)], [[1, 2, 3], []], [0, None]),
        # A touch that is not decided ends an orbit, as its first or its last.
        ([(0, 1.0, UNDECIDED), (0, 2.0, 2), (1, 1.0, 1)], [[], [1]], [Outcome.FAILED, None]),
        ([(0, 1.0, 2), (0, 2.0, 2), (0, 3.0, UNDECIDED)], [[1, 2], []], [Outcome.FAILED, None]),
        # So does a crossing after the limit, which is counted for each orbit alone.
        ([(0, 10.5, 2), (0, 20.0, 2), (1, 1.0, 1)], [[], [1]], [Outcome.NO_CROSSING, None]),
        ([(0, 10.0, 2), (0, 20.0, 2), (0, 30.5, 2)], [[10, 20], []], [Outcome.NO_CROSSING, None]),
        ([(0, 30.0, 2), (1, 35.0, 2)], [[], []], [Outcome.NO_CROSSING] * 2),
        ([], [[], []], [None, None]),
    ],
)
def test_crossings_are_written_until_an_orbit_ends(
    given: Any, times: list[list[float]], outcomes: list[Any]
) -> None:
    """Where it does not end its outcome stays as it was."""
    found = no_crossings(3, 2)
    expected = [was if x is None else x for x, was in zip(outcomes, found.outcome, strict=True)]
    written(np.array(given, dtype=float).reshape(-1, 3).T, found, LIMIT)
    assert found.outcome.tolist() == expected
    beside = {(column, time): separatrix for column, time, separatrix in given}
    for k, row in enumerate(times):
        n = len(row)
        assert found.time[:n, k].tolist() == row
        assert found.separatrix[:n, k].tolist() == [beside[k, time] for time in row]
        assert np.isnan(found.time[n:, k]).all()
        assert not found.separatrix[n:, k].any()


@pytest.mark.parametrize(
    ("beside", "kept"), [("21432", 5), ("23123", 2), ("42120", 1), ("21000", 2)]
)
def test_crossings_that_do_not_rise_and_sink_in_turn_end_an_orbit(beside: str, kept: int) -> None:
    column = np.array([*map(int, beside)], dtype=np.uint8)[:, None]
    time = np.where(column > 0, np.arange(5.0)[:, None], np.nan)
    found = in_turn(Crossings(time, column, np.array([Outcome.COMPLETE], dtype=np.uint8)))
    assert np.count_nonzero(found.separatrix) == np.isfinite(found.time).sum() == kept
    whole = kept == len(beside.rstrip("0"))
    assert found.outcome[0] == (Outcome.COMPLETE if whole else Outcome.FAILED)


def test_an_orbit_is_done_with_its_last_crossing_and_with_a_touch_that_is_not_decided() -> None:
    """Three orbits are noted beside another: whole, on their way, and ended by a touch."""
    nothing: Any = None
    walk = neighbours.Walk(nothing, np.zeros((6, 3)), np.zeros(3), 3, 10.0, 1e-15)
    walk.note(1.0, 2)
    walk.note(2.0, 1, 0)
    walk.note(3.0, 4, 0)
    walk.note(2.0, UNDECIDED, 2)
    assert walk.count.tolist() == [3, 1, 3]
    walk.note(4.0, 3)
    assert walk.rows[3:] == [(0, 2.0, 1), (0, 3.0, 4), (2, 2.0, UNDECIDED), (1, 4.0, 3)]


@pytest.mark.parametrize(("gap", "expected"), [(1e-3, []), (1e-7, [UNDECIDED])])
def test_the_depth_of_a_touch_is_relative_to_the_momentum_alone(
    gap: float, expected: list[int]
) -> None:
    """M3 of the second neighbour turns at a gap from zero, where the others are far from it."""
    series = np.zeros((3, 6, 3))
    series[:, 2, 0] = 0.25 + gap, -1.0, 1.0
    series[0, :2, 0] = 0.6, 0.8
    series[0, 2:, 0] = 1.25 + gap, 1e4, 1e4, 1e4
    series[0, 2, 1:] = 9.0, -1.0
    found = [(orbit, separatrix) for orbit, _, separatrix in neighbours.crossed(series)]
    assert found == [(1, x) for x in expected]


def test_an_orbit_that_crosses_no_more_is_asymptotic_on_an_invariant_plane() -> None:
    assert silent_outcome(0, 1) == silent_outcome(1, 0) == Outcome.ASYMPTOTIC
    assert silent_outcome(1, 1e-300) == Outcome.NO_CROSSING


HEAVY = Body(A=(2, 1, "1.5"), r=(1, 3, 0), mu="0.4")
BITS, INTEGERS = 160, 130
BACK = 1.0
"""How long before the touch the orbits start, in t'; the next crossing comes much later."""


@functools.cache
def body(bits: int) -> AlignedCoefficients:
    m = context(BITS + 60)
    exactly = aligned_coefficients(HEAVY.angles(BITS + 60), m)
    return AlignedCoefficients(*(fraction(x, bits) for x in exactly))


def at_touch(depth: str) -> list[Fraction]:
    """A state with M3 = depth and M3' = 0."""
    c, P = body(53), BITS + 120
    gamma1, gamma2, gamma3 = Fraction("0.36"), Fraction("0.48"), Fraction("0.8")
    # Qp^2 - Qm^2 balances the weight.
    Qm = Fraction("0.9")
    square = Qm * Qm - (c.mu_r2 * gamma1 - c.mu_r1 * gamma2) / c.twist
    m = context(P)
    root = m.sqrt(m.mpf(square.numerator) / square.denominator)
    Qp = Fraction(int(root * 2**P), 2**P)
    return [Qp, Qm, Fraction(depth), gamma1, gamma2, gamma3]


@functools.cache
def before_touch(depth: str) -> tuple[Fraction, ...]:
    """The state of the same orbit at -BACK."""
    state = np.array([at_touch(depth)]).T
    return tuple(states_at(body(53), state, [Fraction(-BACK)], BITS + 60, engine="scipy")[:, 0, 0])


@functools.cache
def found(depth: str, bits: int, wanted: int = 2, limit: float = 2 * BACK) -> Crossings:
    states: Any = np.array([before_touch(depth)]).T
    c: Any = body(53)
    if bits == 53:
        states, c = states.astype(float), AlignedCoefficients(*map(float, c))
    engine = "taylor" if bits in (53, 64, 106, 113, 160) else "scipy"
    bits = bits if engine == "taylor" else INTEGERS
    return crossings(Orbits(c, states, wanted, limit), **by(engine, bits))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "bits"),
    [
        *itertools.product(("1e-2", "1e-4"), (53, 106, 160)),
        *[("1e-6", 113), ("1e-18", 113), ("1e-18", INTEGERS)],
    ],
)
def test_a_pair_of_crossings_beside_a_touch_is_found_and_none_where_it_misses(
    size: str, bits: int
) -> None:
    """M3'' is positive there."""
    pair, missed = found(f"-{size}", bits), found(size, bits)
    assert pair.outcome.tolist() == [Outcome.COMPLETE]
    assert pair.time[0] < BACK < pair.time[1], "one on either side of the touch"
    if float(size) > 1e-5:
        truth = found(f"-{size}", INTEGERS)
        np.testing.assert_allclose(pair.time, truth.time, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(pair.separatrix, truth.separatrix)
    assert missed.outcome.tolist() == [Outcome.NO_CROSSING]
    assert np.isnan(missed.time).all()


@pytest.mark.parametrize(
    ("depth", "bits"),
    [*itertools.product(("0", "1e-6", "-1e-6"), (53, 64)), ("0", 106), ("0", 113), ("0", INTEGERS)],
)
def test_a_touch_is_undecided_in_every_precision_and_what_is_near_one_in_doubles(
    depth: str, bits: int
) -> None:
    undecided = found(depth, bits)
    assert undecided.outcome.tolist() == [Outcome.FAILED]
    assert np.isnan(undecided.time[1]), "the crossing behind, without which no symbol is certain"


@pytest.mark.parametrize(("engine", "bits"), [("taylor", 106), ("scipy", 113)])
def test_a_first_crossing_that_is_not_decided_is_none(engine: str, bits: int) -> None:
    touching, crossing = (np.array([before_touch(depth)]).T for depth in ("0", "-1e-6"))
    assert first_crossings(body(53), touching, 2 * BACK, **by(engine, bits)) is None
    # What doubles alone do not decide.
    crossed = first_crossings(body(53), crossing, 2 * BACK, **by(engine, bits))
    assert crossed is not None
    assert float(crossed[0][0]) == pytest.approx(found("-1e-6", INTEGERS).time[0, 0], abs=1e-9)


@pytest.mark.parametrize(
    "coefficients",
    [
        [-0.25, 1.0],
        [0.09, -0.6, 1.0 - 1e-3],
        [0.09 + 1e-3, -0.6, 1.0],
        [-1.0, 1.0],
        [0.0, 1.0],
        [-6 / 64, 11 / 16, -6 / 4, 1.0],
    ],
)
def test_zeros_are_isolated(coefficients: list[float]) -> None:
    roots = [x.real for x in np.roots(coefficients[::-1]) if x.imag == 0 and 0 < x.real <= 1]
    at, decided = np.reshape(list(zeros(coefficients, 1e-9)), (-1, 2)).T
    assert decided.all()
    np.testing.assert_allclose(at, sorted(roots), atol=1e-12)


def test_a_zero_where_the_slope_keeps_its_sign_asks_finer_numbers_once() -> None:
    """They are a hundred times as slow as doubles, which err by 2^-40 here."""
    c = [-0.3, 1.0, 0.1]
    finer = [Fraction(x) for x in c]
    finer[0] += Fraction(1, 2**40)
    exactly = Mock(side_effect=lambda x: float(value_at(finer, Fraction(x))))
    [(zero, decided)] = zeros(c, 1e-30, exactly)
    assert decided
    assert exactly.call_count == 1
    assert abs(value_at(finer, Fraction(zero))) < 2.0**-53


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("first", "expected"), [(0.0, [TINY]), (1 - TINY, [1 - TINY, 1.0])])
def test_a_zero_at_the_end_is_one_and_none_at_the_beginning_also_beside_a_turning_point(
    first: float, expected: list[float], side: int
) -> None:
    """Of side (x - first) (x - second), whose two zeros no halving of the step has between them."""
    second = first + TINY
    found = list(zeros([side * first * second, -side * (first + second), side], 1e-15))
    assert [decided for _, decided in found] == [True] * len(expected)
    np.testing.assert_allclose([x for x, _ in found], expected, rtol=1e-9)


def test_a_double_zero_is_told_and_in_the_middle_where_no_turn_lies_between() -> None:
    """Such as a pair of zeros nearer than a millionth, whose slope no bisection tells from zero."""
    at, decided = next(zeros([0.09, -0.6, 1.0], 1e-9))
    assert not decided
    assert at == pytest.approx(0.3, abs=1e-3)
    assert next(zeros([0.0] * 3 + [1e-30], 1e-9)) == (2.0**-21, False)
