"""What plans remember: configs and results are recalled from the same bytes by the same package."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from rigidpend.machine import cache, files
from rigidpend.results import store
from rigidpend.runs import loading, recalled, runner
from tests.config.samples import SMALL, written


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A config with its result, where no earlier process has remembered anything."""
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "cache")
    config = loading.load(written(tmp_path, SMALL, "small.yaml"))
    planned = runner.plan(config, tmp_path, force=True)
    runner.run(planned, jobs=1, report=lambda _: None)
    return planned.target


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of what is read in earnest from now on."""
    calls: list[str] = []
    load, attributes = loading.load_groups, store.attributes

    def noted(call: Any, name: str) -> Any:
        def noting(*given: Any) -> Any:
            calls.append(name)
            return call(*given)

        return noting

    monkeypatch.setattr(loading, "load_groups", noted(load, "load"))
    monkeypatch.setattr(store, "attributes", noted(attributes, "open"))
    return calls


def plan(folder: Path, *settings: str) -> runner.Plan:
    [group] = recalled.load_groups([folder / "small.yaml"], settings)
    [config] = group.members
    return runner.plan(config, folder)


def edit(folder: Path, mu: str) -> None:
    config = folder / "small.yaml"
    config.write_text(config.read_text().replace("mu: 0.001", f"mu: {mu}"))


def test_a_plan_is_the_same_without_reading_config_and_result_again(
    made: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, again = plan(made.parent), plan(made.parent)
    assert counted == ["load", "open"]
    assert first.reason == again.reason == ""
    assert (first.fingerprint, first.doubt, first.seconds) == (
        again.fingerprint,
        again.doubt,
        again.seconds,
    )
    assert again.config.resolved() == first.config.resolved()
    # Another package, and other bytes of a memory, are asked nothing.
    monkeypatch.setattr(recalled, "package_digest", lambda: "other")
    plan(made.parent)
    assert counted == ["load", "open"] * 2
    for path in (made.parent / "cache" / "plans").iterdir():
        path.write_bytes(files.sealed(b"[1]"))
    with pytest.warns(cache.KeptFileWarning):
        assert plan(made.parent).reason == ""
    assert counted == ["load", "open"] * 3


def test_another_text_other_settings_and_another_name_are_other_configs(
    made: Path, counted: list[str]
) -> None:
    plan(made.parent)
    assert plan(made.parent, "problem.mu=0.002").reason.startswith("its config changed")
    edit(made.parent, "0.003")
    assert "0.003" in plan(made.parent).reason
    shutil.copy(made.parent / "small.yaml", made.parent / "con.yaml")
    with pytest.raises(loading.ConfigError, match="device"):
        recalled.load_groups([made.parent / "con.yaml"])
    assert counted.count("load") == 4


def test_a_new_config_is_read_beside_one_that_is_known(made: Path) -> None:
    plan(made.parent)
    paths = [made.parent / "small.yaml", made.parent / "other.yaml"]
    shutil.copy(*paths)
    assert [group.path for group in recalled.load_groups(paths)] == paths
    [named] = recalled.load_groups(paths[:1], name="mine")
    assert [config.name for config in named.members] == ["mine"]


def test_a_damaged_result_and_one_of_another_config_are_noticed(made: Path) -> None:
    plan(made.parent)
    content = bytearray(made.read_bytes())
    content[len(content) // 2] ^= 1
    made.write_bytes(content)
    with pytest.raises(files.StoreError, match="damaged"):
        plan(made.parent)
    config = loading.load(made.parent / "small.yaml", ["problem.mu=0.002"])
    other = runner.plan(config, made.parent / "other", force=True)
    runner.run(other, jobs=1, report=lambda _: None)
    shutil.copyfile(other.target, made)
    assert "its config changed" in plan(made.parent).reason


def test_a_config_that_changes_between_plan_and_run_is_not_computed(made: Path) -> None:
    plan(made.parent)
    made.unlink()
    planned = plan(made.parent)
    assert planned.reason == "no result yet"
    edit(made.parent, "0.003")
    with pytest.raises(files.StoreError, match="changed meanwhile"):
        runner.run(planned, jobs=1, report=lambda _: None)
    assert not made.exists()


def test_a_config_that_is_refused_is_not_remembered(made: Path, counted: list[str]) -> None:
    edit(made.parent, "-1")
    for _ in range(2):
        with pytest.raises(loading.ConfigError):
            plan(made.parent)
    assert counted == ["load", "load"]
