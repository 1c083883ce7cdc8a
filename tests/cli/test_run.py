"""`run`: reasons, dry runs, going on, how much is said, the JSON document, logs, a terminal."""

import json
import pickle
import re
import sys
import time
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from rigidpend.cli import common, run
from rigidpend.machine import files, progress, workers
from rigidpend.orbits.integrate.arithmetic import EngineError
from rigidpend.results import store
from rigidpend.runs import runner
from tests.cli.calls import call, succeeded
from tests.config.samples import SMALL, ZOOM, changed, written
from tests.runs.checkers import lines


@pytest.mark.slow
def test_a_config_is_planned_then_computed_then_left_alone_as_loud_as_is_asked(small: Path) -> None:
    def ran(*how: str) -> tuple[Any, list[str]]:
        done = succeeded(small, "run", "small.yaml", "--json", *how)
        [outcome] = json.loads(done.stdout)
        return outcome, done.stderr.splitlines()

    result, log = small / "results" / "small.h5", small / "results" / "small.log"
    planned, [dry] = ran("-n")
    assert dry.startswith("small: would compute (no result yet), ")
    assert [x.name for x in small.iterdir()] == ["small.yaml"]
    computed, (begin, *parts, end) = ran()
    assert begin.startswith("small: computing (no result yet), ")
    assert [line.split()[:4] for line in parts] == [["small:", "only:", "5", "orbits,"]]
    assert end.startswith(f"small: {Path('results', 'small.h5')} written, ")
    opening, *said = lines(log)
    assert opening.endswith("run small.yaml --json")
    assert [f"small: {line}" for line in said] == [begin, *parts, end]
    # It is left alone, with its log.
    before = result.stat().st_mtime_ns, log.stat().st_mtime_ns
    same, told = ran()
    assert told == [f"small: {Path('results', 'small.h5')} is up to date"]
    assert before == (result.stat().st_mtime_ns, log.stat().st_mtime_ns)
    loud, told = ran("-v", "--force")
    assert all(line.split()[1] == "s" for line in told)
    assert store.attributes(result)["code_hash"] in " ".join(told)
    quiet, told = ran("-q", "--force")
    assert told == []
    outcomes = planned, computed, same, loud, quiet
    statuses = ["planned", "computed", "up to date", "computed", "computed"]
    assert [x["status"] for x in outcomes] == statuses
    reasons = ["no result yet", "no result yet", None, "--force", "--force"]
    assert [x["reason"] for x in outcomes] == reasons
    assert {x["config_hash"] for x in outcomes} == {planned["config_hash"]}
    assert same["seconds"] is None
    _, [again] = ran("--dry-run", "--set", "problem.mu=2e-3")
    changed = "its config changed: problem.mu from 0.001 to 0.002"
    assert again.startswith(f"small: would compute ({changed}), ")
    wrong = call(small, "run", "small.yaml", "--quiet", "--set", "problem.mu=x")
    assert wrong.stderr.startswith("--set problem.mu=x: ")


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three configs; the first cannot be computed, the second has a damaged result."""
    folder = tmp_path_factory.mktemp("failing")
    written(folder, changed("between: [1.5, 1.6]", "between: [1, 1.1]", ZOOM), "a.yaml")
    for name in ("b", "c"):
        written(folder, SMALL, f"{name}.yaml")
    (folder / "results").mkdir()
    (folder / "results" / "b.h5").write_bytes(b"mine")
    return folder


def test_the_worst_failure_is_the_exit_code(failing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    errors = files.StoreError("x"), EngineError("x"), files.StoreError("x")
    monkeypatch.setattr(runner, "plan", Mock(side_effect=errors))
    done = call(failing, "run", "a.yaml", "b.yaml", "c.yaml", "-k")
    assert done.returncode == common.ABSENT


def test_a_terminal_has_one_line_that_changes_and_keeps_none_of_what_failed(
    failing: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "changes", lambda: True)
    monkeypatch.setattr(progress, "PERIOD", 0.01)
    # What takes the place of stderr here is no terminal, whose size tqdm could ask for.
    monkeypatch.setattr("tqdm.std._screen_shape_wrapper", lambda: lambda _: (79, 23))

    def run(planned: runner.Plan, **how: Any) -> str:
        how["report"]("in the midst of it")
        # However long the thread waits that changes the line.
        shown, deadline = f"; {planned.config.name}: in the midst", time.monotonic() + 20
        stderr: Any = sys.stderr.buffer
        while shown not in stderr.getvalue().decode():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        if planned.config.name == "b":
            raise files.StoreError("no room")
        return ""

    monkeypatch.setattr(runner, "run", run)
    done = call(failing, "run", "c.yaml", "b.yaml", "--force", "-k", "--out", "shown")
    assert re.search(r"\r\[50 %.* left\] 1 of 2 done; b: in the midst of it", done.stderr)
    assert all(len(x) < 80 for line in done.stderr.split("\n") for x in line.split("\r"))
    stay = [line.split("\r")[-1].strip() for line in done.stderr.split("\n")]
    assert stay[0].startswith("c: shown/c.h5 written, ")
    assert stay[1:] == ["rigidpend: b: no room", ""]


@pytest.mark.slow
def test_the_first_failure_ends_a_run_that_does_not_keep_going(
    failing: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And is its last line, however long the run took."""
    monkeypatch.setattr(progress, "LOG_PERIOD", -1.0)
    done = call(failing, "run", "a.yaml", "c.yaml", "--out", "other", "--json")
    assert done.returncode == 1
    assert [entry["status"] for entry in json.loads(done.stdout)] == ["failed", "not run"]
    assert done.stderr.splitlines()[-1].startswith("rigidpend: a: ")
    assert not (failing / "other" / "c.h5").exists()
    assert "failed: " in lines(failing / "other" / "a.log")[-1]
    done = call(failing, "run", "a.yaml", "b.yaml", "c.yaml", "-k", "-v", "--json")
    assert "None" not in done.stderr
    assert done.returncode == 1
    a, b, c = json.loads(done.stdout)
    assert [x["status"] for x in (a, b, c)] == ["failed", "failed", "computed"]
    assert [done.stderr.count(x["error"]) for x in (a, b)] == [1, 1]
    assert b["error"].endswith("move it away, or overwrite it with --force")
    assert (failing / "results" / "b.h5").read_bytes() == b"mine"
    assert (c["error"], c["log"]) == (None, str(Path("results", "c.log")))
    assert store.attributes(failing / c["file"])["config_hash"] == c["config_hash"]
    assert 0 < c["seconds"] < 60
    assert call(failing, "run", "b.yaml", "--force").returncode == 0
    assert store.attributes(failing / "results" / "b.h5")["name"] == "b"


