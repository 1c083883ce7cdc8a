"""Verdicts follow from value and bound; the table tells them all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from rigidpend.experiments.stress import report
from rigidpend.experiments.stress.layout import FAILED, LIMIT, PASSED
from rigidpend.experiments.stress.trials.claims import (
    Claim,
    Findings,
    Limit,
    Trial,
    tree,
    tried,
)
from rigidpend.results import store
from rigidpend.routes.problem import ProblemError


def claim(bound: float, up_to: float | None = None, name: str = "a") -> Claim:
    limit = None if up_to is None else Limit("known why", up_to)
    return Claim(name, bound, "what is measured", "the reason", "rad", limit)


@pytest.mark.parametrize(
    ("value", "bound", "up_to", "verdict", "ratio"),
    [
        (1.0, 2.0, None, PASSED, 0.5),
        (2.0, 2.0, None, PASSED, 1.0),
        (3.0, 2.0, None, FAILED, 1.5),
        (3.0, 2.0, 3.0, LIMIT, 1.5),
        (3.1, 2.0, 3.0, FAILED, 1.55),
        (1.0, 2.0, 3.0, PASSED, 0.5),
        (0.0, 0.0, None, PASSED, 0.0),
        (1.0, 0.0, None, FAILED, math.inf),
        (math.inf, 1.0, None, FAILED, math.inf),
        (math.inf, 1.0, 3.0, FAILED, math.inf),
    ],
)
def test_verdict_and_ratio(
    value: float, bound: float, up_to: float | None, verdict: str, ratio: float
) -> None:
    made = claim(bound, up_to)
    assert made.verdict(value) == verdict
    assert made.ratio(value) == pytest.approx(ratio)


@pytest.mark.parametrize("up_to", [None, 9.0])
def test_what_could_not_be_measured_fails_whatever_limit_is_declared(up_to: float | None) -> None:
    assert claim(1.0, up_to).verdict(math.nan) == FAILED


@pytest.mark.parametrize("error", [ProblemError("J1_0", "no such orbit"), ArithmeticError("stuck")])
def test_a_refusal_refutes_every_claim_of_its_trial(error: Exception) -> None:
    def refuse() -> Findings:
        raise error

    made: Any = tried(Trial("t", (claim(1.0), claim(1.0, math.inf, "b")), refuse))
    assert [str(x["verdict"].values) for x in made["claims"].values()] == [FAILED] * 2
    for each in made["claims"].values():
        assert str(each["note"].values) == f"refused: {error}"


def test_a_claim_that_nothing_was_measured_of_fails() -> None:
    made: Any = tree([claim(1.0), claim(1.0, name="b")], Findings([0.5]))
    verdicts = {name: str(x["verdict"].values) for name, x in made["claims"].items()}
    assert verdicts == {"a": PASSED, "b": FAILED}


def test_what_was_not_declared_before_is_refused() -> None:
    with pytest.raises(ValueError, match="measured 2 values, declared 1 before"):
        tree([claim(1.0)], Findings([0.5, 0.1]))


def test_table_and_json_tell_what_was_stored(tmp_path: Path) -> None:
    claims = [claim(2, name="x"), claim(2, name="y"), claim(2, 6, "z")]
    found = Findings([1, math.inf, 5], notes=["", "much too far"])
    path = tmp_path / "r.h5"
    store.write(
        path, store.Result({"experiment": "stress"}, {}, {}, {"some_group": tree(claims, found)})
    )
    data = store.read_tree(path)
    assert report.counts(data) == {PASSED: 1, LIMIT: 1, FAILED: 1}
    told = json.loads(json.dumps(report.summary(data), allow_nan=False))
    assert [x["name"] for x in told["claims"]] == ["x", "y", "z"]
    assert told["claims"][1]["value"] == "inf"
    assert told["claims"][2]["reason"] == "the reason"
    said = list(report.text(data))
    assert said[-1] == "1 passed, 1 limit, 1 FAILED"
    assert any(x.startswith("limit: some_group, z") and x.endswith("known why") for x in said)
    assert any(x.startswith("FAILED: some_group, y") and x.endswith("too far") for x in said)
