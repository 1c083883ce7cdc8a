"""Runs: what is up to date and why not, what a result holds, what a failure leaves."""

from __future__ import annotations

import importlib.metadata
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import pytest

from rigidpend import experiments
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.machine.progress import tell_nobody
from rigidpend.orbits.integrate import arithmetic
from rigidpend.results import store
from rigidpend.runs import loading, provenance, runner
from tests.config.samples import SMALL, written


def run(loaded: loading.LoadedConfig, folder: Path) -> Path:
    planned = runner.plan(loaded, folder, force=True)
    runner.run(planned, jobs=1, report=tell_nobody)
    return planned.target


@pytest.fixture
def loaded(tmp_path: Path) -> loading.LoadedConfig:
    return loading.load(written(tmp_path, SMALL, "small.yaml"))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of the small config, computed once; not to be changed."""
    folder = tmp_path_factory.mktemp("made")
    return run(loading.load(written(folder, SMALL, "small.yaml")), folder)


@pytest.fixture
def out(tmp_path: Path, made: Path) -> Path:
    """A folder with a copy of the result."""
    folder = tmp_path / "out"
    folder.mkdir()
    shutil.copyfile(made, folder / made.name)
    return folder


def test_the_first_run_has_no_result_yet(loaded: loading.LoadedConfig, tmp_path: Path) -> None:
    planned = runner.plan(loaded, tmp_path / "none")
    assert planned.reason == "no result yet"
    assert planned.target == tmp_path / "none" / "small.h5"
    assert not (tmp_path / "none").exists()


CODE: list[str] = []
FORMAT: list[str] = []
"""No settings: the code, and the format of the result, are others."""
MU = "its config changed: problem.mu from 0.001 to 0.002"


@pytest.mark.parametrize(
    ("settings", "version", "force", "reason"),
    [
        ([], "", False, ""),
        (["problem.mu=1e-3"], "", False, ""),
        ([], "", True, "--force"),
        (["problem.mu=0.002"], "", False, MU),
        ([], "0.0", False, "the engine changed"),
        (["problem.mu=0.002"], "0.0", False, f"{MU}; the engine changed"),
        (CODE, "", False, "the code that computes it changed"),
        (FORMAT, "", False, "its result has another format version"),
    ],
)
def test_what_changed_is_the_reason(
    tmp_path: Path,
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    settings: list[str],
    version: str,
    force: bool,
    reason: str,
) -> None:
    if version:
        monkeypatch.setattr(importlib.metadata, "version", lambda _: version)
    if settings is CODE:
        monkeypatch.setattr(provenance, "code_hash", lambda _: "another")
    if settings is FORMAT:
        with h5py.File(out / "small.h5", "a") as file:
            file.attrs["format_version"] = store.FORMAT_VERSION + 1
    text = f"{SMALL}# A comment.\n"
    loaded = loading.load(written(tmp_path, text, "small.yaml"), [*settings])
    before = (out / "small.h5").read_bytes()
    assert runner.plan(loaded, out, force=force).reason == reason
    assert (out / "small.h5").read_bytes() == before


def test_a_result_says_what_it_was_made_from(loaded: loading.LoadedConfig, made: Path) -> None:
    planned = runner.plan(loaded, made.parent)
    with store.opened(made) as file:
        attributes = dict(file.attrs)
        assert attributes.pop("precisions").tolist() == [53]
        assert attributes.pop("seconds") > 0
        assert attributes.pop("tolerance") == arithmetic.DEFAULT_TOLERANCE[planned.config.engine]
        assert attributes == {
            "format": "rigidpend",
            "format_version": 1,
            "name": "small",
            "figure": loaded.content.figure,
            "experiment": "route_codes",
            **planned.fingerprint,
            "doubt": "",
        }
        assert json.loads(file["config"].asstr()[()]) == loaded.resolved()
        expected = set(provenance.provenance())
        assert set(file["provenance"].attrs) == expected


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_ends_early_leaves_the_old_result(
    loaded: loading.LoadedConfig,
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: type[BaseException],
) -> None:
    before = (out / "small.h5").read_bytes()

    def compute(*_: Any) -> Any:
        raise error

    monkeypatch.setattr(route_codes, "compute", compute)
    with pytest.raises(error):
        runner.run(runner.plan(loaded, out, force=True), jobs=1, report=tell_nobody)
    assert [path.name for path in out.iterdir()] == ["small.h5"]
    assert (out / "small.h5").read_bytes() == before


def test_a_result_whose_name_differs_in_case_only_is_not_made(tmp_path: Path) -> None:
    config = loading.load(written(tmp_path, SMALL, "small.yaml"))
    (tmp_path / "Small.h5").write_bytes(b"another")
    with pytest.raises(store.StoreError, match=r"Small\.h5 is there, and some systems take both"):
        runner.plan(config, tmp_path)
    # Where both are there, the system tells them apart.
    (tmp_path / "small.h5").write_bytes(b"this one")
    assert runner.plan(config, tmp_path, force=True).reason


def test_how_long_a_plan_takes_is_told_by_what_is_stored_or_else_by_its_experiment(
    loaded: loading.LoadedConfig, tmp_path: Path
) -> None:
    plan = runner.plan(loaded, tmp_path)
    told = experiments.cost(loaded.experiment, loaded.content)
    assert told
    for seconds, reason, expected in ((7.0, "", 7.0), (7.0, "x", 7.0), (0.0, "x", told)):
        found = replace(plan, reason=reason, seconds=seconds)
        assert runner.expected_seconds(found) == expected
    assert runner.expected_seconds(replace(plan, reason="")) is None
