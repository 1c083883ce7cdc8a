"""Runs: what is loaded, what is up to date and why not, what a result holds, what is left."""

import importlib.metadata
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import h5py
import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.config.complaints import ConfigError
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.machine import files
from rigidpend.machine.progress import tell_nobody
from rigidpend.machine.signals import Stopped
from rigidpend.orbits.integrate.arithmetic import (
    DEFAULT_TOLERANCE,
    FINEST_TOLERANCE,
    Arithmetic,
    resolve,
)
from rigidpend.results import store
from rigidpend.runs import loading, provenance, runner
from rigidpend.runs.logs import Logs
from rigidpend.runs.parts import Parts
from tests.config.samples import FIG4, TEXT, changed, written
from tests.runs.checkers import lines

CONFIG, RESULTS, RESULT = Path("configs/small.yaml"), Path("results"), Path("results/small.h5")
MU = "its config changed: problem.mu from 0.001 to 0.002"


def test_only_the_paper_s_own_problem_has_the_name_of_its_figure(tmp_path: Path) -> None:
    assert loading.load(written(tmp_path, TEXT)).content.figure == "4"
    assert loading.load(FIG4, ["numerics.engine=scipy"]).content.figure == "4"
    assert loading.load(FIG4, ["problem.mu=0.01"]).content.figure == ""
    other = changed("A: [2, 1, 1.5]", "A: [3, 2, 2.5]")
    assert loading.load(written(tmp_path, other)).content.figure == ""
    zoom = FIG4.with_name("fig4_zoom.yaml")
    assert loading.load(zoom).content.figure == "4, zoomed"
    assert loading.load(zoom, ["problem.mu=0.01"]).content.figure == ""
    # A name that is not the paper's stays.
    mine = changed('figure: "4"', "figure: mine")
    assert loading.load(written(tmp_path, mine), ["problem.mu=0.01"]).content.figure == "mine"


def test_what_is_wrong_in_several_files_is_said_at_once(tmp_path: Path) -> None:
    wrong = changed("mu: 0.001", "mu: x")
    paths = [written(tmp_path, wrong, "a.yaml"), FIG4, written(tmp_path, wrong, "b.yaml")]
    with pytest.raises(ConfigError) as caught:
        loading.load_swept(paths, ["problem.h0=y"])
    origins = [str(problem.origin) for problem in caught.value.complaints]
    # The setting is the same for all, and said once.
    assert [x.rpartition("/")[2] for x in origins] == [
        *("--set problem.h0=y", "a.yaml:8:7", "b.yaml:8:7")
    ]


def other_format(_: pytest.MonkeyPatch) -> None:
    with h5py.File(RESULT, "a") as file:
        file.attrs["format_version"] = store.FORMAT_VERSION + 1


def edited(_: pytest.MonkeyPatch) -> None:
    """A symbol is flipped by hand."""
    with h5py.File(RESULT, "r+") as file:
        codes: Any = next(iter(file["data"].values()))["codes"]
        codes[0, 0] = 1 - codes[0, 0]


def other(module: Any, name: str) -> Callable[[pytest.MonkeyPatch], None]:
    """A change of what a function of a module tells."""
    return lambda patch: patch.setattr(module, name, lambda _: "another")


@pytest.mark.parametrize(
    ("setting", "change", "reason"),
    [
        ("problem.mu=1e-3", None, ""),
        ("problem.mu=1e-3", lambda _: RESULT.unlink(), "no result yet"),
        ("problem.mu=0.002", other(importlib.metadata, "version"), f"{MU}; the engine changed"),
        ("problem.mu=1e-3", other(provenance, "code_hash"), "the code that computes it changed"),
        ("problem.mu=1e-3", other_format, "its result has another format version"),
        ("problem.mu=1e-3", edited, "another program changed its file"),
    ],
)
def test_what_changed_is_the_reason(
    desk: Path, monkeypatch: pytest.MonkeyPatch, setting: str, change: Any, reason: str
) -> None:
    CONFIG.write_text(f"{CONFIG.read_text()}# A comment.\n")
    if change:
        change(monkeypatch)
    before = RESULT.read_bytes() if RESULT.exists() else b""
    config = loading.load(CONFIG, [setting])
    planned = runner.plan(config, RESULTS)
    kept = "", "the code that computes it changed", "another program changed its file"
    same = reason in kept
    assert (planned.reason, planned.seconds > 0) == (reason, same)
    assert runner.plan(config, RESULTS, force=True).reason == "--force"
    assert (RESULT.read_bytes() if RESULT.exists() else b"") == before


