"""Verdicts follow from value and bound; the table tells them all."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from rigidpend.measure.stress import table
from rigidpend.measure.stress.cases import FAILED, LIMIT, PASSED, Case, tree
from rigidpend.results import store


def case(value: float, bound: float, limit: str = "", name: str = "a") -> Case:
    return Case(name, "what is measured", "rad", value, bound, "the reason", limit)


@pytest.mark.parametrize(
    ("value", "bound", "limit", "verdict", "ratio"),
    [
        (1.0, 2.0, "", PASSED, 0.5),
        (2.0, 2.0, "", PASSED, 1.0),
        (3.0, 2.0, "", FAILED, 1.5),
        (3.0, 2.0, "known", LIMIT, 1.5),
        (1.0, 2.0, "known", PASSED, 0.5),
        (0.0, 0.0, "", PASSED, 0.0),
        (1.0, 0.0, "", FAILED, math.inf),
        (math.inf, 1.0, "", FAILED, math.inf),
    ],
)
def test_verdict_and_ratio(
    value: float, bound: float, limit: str, verdict: str, ratio: float
) -> None:
    made = case(value, bound, limit)
    assert (made.verdict, made.ratio) == (verdict, ratio)


def test_what_could_not_be_measured_fails() -> None:
    assert case(math.nan, 1.0).verdict == FAILED


def test_table_and_json_tell_what_was_stored(tmp_path: Path) -> None:
    cases = [case(1, 2, name="x"), case(math.inf, 2, name="y"), case(5, 2, "known why", name="z")]
    path = tmp_path / "r.h5"
    store.write(path, store.Result({}, "", {}, {"some_group": tree(cases)}))
    data = store.read_tree(path, part=True)
    assert table.counts(data) == {PASSED: 1, LIMIT: 1, FAILED: 1}
    found = json.loads(json.dumps(table.summary(data), allow_nan=False))
    assert [x["name"] for x in found["cases"]] == ["x", "y", "z"]
    assert found["cases"][1]["value"] == "inf"
    assert found["cases"][2]["reason"] == "the reason"
    said = list(table.text(data))
    assert said[-1] == "1 passed, 1 limit, 1 FAILED"
    assert any(x.startswith("limit: some_group, z") and x.endswith("known why") for x in said)
    assert any(x.startswith("FAILED: some_group, y") for x in said)
