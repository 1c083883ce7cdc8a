"""Experiment `stress`: trials at the limits, each with a stated bound."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Tree
from rigidpend.experiments.stress import (
    addresses,
    extremes,
    honesty,
    long_time,
    passages,
    symmetries,
)
from rigidpend.experiments.stress.claims import Trial, tried
from rigidpend.machine.progress import PartDone

if TYPE_CHECKING:
    from rigidpend.experiments.stress.schema import Config, Problem

SUBJECTS = (symmetries, extremes, passages, honesty, addresses, long_time)
"""Modules whose ``trials(problem, jobs)`` are run, in this order."""


def compute(config: Config, means: Means) -> Tree:
    """Run all trials of a config; what an interrupted run finished is not run again.

    Returns
    -------
    Tree
        A group for each kind of trial: `claims`, each with value, bound, ratio and verdict, and
        the `curves` behind them.
    """
    every = list(trials(config.problem, means.jobs))
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for number, trial in enumerate(every, 1):
        name, begun = label(trial.name), time.perf_counter()
        made: Any = means.part(f"{trial.kind}.{name}", partial(tried, trial))
        group = found.setdefault(trial.kind, {"claims": {}, "curves": {}})
        group["claims"] |= made["claims"]
        # A trial that refuses to compute has none, and an empty group would not fit the layout.
        if made["curves"]:
            group["curves"][name] = made["curves"]
        verdicts = ", ".join(str(claim["verdict"].values) for claim in made["claims"].values())
        taken = f"{time.perf_counter() - begun:.1f} s"
        text = f"{number}/{len(every)}: {trial.kind}, {trial.name}: {verdicts}, {taken}"
        means.report(PartDone(text, number, len(every)))
    return found


def trials(problem: Problem, jobs: int) -> Iterator[Trial]:
    """All trials, in the order in which they are run."""
    return (trial for subject in SUBJECTS for trial in subject.trials(problem, jobs))


def label(name: str) -> str:
    """A name of letters, digits, points and dashes."""
    # Labels name groups in a file and parts on the disk, which bear no blank, slash or bracket.
    return re.sub(r"[^A-Za-z0-9.-]+", "_", name).strip("_")
