"""How it is measured: medians, budgets, what is decisive, and the worker's own process."""

from __future__ import annotations

import os
import time
from typing import Any

import numpy as np
import pytest

from rigidpend.measure.benchmark import problems, protocol, worker
from rigidpend.measure.benchmark.problems import Sizes
from rigidpend.measure.benchmark.protocol import Protocol, measure, measure_long
from rigidpend.measure.benchmark.tasks import Flow, Solver
from tests.integrate.problems import needs_heyoka

SIZES = Sizes(orbits=2, turns=1, columns=2, n_symbols=2, companions=1, periods=4)


def sleeper(naps: list[float]) -> Any:
    """A method of which solves take as long as is said, one after the other."""
    calls = iter(naps)

    def make(_: Any, knob: Any) -> Solver:
        return Solver(lambda: time.sleep(next(calls)), lambda found: found)

    return make


def test_the_median_of_warm_solves_counts_and_the_first_is_preparation() -> None:
    naps = [0.2, 0.03, 0.09, 0.03]
    [found] = measure(None, sleeper(naps), [1.0], Protocol(3, 10.0), lambda _: {"error": 0.5})
    assert found["repeats"] == 3
    assert 0.03 <= found["seconds"] < 0.08 < found["slowest"]
    assert 0.1 < found["prepare"] < 0.2
    assert found["error"] == 0.5
    assert found["memory"] > 1


def test_a_quick_solve_is_repeated_on() -> None:
    naps = [0.0] * 100
    [found] = measure(None, sleeper(naps), [1.0], Protocol(3, 10.0), lambda _: {})
    assert 3 < found["repeats"] <= protocol.MANY


def test_the_budget_cuts_the_knobs_that_are_left() -> None:
    found = list(
        measure(None, sleeper([0.1] * 9), [1.0, 2.0, 3.0], Protocol(3, 0.15), lambda _: {})
    )
    assert [line["knob"] for line in found] == [1.0]
    assert found[0]["repeats"] == 1


def test_what_is_decisive_is_repeated_whatever_the_budget() -> None:
    wrong = iter([3.0, 0.0])
    naps = {1.0: 0.01, 2.0: 0.08}

    def make(_: Any, knob: Any) -> Solver:
        return Solver(lambda: time.sleep(naps[knob]), lambda found: found)

    def error(_: Any) -> dict[str, float]:
        return {"wrong_symbols": next(wrong)}

    found = list(measure(None, make, [1.0, 2.0], Protocol(4, 0.1), error))
    assert found[0]["repeats"] >= 4
    assert found[1]["repeats"] == 4


def test_long_times_go_as_far_as_the_budget_carries() -> None:
    task = problems.module("long_time").task(SIZES._replace(periods=1e6))

    def make(_: Any, knob: Any) -> Flow:
        return Flow(lambda: None, lambda t: time.sleep(0.01), lambda: task.states)

    reference = problems.module("long_time").reference(task)
    [found] = measure_long(
        task,
        make,
        [1.0],
        Protocol(2, 0.3),
        lambda x: problems.module("long_time").error(x, reference),
    )
    assert found["error"] < 1e-15
    assert 1 < found["reach"] < found["asked"] == pytest.approx(1e6)
    # What was not reached is extrapolated.
    assert found["seconds"] == pytest.approx(0.3 * 1e6 / found["reach"], rel=0.3)


def test_drift_is_told_for_each_integral() -> None:
    long_time = problems.module("long_time")
    task = long_time.task(SIZES)
    reference = long_time.reference(task)
    begin = np.array(list(reference.values()))
    answer = np.stack((begin, begin), axis=1)
    answer[1, 1] *= 1 + 1e-5
    answer[2, 1] += 1e-7
    found = long_time.error(answer, reference)
    assert found["error"] == found["gamma"] == pytest.approx(1e-5)
    assert 0 < found["area"] < 1e-6
    assert found["energy"] == 0


