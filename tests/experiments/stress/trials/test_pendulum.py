"""The pendulum keeps its period, and another period is noticed."""

from __future__ import annotations

from typing import Any

import pytest

from rigidpend.experiments.stress.trials import pendulum
from rigidpend.experiments.stress.trials.claims import tried
from rigidpend.routes.problem import RouteProblem, rotation_period
from tests.orbits.integrate.problems import FIG4


def test_the_pendulum_keeps_its_period_and_another_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def run() -> list[str]:
        made: Any = tried(pendulum.trial(FIG4, "1.3342", "taylor", rotations=300))
        return [str(claim["verdict"].values) for claim in made["claims"].values()]

    assert run() == ["passed"]

    def longer(problem: RouteProblem) -> float:
        return rotation_period(problem) * (1 + 1e-12)

    monkeypatch.setattr(pendulum, "rotation_period", longer)
    assert run() == ["FAILED"]
