"""`run`: reasons, dry runs, going on, how much is said, the JSON document, logs, a terminal."""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import pty
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from rigidpend.cli import common, run
from rigidpend.machine import progress, workers
from rigidpend.orbits.integrate.arithmetic import EngineError
from rigidpend.results import store
from rigidpend.runs import runner
from tests.cli.calls import ENVIRONMENT, Done, call, succeeded
from tests.config.samples import SMALL, changed, written


def state(path: Path) -> tuple[bytes, int]:
    return path.read_bytes(), path.stat().st_mtime_ns


def lines(path: Path) -> list[str]:
    return [line.split(maxsplit=1)[1] for line in path.read_text().splitlines()]


@pytest.mark.slow
def test_a_run_says_why_and_what_it_does_on_stderr_and_in_its_log(
    desk: Path, first: Done, result: Path
) -> None:
    assert first.stdout == ""
    begin, *reports, end = first.stderr.splitlines()
    assert begin.startswith("fig4: computing (no result yet), ")
    assert [line.split()[:4] for line in reports] == [
        ["fig4:", "left:", "63", "orbits,"],
        ["fig4:", "right:", "32", "orbits,"],
    ]
    assert end.startswith(f"fig4: {Path('deep', 'results', 'fig4.h5')} written, ")
    opening, *said = lines(result.with_suffix(".log"))
    assert opening.endswith("run fig4 -j 1 --out deep/results")
    assert [f"fig4: {line}" for line in said] == first.stderr.splitlines()
    # It is left alone, with its log.
    before = [state(result.with_suffix(suffix)) for suffix in (".h5", ".log")]
    done = call(desk, "run", "fig4", "--out", "deep/results")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == f"fig4: {Path('deep', 'results', 'fig4.h5')} is up to date\n"
    assert before == [state(result.with_suffix(suffix)) for suffix in (".h5", ".log")]


@pytest.mark.slow
def test_a_read_only_folder_of_configs_is_enough(tmp_path: Path) -> None:
    (tmp_path / "configs").mkdir()
    path = written(tmp_path / "configs", SMALL, "mine.yaml")
    path.chmod(0o444)
    (tmp_path / "configs").chmod(0o555)
    succeeded(tmp_path, "run", "mine")
    assert (tmp_path / "results" / "mine.h5").is_file()
    assert [x.name for x in (tmp_path / "configs").iterdir()] == ["mine.yaml"]


@pytest.mark.slow
def test_a_config_is_planned_then_computed_then_left_alone_as_loud_as_is_asked(small: Path) -> None:
    dry = call(small, "run", "small.yaml", "-n")
    assert (dry.returncode, dry.stdout) == (0, "")
    assert dry.stderr.startswith("small: would compute (no result yet), ")
    [planned] = json.loads(call(small, "run", "small.yaml", "--json", "-n").stdout)
    assert not (small / "results").exists()
    loud = call(small, "run", "small.yaml", "--json", "-v")
    [computed] = json.loads(loud.stdout)
    assert all(line.split()[1] == "s" for line in loud.stderr.splitlines())
    quiet = call(small, "run", "small.yaml", "--json", "-q", "--force")
    assert quiet.stderr == ""
    same = call(small, "run", "small.yaml", "--json", "-n")
    assert same.stderr == f"small: {Path('results', 'small.h5')} is up to date\n"
    told = planned, computed, *json.loads(quiet.stdout), *json.loads(same.stdout)
    statuses = [x["status"] for x in told]
    assert statuses == ["planned", "computed", "computed", "up to date"]
    assert [x["reason"] for x in told] == ["no result yet", "no result yet", "--force", None]
    assert {x["config_hash"] for x in told} == {planned["config_hash"]}
    assert told[-1]["seconds"] is None
    assert store.attributes(small / "results" / "small.h5")["code_hash"] in loud.stderr
    usual = call(small, "run", "small.yaml", "--force")
    assert len(loud.stderr.splitlines()) > len(usual.stderr.splitlines())
    again = call(small, "run", "small.yaml", "--dry-run", "--set", "problem.mu=2e-3")
    assert again.stderr.startswith(
        "small: would compute (its config changed: problem.mu from 0.001 to 0.002), "
    )
    wrong = call(small, "run", "small.yaml", "--quiet", "--set", "problem.mu=x")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith("--set problem.mu=x: ")


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three configs; the first cannot be computed, the second has a damaged result."""
    folder = tmp_path_factory.mktemp("failing")
    zoom = """\
figure: none
experiment: route_zoom
problem: {A: [2, 1, 1.5], r: [1, 1, 0], mu: 0.001, h0: 1.3342, J1_0: 1e-8, n_symbols: 1,
  between: [1, 1.1], step: 1/10, levels: 1, count: 3}
