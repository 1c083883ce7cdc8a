"""How it is measured: the search within its budget, the meeting in turn, the worker's process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench.measuring import problems, protocol, worker
from rigidpend.experiments.bench.measuring.methods import METHODS, Answer, Method
from rigidpend.experiments.bench.measuring.methods.peers import shared_out
from rigidpend.experiments.bench.measuring.protocol import Attempt, Stage
from rigidpend.experiments.bench.measuring.tasks import (
    Carrier,
    MotionTask,
    Solver,
)
from tests.orbits.integrate.problems import FIG4, needs_heyoka

SIZES: dict[str, Any] = {
    "orbits": 2,
    "turns": 1,
    "columns": 2,
    "n_symbols": 2,
    "companions": 1,
    "periods": 4,
    "few": 1,
}
ANSWER = Answer("", "")


def stage(kind: str = "motion", orbits: int = 6, few: int = 2) -> Stage:
    """A problem of which the error is what the method says."""
    module: Any = SimpleNamespace(
        KIND=kind, error=lambda found, truth: {"error": float(np.size(truth["x"]))}
    )
    task = MotionTask(FIG4, np.arange(6.0 * orbits).reshape(6, orbits), 10.0, 1.0)
    return Stage(module, task, {"x": np.arange(orbits)}, few)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that goes on only when it is told to."""
    now = [0.0]
    monkeypatch.setattr(protocol, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    return now


@pytest.fixture
def napping(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Any:
    """Methods that take as long as setting and knob say; what was made is kept."""
    made: list[Any] = []

    def function(answer: Any, threads: int, setting: Any) -> Any:
        def make(task: Any, knob: Any) -> Solver:
            made.append((setting, knob, task.states.shape[1]))
            nap = setting.get("nap", 0.0) + (knob or 0.0)

            def solve() -> None:
                clock[0] += nap

            return Solver(solve, lambda found: found)

        return make

    monkeypatch.setattr(protocol, "function", function)
    return made


def method(**more: Any) -> Method:
    return Method("napping", "others", {}, **more)


def test_the_fastest_form_is_kept_for_every_knob(napping: Any) -> None:
    forms = ({"nap": 0.03}, {"nap": 0.002}, {"nap": 0.02})
    head, *rows = protocol.search(stage(), method(forms=forms), ANSWER, [0.0, 0.001], 9.0, 2)
    assert head["form"] == 1
    assert head["forms"].endswith("chosen: nap 0.002")
    assert [setting for setting, *_ in napping[3:]] == [{"nap": 0.002}] * 2
    assert [row["knob"] for row in rows][1] == 0.001


def test_every_variant_is_tried_at_every_knob_and_medians_count(napping: Any) -> None:
    variants = ({"nap": 0.002}, {"nap": 0.01})
    _, *rows = protocol.search(stage(), method(variants=variants), ANSWER, [0.0, 0.001], 9.0, 3)
    assert [row["setting"] for row in rows] == [0, 0, 1, 1]
    assert all(row["repeats"] == 3 for row in rows)
    assert [row["seconds"] for row in rows] == pytest.approx([0.002, 0.003, 0.01, 0.011])


def test_the_budget_cuts_the_knobs_that_are_left(napping: Any) -> None:
    _, *rows = protocol.search(stage(), method(), ANSWER, [0.06, 0.07, 0.08], 0.1, 1)
    assert [row["knob"] for row in rows] == [0.06]


def test_one_after_the_other_gets_few_orbits_and_is_scaled_openly(napping: Any) -> None:
    _, row = protocol.search(stage(), method(abreast=False), ANSWER, [0.01], 9.0, 1)
    assert row["orbits"] == 2
    assert row["error"] == 2, "the truth is that of the same orbits"
    assert row["seconds"] == pytest.approx(0.03), "2 of 6 orbits, times 3"
    assert row["once"] == pytest.approx(0.01)
    task, truth, _ = stage().part(False)
    np.testing.assert_array_equal(truth["x"], [0, 5])
    np.testing.assert_array_equal(task.states[0], [0, 5])


def test_over_long_times_a_slow_method_goes_a_part_of_the_way(clock: list[float]) -> None:
    long = stage("long", orbits=1)

    def walk(t: float) -> None:
        clock[0] += t

    walker = Carrier(lambda: None, walk, lambda: long.task.states)
    # Each look goes from the start: the whole way takes 10 * (1 + ... + 20)/20 = 105 s.
    assert protocol._part_of_the_way(long, long.task, walker, 21.0)[0] == pytest.approx(0.1)
    assert protocol._part_of_the_way(long, long.task, walker, 0.01)[0] == 1e-3
    assert protocol._part_of_the_way(long, long.task, walker, 106.0)[0] == 1


def test_over_long_times_the_way_is_looked_at() -> None:
    long, moments = stage("long"), [0.0]
    walker = Carrier(lambda: moments.clear(), moments.append, lambda: long.task.states)
    found = protocol.solver_of(long, long.task, walker, 0.5).solve()
    assert len(found) == protocol.LOOKS
    assert moments[-1] == pytest.approx(5.0)
    assert moments == sorted(moments)


def test_methods_meet_in_turn_and_the_order_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []

    def function(answer: Any, threads: int, setting: Any) -> Any:
        name = setting["name"]
        return lambda task, knob: Solver(lambda: calls.append(name), lambda found: found)

    monkeypatch.setattr(protocol, "function", function)
    trials = {name: Attempt(method(), ANSWER, {"name": name}, None) for name in "abc"}
    found = protocol.meeting(stage(), trials, {}, 3, 9.0)
    assert calls == list("abc") + list("abc") + list("bca") + list("cab"), "first all warm up"
    assert all(len(found[name]["rounds"]) == 3 for name in "abc")


def test_with_two_threads_a_method_takes_one_where_that_is_faster(
    clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds = {("lone", 1): 0.1, ("lone", 2): 0.4, ("shared", 1): 0.4, ("shared", 2): 0.3}
    calls: list[tuple[str, int]] = []

    def function(answer: Any, threads: int, setting: Any) -> Any:
        which = setting["name"], threads

        def solve() -> None:
            calls.append(which)
            clock[0] += seconds[which]

        return lambda task, knob: Solver(solve, lambda found: found)

    monkeypatch.setattr(protocol, "function", function)
    trials = {
        name: Attempt(method(), ANSWER, {"name": name}, None, 2) for name in ("lone", "shared")
    }
    found = protocol.meeting(stage(), trials, {}, 3, 9.0)
    assert (found["lone"]["threads"], found["shared"]["threads"]) == (1, 2)
    assert calls[-6:].count(("lone", 1)) == calls[-6:].count(("shared", 2)) == 3


def test_who_has_spent_his_time_misses_the_rounds_that_are_left(napping: Any) -> None:
    trials = {
        "slow": Attempt(method(), ANSWER, {"nap": 0.03}, None),
        "quick": Attempt(method(abreast=False), ANSWER, {"nap": 0.001}, None),
    }
    found = protocol.meeting(stage(), trials, {"quick": 0.5}, 4, 0.05)
    assert np.isnan(found["slow"]["rounds"]).tolist() == [False, False, True, True]
    assert np.isfinite(found["quick"]["rounds"]).all()
    # 2 of 6 orbits, half the way: six times as long.
    assert found["quick"]["rounds"] == pytest.approx([0.006] * 4)


def test_threads_share_the_orbits_and_give_the_same() -> None:
    states = np.arange(14.0).reshape(2, 7)
    solve = shared_out(lambda part: lambda: part * 2, states, 2)
    np.testing.assert_array_equal(solve(), states * 2)

    def carrier(part: Any) -> Carrier:
        now = [part]
        return Carrier(lambda: now.append(part), lambda t: now.append(part + t), lambda: now[-1])

    made = shared_out(carrier, states, 3)
    made.start()
    made.to(1.0)
    np.testing.assert_array_equal(made.states(), states + 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "name", "knobs", "fields"),
    [
        pytest.param(
            *("pendulum", "aligned_batch", [1e-4, 1e-10]),
            {"error", "seconds", "prepare", "setting"},
            marks=needs_heyoka("the references in 113 bits"),
        ),
        ("codes", "scipy_dop853", [1e-4, 1e-10], {"error", "wrong_symbols", "undecided"}),
        ("long_time", "lie_poisson", [8, 16], {"error", "part", "energy"}),
    ],
)
def test_a_worker_searches_in_its_own_process(
    tmp_path: Any, problem: str, name: str, knobs: list[float], fields: set[str]
) -> None:
    module = problems.module(problem)
    reference = tmp_path / "reference.npz"
    truth = module.reference(module.task(SimpleNamespace(**SIZES)))
    np.savez(reference, **{f"{problem}.{key}": value for key, value in truth.items()})
    order = worker.Order(
        "search", {name: [{"knobs": knobs}]}, SIZES, 1, 20.0, (problem,), str(reference)
    )
    (once, head, *rows), ended = worker.measured(order, 100)
    assert ended == ""
    assert once["import"] >= 0
    assert head["form"] in range(len(METHODS[name].forms))
    assert len(rows) == len(knobs) * len(METHODS[name].variants)
    assert all(fields <= set(row) for row in rows)
    assert rows[1]["error"] < rows[0]["error"] / 2 or problem == "long_time"


@pytest.mark.slow
def test_a_worker_that_is_too_slow_is_ended_and_what_it_had_is_kept() -> None:
    order = worker.Order("phases", {"lie_poisson": [SLOW]}, {}, 250, 50.0)
    lines, ended = worker.measured(order, 1.5)
    assert "ended at 1.5 s" in ended
    assert lines == []


SLOW = {"knob": 1e5, "setting": {"order": 8}}


def search(name: str, knobs: list[Any], tmp_path: Path) -> Any:
    """A search at the pendulum, of a reference that no method looks at before it has failed."""
    reference = tmp_path / "reference.npz"
    truth: Any = {"pendulum.states": np.zeros((6, 2))}
    np.savez(reference, **truth)
    order = worker.Order(
        "search", {name: [{"knobs": knobs}]}, SIZES, 1, 1.0, ("pendulum",), str(reference)
    )
    return worker.measured(order, 100)


@pytest.mark.slow
def test_a_method_that_finds_no_number_has_failed_and_the_rest_is_measured(tmp_path: Path) -> None:
    (_, head, failed), ended = search("lie_poisson", [0.0], tmp_path)
    assert ended == ""
    assert head["form"] == 0
    assert failed["failed"].startswith("ZeroDivisionError: ")


@pytest.mark.slow
def test_a_fault_of_our_own_lines_ends_the_benchmark(tmp_path: Path) -> None:
    """A knob of the wrong type stands for it: where it rose is told, in one line."""
    with pytest.raises(worker.Fault, match=r"\(lie_poisson\): TypeError: .*, line \d+\)$"):
        search("lie_poisson", ["8"], tmp_path)


@pytest.mark.parametrize(
    "error", [NameError("x"), TypeError("x"), AttributeError("x"), KeyError(1)]
)
def test_what_our_own_lines_raise_is_no_failure_of_a_method(error: Exception) -> None:
    assert not isinstance(error, worker.FAILURES)


@pytest.mark.parametrize("ending", [(1, "x"), (worker.FAILED, "failed: x"), (-11, "failed: x")])
def test_a_worker_s_exit_tells_a_method_s_failure_from_a_fault(
    ending: tuple[int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also a library that crashes, which ends it by a signal, has failed."""
    code, said = ending
    process = subprocess.Popen([sys.executable, "-c", f"import os; os._exit({max(code, 0)})"])
    process.wait()
    process.returncode = code
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: process)
    monkeypatch.setattr(worker, "_heard", lambda *_: ("", "x", False))
    order = worker.Order("search", {"cyrk": []}, {}, 1, 1.0)
    if code == 1:
        with pytest.raises(worker.Fault, match=r"worker stopped \(cyrk\): x"):
            worker.measured(order, 1.0)
    else:
        assert worker.measured(order, 1.0) == ([], said)


def test_a_process_keeps_to_its_cores() -> None:
    assert worker.limited_to(2)["OMP_NUM_THREADS"] == "2"
    assert "XLA_FLAGS" in worker.limited_to(1)
    assert "XLA_FLAGS" not in worker.limited_to(2)
    if not hasattr(os, "sched_getaffinity"):
        return
    before = os.sched_getaffinity(0)
    try:
        worker.keep_to(1)
        assert len(os.sched_getaffinity(0)) == 1
    finally:
        os.sched_setaffinity(0, before)


def test_the_median_of_several_solves_counts_and_not_the_fastest(
    monkeypatch: pytest.MonkeyPatch, clock: list[float]
) -> None:
    """Solves of 1, 5 and 2 seconds by the clock, behind one that warms up."""
    naps = iter([7.0, 1.0, 5.0, 2.0])

    def function(answer: Any, threads: int, setting: Any) -> Any:
        def solve() -> None:
            clock[0] += next(naps)

        return lambda task, knob: Solver(solve, lambda found: found)

    monkeypatch.setattr(protocol, "function", function)
    attempt = Attempt(method(), ANSWER, {}, 0.0)
    line, _ = protocol._measured(stage(), attempt, 3, 1e9)
    assert line["repeats"] == 3
    assert line["seconds"] == 2.0