def test_a_result_says_what_it_was_made_from(desk: Path) -> None:
    planned = runner.plan(loading.load(CONFIG), RESULTS)
    with store.opened(RESULT) as file:
        attributes = dict(file.attrs)
        assert attributes.pop("precisions").tolist() == [53]
        assert attributes.pop("seconds") > 0
        assert attributes.pop("tolerance") == DEFAULT_TOLERANCE[planned.config.arithmetic.engine]
        assert attributes == {
            "format": "rigidpend",
            "format_version": 1,
            "name": "small",
            "figure": planned.config.content.figure,
            "experiment": "route_codes",
            **planned.fingerprint,
            "doubt": "",
        }
        assert json.loads(file["config"].asstr()[()]) == planned.config.resolved()
        assert set(file["provenance"].attrs) == set(provenance.provenance())


@pytest.mark.parametrize("engine", ["scipy", "taylor"])
def test_a_result_hangs_on_the_engine_that_its_config_asks_for(tmp_path: Path, engine: str) -> None:
    planned = runner.plan(loading.load(FIG4, [f"numerics.engine={engine}"]), tmp_path)
    assert planned.fingerprint["engine"].startswith(f"{engine} (")


def test_parts_are_those_of_all_that_a_result_hangs_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "Parts", parts := Mock(side_effect=InterruptedError))
    planned = runner.plan(loading.load(FIG4), tmp_path)
    others = [planned.fingerprint | {name: "another"} for name in runner.REASONS]
    for fingerprint in (planned.fingerprint, planned.fingerprint, *others):
        with pytest.raises(InterruptedError):
            runner.run(replace(planned, fingerprint=fingerprint), jobs=1, report=tell_nobody)
    assert len({given.args for given in parts.call_args_list}) == 1 + len(others) == 4


def test_pieces_take_all_jobs_here_and_one_each_on_a_cluster_and_it_is_told_which_are_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute, planned = Mock(side_effect=InterruptedError), runner.plan(loading.load(FIG4), tmp_path)
    Parts(planned.target, json.dumps(planned.fingerprint)).keep("left.0", lambda: {"x": 1.0})
    module = SimpleNamespace(compute=compute, PIECES=True)
    monkeypatch.setattr(experiments, "computation", lambda _: module)
    for scheduler, jobs in ((None, 3), ("tcp://nowhere:1", 1)):
        with pytest.raises(InterruptedError):
            runner.run(planned, jobs=3, report=tell_nobody, scheduler=scheduler)
        means = compute.call_args.args[1]
        assert means.jobs == jobs
        assert means.pieces.keywords.get("jobs") == (None if scheduler else 3)
        assert [means.stored(name) for name in ("left.0", "left.8")] == [True, False]


@pytest.mark.parametrize("before", [0, 1])
def test_a_run_that_is_stopped_writes_no_result(
    desk: Path, monkeypatch: pytest.MonkeyPatch, before: int
) -> None:
    """Before it computes, and before it writes what a signal may have spoilt."""
    planned, content = runner.plan(loading.load(CONFIG), RESULTS, force=True), RESULT.read_bytes()
    monkeypatch.setattr(runner, "check_stop", Mock(side_effect=[*[None] * before, Stopped]))
    with pytest.raises(Stopped):
        runner.run(planned, jobs=1, report=tell_nobody)
    assert RESULT.read_bytes() == content


def test_parts_wait_for_their_run_however_old_they_are(tmp_path: Path) -> None:
    parts, config = Parts(tmp_path / "fig4.h5", "a"), loading.load(FIG4)
    parts.keep("first", lambda: {"x": np.float64(1.0)})
    [folder] = (tmp_path / ".fig4.parts").iterdir()
    os.utime(folder, (0, 0))
    assert runner.plan(config, tmp_path).reason == "no result yet"
    assert parts.has("first")


def test_a_result_whose_name_differs_in_case_only_is_not_made(desk: Path) -> None:
    config = loading.load(CONFIG)
    (desk / "Small.h5").write_bytes(b"another")
    with pytest.raises(files.StoreError, match=r"Small\.h5 exists, and some systems ignore"):
        runner.plan(config, desk)
    # Where both are there, the system tells them apart.
    (desk / "small.h5").write_bytes(b"this one")
    assert runner.plan(config, desk, force=True).reason


def test_how_long_a_plan_takes_is_told_by_what_is_stored_or_else_by_its_experiment(
    desk: Path,
) -> None:
    plan = runner.plan(loading.load(CONFIG), desk)
    told = experiments.cost(plan.config.content)
    assert told
    for seconds, expected in ((7.0, 7.0), (0.0, told)):
        assert runner.expected_seconds(replace(plan, seconds=seconds)) == expected