numerics: {precisions: [53]}
"""
    written(folder, zoom, "a.yaml")
    for name in ("b", "c"):
        written(folder, SMALL, f"{name}.yaml")
    (folder / "results").mkdir()
    (folder / "results" / "b.h5").write_bytes(b"mine")
    return folder


def test_a_config_that_cannot_be_planned_is_told_once_and_keeps_no_other_from_it(
    failing: Path,
) -> None:
    done = call(failing, "run", "b.yaml", "c.yaml", "-k", "-n", "-v")
    assert (done.returncode, done.stdout) == (1, "")
    assert [line for line in done.stderr.splitlines() if "None" in line] == []
    assert done.stderr.startswith(f"rigidpend: {Path('results', 'b.h5')}: ")
    assert "c: would compute (no result yet), " in done.stderr


def test_the_worst_failure_is_the_exit_code() -> None:
    runs = run.Runs(1, None, keep_going=True)
    for error in (store.StoreError("x"), EngineError("x"), store.StoreError("x")):
        runs._failed(run.RunOutcome("a", "planned", "none"), error, None)
    assert runs.code == common.ABSENT


@pytest.mark.slow
def test_the_first_failure_ends_a_run_that_does_not_keep_going(failing: Path) -> None:
    done = call(failing, "run", "a.yaml", "c.yaml", "--out", "other", "--json")
    assert done.returncode == 1
    assert [entry["status"] for entry in json.loads(done.stdout)] == ["failed", "not run"]
    assert done.stderr.splitlines()[-1].startswith("rigidpend: a: ")
    assert not (failing / "other" / "c.h5").exists()
    assert "failed: " in lines(failing / "other" / "a.log")[-1]
    done = call(failing, "run", "a.yaml", "b.yaml", "c.yaml", "-k", "--json")
    assert done.returncode == 1
    a, b, c = json.loads(done.stdout)
    assert [x["status"] for x in (a, b, c)] == ["failed", "failed", "computed"]
    assert a["error"] in done.stderr
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
    for name in ("b", "c"):
        written(tmp_path, SMALL, f"{name}.yaml")
    begun = []

    def apart(work: Any, given: Any, hear: Any) -> None:
        """A process is sent its work, and says in strings what is done."""
        begun.append(given[1])
        work, given = pickle.loads(pickle.dumps((work, given)))
        work(*given, hear)

    monkeypatch.setattr(workers, "apart", apart)
    monkeypatch.setattr(run, "LONG", 0.0)
    given = ("run", "b.yaml", "c.yaml", "-j", "2", "--json", "--out", ".")
    done = succeeded(tmp_path, *given)
    assert [x["status"] for x in json.loads(done.stdout)] == ["computed", "computed"]
    assert begun == [1, 1]
    for name in ("b", "c"):
        _, begin, *_, end = lines(tmp_path / f"{name}.log")
        assert begin.startswith("computing (no result yet), ")
        assert end.startswith(f"{name}.h5 written, ")
    # One that outlasts all the others has all threads, in this process.
    seconds = {"b": 12.0, "c": 3.0}
    monkeypatch.setattr(runner, "expected_seconds", lambda plan: seconds[plan.config.name])
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
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "run", Mock(side_effect=KeyboardInterrupt))
    done = call(desk, "run", "small.yaml", "fig2", "--json", "--out", "interrupted")
    assert done.returncode == 130
    assert [one["status"] for one in json.loads(done.stdout)] == ["interrupted", "not run"]


@pytest.mark.slow
def test_a_terminal_has_one_line_that_changes_and_no_colours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        written(tmp_path, SMALL, f"{name}.yaml")
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "rigidpend", "run", "a.yaml", "b.yaml"],
        cwd=tmp_path,
        env=ENVIRONMENT | {"COLUMNS": "80", "LINES": "24", "TERM": "xterm"},
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    ) as process:
        os.close(theirs)
        shown = ""
        # Linux says so when the other side is closed.
        with contextlib.suppress(OSError):
            while block := os.read(ours, 10_000):
                shown += block.decode()
        os.close(ours)
    assert process.returncode == 0, shown
    assert "\x1b" not in shown
    assert "\r[1 of 2 done, " in shown
    shown = shown.replace("\r\n", "\n")
    assert all(len(text) < 80 for line in shown.split("\n") for text in line.split("\r"))
    stay = [line.split("\r")[-1].strip() for line in shown.split("\n") if line]
    assert [line.split()[:3] for line in stay if line] == [
        ["a:", "results/a.h5", "written,"],
        ["b:", "results/b.h5", "written,"],
    ]
    # One that cannot go back to the beginning of a line has plain lines.
    for name in ("xterm", "dumb"):
        monkeypatch.setenv("TERM", name)
        assert progress.changes(SimpleNamespace(isatty=lambda: True)) == (name == "xterm")


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [("a.yaml", "sub/a.yaml"), ("fig4", "fig4.yaml"), ("a.yaml", "sub/A.yaml")],
)
def test_two_configs_of_one_name_are_wrong_usage(tmp_path: Path, names: tuple[str, str]) -> None:
    (tmp_path / "sub").mkdir()
    for name in ("a.yaml", "sub/a.yaml", "sub/A.yaml", "fig4.yaml"):
        written(tmp_path, SMALL, name)
    done = call(tmp_path, "run", *names)
    stem = Path(names[1]).stem
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{names[1]} would both be stored as {stem}.h5" in done.stderr
    assert not (tmp_path / "results").exists()


@pytest.mark.slow
def test_all_configs_are_checked_before_the_first_is_computed(tmp_path: Path) -> None:
    written(tmp_path, SMALL, "good.yaml")
    for name in ("bad.yaml", "worse.yaml"):
        written(tmp_path, changed("mu: 0.001", "mu: x", SMALL), name)
    done = call(tmp_path, "run", "good.yaml", "bad.yaml", "worse.yaml")
    assert done.returncode == 2
    starts = [line for line in done.stderr.splitlines() if not line.startswith(" ")]
    assert starts[0].startswith("bad.yaml:7:7: problem.mu: ")
    assert starts[1].startswith("worse.yaml:7:7: problem.mu: ")
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("seconds", "files", "jobs", "scheduler", "expected"),
    [
        ([10, 10, 5], 3, 8, None, 2),
        ([10, 10, 5], 3, 1, None, 1),
        # What is short goes one after the other, what a sweep asks for as jobs go.
        ([0.5, 0.5, 0.5], 3, 8, None, 1),
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
