"""Logs: what was said of the last run of each name, beside its result."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest

from rigidpend.runs.logs import Logs


def lines(path: Path) -> list[str]:
    """A log's lines without their times, which must be some."""
    found = [line.split(" ", 1) for line in path.read_text(encoding="utf-8").splitlines()]
    assert all(datetime.datetime.fromisoformat(time).tzinfo for time, _ in found)
    return [text for _, text in found]


@pytest.fixture
def targets(tmp_path: Path) -> dict[str, Path]:
    return {name: tmp_path / "results" / f"{name}.h5" for name in ("a", "b", "c: d")}


def test_each_name_has_its_own_log_as_it_goes(targets: dict[str, Path]) -> None:
    logs = Logs(targets, "run a b")
    logs.hear("a", "computing: now")
    assert lines(targets["a"].with_suffix(".log")) == ["run a b", "computing: now"]
    assert logs.path("a") == targets["a"].with_suffix(".log")
    assert logs.path("b") is None
    assert [x.name for x in targets["a"].parent.iterdir()] == ["a.log"]


def test_the_log_is_that_of_the_last_run(targets: dict[str, Path]) -> None:
    for text in ("first", "second"):
        Logs(targets, text).hear("a", f"{text}, {text}")
    assert lines(targets["a"].with_suffix(".log")) == ["second", "second, second"]


def test_any_text_can_be_logged(targets: dict[str, Path]) -> None:
    Logs(targets, "run \udcff").hear("a", "öäü")
    assert lines(targets["a"].with_suffix(".log")) == ["run ?", "öäü"]
