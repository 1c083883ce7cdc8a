"""What plans remember: configs and results are recalled from the same bytes by the same code."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from rigidpend.machine import cache, files, kept, memory
from rigidpend.results import store
from rigidpend.runs import loading, recalled, runner
from tests.config.samples import SMALL, written


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a config, where no earlier process has remembered anything."""
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "cache")
    forget()
    written(tmp_path, SMALL, "small.yaml")
    return tmp_path


def forget() -> None:
    """Become another process, as far as memory goes."""
    recalled.memory_of.cache_clear()


@pytest.fixture
def made(fresh: Path) -> Path:
    planned = runner.plan(loading.load(fresh / "small.yaml"), fresh, force=True)
    runner.run(planned, jobs=1, report=lambda _: None)
    return planned.target


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of what is read in earnest from now on."""
    calls: list[str] = []
    load, attributes = loading.load, store.attributes

    def loads(path: Path, *given: Any) -> Any:
        # A config of the paper is compared with the shipped ones, which are loaded for that.
        calls.extend(["load"] if path.name == "small.yaml" else [])
        return load(path, *given)

    def opens(*given: Any) -> Any:
        calls.append("open")
        return attributes(*given)

    monkeypatch.setattr(loading, "load", loads)
    monkeypatch.setattr(store, "attributes", opens)
    return calls


def plan(folder: Path, *settings: str) -> runner.Plan:
    forget()
    return runner.plan(recalled.load(folder / "small.yaml", settings), folder)


def test_a_plan_is_the_same_without_reading_config_and_result_again(
    made: Path, counted: list[str]
) -> None:
    first = plan(made.parent)
    assert counted == ["load", "open"]
    again = plan(made.parent)
    assert counted == ["load", "open"]
    assert first.reason == again.reason == ""
    assert (first.fingerprint, first.doubt, first.seconds) == (
        again.fingerprint,
        again.doubt,
        again.seconds,
    )
    assert again.config.resolved() == first.config.resolved()


def test_another_text_and_other_settings_are_other_configs(made: Path, counted: list[str]) -> None:
    plan(made.parent)
    assert plan(made.parent, "problem.mu=0.002").reason.startswith("its config changed")
    config = made.parent / "small.yaml"
    config.write_text(config.read_text().replace("mu: 0.001", "mu: 0.003"))
    assert "0.003" in plan(made.parent).reason
    assert counted.count("load") == 3


def test_other_code_of_a_schema_or_a_layout_reads_again(
    made: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan(made.parent)
    monkeypatch.setattr(recalled, "part_code", lambda *_: "other")
    plan(made.parent)
    assert counted == ["load", "open"] * 2


def test_a_damaged_result_is_noticed_whatever_is_remembered(made: Path) -> None:
    plan(made.parent)
    content = bytearray(made.read_bytes())
    content[len(content) // 2] ^= 1
    made.write_bytes(content)
    with pytest.raises(files.StoreError, match="damaged"):
        plan(made.parent)


def test_a_result_of_another_config_is_not_taken_for_the_one_before(made: Path) -> None:
    plan(made.parent)
    other = runner.plan(
        loading.load(made.parent / "small.yaml", ["problem.mu=0.002"]),
        made.parent / "other",
        force=True,
    )
    runner.run(other, jobs=1, report=lambda _: None)
    shutil.copyfile(other.target, made)
    assert "its config changed" in plan(made.parent).reason


def test_a_config_that_changes_between_plan_and_run_is_not_computed(
    made: Path, counted: list[str]
) -> None:
    plan(made.parent)
    made.unlink()
    planned = plan(made.parent)
    assert planned.reason == "no result yet"
    config = made.parent / "small.yaml"
    config.write_text(config.read_text().replace("mu: 0.001", "mu: 0.003"))
    with pytest.raises(files.StoreError, match="changed meanwhile"):
        runner.run(planned, jobs=1, report=lambda _: None)
    assert not made.exists()


def test_a_config_that_is_refused_is_not_remembered(fresh: Path, counted: list[str]) -> None:
    config = fresh / "small.yaml"
    config.write_text(config.read_text().replace("mu: 0.001", "mu: -1"))
    for _ in range(2):
        with pytest.raises(loading.ConfigError):
            plan(fresh)
    assert counted == ["load", "load"]


def test_a_memory_that_was_damaged_is_made_again(made: Path, counted: list[str]) -> None:
    plan(made.parent)
    paths = list((made.parent / "cache" / "plans").iterdir())
    assert len(paths) >= 2
    for path in paths:
        path.write_bytes(files.sealed(b"[1]"))
    with pytest.warns(kept.KeptFileWarning):
        assert plan(made.parent).reason == ""
    assert counted == ["load", "open"] * 2


def test_a_memory_that_is_full_keeps_what_is_in_use(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MOST", 3)
    for name in "abc":
        one = memory.Memory("full")
        one.put(name, name)
        one.save()
    last = memory.Memory("full")
    assert last.get("b") == "b"
    last.put("d", "d")
    last.save()
    kept = memory.Memory("full")
    assert [kept.get(name) for name in "abcd"] == [None, "b", None, "d"]
