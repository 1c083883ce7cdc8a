"""Logs: what was said of the last run of each name, beside its result."""

from __future__ import annotations

import datetime
from pathlib import Path

from rigidpend.runs.logs import Logs


def lines(path: Path) -> list[str]:
    """A log's lines without their times, which must be some."""
    found = [line.split(" ", 1) for line in path.read_text(encoding="utf-8").splitlines()]
    assert all(datetime.datetime.fromisoformat(time).tzinfo for time, _ in found)
    return [text for _, text in found]


def test_each_name_has_a_log_of_its_last_run_with_any_text(tmp_path: Path) -> None:
    targets = {name: tmp_path / "results" / f"{name}.h5" for name in ("a", "b", "c: d")}
    for text in ("first", "second \udcff"):
        logs = Logs(targets, text)
        logs.hear("a", "computing: now")
        logs.hear("a", "öäü")
    assert logs.path("a") == targets["a"].with_suffix(".log")
    assert lines(targets["a"].with_suffix(".log")) == ["second ?", "computing: now", "öäü"]
    assert logs.path("b") is None
    assert [x.name for x in targets["a"].parent.iterdir()] == ["a.log"]
