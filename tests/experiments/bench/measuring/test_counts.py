"""Symbols that are counted and timed: of many orbits, and of bodies drawn by lot."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments.bench import drawn
from rigidpend.experiments.bench.measuring import counts
from rigidpend.experiments.bench.measuring.fields import time_unit
from rigidpend.experiments.bench.measuring.problems import (
    FIG4,
    Crossed,
    Task,
    judged,
    random_routes,
)
from rigidpend.experiments.bench.measuring.solvers import Solver
from rigidpend.routes.codes import route_codes
from tests.orbits.integrate.problems import needs_heyoka


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Any:
    """A method that takes so many seconds for an orbit, and more at first; lines of many orbits."""

    def lines(each: float, first: float, numbers: list[int], seconds: float) -> Any:
        left = [first]

        def made(name: str, task: Task, entry: Any) -> Solver:
            n = task.states.shape[1]

            def solve() -> int:
                clock[0] += n * each + left[0]
                left[0] = 0.0
                return n

            certain, none = np.arange(n) > 0, np.zeros((2, n), dtype=np.uint8)
            return Solver(solve, lambda n: Crossed(none[:, :n], np.zeros((3, n)), certain[None]))

        monkeypatch.setattr(counts, "made", made)
        return list(counts.many_orbits({"x": {}}, numbers, 2, 3, seconds))

    return lines


def test_numbers_are_tried_until_the_next_would_go_beyond_the_budget(slow: Any) -> None:
    lines = slow(1e-3, 0.2, [4, 20, 1000], 0.5)
    assert [line["orbits"] for line in lines] == [4, 20]
    assert [line["undecided"] for line in lines] == [1, 1]
    assert [line["prepare"] for line in lines] == pytest.approx([0.2, 0.0])
    assert [line["seconds"] for line in lines] == pytest.approx([0.004, 0.02])
    assert lines[0]["repeats"] == 3


def test_a_first_solve_beyond_the_budget_is_all_there_is(slow: Any) -> None:
    [line] = slow(0.02, 0.0, [5, 6], 0.05)
    assert (line["orbits"], line["repeats"]) == (5, 1)


def route(task: Task, turned: int = -1) -> Crossed:
    """What integration finds, with one symbol of the column `turned` turned over."""
    p = task.routes
    given: dict[str, Any] = {"h0": p.h0, "J1_0": p.J1_0, "n_symbols": p.n_symbols}
    found = route_codes(p.body, task.theta2_0, **given)
    codes = found.codes.copy()
    if turned in range(codes.shape[1]):
        codes[1, turned] ^= 1
    return Crossed(codes, found.crossing_time, found.certain)


SHORT = replace(FIG4, n_symbols=2)


def with_bodies(entries: Any, problems: list[Any], *given: Any) -> list[Any]:
    """The lines of methods with such bodies, as if they had been drawn by lot."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawn, "drawn", lambda *_: problems)
        return list(counts.bodies(entries, 0, 0, list(range(len(problems))), *given))


@pytest.fixture
def tasks() -> list[Task]:
    """What methods are made ready for."""
    return []


@pytest.fixture
def methods(
    monkeypatch: pytest.MonkeyPatch, clock: list[float], tasks: list[Task]
) -> list[tuple[str, int]]:
    """Methods of known errors: `peer` errs in column 3, `ours` nowhere; who was called."""
    called: list[tuple[str, int]] = []

    def made(name: str, task: Task, entry: Any, threads: int) -> Solver:
        tasks.append(task)

        def solve() -> Crossed:
            called.append((name, task.states.shape[1]))
            clock[0] += 2e-3 * task.states.shape[1]
            return route(task, 3 if name == entry["wrong"] else -1)

        return Solver(solve)

    monkeypatch.setattr(counts, "made", made)
    return called


@pytest.mark.slow
@needs_heyoka("symbols in principal axes")
@pytest.mark.parametrize("wrong", ["peer", "ours"])
def test_where_two_methods_differ_more_bits_tell_which_is_right(
    methods: list[tuple[str, int]], wrong: str
) -> None:
    entries = {key: {"wrong": wrong} for key in ("ours", "peer")}
    [line] = with_bodies(entries, [SHORT], 40, 1, 2, 0.061, 1.0)
    # Sixteen orbits of a pilot take 32 ms: 61 ms are enough for thirty.
    assert (line["ours"]["orbits"], line["peer"]["orbits"]) == (40, 30)
    other = "peer" if wrong == "ours" else "ours"
    for name in ("ours", "peer"):
        assert line[name]["symbols"] == 2 * line["peer"]["orbits"], "what both computed"
    assert (line[wrong]["wrong"], line[wrong]["wrong_trusted"]) == (1, 1)
    assert (line[other]["wrong"], line[other]["undecided"]) == (0, 0)
    assert (line["peer"]["first"], line["peer"]["again"]) == pytest.approx((0.06, 0.06))
    # Both are called with another body first: what any body needs is not told of this one.
    assert methods[:3] == [("ours", 1), ("ours", 40), ("peer", 16)]


