"""The rule by which two computations establish a symbol, on records made by hand."""

from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.routes import certainty
from rigidpend.routes.certainty import LIMIT_OF_UNEQUAL, SECOND_SCALES, THIRD_SCALES, decide
from rigidpend.routes.ladder import Rung, rungs
from rigidpend.routes.start import Scales

RATE, LIMIT = 2.0, 1e-3
NEAR, FAR = 0.4e-3, 0.6e-3
"""Times apart by less and by more than LIMIT / RATE."""
BASE = [10.0, 20.0, 30.0, 40.0]


def record(
    times: Any = BASE, separatrices: Any = (2, 1, 4, 3), outcome: Outcome = Outcome.COMPLETE
) -> Crossings:
    """One orbit of four crossings, with None where there is none."""
    return Crossings(
        np.array(times, dtype=float)[:, None],
        np.array(separatrices, dtype=np.uint8)[:, None],
        np.array([outcome], dtype=np.uint8),
    )


def ended(at: float = 20.0, outcome: Outcome = Outcome.ASYMPTOTIC) -> Crossings:
    """One with two crossings, after which there is none."""
    return record([10.0, at, None, None], (2, 1, 0, 0), outcome)


ASYMPTOTIC_LATER = record([10.0, 20.0, 30.0, None], (2, 1, 4, 0), Outcome.ASYMPTOTIC)


def ladder(most: dict[int, int], known: int = 0) -> list[Rung]:
    """Rungs of integrations by their bits, with the largest number of computations on each."""
    return rungs(most, known, most=most)


@pytest.mark.parametrize(
    ("a", "b", "symbols"),
    [
        # Symbol i lies between crossings i and i + 1; what comes later is doubtful too.
        (record(), record(), 3),
        (record(), record(np.add(BASE, [NEAR, -NEAR, NEAR, -NEAR])), 3),
        *(
            (record(), record(np.add(BASE, side * FAR * np.eye(4)[k])), max(0, k - 1))
            for k in range(4)
            for side in (1, -1)
        ),
        (record(), record(separatrices=(2, 1, 2, 3)), 1),
        (record(), record(separatrices=(4, 1, 4, 3)), 0),
        *(
            (ended(outcome=outcome), other, 1)
            for outcome in (Outcome.NO_CROSSING, Outcome.FAILED)
            for other in (ended(outcome=outcome), record())
        ),
        # That an orbit is asymptotic, and has no symbol, is certain where both say so alike.
        (ended(), ended(), 3),
        (ended(), ended(outcome=Outcome.NO_CROSSING), 1),
        (ended(), record(), 1),
        (ended(), ended(20.0 + FAR), 0),
        (ended(), ASYMPTOTIC_LATER, 1),
    ],
)
def test_all_must_agree_up_to_a_symbol(a: Crossings, b: Crossings, symbols: int) -> None:
    found = certainty.agreement(a, b, RATE, LIMIT)
    assert found[:, 0].tolist() == [k < symbols for k in range(3)]
    np.testing.assert_array_equal(found, certainty.agreement(b, a, RATE, LIMIT))


STAYS, TOO_LONG = (ended(outcome=x) for x in (Outcome.NO_CROSSING, Outcome.TOO_LONG))


@pytest.mark.parametrize(
    ("first", "second", "again"),
    [
        # Both find two crossings alike, and then none within the limit, or take too many steps:
        (STAYS, STAYS, False),
        (TOO_LONG, TOO_LONG, False),
        # one finds another, or another time, or has given up.
        (STAYS, record([10.0, 20.0, 30.0, None], (2, 1, 4, 0), Outcome.NO_CROSSING), True),
        (STAYS, record([10.0, None, None, None], (2, 0, 0, 0), Outcome.NO_CROSSING), True),
        (STAYS, ended(20.0 + FAR, Outcome.NO_CROSSING), True),
        (STAYS, ended(outcome=Outcome.FAILED), True),
        (STAYS, record(), True),
    ],
)
def test_an_orbit_that_two_computations_see_stay_is_computed_no_more(
    first: Crossings, second: Crossings, again: bool
) -> None:
    """Two in doubles, in either order, or one in doubles and one in 64 bits."""
    for most in (1, 2) if second.time[1] != 20.0 + FAR else (2,):
        for both in ([first, second], [second, first]):
            coming, asked = iter([*both, record(), record()]), list[int]()

            def compute(bits: int, *_: Any, coming: Any = coming, asked: Any = asked) -> Crossings:
                asked.append(bits)
                return next(coming)

            found = decide(compute, 1, RATE, ladder({53: most, 64: most, 106: most}))
            assert asked[:2] == [53, 64 if most == 1 else 53]
            assert (len(asked) > 2) is again
            assert again or found.certain[:, 0].tolist() == [True, False, False]


