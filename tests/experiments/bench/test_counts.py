"""Symbols that are counted and timed: of many orbits, and of bodies drawn by lot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import counts
from rigidpend.experiments.bench.problems import (
    FIG4,
    SEED,
    drawn,
    from_phases,
    judged,
    precession_angle,
    random_routes,
)
from rigidpend.experiments.bench.solvers import Crossed, Solver, Task, time_unit
from rigidpend.routes.codes import route_codes

SHORT = replace(FIG4, n_symbols=2)


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
    # A first solve beyond the budget is all there is.
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


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Callable[..., Any]:
    """Lines of methods with bodies; the method `wrong` errs in column 3; who was called with what.

    Each orbit takes 2 ms by the clock, the first time with a body so many seconds more; in
    principal axes an orbit takes `dear`, and in 64 bits is told `rough`, if that is not right.
    """

    def run(
        names: str, orbits: int, repeats: int, seconds: float, longest: float, **more: Any
    ) -> Any:
        seen, called = set(), []

        def made(name: str, task: Task, entry: Any, threads: int) -> Solver:
            def solve() -> Crossed:
                n = task.states.shape[1]
                called.append((name, n, float(task.times.max())))
                anew = (name, task.body) not in seen
                clock[0] += 2e-3 * n + more.get("first", 0.0) * anew
                seen.add((name, task.body))
                return route(task, 3 if name == more.get("wrong") else -1)

            return Solver(solve)

        def told(problem: Any, phases: Any, *, bits: int, jobs: int) -> Any:
            clock[0] += more.get("dear", 0.01)
            right = route(from_phases(problem, phases)).codes
            return 1 - right if bits == 64 and more.get("rough") else right

        monkeypatch.setattr(counts, "made", made)
        monkeypatch.setattr(
            principal_axes, "offers", lambda bits: bits in more.get("bits", (64, 113))
        )
        monkeypatch.setattr(principal_axes, "codes", told)
        problems = more.get("problems", [SHORT])
        monkeypatch.setattr(counts, "drawn", lambda *_: problems)
        entries: Any = {name: {} for name in names.split()}
        given = 0, len(problems), orbits, 1, repeats, seconds, longest
        return list(counts.bodies(entries, *given)), called

    return run


@pytest.mark.parametrize("wrong", ["peer", "ours"])
@pytest.mark.parametrize("rough", [False, True])
def test_where_two_methods_differ_more_bits_tell_which_is_right(
    lines: Any, wrong: str, rough: bool
) -> None:
    [line], called = lines("ours peer", 40, 2, 0.061, 1.0, wrong=wrong, rough=rough, dear=8e-3)
    # Sixteen orbits of a pilot take 32 ms: 61 ms are enough for thirty.
    assert (line["ours"]["orbits"], line["peer"]["orbits"]) == (40, 30)
    other = "peer" if wrong == "ours" else "ours"
    for name in ("ours", "peer"):
        assert line[name]["symbols"] == 2 * line["peer"]["orbits"], "what both computed"
    assert (line[wrong]["wrong"], line[wrong]["wrong_trusted"]) == (1, 1)
    assert (line[other]["wrong"], line[other]["undecided"]) == (0, 0)
    assert (line["peer"]["first"], line["peer"]["again"]) == pytest.approx((0.06, 0.06))
    assert line["body"] == [2, 1, 1.5, *[0.5**0.5] * 2, 0.001, 1.3342, 1e-8]
    # Both are called with another body first: what any body needs is not told of this one.
    assert [x[:2] for x in called[:3]] == [("ours", 1), ("ours", 40), ("peer", 16)]
    last = route(random_routes(SHORT, 40)).time.max()
    assert last < called[-1][2] * time_unit(SHORT.body) < 1.01 * last, "the horizon of a peer"


@pytest.mark.parametrize(
    "more",
    [
        {"seconds": -1.0},
        # Thirty times 41 ms, in 113 bits, are more than four times 0.3 s.
        {"seconds": 0.3, "rough": True, "dear": 0.041},
        # 113 bits may not be offered, nor 64.
        {"seconds": 1.0, "rough": True, "bits": (64,)},
        {"seconds": 1.0, "bits": ()},
    ],
)
def test_what_nobody_could_settle_in_time_is_not_counted(lines: Any, more: Any) -> None:
    seconds = more.pop("seconds")
    [line], _ = lines("ours peer", 20, 1, seconds, 9.0, wrong="peer", **more)
    assert line["peer"]["orbits"] > 3
    for name in ("ours", "peer"):
        # Column 3 is the first in doubt: what is behind it would be without its like.
        assert (line[name]["symbols"], line[name]["wrong"]) == (2 * 3, 0)


def test_a_first_call_that_takes_longer_than_a_peer_may_is_followed_by_another(lines: Any) -> None:
    """Ours builds maps in its first call with a body."""
    other = replace(SHORT, body=Body((2, 1, "1.4"), (1, 1, 0), "0.001"))
    [line], _ = lines("ours", 3, 3, 0.15, 9.0, first=5.0, problems=[other])
    assert (line["ours"]["first"], line["ours"]["again"]) == pytest.approx((5.006, 0.006))


@pytest.mark.parametrize(("longest", "done"), [(0.05, 2), (0.07, 3), (0.02, 1)])
def test_no_further_body_is_begun_when_the_time_of_all_is_spent(
    lines: Any, longest: float, done: int
) -> None:
    """Ours takes 80 ms in its two calls with a body."""
    assert len(lines("ours", 20, 1, 0.0, longest, problems=[SHORT] * 3)[0]) == done


@pytest.mark.parametrize(("longest", "n"), [(0.04, 40), (0.039, 20), (1e-3, 10)])
def test_ours_follows_as_many_orbits_as_it_is_expected_to_in_its_time(
    lines: Any, monkeypatch: pytest.MonkeyPatch, longest: float, n: int
) -> None:
    """An orbit is expected to take 1 ms; few are followed in any case."""
    monkeypatch.setattr(counts, "expected_seconds", lambda _, orbits: 1e-3 * orbits)
    [line], _ = lines("ours", 40, 1, 9.0, longest)
    assert line["ours"]["orbits"] == n


def test_symbols_of_random_phases_are_held_against_113_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A symbol turned over in each chunk is one wrong symbol of each."""
    monkeypatch.setattr(counts, "CHUNK", 50)
    monkeypatch.setattr(counts, "made", lambda _, task, __: Solver(lambda: route(task, 2)))
    lines = list(counts.random_phases({"x": {}}, 2 * counts.CHUNK, 1e9))
    assert [line["J1_0"] for line in lines] == ["1e-6", "1e-10"]
    for made in lines:
        assert (made["orbits"], made["symbols"]) == (100, 1500)
        assert (made["wrong"], made["wrong_trusted"], made["undecided"]) == (2, 2, 0)
        assert made["last_crossing"] < 1e-6


