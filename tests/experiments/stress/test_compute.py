"""The experiment `stress`: every trial a part, verdicts compared, the command's exit code."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from rigidpend.cli.stress import command
from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from rigidpend.experiments.contract import Means
from rigidpend.experiments.stress import compute as stress
from rigidpend.experiments.stress.schema import Config
from rigidpend.experiments.stress.trials import (
    claims,
    extremes,
    honesty,
    passages,
    spoilt_maps,
    symmetries,
)
from rigidpend.experiments.stress.trials.claims import (
    Claim,
    Findings,
    Limit,
    Trial,
)
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.results import store
from rigidpend.routes.problem import ProblemError
from rigidpend.runs import loading
from tests.config.samples import content as typed
from tests.config.samples import refused
from tests.experiments.trees import differences

CONFIGS = Path(__file__).parents[3] / "configs" / "measure"


def trial(name: str, claim: str, value: float, limit: Limit | None = None, **curves: Any) -> Trial:
    """A trial of one claim, of bound 1."""
    declared = Claim(claim, 1.0, "what is measured", "why", "rad", limit)
    return Trial(name, (declared,), lambda: Findings([value], curves))


@pytest.fixture
def given() -> Any:
    return typed(Config, CONFIGS / "stress_quick.yaml")


def means(**replaced: Any) -> Means:
    return Means(resolve("taylor"))._replace(**replaced)


@pytest.mark.parametrize("name", ["stress", "stress_quick"])
def test_configs_ask_for_every_trial_under_its_own_name(name: str) -> None:
    asked = typed(Config, CONFIGS / f"{name}.yaml")
    trials = list(stress.trials(asked.problem, means()))
    labels = [f"{group}.{stress.label(x.name)}" for group, x in trials]
    assert len(set(labels)) == len(labels) > 75
    assert {group for group, _ in trials} == {
        "symmetries",
        *extremes.GROUPS,
        "separatrices",
        "passages",
        "honesty",
        "addresses",
        "long_time",
    }


def test_without_heyoka_the_other_engine_is_tried(given: Any) -> None:
    names = [x.name for _, x in stress.trials(given.problem, means(arithmetic=resolve("scipy")))]
    assert not any("taylor" in x for x in names)
    assert any("scipy" in x for x in names)


def test_claims_of_one_group_come_together(given: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def trials(*_: Any) -> Any:
        yield "a", trial("first = 1", "x", 0.5)
        yield "a", trial("second", "y", 2.0, c={})
        yield "b", trial("third", "z", 2.0, Limit("known", 2.0))

    monkeypatch.setattr(stress, "trials", trials)
    said: list[str] = []
    kept: list[str] = []

    def part(name: str, compute: Any) -> Any:
        kept.append(name)
        return compute()

    made: Any = stress.compute(given, means(report=said.append, part=part))
    assert kept == ["a.first_1", "a.second", "b.third"]
    assert list(made["a"]["claims"]) == ["x", "y"]
    assert list(made["a"]["curves"]) == ["second"]
    told = ["2/3: a, second: FAILED", "3/3: b, third: limit"]
    assert [x.rpartition(", ")[0] for x in said[1:]] == told


def test_differences_are_in_claims_and_verdicts_not_in_values() -> None:
    stored: Any = {
        "a": {"claims": {"x": {"verdict": "passed", "value": 1}, "y": {"verdict": "limit"}}}
    }
    fresh = copy.deepcopy(stored)
    fresh["a"]["claims"]["x"]["value"] = 2
    assert differences("stress", stored, fresh) == []
    fresh["a"]["claims"]["x"]["verdict"] = "FAILED"
    found = differences("stress", stored, fresh)
    assert found == ["a/claims/x/verdict: stored passed, computed FAILED"]
    assert differences("stress", fresh, fresh) == ["a/claims/x/verdict: FAILED"]
    del fresh["a"]["claims"]["y"]
    assert differences("stress", stored, fresh) == ["a/claims/y is only stored"]


@pytest.mark.slow
@pytest.mark.parametrize(("value", "code"), [(0.5, 0), (2.0, 1)])
def test_command_draws_tells_and_ends_as_the_claims_do(
    value: float, code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from rigidpend import render

    def trials(*_: Any) -> Any:
        yield "a", trial("first", "x", value)

    def drawn(source: Path, target: Path) -> None:
        target.write_text(store.load(source)["attributes"]["experiment"])

    monkeypatch.setattr(stress, "trials", trials)
    monkeypatch.setattr(render, "render", drawn)
    result = CliRunner().invoke(command, ["--quick", "--json", "--out", str(tmp_path)])
    assert result.exit_code == code, result.output
    found = json.loads(result.stdout)
    assert found["claims"][0]["value"] == value
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


def test_a_route_codes_that_always_refuses_fails_everything_that_needs_it(
    given: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No limit is written by the case itself: what refuses has refuted what was claimed."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise ProblemError("J1_0", "not today")

    for module in (extremes, honesty, passages, spoilt_maps, symmetries):
        monkeypatch.setattr(module, "route_codes", refuse)
    needed = {*extremes.GROUPS, "honesty", "symmetries"}
    tried = [x for group, x in stress.trials(given.problem, means()) if group in needed]
    assert len(tried) > 40
    for each in tried:
        made: Any = claims.tried(each)
        verdicts = {str(claim["verdict"].values) for claim in made["claims"].values()}
        assert verdicts == {"FAILED"}, each.name


def test_no_orbit_is_lost_where_the_starts_share_them(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, int]] = []

    def trial(*_: Any, orbits: int, checked: int, **__: Any) -> None:
        asked.append((orbits, checked))

    monkeypatch.setattr(honesty, "trial", trial)
    monkeypatch.setattr(honesty, "hard_trial", lambda *_: None)
    sizes = SimpleNamespace(orbits=8, checked=4, n_symbols=2, tolerances=())
    problem: Any = SimpleNamespace(honesty=sizes, body=None, h0=None, seed=1)
    way: Any = SimpleNamespace(engine="scipy")
    assert len(list(stress.honesty_trials(problem, way))) == 1 + len(asked)
    assert asked == [(3, 2), (3, 1), (2, 1)]


def test_limits_are_declared_before_anything_is_measured(given: Any) -> None:
    limited = {
        claim.name: claim.limit.up_to
        for _, each in stress.trials(given.problem, means())
        for claim in each.claims
        if claim.limit
    }
    assert len(limited) == 6
    assert all(name.startswith("taylor at 3.0e-14, ") for name in limited)
    assert all(up_to < 1 for up_to in limited.values())


@pytest.mark.parametrize(("long", "tried"), [("true", 1), ("false", 0)])
def test_what_takes_minutes_is_tried_where_that_is_asked_for(long: str, tried: int) -> None:
    asked = typed(Config, CONFIGS / "stress_quick.yaml", [f"problem.extremes.long={long}"])
    names = [each.name for _, each in stress.trials(asked.problem, means())]
    assert names.count("near-spherical, J1_0 = 1e-80") == tried


@pytest.mark.parametrize("setting", ["tolerance=1e-10", "precisions=[53]"])
def test_what_no_trial_reads_is_refused(setting: str) -> None:
    with pytest.raises(ConfigError, match="unknown key"):
        loading.load(CONFIGS / "stress_quick.yaml", (f"numerics.{setting}",))


BOUNDS: dict[str, dict[str, float]] = {
    "symmetries": {"reflection": 0, "time reversal": 0, "2 pi": 1e-5, "": 14.2},
    "routes": {": error": 0.01, ": uncertain": 0},
    "separatrices": {"": 10},
    "passages": {
        "size of errors": 3,
        "growth a passage": 0.042,
        "wrong": 0,
        "53 bits": 6.6,
        "64 bits": 9.1,
        "106 bits": 11.4,
        "113 bits": 18,
    },
    "honesty": {"right at": 0.999, "certain, all off": 0.5, "": 0},
    "addresses": {"delay": 1e-9, "": 0},
    "long_time": {
        "pendulum": 4,
        "scipy": 1,
        ": power": 0.077,
        ": size": 6.2e-13,
        "splitting 2, energy": 1.6e-3,
        "splitting 4, energy": 5e-6,
        "splitting 6, energy": 9e-7,
        "splitting 8, energy": 4e-8,
        # Four of 0.212 x 2^-52 a rounding, by the roots of 6 x 250,000 of them, and so on.
        "splitting 2": 2.32e-13,
        "splitting 4": 3.66e-13,
        "splitting 6": 3.8e-13,
        "splitting 8": 4.3e-13,
    },
}
"""The most that any claim of the whole run may allow, by the first words found in its name."""


def test_every_bound_is_what_theory_or_other_orbits_gave() -> None:
    """Within three per cent of what is said here: no looser, and no tighter by accident."""
    asked = typed(Config, CONFIGS / "stress.yaml")
    for group, each in stress.trials(asked.problem, means()):
        kind = "routes" if group in extremes.GROUPS else group
        for claim in each.claims:
            most = next(most for words, most in BOUNDS[kind].items() if words in claim.name)
            assert 0.97 * most <= claim.bound <= most, claim.name
