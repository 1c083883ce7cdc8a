"""Verdicts follow from value and bound; the table tells them all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from rigidpend.experiments.stress import FAILED, LIMIT, PASSED, draw
from rigidpend.experiments.stress.claims import Claim, Findings, Trial, tried
from rigidpend.results import store
from rigidpend.routes.problem import ProblemError
from tests.experiments.stress.verdicts import verdicts


def claim(name: str, bound: float, up_to: float = -math.inf) -> Claim:
    return Claim(name, bound, "what is measured", "the reason", "rad", "known why", up_to)


def trial(claims: list[Claim], *values: float, notes: Any = ()) -> Trial:
    return Trial("some_group", "t", claims, lambda: Findings(values, notes))


@pytest.mark.parametrize(
    ("value", "bound", "up_to", "verdict", "ratio"),
    [
        (1.0, 2.0, -math.inf, PASSED, 0.5),
        (2.0, 2.0, -math.inf, PASSED, 1.0),
        (3.0, 2.0, -math.inf, FAILED, 1.5),
        (3.0, 2.0, 3.0, LIMIT, 1.5),
        (3.1, 2.0, 3.0, FAILED, 1.55),
        (0.0, 0.0, -math.inf, PASSED, 0.0),
        (1.0, 0.0, -math.inf, FAILED, math.inf),
        (math.inf, 1.0, 3.0, FAILED, math.inf),
        (math.nan, 1.0, 9.0, FAILED, math.nan),
    ],
)
def test_verdict_and_ratio(
    value: float, bound: float, up_to: float, verdict: str, ratio: float
) -> None:
    made = claim("a", bound, up_to)
    assert made.verdict(value) == verdict
    assert made.ratio(value) == pytest.approx(ratio, nan_ok=True)


@pytest.mark.parametrize("error", [ProblemError("J1_0", "no such orbit"), ArithmeticError("stuck")])
def test_a_refusal_refutes_every_claim_of_its_trial(error: Exception) -> None:
    def refuse() -> Findings:
        raise error

    made: Any = tried(Trial("k", "t", [claim("a", 1.0), claim("b", 1.0, 9.0)], refuse))
    assert verdicts(made) == {"a": FAILED, "b": FAILED}
    assert {str(x["note"].values) for x in made["claims"].values()} == {f"refused: {error}"}


def test_a_claim_that_nothing_was_measured_of_fails_and_one_not_declared_is_refused() -> None:
    assert verdicts(trial([claim("a", 1.0), claim("b", 1.0)], 0.5)) == {"a": PASSED, "b": FAILED}
    with pytest.raises(ValueError, match="measured 2 values, declared 1 before"):
        tried(trial([claim("a", 1.0)], 0.5, 0.1))


def test_table_and_json_tell_what_was_stored(tmp_path: Path) -> None:
    claims = [claim("x", 2), claim("y", 2), claim("z", 2, 6)]
    made = tried(trial(claims, 1, math.inf, 5, notes=["", "much too far"]))
    path, attributes = tmp_path / "r.h5", {"experiment": "stress"}
    store.write(path, store.Result(attributes, {}, {}, {"some_group": made}))
    data = store.read_tree(path)
    told = json.loads(json.dumps(draw.summary(data), allow_nan=False))
    assert told["counts"] == {PASSED: 1, LIMIT: 1, FAILED: 1}
    assert [x["name"] for x in told["claims"]] == ["x", "y", "z"]
    assert told["claims"][1]["value"] == "inf"
    assert told["claims"][2]["reason"] == "the reason"
    said = list(draw.text(data))
    assert said[-1] == "1 passed, 1 limit, 1 FAILED"
    assert any(x.startswith("limit: some_group, z") and x.endswith("known why") for x in said)
    assert any("FAILED: some_group, y: what is measured; much too far" in x for x in said)
