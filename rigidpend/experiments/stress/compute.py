"""Experiment `stress`: trials at the limits, each with a stated bound."""

import time
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.stress import OF_CLAIM, conserved, extremes, honesty, passages, scenes
from rigidpend.experiments.stress.scenes import Trial
from rigidpend.experiments.stress.schema import Config, Problem
from rigidpend.machine.progress import PartDone


def compute(config: Config, means: Means) -> Tree:
    """Run all trials of a config; those that an interrupted run finished are not repeated.

    Returns
    -------
    Tree
        A group for each kind of trial: `claims`, each with value, bound, ratio and verdict, and
        the `curves` behind them.
    """
    every = list(trials(config.problem, means.jobs))
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for number, trial in enumerate(every, 1):
        begun = time.perf_counter()
        made: Any = means.part(f"{trial.kind}.{trial.label}", trial.tried)
        group = found.setdefault(trial.kind, {"claims": {}, "curves": {}})
        for part, members in group.items():
            members |= made[part]
        verdicts = ", ".join(claim["verdict"] for claim in made["claims"].values())
        taken = f"{time.perf_counter() - begun:.1f} s"
        text = f"{number}/{len(every)}: {trial.kind}, {trial.name}: {verdicts}, {taken}"
        means.report(PartDone(text, number, len(every)))
    return {kind: {**group, "claims": table(group["claims"])} for kind, group in found.items()}


def table(claims: Mapping[str, Any]) -> Tree:
    """The fields of claims, one after the other."""
    return {key: np.array([claim[key] for claim in claims.values()]) for key in OF_CLAIM}


def trials(problem: Problem, jobs: int) -> Iterator[Trial]:
    """All trials, in the order in which they are run."""
    yield conserved.symmetries(scenes.of_problem(problem, jobs))
    for subject in (extremes, passages, honesty, conserved):
        yield from subject.trials(problem, jobs)
