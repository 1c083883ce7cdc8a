"""Crossings: beside what they lie, where an orbit ends, and passages that nearly touch M3 = 0.

For a touch an orbit is placed beside one, M3 = depth and M3' = 0, and carried back by integers of
200 bits, from where every engine has to find what it does there.
"""

from __future__ import annotations

import functools
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_coefficients
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    crossings,
    in_turn,
    joined,
    neighbours,
    no_crossings,
)
from rigidpend.orbits.integrate.batch import Found
from rigidpend.orbits.integrate.passages import UNDECIDED, zeros
from rigidpend.orbits.integrate.reference_orbit import Passed
from rigidpend.orbits.integrate.states import first_crossings, states_at
from tests.orbits.integrate.problems import FREE, on_separatrix

LIMIT = 10.0


def written(*crossings: tuple[int, float, int], rows: int = 3, before: int) -> Crossings:
    """A record of two orbits into which crossings (orbit, time, separatrix) are written."""
    found = no_crossings(rows, 2)
    found.outcome[:] = before
    Found.of(crossings).write(found, LIMIT)
    return found


def test_crossings_are_written_in_their_order_and_fill_an_orbit() -> None:
    given = (1, 5.0, 3), (0, 1.0, 2), (1, 2.0, 4), (0, 9.0, 1), (0, 4.0, 3)
    found = written(*given, before=Outcome.NO_CROSSING)
    np.testing.assert_array_equal(found.time, [[1, 2], [4, 5], [9, np.nan]])
    assert found.separatrix.tolist() == [[2, 4], [3, 3], [1, 0]]
    assert found.outcome.tolist() == [Outcome.COMPLETE, Outcome.NO_CROSSING]


def test_crossings_beyond_the_record_are_left_out() -> None:
    found = written(*((0, float(k), 1 + k % 4) for k in range(5)), before=Outcome.FAILED)
    assert found.time[:, 0].tolist() == [0, 1, 2]
    assert found.outcome.tolist() == [Outcome.COMPLETE, Outcome.FAILED]


@pytest.mark.parametrize("at", [0, 1, 2])
def test_an_undecided_touch_ends_an_orbit_as_failed(at: int) -> None:
    given = [(0, 1.0 + k, UNDECIDED if k == at else 2) for k in range(4)]
    found = written(*given, (1, 1.0, 1), before=Outcome.NO_CROSSING)
    assert found.outcome.tolist() == [Outcome.FAILED, Outcome.NO_CROSSING]
    assert np.isfinite(found.time[:, 0]).tolist() == [k < at for k in range(3)]
    assert found.separatrix[:, 0].tolist() == [2] * at + [0] * (3 - at)
    assert found.separatrix[:, 1].tolist() == [1, 0, 0]


@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_crossing_that_came_after_the_limit_ends_an_orbit(at: int) -> None:
    waits = [LIMIT + 0.5 * (k == at) for k in range(4)]
    given = [(0, float(time), 2) for time in np.cumsum(waits)]
    found = written(*given, (1, 1.0, 1), before=Outcome.COMPLETE)
    assert found.outcome.tolist() == [Outcome.NO_CROSSING, Outcome.COMPLETE]
    assert np.isfinite(found.time[:, 0]).tolist() == [k < at for k in range(3)]


def test_the_wait_of_one_orbit_is_not_counted_from_another() -> None:
    found = written((0, 30.0, 2), (1, 35.0, 2), before=Outcome.FAILED, rows=1)
    assert found.outcome.tolist() == [Outcome.NO_CROSSING] * 2
    assert np.isnan(found.time).all()


def test_no_crossings_change_nothing() -> None:
    found = no_crossings(2, 1)
    Found.of([]).write(found, LIMIT)
    assert found.outcome.tolist() == [Outcome.FAILED]


@pytest.mark.parametrize(
    ("separatrix", "kept"),
    [
        ([2, 1, 4, 3, 2], 5),
        ([2, 3, 1, 2, 3], 2),
        ([4, 2, 1, 2, 0], 1),
        ([2, 1, 0, 0, 0], 2),
    ],
)
def test_crossings_that_do_not_rise_and_sink_in_turn_end_an_orbit(
    separatrix: list[int], kept: int
) -> None:
    column = np.array(separatrix, dtype=np.uint8)[:, None]
    time = np.where(column > 0, np.arange(5.0)[:, None], np.nan)
    given = Crossings(time, column, np.array([Outcome.COMPLETE], dtype=np.uint8))
    found = in_turn(given)
    assert np.count_nonzero(found.separatrix) == kept
    assert np.isnan(found.time[kept:]).all()
    whole = kept == np.count_nonzero(separatrix)
    assert found.outcome[0] == (Outcome.COMPLETE if whole else Outcome.FAILED)