@needs_heyoka
@pytest.mark.parametrize(
    ("problem", "method", "fields"),
    [
        ("pendulum", "aligned_batch", {"error", "seconds", "prepare"}),
        ("codes", "scipy_dop853", {"error", "wrong_symbols", "worst"}),
        ("long_time", "splitting_2", {"error", "reach", "asked", "energy"}),
    ],
)
def test_a_worker_measures_in_its_own_process(
    tmp_path: Any, problem: str, method: str, fields: set[str]
) -> None:
    module = problems.module(problem)
    reference = tmp_path / "reference.npz"
    np.savez(reference, **module.reference(module.task(SIZES)))
    knobs = [8.0, 16.0] if method == "splitting_2" else [1e-4, 1e-10]
    order = worker.Order(problem, method, [SIZES._asdict()], knobs, 2, 20.0, str(reference))
    (once, *rows), ended = worker.measured(order, 100)
    assert ended == ""
    assert once["import"] >= 0
    assert [row["knob"] for row in rows] == knobs
    assert all(fields <= set(row) for row in rows)
    assert rows[1]["error"] < rows[0]["error"] / 2 or problem == "long_time"


@needs_heyoka
def test_a_worker_measures_the_cost_at_each_size_until_it_costs_too_much() -> None:
    sizes = [SIZES._replace(columns=n)._asdict() for n in (1, 4, 10**6)]
    order = worker.Order("codes", "aligned_batch", sizes, [1e-10], 1, 0.1, "")
    (_, *rows), ended = worker.measured(order, 100)
    assert ended == ""
    assert [row["columns"] for row in rows] == [1, 4]


def test_a_worker_that_is_too_slow_is_ended_and_what_it_had_is_kept() -> None:
    order = worker.Order("codes", "splitting_8", [Sizes()._asdict()], [1e5], 1, 50.0, "")
    lines, ended = worker.measured(order, 3.0)
    assert "ended at 3 s" in ended
    assert len(lines) == 1


def test_a_worker_that_fails_says_how() -> None:
    order = worker.Order("codes", "splitting_8", [{"no": 1}], [8], 1, 1.0, "")
    lines, ended = worker.measured(order, 100)
    assert ended.startswith("failed: ")
    assert "KeyError" in ended
    assert lines[0]["import"] >= 0


def test_one_core_is_kept_to() -> None:
    if not hasattr(os, "sched_getaffinity"):
        return
    before = os.sched_getaffinity(0)
    try:
        worker.keep_to_one_core()
        assert len(os.sched_getaffinity(0)) == 1
    finally:
        os.sched_setaffinity(0, before)


def test_the_median_of_several_walks_counts_for_long_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the quickest nor the slowest of three: 1, 5 and 2 seconds for as far."""
    task = problems.module("long_time").task(SIZES._replace(periods=1e6))
    walks = iter([(1.0, 10.0), (5.0, 10.0), (2.0, 10.0)])
    monkeypatch.setattr(protocol, "_followed", lambda *_: (*next(walks), None))

    def make(_: Any, knob: Any) -> Flow:
        return Flow(lambda: None, lambda t: None, lambda: task.states)

    [found] = measure_long(task, make, [1.0], Protocol(3, 1e9), lambda _: {})
    assert (found["fastest"], found["slowest"]) == pytest.approx((1e5, 5e5))
    assert found["seconds"] == pytest.approx(2e5)


def test_the_median_of_several_solves_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Preparation, the first solve, then three of 1, 5 and 2 seconds by the clock."""
    durations = iter([0.5, 7.0, 1.0, 5.0, 2.0])
    monkeypatch.setattr(protocol, "timed", lambda work: (next(durations), work()))
    made = measure(None, sleeper([0.0] * 9), [1.0], Protocol(3, 1e9), lambda _: {})
    [found] = made
    assert (found["fastest"], found["seconds"], found["slowest"]) == (1.0, 2.0, 5.0)
    assert found["prepare"] == 0.5 + 7.0 - 2.0