@pytest.mark.slow
def test_long_configs_have_processes_of_their_own_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The last is as long as is not worth a process.
    seconds, begun = {"b": 1.5, "c": 1.5, "d": run.LONG}, []

    def apart(work: Any, given: Any, hear: Any) -> None:
        """A process is sent its work, and says in strings what is done."""
        begun.append((given[0].config.name, given[1]))
        work, given = pickle.loads(pickle.dumps((work, given)))
        work(*given, hear)

    monkeypatch.setattr(workers, "apart", apart)
    monkeypatch.setattr(runner, "expected_seconds", lambda plan: seconds[plan.config.name])
    for name in seconds:
        written(tmp_path, SMALL, f"{name}.yaml")
    given = ("run", "b.yaml", "c.yaml", "d.yaml", "-j", "5", "--json", "--out", ".")
    done = succeeded(tmp_path, *given)
    assert [x["status"] for x in json.loads(done.stdout)] == ["computed"] * 3
    assert sorted(begun) == [("b", 2), ("c", 2)]
    for name in seconds:
        _, begin, *_, end = lines(tmp_path / f"{name}.log")
        assert begin.startswith("computing (no result yet), ")
        assert end.startswith(f"{name}.h5 written, ")
    # One that outlasts all the others has all threads, in this process.
    seconds["b"] = 12.0
    monkeypatch.setattr(workers, "apart", None)
    assert call(tmp_path, *given, "--force").returncode == 0


def test_the_longest_come_first_and_a_killed_process_leaves_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds, begun = {"b": 2.0, "c": 2.5, "d": 2.4}, []

    def killed(_: Any, given: Any, hear: Any) -> None:
        target = given[0].target
        begun.append(target.stem)
        target.with_name(f".{target.name}.abc.part").write_bytes(b"half")
        raise workers.WorkerError("was killed")

    monkeypatch.setattr(workers, "apart", killed)
    monkeypatch.setattr(runner, "expected_seconds", lambda plan: seconds[plan.config.name])
    for name in seconds:
        written(tmp_path, SMALL, f"{name}.yaml")
    done = call(tmp_path, "run", "b.yaml", "c.yaml", "d.yaml", "-j", "2", "-k", "--out", "out")
    assert done.returncode == 1
    assert (set(begun[:2]), begun[2:]) == ({"c", "d"}, ["b"])
    assert sorted(x.name for x in (tmp_path / "out").iterdir()) == ["b.log", "c.log", "d.log"]


def test_an_interrupted_run_has_its_document_too(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "run", Mock(side_effect=KeyboardInterrupt))
    done = call(small, "run", "small.yaml", "fig2", "--json", "--out", "interrupted")
    assert done.returncode == 130
    assert done.stderr.splitlines()[1:] == ["interrupted; finished results are kept"]
    assert [one["status"] for one in json.loads(done.stdout)] == ["interrupted", "not run"]


@pytest.mark.parametrize(
    ("seconds", "files", "jobs", "scheduler", "expected"),
    [
        ([10, 10, 5], 3, 8, None, 2),
        ([10, 10, 5], 3, 1, None, 1),
        # What is short goes one after the other, what a sweep asks for as jobs go.
        ([1.0, 1.0, 1.0], 3, 8, None, 1),
        ([1.1, 1.1, 1.1], 3, 8, None, 3),
        ([10, 10, 5], 1, 2, None, 2),
        ([10, 10, 5], 1, 8, None, 3),
        ([10, 10, 5], 3, 1, "tcp://head:8786", 3),
        ([], 3, 8, None, 0),
    ],
)
def test_so_many_go_side_by_side_that_none_outlasts_all_others(
    seconds: list[float], files: int, jobs: int, scheduler: str | None, expected: int
) -> None:
    runs: Any = run.Runs(jobs, scheduler, keep_going=False)
    runs.waiting = list(range(len(seconds)))
    runs.expected = {str(k): x for k, x in enumerate(seconds)}
    assert runs.at_once(files) == expected


@pytest.mark.parametrize(("given", "at_once"), [(("-j1",), 1), (("--scheduler", "head:8786"), 0)])
def test_of_a_cluster_the_whole_time_is_not_told(
    small: Path, monkeypatch: pytest.MonkeyPatch, given: tuple[str, ...], at_once: int
) -> None:
    """It is unknown how many workers share the configs."""
    shown = Mock(wraps=progress.Progress)
    monkeypatch.setattr(run, "Progress", shown)
    succeeded(small, "run", "small.yaml", "-n", "--out", "new", *given)
    assert shown.call_args.args[2] == at_once