class Noted:
    """Computations of columns, (n,) or each crossing, (4, n), late; writes down what is asked."""

    def __init__(self, **late: Any) -> None:
        scales = {"first": certainty.FIRST_SCALES, "second": SECOND_SCALES, "third": THIRD_SCALES}
        split = {key.partition("_"): np.asarray(by) for key, by in late.items()}
        self.late = {(int(bits), scales[name]): by for (name, _, bits), by in split.items()}
        self.asked: list[tuple[int, Scales, list[int]]] = []

    def __call__(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        self.asked.append((bits, scales, list(columns)))
        time = np.array(BASE)[:, None] + self.late[bits, scales][..., columns]
        separatrix = np.tile(np.array([2, 1, 4, 3], dtype=np.uint8)[:, None], time.shape[1])
        return Crossings(time, separatrix, np.zeros(time.shape[1], dtype=np.uint8))


UNASKED = 1.0
"""A time by which a third computation would refuse what two establish."""


def test_two_or_three_computations_settle_what_is_below_their_limits() -> None:
    """Each column for itself: how late its second and third computation are, and its symbols."""
    table: list[tuple[Any, Any, int]] = [
        # A millionth of a radian is the most that two computations settle,
        (0.0, UNASKED, 3),
        (0.9e-6, UNASKED, 3),
        (1.1e-6, 0.0, 3),
        # a thousandth the most that three do, which all must agree.
        (0.9e-3, 0.45e-3, 3),
        (0.45e-3, 0.9e-3, 3),
        (0.55e-3, 1.1e-3, 0),
        (0.55e-3, -0.6e-3, 0),
        # None is asked for where it could establish nothing,
        (1.1e-3, UNASKED, 0),
        ([0.0, 0.0, 2e-3, 2e-3], UNASKED, 1),
        # and it is asked for the symbols that two leave open; what these establish stays so.
        ([0.0, 0.0, 0.5e-3, 0.5e-3], [0.0, 0.0, 2e-3, 2e-3], 1),
        ([0.0, 0.0, 0.5e-3, 0.5e-3], [0.0, 0.0, 0.25e-3, 0.25e-3], 3),
        ([0.0, 0.0, 0.5e-3, 0.5e-3], 2e-3, 1),
        # That it leaves the last symbol open is no reason against it.
        ([0.0, 0.0, 0.5e-3, 2e-3], [0.0, 0.0, 0.25e-3, 1e-3], 2),
    ]
    second, third, symbols = zip(*table, strict=True)
    late = [np.column_stack([np.broadcast_to(x, 4) for x in each]) for each in (second, third)]
    noted = Noted(first_53=0 * late[0], second_53=late[0], third_53=late[1])
    found = decide(noted, len(table), 1.0, rungs((53,)))
    np.testing.assert_array_equal(found.certain, np.arange(3)[:, None] < symbols)
    asked = [k for k, by in enumerate(third) if by != UNASKED]
    assert noted.asked[2:] == [(53, THIRD_SCALES, asked)]


@pytest.mark.parametrize(
    ("precisions", "limit"),
    [
        ((53, 64), LIMIT_OF_UNEQUAL),
        ((53, 61), LIMIT_OF_UNEQUAL / 8),
        ((53, 106), LIMIT_OF_UNEQUAL),
        # The last one before counts, and not the first.
        ((53, 64, 72), LIMIT_OF_UNEQUAL / 8),
        # Pairs of doubles count as 97 bits.
        ((53, 90, 106), LIMIT_OF_UNEQUAL / 16),
        # But as all their bits beside sharper ones.
        ((53, 106, 109), LIMIT_OF_UNEQUAL / 256),
    ],
)
def test_closer_precisions_must_agree_better(precisions: tuple[int, ...], limit: float) -> None:
    """So that the chance of errors alike is that of 11 bits, whatever was decided before."""
    assert LIMIT_OF_UNEQUAL == 1e-2
    # Each is a radian or more from the one before it, but for the last.
    *between, last = (f"first_{bits}" for bits in precisions[1:])
    late = {last: np.array([0.99, 1.01]) * limit + len(between)}
    late |= {key: np.ones(2) for key in between}
    noted = Noted(first_53=np.ones(2), second_53=np.zeros(2), **late)
    found = decide(noted, 2, 1.0, ladder({bits: 1 + (bits == 53) for bits in precisions}))
    assert found.certain.all(axis=0).tolist() == [True, False]


COARSE, EQUAL, SHARPER = 0.25, 1e-3, 0.02


@pytest.mark.parametrize(("bits", "serves"), [(61, True), (60, True), (59, False)])
def test_a_less_sharp_computation_is_a_third_one_from_seven_bits_on(
    bits: int, serves: bool
) -> None:
    """Columns by how far it is from the two, and these from one another."""
    table = [(0.99 * COARSE, 0.99 * EQUAL), (1.01 * COARSE, 2e-6), (0.9 * COARSE, 1.01 * EQUAL)]
    less, apart = np.array(table).T
    late = {f"second_{bits}": np.zeros(3), f"first_{bits}": -apart}
    noted = Noted(second_53=less - apart, **late)
    found = decide(noted, 3, 1.0, ladder({53: 1, bits: 2}))
    assert found.certain.all(axis=0).tolist() == [serves, False, False]


@pytest.mark.parametrize("most", [1, 2])
def test_what_is_beside_the_last_computation_must_confirm_a_further_one_too(most: int) -> None:
    """Each must agree with the others, however many may follow."""
    last = np.array([0.99, 0.99, 0.5, 1.01, 0.5, 0]) * SHARPER
    other = np.array([0.0, 0.99, -0.51, 0.5, 1.01, 2]) * SHARPER
    late = {"second_90": last, "first_106": np.zeros(6)}
    late |= {name: np.full(6, 0.5 * SHARPER) for name in ("second_106", "first_160")}
    noted = Noted(third_53=other, **late)
    found = decide(noted, 6, 1.0, [Rung(90, most=1)])
    asked: list[int] = []

    def beside(columns: Any) -> Crossings:
        asked.extend(columns)
        return noted(53, THIRD_SCALES, columns)

    first, second = ladder({106: most, 160: 1}, known=90)
    certainty.climb(noted, found, 1.0, [first._replace(beside=beside), second])
    assert found.bits.tolist() == [106, 106, 160, 160, 160, 160]
    # It is made for columns in which the last one is near, and beside that one alone.
    assert asked == [0, 1, 2, 4, 5]


@pytest.mark.parametrize("known", [53, 90])
def test_a_symbol_that_is_certain_stays_so_unless_a_further_computation_contradicts_it(
    known: int,
) -> None:
    """More than a quarter of a radian does: columns by how late two computations are up to it."""
    within, beyond = 0.99 * COARSE, 1.01 * COARSE
    first, second = np.array(
        [(within, 0.0), (within, 2 * within), (beyond, within), (0.0, beyond)]
    ).T
    # (4, n): a number of radians at the last crossing alone.
    last = np.eye(4)[:, 3:] * np.ones(4)
    late = {f"second_{known}": 0 * last, f"first_{known}": last, "third_160": 5 * last}
    late |= {"first_106": first + 2 * last, "second_106": second + 3 * last}
    noted = Noted(**late)
    found = decide(noted, 4, 1.0, [Rung(known, most=2)])
    assert found.certain.sum(axis=0).tolist() == [2, 2, 2, 2]

    def beside(columns: Any) -> Crossings:
        return noted(160, THIRD_SCALES, columns)

    certainty.climb(noted, found, 1.0, [Rung(106, 2, 97 - known, beside if known == 90 else None)])
    assert found.certain.sum(axis=0).tolist() == [2, 2, 0, 0]
    assert found.bits.tolist() == [106] * 4


@pytest.mark.parametrize("most", [1, 2, 3])
def test_no_more_is_computed_than_is_open_and_can_be(most: int) -> None:
    """Columns that two doubles, and one, two and three of more bits would establish, and none."""
    noted = Noted(
        first_53=[0, 9, 9, 1e-5, 9],
        second_53=[0, 0, 0, 0, 0],
        first_106=[5, 0, 1, 1, 5],
        second_106=[5, 0, 1, 1 + 1e-5, 6],
        third_106=[5, 0, 1, 1, 7],
    )
    division = Mock(side_effect=certainty.undivided)
    found = decide(noted, 5, 1.0, ladder({53: 2, 106: most}), division)
    assert [given.args for given in division.call_args_list] == [(5, 53), (4, 106)]
    assert found.certain.all(axis=0).tolist() == [True, *(most >= n for n in (1, 2, 3)), False]
    assert found.bits.tolist() == [53, *[106] * 4]
    every = list(range(5))
    asked = [
        (53, certainty.FIRST_SCALES, every),
        (53, SECOND_SCALES, every),
        (106, certainty.FIRST_SCALES, every[1:]),
    ]
    asked += [(106, SECOND_SCALES, [2, 3, 4]), (106, THIRD_SCALES, [3])]
    assert noted.asked == asked[: 2 + most]
    assert found.crossings.time[:, 1].tolist() == BASE
    assert found.crossings.time[0, 4] == BASE[0] + (5 if most == 1 else 6), "the last one is kept"


def test_nothing_is_computed_where_two_doubles_establish_all() -> None:
    noted = Noted(first_53=[0, 0], second_53=[0, 0])
    assert decide(noted, 2, 1.0, rungs((53, 64, 113))).bits.tolist() == [53, 53]
    assert len(noted.asked) == 2
