"""Trials tried, and their verdicts; what the small config asks for, with other settings."""

from typing import Any

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.scenes import Trial
from tests.experiments import trees


def asked(*settings: str, config: str = "stress_quick") -> Any:
    """The problem of a config, its keys set otherwise."""
    return trees.asked(config, *(f"problem.{x}" for x in settings)).problem


def verdicts(trial: Trial | Any) -> dict[str, str]:
    made: Any = trial.tried() if isinstance(trial, Trial) else trial
    return {name: claim["verdict"] for name, claim in made["claims"].items()}


def failed(trial: Trial | Any) -> set[str]:
    """The names of the claims that failed; all others passed."""
    found = verdicts(trial)
    assert set(found.values()) <= {"passed", "FAILED"}
    return {name for name, verdict in found.items() if verdict == "FAILED"}


def changed(monkeypatch: Any, change: Any, right: Any = scenes.routes) -> None:
    """Let the routes that trials compute be changed: ``change(routes, True if spoilt)``."""

    def other(problem: Any, phases: Any, *more: Any) -> Any:
        # What is spoilt has a method of its own, beside arithmetic and jobs.
        return change(right(problem, phases, *more), len(more) > 2)

    monkeypatch.setattr(scenes, "routes", other)
