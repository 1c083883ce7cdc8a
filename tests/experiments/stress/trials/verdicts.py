"""Trials tried, and their verdicts."""

from __future__ import annotations

from typing import Any

from rigidpend.experiments.stress.trials.claims import Trial, tried


def verdicts(trial: Trial | Any) -> dict[str, str]:
    """The verdict on each claim of a trial, or of one that was tried."""
    made: Any = tried(trial) if isinstance(trial, Trial) else trial
    return {name: str(claim["verdict"].values) for name, claim in made["claims"].items()}


def failed(trial: Trial | Any) -> set[str]:
    """The names of the claims that failed; all others passed."""
    found = verdicts(trial)
    assert set(found.values()) <= {"passed", "FAILED"}
    return {name for name, verdict in found.items() if verdict == "FAILED"}
