"""How it is measured: the search within its budget, the meeting in turn, the worker's process."""

from __future__ import annotations

import io
import subprocess
import sys
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import counts, protocol, worker
from rigidpend.experiments.bench.methods import METHODS, Method
from rigidpend.experiments.bench.problems import LOOKS
from rigidpend.experiments.bench.protocol import Stage
from rigidpend.experiments.bench.solvers import Solver, Task, in_looks
from tests.orbits.integrate.problems import FIG4

SIZES: dict[str, Any] = {
    "orbits": 2,
    "turns": 1,
    "columns": 2,
    "n_symbols": 2,
    "companions": 1,
    "periods": 4,
}


def stage(long: bool = False, orbits: int = 6) -> Stage:
    """A problem of which the error is the size of the truth."""
    times = np.tile(10.0 * np.arange(1, 21)[:, None] / 20, orbits)
    task = Task("motion", FIG4, np.arange(6.0 * orbits).reshape(6, orbits), times)
    return Stage(task, {"x": np.arange(orbits)}, lambda _, truth: {"error": truth["x"].size}, long)


@pytest.fixture
def napping(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Any:
    """Methods that take as long as setting and knob say; what was made and solved is kept."""
    made: list[Any] = []

    def make(name: str, task: Task, entry: Any, threads: int = 1) -> Solver:
        setting, knob = entry["setting"], entry["knob"]
        made.append((name, setting, knob))
        naps = setting.get("naps", {}).get(threads, setting.get("nap", 0.0)) + (knob or 0.0)
        queue = iter(setting.get("queue", ()))

        def solve() -> None:
            made.append((name, threads))
            clock[0] += next(queue, naps) * task.times[-1, 0] / 10

        return Solver(solve)

    monkeypatch.setattr(protocol, "made", make)
    return made


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A table with one method, of such forms and variants."""

    def method(**more: Any) -> str:
        monkeypatch.setitem(METHODS, "napping", Method("napping", "others", **more))
        return "napping"

    return method


def test_the_fastest_form_is_kept_for_every_knob(napping: Any, tried: Any) -> None:
    name = tried(forms=({"nap": 0.03}, {"nap": 0.002}, {"nap": 0.02}))
    head, *rows = protocol.settings(stage(), name, [0.0, 0.001], 2, 9.0)
    assert head["form"] == 1
    assert head["forms"].endswith("chosen: nap 0.002")
    made = [one[1] for one in napping if len(one) == 3]
    assert made[3:] == [{"nap": 0.002}] * 2
    assert [row["knob"] for row in rows][1] == 0.001


def test_every_variant_is_tried_at_every_knob_and_medians_count(napping: Any, tried: Any) -> None:
    name = tried(variants=({"nap": 0.002}, {"nap": 0.01}))
    _, *rows = protocol.settings(stage(), name, [0.0, 0.001], 3, 9.0)
    assert [row["setting"] for row in rows] == [0, 0, 1, 1]
    assert all(row["repeats"] == 3 for row in rows)
    assert [row["seconds"] for row in rows] == pytest.approx([0.002, 0.003, 0.01, 0.011])


def test_the_budget_cuts_the_knobs_that_are_left(napping: Any, tried: Any) -> None:
    _, *rows = protocol.settings(stage(), tried(), [0.06, 0.07, 0.08], 1, 0.1)
    assert [row["knob"] for row in rows] == [0.06]


def test_the_median_of_several_solves_counts_and_not_the_fastest(napping: Any) -> None:
    """Solves of 1, 5 and 2 seconds by the clock, behind one that warms up."""
    entry = {"knob": 0.0, "setting": {"queue": (7.0, 1.0, 5.0, 2.0)}}
    line, _ = protocol.measured(stage(), "x", entry, 3, 1e9)
    assert (line["repeats"], line["seconds"], line["prepare"]) == (3, 2.0, 5.0)


@pytest.mark.parametrize(("share", "part"), [(21.0, 0.1), (0.01, 1e-3), (106.0, 1.0)])
def test_over_long_times_a_slow_method_goes_a_part_of_the_way(
    napping: Any, share: float, part: float
) -> None:
    """All of it takes 105 s, and half of the share is gone for."""
    entry = {"knob": None, "setting": {"nap": 105.0}}
    line, _ = protocol.measured(stage(long=True), "x", entry, 1, share)
    assert line["part"] == pytest.approx(part)
    assert line["seconds"] == pytest.approx(105.0), "scaled to the whole way"


def test_the_way_is_looked_at_in_order_from_where_it_was() -> None:
    moments: list[Any] = []

    def ends(states: Any, start: float, times: Any) -> Any:
        moments.append((start, times[0]))
        return states + 1

    found = in_looks(stage().task, ends)()
    assert found.shape == (LOOKS, 6, 6)
    assert moments[0] == (0.0, 0.5)
    assert all(before[1] == after[0] for before, after in pairwise(moments))
    np.testing.assert_array_equal(found[-1], stage().task.states + LOOKS)


def test_methods_meet_in_turn_and_the_order_turns(napping: Any) -> None:
    entries: Any = {name: {"setting": {}, "knob": None} for name in "abc"}
    found = protocol.met(stage(), entries, 1, 3, 9.0, {})
    calls = [name for name, *rest in napping if rest == [1]]
    assert calls == list("abc") + list("abc") + list("bca") + list("cab"), "first all warm up"
    assert all(len(found[name]["rounds"]) == 3 for name in "abc")


def test_with_two_threads_a_method_takes_one_where_that_is_faster(
    napping: Any, tried: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Solvers of one thread are made once; who gains nothing from a second one stays away."""
    naps = {"lone": {1: 0.1, 2: 0.4}, "shared": {1: 0.4, 2: 0.3}, "single": {}}
    for name in naps:
        monkeypatch.setitem(METHODS, name, Method(name, "others", threads=name != "single"))
    monkeypatch.setattr(protocol, "stage", lambda *_: stage())
    entries = {name: {"setting": {"naps": x}, "knob": None} for name, x in naps.items()}
    found = list(protocol.meeting(entries, {}, {}, 3, 9.0, [1, 2], "free_body"))
    assert [(x["method"], x["most"], x["threads"]) for x in found] == [
        *(("lone", 1, 1), ("shared", 1, 1), ("single", 1, 1)),
        *(("lone", 2, 1), ("shared", 2, 2)),
    ]
    assert napping[-6:].count(("lone", 1)) == napping[-6:].count(("shared", 2)) == 3
    assert sum(len(one) == 3 for one in napping) == 5


def test_who_has_spent_his_time_misses_the_rounds_that_are_left(napping: Any) -> None:
    entries: Any = {
        "slow": {"setting": {"nap": 0.03}, "knob": None},
        "quick": {"setting": {"nap": 0.001}, "knob": None, "part": 0.5},
    }
    found = protocol.met(stage(), entries, 1, 4, 0.05, {})
    assert np.isnan(found["slow"]["rounds"]).tolist() == [False, False, True, True]
    assert found["quick"]["rounds"] == pytest.approx([0.001] * 4), "half the way, told for all"


@pytest.mark.slow
def test_a_method_that_fails_ends_its_worker_by_a_code_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where the program is at fault it is 1."""

    def fails() -> Any:
        raise MemoryError

    monkeypatch.setattr(counts, "random_phases", fails)
    monkeypatch.setattr(sys, "stdin", io.StringIO('["phases", {}]'))
    with pytest.raises(SystemExit) as ended:
        worker.main()
    assert ended.value.code == worker.FAILED
    assert worker.FAILED not in (0, 1)
    assert isinstance(worker.FAILED, int)


def test_a_worker_that_is_too_slow_is_ended_and_what_it_had_is_kept() -> None:
    slow = {"knob": 1e-13, "setting": {}}
    given = {"entries": {"scipy_dop853": slow}, "orbits": 250, "seconds": 50.0}
    lines, ended = worker.measured("phases", given, 1.5)
    assert "ended at 1.5 s" in ended
    assert lines == []


def search(name: str, knobs: list[Any]) -> Any:
    """A search at the pendulum, of a truth that no method looks at before it has failed."""
    truth = {"pendulum": {"states": [[0.0, 0.0]] * 6}}
    given = {"entries": {name: {"pendulum": knobs}}, "sizes": SIZES, "truth": truth}
    return worker.measured("search", {**given, "repeats": 1, "seconds": 1.0}, 100)


@pytest.mark.slow
def test_a_method_that_finds_no_number_has_failed_and_the_rest_is_measured() -> None:
    (_, head, failed), ended = search("lie_poisson", [0.0])
    assert ended == ""
    assert head["form"] == 0
    assert failed["failed"].startswith("ZeroDivisionError: ")


@pytest.mark.slow
def test_a_fault_of_our_own_lines_ends_the_benchmark() -> None:
    """A knob of the wrong type stands for it: where it rose is told, in one line."""
    with pytest.raises(worker.Fault, match=r"\(lie_poisson\): TypeError: .*, line \d+\)$"):
        search("lie_poisson", ["8"])


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
    monkeypatch.setattr(worker, "heard", lambda *_: ("", "x", False))
    given: Any = "search", {"entries": {"cyrk": {}}}, 1.0
    if code == 1:
        with pytest.raises(worker.Fault, match=r"worker stopped \(cyrk\): x"):
            worker.measured(*given)
    else:
        assert worker.measured(*given) == ([], said)
