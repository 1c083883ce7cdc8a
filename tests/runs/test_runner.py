"""Runs: what is up to date and why not, what a result and a log hold, what a failure leaves."""

from __future__ import annotations

import datetime
import importlib.metadata
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import h5py
import pytest

from rigidpend import experiments
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.machine import cache, files
from rigidpend.machine.progress import tell_nobody
from rigidpend.orbits.integrate import arithmetic
from rigidpend.results import store
from rigidpend.runs import loading, provenance, runner
from rigidpend.runs.logs import Logs

CONFIG, RESULTS, RESULT = Path("configs/small.yaml"), Path("results"), Path("results/small.h5")
MU = "its config changed: problem.mu from 0.001 to 0.002"


def other_format(_: pytest.MonkeyPatch) -> None:
    with h5py.File(RESULT, "a") as file:
        file.attrs["format_version"] = store.FORMAT_VERSION + 1


@pytest.mark.parametrize(
    ("settings", "change", "force", "reason"),
    [
        ([], None, False, ""),
        (["problem.mu=1e-3"], None, False, ""),
        ([], None, True, "--force"),
        ([], lambda _: RESULT.unlink(), False, "no result yet"),
        (
            ["problem.mu=0.002"],
            lambda patch: patch.setattr(importlib.metadata, "version", lambda _: "0.0"),
            False,
            f"{MU}; the engine changed",
        ),
        (
            [],
            lambda patch: patch.setattr(provenance, "code_hash", lambda _: "another"),
            False,
            "the code that computes it changed",
        ),
        ([], other_format, False, "its result has another format version"),
    ],
)
def test_what_changed_is_the_reason(
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    settings: list[str],
    change: Callable[[pytest.MonkeyPatch], None] | None,
    force: bool,
    reason: str,
) -> None:
    CONFIG.write_text(f"{CONFIG.read_text()}# A comment.\n")
    if change:
        change(monkeypatch)
    before = RESULT.read_bytes() if RESULT.exists() else b""
    assert runner.plan(loading.load(CONFIG, settings), RESULTS, force=force).reason == reason
    assert (RESULT.read_bytes() if RESULT.exists() else b"") == before


def test_a_result_says_what_it_was_made_from(desk: Path) -> None:
    planned = runner.plan(loading.load(CONFIG), RESULTS)
    with store.opened(RESULT) as file:
        attributes = dict(file.attrs)
        assert attributes.pop("precisions").tolist() == [53]
        assert attributes.pop("seconds") > 0
        assert attributes.pop("tolerance") == arithmetic.DEFAULT_TOLERANCE[planned.config.engine]
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


def test_a_run_that_ends_early_leaves_the_old_result(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = RESULT.read_bytes()
    monkeypatch.setattr(route_codes, "compute", Mock(side_effect=KeyboardInterrupt))
    planned = runner.plan(loading.load(CONFIG), RESULTS, force=True)
    with pytest.raises(KeyboardInterrupt):
        runner.run(planned, jobs=1, report=tell_nobody)
    assert sorted(path.name for path in RESULTS.iterdir()) == ["reference", "small.h5"]
    assert RESULT.read_bytes() == before


def test_a_result_whose_name_differs_in_case_only_is_not_made(desk: Path) -> None:
    config = loading.load(CONFIG)
    (desk / "Small.h5").write_bytes(b"another")
    with pytest.raises(store.StoreError, match=r"Small\.h5 is there, and some systems take both"):
        runner.plan(config, desk)
    # Where both are there, the system tells them apart.
    (desk / "small.h5").write_bytes(b"this one")
    assert runner.plan(config, desk, force=True).reason


def test_how_long_a_plan_takes_is_told_by_what_is_stored_or_else_by_its_experiment(
    desk: Path,
) -> None:
    plan = runner.plan(loading.load(CONFIG), desk)
    told = experiments.cost("route_codes", plan.config.content)
    assert told
    for seconds, reason, expected in ((7.0, "", 7.0), (7.0, "x", 7.0), (0.0, "x", told)):
        found = replace(plan, reason=reason, seconds=seconds)
        assert runner.expected_seconds(found) == expected
    assert runner.expected_seconds(replace(plan, reason="")) is None


def plan(*settings: str) -> runner.Plan:
    return runner.plan_kept(loading.load(CONFIG, settings), CONFIG, RESULTS, settings)


def recalled(*settings: str) -> runner.Plan | None:
    return runner.recalled(CONFIG, RESULTS, settings)


def test_a_plan_is_recalled_as_it_was_found_for_the_same_bytes_alone(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "folder", lambda: desk / "cache")
    assert recalled() is None
    planned = plan()
    left = RESULTS / ".small.h5.abc.part"
    left.write_bytes(b"half")
    found = recalled()
    assert found is not None
    assert not left.exists()
    assert found == replace(planned, config=None, seconds=0.0)
    # Other engines, another package and other settings tell nothing.
    for name, other in (("provenance.version", "0.0"), ("package_digest", "other")):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(f"rigidpend.runs.runner.{name}", lambda *_, other=other: other)
            assert recalled() is None
    assert recalled("problem.mu=0.002") is None
    assert plan("problem.mu=0.002").reason == MU
    again = recalled("problem.mu=0.002")
    assert again is not None
    assert again.reason == MU
    # Nor does another name.
    shutil.copy(CONFIG, "configs/con.yaml")
    shutil.copy(RESULT, "results/con.h5")
    assert runner.recalled(Path("configs/con.yaml"), RESULTS) is None
    # Nor do other bytes of the result, none, a twin of it, another text, and a damaged memory.
    content = bytearray(RESULT.read_bytes())
    content[len(content) // 2] ^= 1
    RESULT.write_bytes(content)
    assert recalled() is None
    with pytest.raises(files.StoreError, match="damaged"):
        plan()
    RESULT.unlink()
    # A member of a sweep of the same file has values of its own.
    member = replace(loading.load(CONFIG, ["problem.mu=0.002"]), name="small_mu=0.002")
    assert runner.plan_kept(member, CONFIG, RESULTS).reason == "no result yet"
    assert recalled() is None
    assert plan().reason == "no result yet"
    assert recalled() is not None
    twin = RESULTS / "Small.h5"
    twin.write_bytes(b"")
    assert recalled() is None
    twin.unlink()
    text = CONFIG.read_text()
    CONFIG.write_text(f"{text}# A comment.\n")
    assert recalled() is None
    CONFIG.write_text(text)
    for path in (desk / "cache" / "plans").iterdir():
        path.write_bytes(files.sealed(b"[1]"))
    with pytest.warns(cache.KeptFileWarning):
        assert recalled() is None


def lines(path: Path) -> list[str]:
    """A log's lines without their times, which must be some."""
    found = [line.split(" ", 1) for line in path.read_text(encoding="utf-8").splitlines()]
    assert all(datetime.datetime.fromisoformat(time).tzinfo for time, _ in found)
    return [text for _, text in found]


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
