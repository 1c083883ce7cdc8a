"""The rule by which two computations establish a symbol, on records made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.routes.certainty import (
    AGREEMENT,
    CLOSE,
    FIRST,
    LINEAR,
    SECOND,
    THIRD,
    agreement,
    decide,
)
from rigidpend.routes.start import Scales

RATE, LIMIT = 2.0, 1e-3
NEAR, FAR = 0.4e-3, 0.6e-3
"""Times apart by less and by more than LIMIT / RATE."""


def record(
    times: Any, separatrices: Any = (2, 1, 4, 3), outcome: Outcome = Outcome.COMPLETE
) -> Crossings:
    """One orbit of four crossings."""
    return Crossings(
        np.array(times, dtype=float)[:, None],
        np.array(separatrices, dtype=np.uint8)[:, None],
        np.array([outcome], dtype=np.uint8),
    )


BASE = [10.0, 20.0, 30.0, 40.0]


def certain(a: Crossings, b: Crossings) -> list[bool]:
    found = agreement(a, b, RATE, LIMIT)
    assert found.tolist() == agreement(b, a, RATE, LIMIT).tolist(), "the order must not matter"
    assert found.shape == (3, 1)
    return [bool(x) for x in found[:, 0]]


def shifted(*by: float) -> Crossings:
    return record(np.add(BASE, by))


def test_agreement_wants_every_time_close() -> None:
    assert certain(record(BASE), record(BASE)) == [True] * 3
    assert certain(record(BASE), shifted(NEAR, -NEAR, NEAR, -NEAR)) == [True] * 3


@pytest.mark.parametrize(
    ("apart_at", "expected"),
    [
        (0, [False, False, False]),
        (1, [False, False, False]),
        (2, [True, False, False]),
        (3, [True, True, False]),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_agreement_ends_before_the_first_crossing_apart(
    apart_at: int, expected: list[bool], sign: int
) -> None:
    """Symbol i lies between crossings i and i + 1; what comes later is doubtful too."""
    by = [0.0] * 4
    by[apart_at] = sign * FAR
    assert certain(record(BASE), shifted(*by)) == expected


def test_agreement_wants_the_same_separatrix() -> None:
    assert certain(record(BASE), record(BASE, (2, 1, 2, 3))) == [True, False, False]
    assert certain(record(BASE), record(BASE, (4, 1, 4, 3))) == [False] * 3


def test_agreement_knows_nothing_where_a_crossing_is_missing() -> None:
    broken = [10.0, 20.0, np.nan, np.nan]
    for outcome in (Outcome.NO_CROSSING, Outcome.FAILED):
        silent = record(broken, (2, 1, 0, 0), outcome)
        assert certain(silent, silent) == [True, False, False]
        assert certain(silent, record(BASE)) == [True, False, False]


def test_agreement_is_certain_that_an_asymptotic_orbit_has_no_symbol() -> None:
    ended = record([10.0, 20.0, np.nan, np.nan], (2, 1, 0, 0), Outcome.ASYMPTOTIC)
    assert certain(ended, ended) == [True] * 3
    # Not where one computation says so alone, nor where the crossings before differ.
    waiting = ended._replace(outcome=np.array([Outcome.NO_CROSSING], dtype=np.uint8))
    assert certain(ended, waiting) == [True, False, False]
    assert certain(ended, record(BASE)) == [True, False, False]
    late = record([10.0, 20.0 + FAR, np.nan, np.nan], (2, 1, 0, 0), Outcome.ASYMPTOTIC)
    assert certain(ended, late) == [False] * 3


class Fake:
    """Columns that agree from a certain computation on; it writes down what it is asked."""

    def __init__(self, settled_from: list[int]) -> None:
        self.settled_from = np.array(settled_from)
        self.asked: list[tuple[int, Scales, list[int]]] = []

    def __call__(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        turn = len(self.asked)
        self.asked.append((bits, scales, list(columns)))
        columns = np.asarray(columns)
        # Until a column settles every computation finds another time.
        off = np.where(turn < self.settled_from[columns], turn + 1.0, 0.0)
        time = np.array(BASE)[:, None] + off
        separatrix = np.tile(np.array([2, 1, 4, 3], dtype=np.uint8)[:, None], columns.size)
        return Crossings(time, separatrix, np.zeros(columns.size, dtype=np.uint8))


def test_decide_climbs_with_what_is_uncertain_alone() -> None:
    # Column 0 agrees at once, 1 from the first computation in 64 bits, 2 within 64 bits,
    # 3 only in the last precision, 4 never.
    fake = Fake([0, 1, 2, 4, 99])
    decided = decide(fake, 5, 1.0, (53, 64, 113))
    assert fake.asked == [
        (53, FIRST, [0, 1, 2, 3, 4]),
        (53, SECOND, [0, 1, 2, 3, 4]),
        (64, FIRST, [1, 2, 3, 4]),
        (64, SECOND, [2, 3, 4]),
        (113, FIRST, [3, 4]),
        (113, SECOND, [3, 4]),
    ]
    assert decided.bits.tolist() == [53, 64, 64, 113, 113]
    assert decided.certain.all(axis=0).tolist() == [True, True, True, True, False]
    assert decided.crossings.time[:, 3].tolist() == BASE
    assert decided.crossings.time[0, 4] == BASE[0] + 6, "the last computation is kept"


def test_decide_asks_no_more_than_it_needs() -> None:
    fake = Fake([0, 0])
    decided = decide(fake, 2, 1.0, (53, 64, 113))
    assert [asked[:2] for asked in fake.asked] == [(53, FIRST), (53, SECOND)]
    assert decided.certain.all()
    assert decided.bits.tolist() == [53, 53]


def test_decide_compares_two_computations_in_one_precision_too() -> None:
    fake = Fake([0, 1, 2])
    decided = decide(fake, 3, 1.0, (113,))
    assert [asked[:2] for asked in fake.asked] == [(113, FIRST), (113, SECOND)]
    assert decided.certain.all(axis=0).tolist() == [True, False, False]


class Late:
    """Computations of one column, each late by its own time; it writes down what it is asked."""

    def __init__(self, **late: float) -> None:
        scales = {"first": FIRST, "second": SECOND, "third": THIRD}
        self.late = {
            (int(bits), scales[name]): by
            for key, by in late.items()
            for name, bits in [key.split("_")]
        }
        self.asked: list[tuple[int, Scales]] = []

    def __call__(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        self.asked.append((bits, scales))
        found = record(BASE)
        return found._replace(time=found.time + self.late[bits, scales])


def test_decide_wants_a_third_computation_where_two_are_not_close() -> None:
    late = Late(first_53=0.0, second_53=CLOSE / 2)
    assert decide(late, 1, 1.0, (53,)).certain.all()
    assert len(late.asked) == 2
    for third, established in ((0.0, True), (1.4 * AGREEMENT, False), (-0.6 * AGREEMENT, False)):
        late = Late(first_53=0.0, second_53=AGREEMENT / 2, third_53=third)
        assert decide(late, 1, 1.0, (53,)).certain.all() == established, third
        assert late.asked == [(53, FIRST), (53, SECOND), (53, THIRD)]


def test_decide_asks_for_no_third_computation_that_cannot_help() -> None:
    late = Late(first_53=0.0, second_53=2 * AGREEMENT)
    assert not decide(late, 1, 1.0, (53,)).certain.any()
    assert len(late.asked) == 2


def test_decide_judges_two_precisions_by_another_limit_than_one() -> None:
    between = (AGREEMENT * LINEAR) ** 0.5
    assert not decide(Late(first_53=0.0, second_53=between), 1, 1.0, (53,)).certain.any()
    late = Late(first_53=0.0, second_53=between, first_64=0.0)
    decided = decide(late, 1, 1.0, (53, 64))
    assert decided.certain.all()
    assert decided.bits.tolist() == [64]


def test_decide_keeps_what_two_establish_and_doubts_what_comes_after() -> None:
    """The third computation is asked for the symbols that two leave open, and no others."""

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        late = {FIRST: 0.0, SECOND: AGREEMENT / 2, THIRD: 2 * AGREEMENT}[scales]
        return shifted(0.0, 0.0, late, late)

    assert decide(compute, 1, 1.0, (53,)).certain[:, 0].tolist() == [True, False, False]


def test_limits_are_in_the_order_of_what_they_must_guard_against() -> None:
    assert 0 < CLOSE < AGREEMENT < LINEAR < 0.1


@pytest.mark.parametrize("pair", [(FIRST, SECOND), (FIRST, THIRD), (SECOND, THIRD)])
def test_scales_of_the_computations_differ_by_no_power_of_two(pair: Any) -> None:
    for first, second in zip(*pair, strict=True):
        mantissa, _ = np.frexp(float(second) / float(first))
        assert mantissa != 0.5


@pytest.mark.parametrize(("apart", "computations"), [(0.9e-6, 2), (1.1e-6, 3)])
def test_a_millionth_of_a_radian_is_the_most_that_two_computations_settle(
    apart: float, computations: int
) -> None:
    late = Late(first_53=0.0, second_53=apart, third_53=0.0)
    assert decide(late, 1, 1.0, (53,)).certain.all()
    assert len(late.asked) == computations


@pytest.mark.parametrize(("apart", "settled"), [(0.9e-3, True), (1.1e-3, False)])
def test_a_thousandth_of_a_radian_is_the_most_that_three_settle(
    apart: float, settled: bool
) -> None:
    for late in (
        Late(first_53=0.0, second_53=apart, third_53=apart / 2),
        Late(first_53=0.0, second_53=apart / 2, third_53=apart),
    ):
        assert decide(late, 1, 1.0, (53,)).certain.all() == settled


@pytest.mark.parametrize(("apart", "settled"), [(0.9e-2, True), (1.1e-2, False)])
def test_a_hundredth_of_a_radian_is_the_most_that_two_precisions_settle(
    apart: float, settled: bool
) -> None:
    late = Late(first_53=0.0, second_53=2e-3, first_64=2e-3 + apart, second_64=1.0)
    decided = decide(late, 1, 1.0, (53, 64))
    assert decided.certain.all() == settled
    assert len(late.asked) == 3 + (not settled)


def test_two_asymptotic_ends_after_different_crossings_establish_nothing_more() -> None:
    early = record([10.0, 20.0, np.nan, np.nan], (2, 1, 0, 0), Outcome.ASYMPTOTIC)
    late = record([10.0, 20.0, 30.0, np.nan], (2, 1, 4, 0), Outcome.ASYMPTOTIC)
    assert certain(early, late) == [True, False, False]


def test_a_third_computation_decides_its_own_column_and_no_other() -> None:
    """Between columns that agree at once: one that it refuses, and one that it grants.

    Column 3 differs by more than `AGREEMENT`, so that no third one is asked for.
    """
    second = np.array([0.0, 10 * CLOSE, 0.0, 10 * AGREEMENT, 10 * CLOSE])
    third = np.array([0.0, 10 * AGREEMENT, 0.0, 0.0, 0.0])
    asked: list[list[int]] = []

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        columns = np.asarray(columns)
        off = {FIRST: np.zeros(5), SECOND: second, THIRD: third}[scales]
        if scales == THIRD:
            asked.append(columns.tolist())
        time = np.array(BASE)[:, None] + off[columns]
        separatrix = np.tile(np.array([2, 1, 4, 3], dtype=np.uint8)[:, None], columns.size)
        return Crossings(time, separatrix, np.zeros(columns.size, dtype=np.uint8))

    found = decide(compute, 5, 1.0, (53,))
    assert asked == [[1, 4]]
    assert found.certain.all(axis=0).tolist() == [True, False, True, False, True]
    assert not found.certain[:, [1, 3]].any()