def test_an_orbit_is_complete_with_its_last_crossing_and_not_with_a_touch() -> None:
    """Three orbits are noted: whole, on their way, and ended by a touch that is not decided."""
    walk = neighbours.Walk(
        None,  # type: ignore[arg-type]
        np.zeros((6, 3)),
        np.zeros(3),
        n_crossings=2,
        passage_limit=10.0,
        bits=53,
        tolerance=1e-15,
    )
    walk.note(Passed(1.0, 2))
    walk.note(Passed(2.0, 1), 0)
    walk.note(Passed(2.0, UNDECIDED), 2)
    assert walk.found.outcome.tolist() == [Outcome.COMPLETE, Outcome.FAILED, Outcome.FAILED]
    assert walk.found.separatrix.T.tolist() == [[2, 1], [2, 0], [2, 0]]
    walk.note(Passed(3.0, 3))
    assert walk.found.separatrix.T.tolist() == [[2, 1], [2, 3], [2, 0]]


@pytest.mark.parametrize(("gap", "expected"), [(1e-3, []), (1e-7, [UNDECIDED])])
def test_the_depth_of_a_touch_is_relative_to_the_momentum_alone(
    gap: float, expected: list[int]
) -> None:
    """M3 of the reference turns at a gap from zero, and its neighbour's with it."""
    series = np.zeros((3, 6, 2))
    series[:, 2, 0] = 0.25 + gap, -1.0, 1.0
    series[0, :2, 0] = 0.6, 0.8
    series[0, 2:, 0] = 0.25 + gap, 1e4, 1e4, 1e4
    found = [separatrix for _, _, separatrix in neighbours.crossed(series, 53)]
    assert found == expected


@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
@pytest.mark.parametrize("nudge", [0.0, 1e-3, -1e-3, 1e-200, -1e-200])
def test_separatrix_beside_knows_the_unperturbed_ones_and_their_neighbours(
    separatrix: int, nudge: float
) -> None:
    state = on_separatrix(separatrix, FREE, 0.5, 0.3)
    assert state[2] == pytest.approx(0, abs=1e-15), "halfway up M3 = 0"
    rising = aligned(state, aligned_coefficients(FREE.angles(), math))[2] > 0
    Qp, Qm = np.where(state[:2] == 0, nudge, state[:2])
    assert separatrix_beside(rising, Qp, Qm) == separatrix


def test_joined_keeps_the_order_of_the_orbits() -> None:
    parts = []
    for width, first in ((2, 0.0), (1, 2.0), (3, 3.0)):
        part = no_crossings(2, width)
        part.time[:] = first + np.arange(width)
        part.separatrix[:] = 1 + first
        part.outcome[:] = first
        parts.append(part)
    whole = joined(parts)
    assert whole.time.tolist() == [[0, 1, 2, 3, 4, 5]] * 2
    assert whole.separatrix.tolist() == [[1, 1, 3, 4, 4, 4]] * 2
    assert whole.outcome.tolist() == [0, 0, 2, 3, 3, 3]
    assert whole.separatrix.dtype == whole.outcome.dtype == np.uint8


HEAVY = Body(A=(2, 1, "1.5"), r=(1, 3, 0), mu="0.4")
BITS = 240
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


def sign_of_bend() -> float:
    """The sign of M3'' at the touch."""
    c, state = AlignedCoefficients(*map(float, body(53))), np.array(at_touch("0"), dtype=float)
    return float(np.sign(aligned(state + 1e-6 * np.array(aligned(state, c)), c)[2]))


@functools.cache
def before_touch(depth: str) -> tuple[Fraction, ...]:
    """The state of the same orbit at -BACK."""
    state = np.array([at_touch(depth)]).T
    return tuple(states_at(body(53), state, [Fraction(-BACK)], 2 * BITS)[:, 0, 0])


@functools.cache
def found(depth: str, bits: int, wanted: int = 2, limit: float = 2 * BACK) -> Crossings:
    states: Any = np.array([before_touch(depth)]).T
    c: Any = body(53)
    if bits == 53:
        states, c = states.astype(float), AlignedCoefficients(*map(float, c))
    engine = "taylor" if bits in (53, 64, 106, 113, 160) else "scipy"
    return crossings(
        Orbits(c, states, wanted, limit),
        engine=engine,
        bits=bits if engine == "taylor" else 200,
        tolerance=2.0**-52,
        jobs=1,
    )