@pytest.mark.slow
@needs_heyoka("symbols in principal axes")
def test_what_nobody_could_settle_in_time_is_not_counted(methods: Any) -> None:
    entries = {key: {"wrong": "peer"} for key in ("ours", "peer")}
    [line] = with_bodies(entries, [SHORT], 20, 1, 1, -1.0, 9.0)
    assert line["peer"]["orbits"] > 3
    for name in ("ours", "peer"):
        # Column 3 is the first in doubt: what is behind it would be without its like.
        assert (line[name]["symbols"], line[name]["wrong"]) == (2 * 3, 0)


def test_a_first_call_that_takes_longer_than_a_peer_may_is_followed_by_another(
    monkeypatch: pytest.MonkeyPatch, clock: list[float]
) -> None:
    """Ours builds maps in its first call with a body: 5 s, and then 0.1 s."""
    seen: set[Any] = set()

    def made(name: str, task: Task, entry: Any, threads: int) -> Solver:
        def solve() -> Crossed:
            clock[0] += 0.1 if task.body in seen else 5.0
            seen.add(task.body)
            return route(task)

        return Solver(solve)

    monkeypatch.setattr(counts, "made", made)
    other = replace(SHORT, body=Body((2, 1, "1.4"), (1, 1, 0), "0.001"))
    [line] = with_bodies({"ours": {}}, [other], 3, 1, 3, 0.15, 9.0)
    assert (line["ours"]["first"], line["ours"]["again"]) == pytest.approx((5.0, 0.1))


def test_no_further_body_is_begun_when_the_time_of_all_is_spent(methods: Any) -> None:
    """Ours takes 80 ms in its two calls with a body."""
    entries = {"ours": {"wrong": ""}}
    for longest, done in ((0.05, 2), (0.07, 3), (0.02, 1)):
        assert len(with_bodies(entries, [SHORT] * 3, 20, 1, 1, 0.0, longest)) == done


def test_the_horizon_of_a_peer_is_behind_the_last_crossing(methods: Any, tasks: list[Task]) -> None:
    entries = {key: {"wrong": ""} for key in ("ours", "peer")}
    with_bodies(entries, [SHORT], 17, 1, 1, 1.0, 1.0)
    last = route(tasks[-1]).time.max()
    horizon = float(tasks[-1].times.max()) * time_unit(SHORT.body)
    assert last < horizon < 1.01 * last


def test_symbols_of_random_phases_are_held_against_113_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A symbol turned over in each chunk is one wrong symbol of each."""
    monkeypatch.setattr(counts, "made", lambda _, task, __: Solver(lambda: route(task, 2)))
    lines = list(counts.random_phases({"x": {}}, 2 * counts.CHUNK, 1e9))
    assert [line["J1_0"] for line in lines] == ["1e-6", "1e-10"]
    for made in lines:
        assert (made["orbits"], made["symbols"]) == (500, 7500)
        assert (made["wrong"], made["wrong_trusted"], made["undecided"]) == (2, 2, 0)
        assert made["last_crossing"] < 1e-6


def test_random_orbits_are_the_same_in_every_run() -> None:
    one, more = random_routes(SHORT, 5), random_routes(SHORT, 9)
    np.testing.assert_array_equal(one.states, more.of(np.arange(5)).states)


def test_a_wrong_symbol_that_a_method_does_not_vouch_for_is_wrong_and_not_trusted() -> None:
    codes, certain = np.array([[0, 1, 1]]), np.array([[True, True, False]])
    answer = Crossed(codes.astype(np.uint8), np.zeros((2, 3)), certain)
    expected = {"symbols": 3, "wrong": 2, "wrong_trusted": 1, "undecided": 1}
    assert judged(answer, np.zeros((1, 3))) == expected
    assert judged(answer._replace(certain=None), np.zeros((1, 3)))["wrong_trusted"] == 2
