"""The experiment `stress`: every trial a part, verdicts compared, the command's exit code."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rigidpend.cli.stress import command
from rigidpend.config import catalogue
from rigidpend.experiments.contract import Means
from rigidpend.experiments.stress import compute as stress
from rigidpend.experiments.stress.schema import Config
from rigidpend.integrate.arithmetic import resolve
from rigidpend.measure.stress.cases import Case, tree
from rigidpend.results import store
from tests.config.samples import content as typed
from tests.config.samples import refused

CONFIGS = Path(__file__).parents[3] / "configs" / "measure"


def case(name: str, value: float, bound: float = 1.0, limit: str = "") -> Case:
    return Case(name, "what is measured", "rad", value, bound, "why", limit)


@pytest.fixture
def given() -> Any:
    return typed(Config, CONFIGS / "stress_quick.yaml")


def means(**replaced: Any) -> Means:
    return Means(resolve("taylor"), 1, lambda _: None)._replace(**replaced)


@pytest.mark.parametrize("name", ["stress", "stress_quick"])
def test_configs_ask_for_every_trial_under_its_own_name(name: str) -> None:
    asked = typed(Config, CONFIGS / f"{name}.yaml")
    trials = list(stress._trials(asked.problem, means()))
    labels = [f"{x.group}.{stress._label(x.name)}" for x in trials]
    assert len(set(labels)) == len(labels) > 75
    assert {x.group for x in trials} == {
        "symmetries",
        *stress.GROUPS,
        "separatrices",
        "passages",
        "honesty",
        "long_time",
    }


def test_without_heyoka_the_other_engine_is_tried(given: Any) -> None:
    names = [x.name for x in stress._trials(given.problem, means(engine="scipy"))]
    assert not any("taylor" in x for x in names)
    assert any("scipy" in x for x in names)


def test_cases_of_one_group_come_together(given: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def trials(*_: Any) -> Any:
        yield stress.Trial("a", "first = 1", lambda: tree([case("x", 0.5)]))
        yield stress.Trial("a", "second", lambda: tree([case("y", 2.0)], {"c": tree([])}))
        yield stress.Trial("b", "third", lambda: tree([case("z", 2.0, limit="known")]))

    monkeypatch.setattr(stress, "_trials", trials)
    said: list[str] = []
    kept: list[str] = []

    def part(name: str, compute: Any) -> Any:
        kept.append(name)
        return compute()

    made: Any = stress.compute(given, means(report=said.append, part=part))
    assert kept == ["a.first_1", "a.second", "b.third"]
    assert list(made["a"]["cases"]) == ["x", "y"]
    assert list(made["a"]["curves"]) == ["second"]
    told = ["2/3: a, second: FAILED", "3/3: b, third: limit"]
    assert [x.rpartition(", ")[0] for x in said[1:]] == told


def test_differences_are_in_cases_and_verdicts_not_in_values() -> None:
    stored: Any = {
        "a": {"cases": {"x": {"verdict": "passed", "value": 1}, "y": {"verdict": "limit"}}}
    }
    fresh = copy.deepcopy(stored)
    fresh["a"]["cases"]["x"]["value"] = 2
    assert stress.differences(stored, fresh) == []
    fresh["a"]["cases"]["x"]["verdict"] = "FAILED"
    del fresh["a"]["cases"]["y"]
    found = stress.differences(stored, fresh)
    assert found == ["a/y is in one file only", "a/x: passed stored, FAILED computed"]
    assert stress.differences(fresh, fresh) == ["a/x: FAILED"]


def test_describe_tells_how_much_is_tried(given: Any) -> None:
    rows = {row.name: row.value for row in stress.describe(given)}
    assert rows["long time"] == "10000 rotations, 16 orbits"
    assert rows["honesty"] == "3000 orbits"


@pytest.mark.parametrize(("value", "code"), [(0.5, 0), (2.0, 1)])
def test_command_draws_tells_and_ends_as_the_cases_do(
    value: float, code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from rigidpend import render

    def trials(*_: Any) -> Any:
        yield stress.Trial("a", "first", lambda: tree([case("x", value)]))

    def drawn(source: Path, target: Path) -> None:
        store.replace(target, store.load(source)["attributes"]["experiment"].encode())

    monkeypatch.setattr(stress, "_trials", trials)
    monkeypatch.setattr(render, "render", drawn)
    result = CliRunner().invoke(command, ["--quick", "--json", "--out", str(tmp_path)])
    assert result.exit_code == code, result.output
    found = json.loads(result.stdout)
    assert found["cases"][0]["value"] == value
    assert found["counts"]["FAILED"] == code
    assert "1/1: a, first" in result.stderr
    assert (tmp_path / "stress_quick.png").read_bytes() == b"stress"
    again = CliRunner().invoke(command, ["--quick", "--out", str(tmp_path)])
    assert "is up to date" in again.stderr
    assert f"{code} FAILED" in again.stdout


@pytest.mark.parametrize("tolerance", ["1e-14", "0.1"])
def test_a_spoilt_tolerance_is_neither_fine_nor_meaningless(tolerance: str) -> None:
    found, *_ = refused(catalogue.known()["stress"], [f"problem.honesty.tolerances=[{tolerance}]"])
    assert f"a spoilt tolerance is from 1e-13 to 0.01, got {tolerance}" in str(found)
