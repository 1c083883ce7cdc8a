"""The experiment `stress`: every trial a part, verdicts compared, the command's exit code."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from click.testing import CliRunner

from rigidpend import render
from rigidpend.cli.measure import stress_command
from rigidpend.experiments.contract import Means
from rigidpend.experiments.stress import compute as stress
from rigidpend.experiments.stress import extremes, scenes
from rigidpend.experiments.stress.scenes import Claim, Trial
from rigidpend.experiments.stress.schema import Addresses, Extremes, LongTime
from rigidpend.results import store
from rigidpend.routes.problem import ProblemError
from tests.cli.calls import REFERENCE
from tests.experiments.stress.verdicts import asked, verdicts
from tests.experiments.trees import differences


def trials(config: str) -> list[Trial]:
    return list(stress.trials(asked(config=config), 1))


def test_every_claim_is_that_of_the_stored_trials_with_the_bound_that_was_declared() -> None:
    """Theory or other orbits gave it, as its reason says; so of how far a known limit goes."""
    stored = store.load(REFERENCE.parent / "measured" / "stress.h5")["data"]
    every, quick = trials("stress"), trials("stress_quick")
    assert list(dict.fromkeys(x.kind for x in every)) == list(stored)
    assert len({f"{x.kind}.{x.label}" for x in every}) == len(every)
    for kind, group in stored.items():
        claims = [claim for each in every if each.kind == kind for claim in each.claims]
        for key in ("name", "unit"):
            assert [getattr(x, key) for x in claims] == group["claims"][key].tolist()
        bounds = [[x.bound, max(x.bound, x.up_to)] for x in claims]
        np.testing.assert_allclose(
            np.transpose(bounds), [group["claims"][key] for key in ("bound", "up_to")], rtol=1e-12
        )
    # The small config leaves out what takes long, and what a config leaves out the full one says.
    assert {x.name for x in every} - {x.name for x in quick} >= {"near-spherical, J1_0 = 1e-80"}
    assert list(dict.fromkeys(x.kind for x in quick)) == list(stored)
    full = asked(config="stress")
    assert (full.long_time, full.extremes, full.addresses) == (LongTime(), Extremes(), Addresses())


def trial(kind: str, name: str, claim: str, value: float, up_to: float = 0.0) -> Trial:
    """A trial of one claim, of bound 1."""
    declared = Claim(claim, 1.0, "what is measured", "why", "rad", "known", up_to)
    return Trial(kind, name, (declared,), lambda: ([value], {}))


def test_claims_of_one_group_come_together(monkeypatch: pytest.MonkeyPatch) -> None:
    every = [trial("a", "first = 1", "x", 0.5), trial("a", "second", "y", 2.0)]
    every += [trial("b", "third", "z", 2.0, 2.0)]
    monkeypatch.setattr(stress, "trials", lambda *_: every)
    said: list[str] = []
    kept: list[str] = []

    def part(name: str, compute: Any) -> Any:
        kept.append(name)
        return compute() | ({"curves": {"second": 1}} if name == "a.second" else {})

    config: Any = type("Config", (), {"problem": None})
    made: Any = stress.compute(config, Means(report=said.append, part=part))
    assert kept == ["a.first_1", "a.second", "b.third"]
    assert made["a"]["claims"]["name"].tolist() == ["x", "y"]
    assert list(made["a"]["curves"]) == ["second"]
    told = ["2/3: a, second: FAILED", "3/3: b, third: limit"]
    assert [x.rpartition(", ")[0] for x in said[1:]] == told


def test_results_differ_by_a_verdict_and_by_no_value() -> None:
    verdicts = np.array(["passed", "limit"], dtype=object)
    stored: Any = {"a": {"claims": {"verdict": verdicts, "value": np.array([1, 3])}}}
    fresh = copy.deepcopy(stored)
    fresh["a"]["claims"]["value"][0] = 2
    assert differences("stress", stored, fresh) == []
    fresh["a"]["claims"]["verdict"][0] = "FAILED"
    found = differences("stress", stored, fresh)
    assert found == ["a/claims/verdict[0]: stored passed, computed FAILED"]


@pytest.mark.slow
@pytest.mark.parametrize(("value", "told", "code"), [(0.5, 0.5, 0), (float("inf"), None, 1)])
def test_command_draws_tells_and_ends_as_the_claims_do(
    value: float, told: Any, code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    every = [trial("a", "first", "x", value), trial("b", "second", "y", 0.5)]
    monkeypatch.setattr(stress, "trials", lambda *_: every)
    monkeypatch.setattr(render, "render", lambda _, target: target.write_text("drawn"))
    result = CliRunner().invoke(stress_command, ["--quick", "--json", "--out", str(tmp_path)])
    assert result.exit_code == code, result.output
    found = json.loads(result.stdout)
    assert found["data"]["a"]["claims"]["value"] == [told]
    assert "1/2: a, first" in result.stderr
    assert store.load(tmp_path / "stress_quick.h5")["attributes"]["experiment"] == "stress"
    assert (tmp_path / "stress_quick.png").read_bytes() == b"drawn"
    again = CliRunner().invoke(stress_command, ["--quick", "--out", str(tmp_path)])
    assert "is up to date" in again.stderr
    assert again.exit_code == code
    assert ("Beyond their bounds" in again.stdout) == bool(code)
    forced = CliRunner().invoke(stress_command, ["--quick", "--force", "--out", str(tmp_path)])
    assert "1/2: a, first" in forced.stderr


def test_a_route_codes_that_always_refuses_fails_everything_that_needs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """No limit is written by the case itself: what refuses has refuted what was claimed."""

    monkeypatch.setattr(scenes, "routes", Mock(side_effect=ProblemError("J1_0", "not today")))
    # All trials of a group of extremes are made alike.
    first = {x.kind: x for x in reversed(trials("stress_quick")) if x.kind in extremes.GROUPS}
    others = [x for x in trials("stress_quick") if x.kind in ("honesty", "symmetries")]
    assert (len(first), len(others)) == (4, 5 + 1)
    for each in (*first.values(), *others):
        made = each.tried()
        assert (set(verdicts(made).values()), made["curves"]) == ({"FAILED"}, {}), each.name
