"""Engine `taylor`: lanes that take one orbit after another."""

import math
import re
from fractions import Fraction
from typing import Any
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.orbits.integrate import (
    WEIGHTS,
    Orbits,
    Outcome,
    batch,
    in_unit,
    no_crossings,
    on_one_thread,
)
from rigidpend.orbits.integrate.arithmetic import bits_of_numbers
from rigidpend.orbits.integrate.kernel import following, taylor_step
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, in_parts
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.integrate.step_crossings import touch
from tests.orbits.integrate.problems import fan, find, same, task


@pytest.mark.parametrize("bits", [53, 106, 212])
def test_an_orbit_makes_room_for_the_next_and_is_the_same_in_any_company(
    bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More than are carried at a time, which no lanes divide, and end after different steps."""
    states = np.concatenate([fan(7, J1=J1) for J1 in (1e-4, 1e-2, 1e-6)], axis=1)
    whole = find(states, "taylor", bits, n_crossings=2)
    assert whole.outcome.tolist() == [Outcome.COMPLETE] * 21
    monkeypatch.setattr(batch, "TOGETHER", {bits: 8})
    monkeypatch.setattr(batch, "STEPS", {bits: 8})
    for n in (21, 1):
        found = find(states[:, :n], "taylor", bits, n_crossings=2)
        assert same(found, tuple(x[..., :n] for x in whole))


def test_orbits_are_told_to_be_under_way_until_they_are_done(monkeypatch: Any) -> None:
    told = list[str]()
    monkeypatch.setattr(batch, "note", lambda text: told.append(text()))
    monkeypatch.setattr(batch, "TOGETHER", {53: 8})
    find(fan(21), "taylor", 53, n_crossings=2)
    open_ = [int(x.partition(" of 21 orbits under way in 53 bits, at t' = ")[0]) for x in told]
    assert open_ == sorted(open_, reverse=True)
    assert (open_[0], 0 < open_[-1] <= 8) == (21, True)
    assert all(re.search(r"at t' = [\d.e+]+; a passage takes [\d.e+]+ at most$", x) for x in told)


@pytest.mark.parametrize("M", [2.0**-7, 1.0, 2.0**7])
@pytest.mark.parametrize("bits", [53, 106, 212])
def test_steps_are_noted_that_come_nearer_than_a_share_of_their_own_momentum(
    bits: int, M: float
) -> None:
    """M3 turns there, and is 5/6 of |Qp| + |Qm| + |M3|, which is |M| or more."""
    state = np.zeros((6 * KINDS[bits].parts, LANES))
    state[:3] = M * np.array([[0.1], [0.1], [1.0]])
    parameters = in_parts(task(fan(1), bits).coefficients, bits)
    for depth, noted in ((0.78, 0), (0.84, LANES)):
        order, notes = 20, np.zeros(LANES, following.note(20, bits))
        given: Any = state.copy(), LANES, np.zeros((2, LANES)), parameters, depth, 1, 1, notes
        assert following.carrying(order, bits)(*given) == noted


def test_the_depth_of_noted_steps_is_that_of_a_touch() -> None:
    run = batch.Batch(task(fan(3), 106), 106, 2.0**-105)
    run.load()
    run.kernel = kernel = Mock(return_value=0)
    run.noted(8)
    assert kernel.call_args.args[4] == touch(106)


def test_long_passages_take_few_calls_of_the_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call a quarter of the silence: from 128 steps to so many in log(steps/128)/log(5/4)."""
    noted = create_autospec(batch.Batch.noted, side_effect=batch.Batch.noted)
    monkeypatch.setattr(batch.Batch, "noted", noted)
    body = Body((2, "1.99", "1.995"), (1, 1, 0), "0.001")
    found = find(fan(2, body), "taylor", 53, body=body, n_crossings=2, passage_limit=1e5)
    assert found.outcome.tolist() == [Outcome.COMPLETE] * 2
    steps = sum(call.args[1] for call in noted.call_args_list)
    assert steps > 10_000
    assert noted.call_count < 2 * (math.log(steps / 128) / math.log(5 / 4) + 10)


@pytest.mark.parametrize("bits", [53, 106, 159, 212, 424])
def test_notes_have_room_for_every_step_of_every_lane(
    bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However few crossings are left or long the silence is, and were each step in doubt."""
    # A kernel that is replaced need not be compiled.
    monkeypatch.setattr(following, "carrying", Mock())
    run = batch.Batch(task(fan(LANES), bits, n_crossings=1), bits, 2.0 ** (1 - bits))
    noted: list[int] = []

    def kernel(*given: Any) -> int:
        groups, steps, notes = given[5:]
        assert groups * run.abreast * steps <= len(notes)
        noted.append(steps)
        run.lanes["silence"] = batch.MOST_STEPS // 2
        run.times[0] = np.inf if len(noted) == 2 else 0
        return 0

    run.kernel = kernel
    run.run()
    assert noted


def test_an_orbit_whose_series_overflow_fails_and_no_other_does() -> None:
    """Of a rotation so fast the coefficients grow beyond 1e308, the largest of doubles."""
    states = fan(3)
    states[:3, 1] *= 1e12
    found, known = (find(x, "taylor", 106, n_crossings=2) for x in (states, fan(3)))
    assert found.outcome.tolist() == [Outcome.COMPLETE, Outcome.FAILED, Outcome.COMPLETE]
    assert same(tuple(x[..., [0, 2]] for x in found), tuple(x[..., [0, 2]] for x in known))


def noted(begin: Any, after: float) -> Any:
    """A note of a step of 1 on which M begins so, and M3 goes evenly to a value."""
    [step] = np.zeros(1, following.note(3, 53))
    step["series"][:, 0, 0], step["length"], step["after"] = begin, 1.0, after
    step["series"][2, 1, 0], step["steady"] = after - begin[2], 1.0
    return step


def test_a_touch_is_as_deep_as_the_momentum_allows_where_the_step_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    crossings = Mock(return_value=[])
    monkeypatch.setattr(batch, "crossings_of_series", crossings)
    step = noted((0.3, 0.0, 0.4), 0.1)
    step["steady"] = 0
    assert batch.crossings_on(np.array([step]), 53).size == 0
    assert crossings.call_args.args[1] == pytest.approx(touch(53) / 2)


def test_an_orbit_that_is_no_number_any_more_is_given_up() -> None:
    run = batch.Batch(task(fan(3), 53), 53, 2.0**-52)
    run.load()
    run.states[4, 1] = np.nan
    assert run.ended().tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("correction", "taken"), [(0.0, True), (2.0**-53, True), (2.0**-26, False), (np.nan, False)]
)
def test_a_zero_is_isolated_where_newton_s_next_correction_would_show(
    correction: float, taken: bool
) -> None:
    """That is the square of the last one; M3 = 0 in the middle, and the kernel found a quarter."""
    step = noted((1, -1, -1), 1.0)
    step["zero"], step["correction"] = 0.25, correction
    [time] = batch.crossings_on(np.array([step]), 53)[1]
    assert time == (0.25 if taken else 0.5)


@pytest.mark.parametrize(("most", "ended"), [(23, [True, False]), (24, [False, False])])
def test_an_orbit_is_given_up_by_its_steps_since_the_last_crossing(
    most: int, ended: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "MOST_STEPS", most)
    run = batch.Batch(task(fan(2), 53), 53, 2.0**-52)
    run.load()
    none, one = np.empty((3, 0)), np.array([[1.0], [0.5], [2.0]])
    for found, steps in ((none, 5), (one, 7), (none, 11)):
        run.take(found, steps)
    assert run.ended().tolist() == ended
    assert (run.found.outcome == Outcome.TOO_LONG).tolist() == ended


def test_numbers_of_the_kernel_have_the_bits_that_are_asked_for() -> None:
    """Three doubles have 159 bits, and their signs two more; the next ones have no fewer."""
    found = {bits: bits_of_numbers(bits) for bits in (53, 54, 106, 107, 160, 161, 212, 213)}
    assert list(found.values()) == [53, 106, 106, 159, 159, 212, 212, 424]
    for table in (batch.TOGETHER, batch.STEPS):
        assert set(table) == set(found.values())


@pytest.mark.parametrize("bits", [53, 106])
def test_orbits_are_shared_among_threads_that_they_are_worth(
    bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    least = batch.worth_a_thread(bits)
    for n, jobs, threads in ((least, 9, 1), (least + 1, 9, 2), (least + 1, 1, 1)):
        assert on_one_thread("taylor", bits, n) is (n == least)
        shared = Mock(side_effect=lambda orbits, *_: no_crossings(4, orbits.states.shape[1]))
        monkeypatch.setattr(batch, "crossings", shared)
        found = find(np.repeat(fan(1), n, axis=1), "taylor", bits, jobs=jobs)
        assert (shared.call_count, found.outcome.size) == (threads, n)


@pytest.mark.parametrize(("bits", "expected"), [(53, 2.0**-40), (106, 2.0**-93), (160, 2.0**-147)])
def test_every_bit_halves_the_tolerance(
    bits: int, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = Mock(side_effect=InterruptedError)
    monkeypatch.setattr(taylor_step, "order_of", asked)
    with pytest.raises(InterruptedError):
        find(fan(1), "taylor", bits, tolerance=2.0**-40)
    asked.assert_called_once_with(expected)


@pytest.mark.slow
@pytest.mark.parametrize("M", [2.0**-10, 2.0**10])
def test_a_unit_of_M_keeps_long_series_in_range(M: float) -> None:
    """In 424 bits 110th powers of M overflow, or are denormal: it is another unit's orbit."""
    near, unit = task(fan(2), 424, n_crossings=1), Fraction(M)
    states = np.concatenate((near.states[:3] * unit, near.states[3:]))
    for bits, given in ((424, near.states), (212, states)):
        assert in_unit(near.coefficients, given, bits)[0] == 1
    heavier = {x: getattr(near.coefficients, x) * unit**2 for x in WEIGHTS}
    c = near.coefficients._replace(**heavier)
    far = Orbits(c, states, 1, near.passage_limit / M)
    seen, found = (batch.crossings(x, 424, 1e-13) for x in (near, far))
    assert seen.outcome.tolist() == [Outcome.COMPLETE] * 2
    assert np.allclose(found.time * M, seen.time, rtol=1e-15, atol=0)
    times, reached = zip(*batch.advance(c, far.states[:, 0], 4, 424, 1e-13), strict=True)
    grid = np.array(times, dtype=object)[:, None]
    expected = states_at(near.coefficients, near.states, grid * unit, 424)
    expected[:3] *= unit
    for there in (states_at(c, far.states, grid, 424)[..., 0], np.array(reached).T):
        assert np.abs(there - expected[..., 0]).max() < M * 2.0**-400