def test_each_name_has_a_log_of_its_last_run_with_any_text(tmp_path: Path) -> None:
    targets = {name: tmp_path / "results" / f"{name}.h5" for name in ("a", "b", "c: d")}
    log, other = targets["a"].with_suffix(".log"), tmp_path / "other"
    # What is in a log's place makes room: nothing is waited for, nothing written through a link.
    makes: list[Callable[[Path], object]] = [Path.touch, os.mkfifo, lambda x: x.symlink_to(other)]
    for make in makes:
        log.parent.mkdir(exist_ok=True)
        log.unlink(missing_ok=True)
        make(log)
        logs = Logs(targets, "run \udcff")
        logs.hear("a", "computing: now")
        logs.hear("a", "öäü")
        assert logs.path("a") == log
        assert lines(log) == ["run ?", "computing: now", "öäü"]
    assert not other.exists()
    assert logs.path("b") is None
    assert [x.name for x in log.parent.iterdir()] == ["a.log"]
    lost = Logs({"d": log / "d.h5"}, "run")
    assert (lost.hear("d", "nowhere"), lost.path("d")) == (False, None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "asked", "used"),
    [
        ("taylor", "1e-20", FINEST_TOLERANCE["taylor"]),
        ("taylor", "1e-9", 1e-9),
        ("scipy", "auto", DEFAULT_TOLERANCE["scipy"]),
    ],
)
def test_numerics_arrive_and_are_stored_as_they_were_used(
    desk: Path, monkeypatch: pytest.MonkeyPatch, engine: str, asked: str, used: float
) -> None:
    """A tolerance finer than the engine can keep is stored as the finest, not as written."""
    compute = Mock(wraps=route_codes.compute)
    monkeypatch.setattr(route_codes, "compute", compute)
    chosen = f"numerics.engine={engine}", f"numerics.tolerance={asked}"
    given = loading.load(CONFIG, ["problem.arrays.only.count=1", *chosen])
    planned = runner.plan(given, desk)
    runner.run(planned, jobs=1, report=tell_nobody)
    [((_, means), _)] = compute.call_args_list
    assert means.arithmetic == Arithmetic(engine, used, (53,))
    stored = store.attributes(planned.target)
    assert (stored["tolerance"], stored["precisions"].tolist()) == (used, [53])


def test_resolving_what_is_resolved_changes_nothing() -> None:
    once = resolve("scipy", "1e-20", (53, 64, 200))
    assert once == Arithmetic("scipy", FINEST_TOLERANCE["scipy"], (53, 200))
    assert resolve(*once) == once


TIMES = ("seconds", "created")
"""Attributes that tell times: of the run, and of the day."""


def seen(path: Path) -> tuple[Any, str]:
    """The data of a file, and all that can be told of its objects in their order but the times."""
    loaded, outline = store.load_outlined(path)
    for attributes in outline.values():
        for name in TIMES:
            attributes.pop(name, None)
    return loaded["data"], repr(outline)


RESUMED = {
    "fig3": "problem.bodies={b: [2, 1.04, 1.7], c: [2, 1, 1.2]}",
    "asymptotic_orbits": "problem.symbols=1; problem.columns=30; problem.drawn=1",
    "exponents": "problem.theta2_0.count=4; problem.log10_J1_0.count=3; problem.checked=2",
    "splitting": "problem.bodies={c: {A: [2, 1, 1.2], r: [1, 1, 0]}}; problem.drawn=c;"
    " problem.mu=[1e-2, 0.1]; problem.phases=9",
    "route_map": "problem.theta2_0.count=6; problem.rows.count=4; problem.zooms={}",
}
"""Configs, and settings with which they take little."""


@pytest.mark.slow
@pytest.mark.parametrize("name", RESUMED)
def test_a_resumed_file_is_the_fresh_one_but_for_its_times(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = FIG4.with_name(f"{name}.yaml")
    planned = runner.plan(loading.load(config, RESUMED[name].split("; ")), tmp_path, force=True)
    monkeypatch.setattr(Parts, "drop", lambda _: None)
    runner.run(planned, jobs=1, report=tell_nobody)
    fresh = tmp_path / "fresh.h5"
    shutil.move(planned.target, fresh)
    parts = sorted((tmp_path / f".{name}.parts").rglob("*.kept"))
    # As if it had been interrupted: one was not finished, all others were.
    if len(parts) > 1:
        parts[-1].unlink()
    said: list[str] = []
    runner.run(planned, jobs=1, report=said.append)
    assert said[0].startswith("continues from")
    (one, told), (other, told_again) = map(seen, (fresh, planned.target))
    assert told_again == told
    timed = [runner.SECONDS in store.attributes(x) for x in (fresh, planned.target)]
    assert timed == [True, False], "the rest of a run is no measure of a whole one"
    np.testing.assert_equal(other, one)