@pytest.mark.slow
@pytest.mark.parametrize("bits", [53, 106, 160])
@pytest.mark.parametrize("size", ["1e-2", "1e-4"])
def test_a_pair_of_crossings_beside_a_touch_is_found_and_none_where_it_misses(
    bits: int, size: str
) -> None:
    bend = sign_of_bend()
    through, clear = (size, f"-{size}") if bend < 0 else (f"-{size}", size)
    pair, truth = found(through, bits), found(through, 200)
    assert pair.outcome.tolist() == [Outcome.COMPLETE]
    np.testing.assert_allclose(pair.time, truth.time, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(pair.separatrix, truth.separatrix)
    assert pair.time[0] < BACK < pair.time[1], "one on either side of the touch"
    missed = found(clear, bits)
    assert missed.outcome.tolist() == [Outcome.NO_CROSSING]
    assert np.isnan(missed.time).all()


@pytest.mark.parametrize("depth", ["0", "1e-6", "-1e-6", "1e-12", "-1e-12"])
@pytest.mark.parametrize("bits", [53, 64])
def test_what_doubles_cannot_decide_they_leave_to_higher_precision(depth: str, bits: int) -> None:
    undecided = found(depth, bits)
    assert undecided.outcome.tolist() == [Outcome.FAILED]
    assert np.isnan(undecided.time[1]), "the crossing behind, without which no symbol is certain"


@pytest.mark.slow
@pytest.mark.parametrize("depth", ["1e-6", "-1e-6", "1e-12", "-1e-12", "1e-18", "-1e-18"])
@pytest.mark.parametrize("bits", [113, 200])
def test_more_bits_decide_what_doubles_leave(depth: str, bits: int) -> None:
    fine = found(depth, bits)
    crossed = (float(depth) > 0) == (sign_of_bend() < 0)
    assert fine.outcome.tolist() == [Outcome.COMPLETE if crossed else Outcome.NO_CROSSING]


@pytest.mark.parametrize("bits", [106, 113, 200])
def test_a_touch_itself_is_undecided_in_every_precision(bits: int) -> None:
    assert found("0", bits).outcome.tolist() == [Outcome.FAILED]


@pytest.mark.parametrize(("engine", "bits"), [("taylor", 106), ("scipy", 113)])
def test_a_first_crossing_that_is_not_decided_is_none(engine: str, bits: int) -> None:
    given: dict[str, Any] = {"engine": engine, "bits": bits, "tolerance": 2.0**-52, "jobs": 1}
    state = np.array([before_touch("0")]).T
    assert first_crossings(body(53), state, 2 * BACK, **given) is None
    # What doubles alone do not decide.
    depth = "1e-12" if sign_of_bend() < 0 else "-1e-12"
    crossed = first_crossings(body(53), np.array([before_touch(depth)]).T, 2 * BACK, **given)
    assert crossed is not None
    assert float(crossed[0][0]) == pytest.approx(found(depth, 200).time[0, 0], abs=1e-9)


@pytest.mark.parametrize(
    ("coefficients", "expected"),
    [
        ([-0.25, 1.0], [0.25]),
        ([0.09, -0.6, 1.0 - 1e-3], "two"),
        ([0.09 + 1e-3, -0.6, 1.0], []),
        ([-1.0, 1.0], [1.0]),
        ([0.0, 1.0], []),
        ([-6 / 64, 11 / 16, -6 / 4, 1.0], [0.25, 0.5, 0.75]),
    ],
)
def test_zeros_are_isolated(coefficients: list[float], expected: Any) -> None:
    found = list(zeros(coefficients, 1e-9))
    assert all(decided for _, decided in found)
    there = [at for at, _ in found]
    if expected == "two":
        roots = np.sort(np.roots(coefficients[::-1]).real)
        np.testing.assert_allclose(there, roots, atol=1e-9)
    else:
        np.testing.assert_allclose(there, expected, atol=1e-12)


def test_a_double_zero_is_told() -> None:
    at, decided = next(zeros([0.09, -0.6, 1.0], 1e-9))
    assert not decided
    assert at == pytest.approx(0.3, abs=1e-3)


def test_where_no_turn_lies_between_the_middle_is_told() -> None:
    """A pair of zeros nearer than a millionth, whose slope no bisection tells from zero."""
    assert next(zeros([0.0] * 3 + [1e-30], 1e-9)) == (2.0**-21, False)