@pytest.mark.parametrize(("seconds", "orbits"), [(5.9, 30), (6.1, 40)])
def test_no_further_chunk_of_random_phases_is_begun_after_the_time_that_there_is(
    monkeypatch: pytest.MonkeyPatch, clock: list[float], seconds: float, orbits: int
) -> None:
    """An orbit takes 0.2 s; what is solved before the clock runs does not count."""

    def made(_: str, task: Task, __: Any) -> Solver:
        n = task.states.shape[1]

        def solve() -> Crossed:
            clock[0] += 0.2 * n
            return Crossed(np.zeros((15, n), dtype=np.uint8), np.zeros((16, n)), None)

        return Solver(solve)

    monkeypatch.setattr(counts, "CHUNK", 10)
    monkeypatch.setattr(counts, "made", made)
    for line in counts.random_phases({"x": {}}, 50, seconds):
        assert (line["orbits"], line["seconds"]) == (orbits, pytest.approx(0.2 * orbits))


@pytest.mark.slow
def test_orbits_of_fig5_end_half_a_passage_behind_their_last_crossing() -> None:
    """Rounded to whole t'."""
    task = precession_angle(None)
    times = route(task).time
    behind = task.times[0] * time_unit(task.body) - times[-1]
    np.testing.assert_allclose(behind, (times[-1] - times[-2]) / 2, rtol=0, atol=0.501)


def test_random_orbits_are_the_same_in_every_run() -> None:
    one, more = random_routes(SHORT, 5), random_routes(SHORT, 9)
    np.testing.assert_array_equal(one.states, more.of(np.arange(5)).states)


def test_a_wrong_symbol_that_a_method_does_not_vouch_for_is_wrong_and_not_trusted() -> None:
    codes, certain = np.array([[0, 1, 1]]), np.array([[True, True, False]])
    answer = Crossed(codes.astype(np.uint8), np.zeros((2, 3)), certain)
    expected = {"symbols": 3, "wrong": 2, "wrong_trusted": 1, "undecided": 1}
    assert judged(answer, np.zeros((1, 3))) == expected
    assert judged(answer._replace(certain=None), np.zeros((1, 3)))["wrong_trusted"] == 2


def test_bodies_drawn_by_lot_are_the_same_ones_and_lie_in_the_domain() -> None:
    problems = drawn()
    assert problems[:3] == drawn(SEED, 3)
    assert set(problems).isdisjoint(drawn(SEED + 1))
    weights = [float(p.body.mu) / float(p.h0) for p in problems]
    starts = [float(p.J1_0) for p in problems]
    assert 0.9e-4 < min(weights) < 3e-4
    assert 0.01 < max(weights) < 0.0202
    assert 0.9e-12 < min(starts) < 1e-11
    assert 1e-7 < max(starts) < 1.01e-6
    assert {p.n_symbols for p in problems} == {15}


def test_shapes_of_drawn_bodies_fill_what_bodies_may_have() -> None:
    """Evenly over a triangle: each of the four equal ones into which it falls has its share."""
    shares = [[float(x) / float(p.body.A[0]) for x in p.body.A[1:]] for p in drawn(7, 400)]
    A2, A3 = np.array(shares).T
    apart, sum_ = A3 - A2, A2 + A3 - 1
    assert (apart > 0).all()
    assert (sum_ > -1e-3).all()
    # Middles of the sides cut off three corners. Four standard errors of a share of 400.
    for corner in (apart > 0.5, 1 - A3 > 0.25, sum_ > 0.5):
        assert abs(corner.mean() - 0.25) < 4 * np.sqrt(3 / 16 / 400)
