"""What a config can ask for: one module an experiment, named as in the config.

Each has

- ``compute(config, means) -> Tree``: from the checked content of a config to the data of its
  result file;
- ``describe(config) -> list[Row]``: what a config asks for, for people;
- ``differences(stored, fresh) -> list[str]``: where two results disagree by more than their
  arithmetic explains, from the groups ``/data`` of two open files.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

from rigidpend.tree import Tree


def compute_now(name: str, compute: Callable[[], Tree]) -> Tree:
    """A part that nothing keeps."""
    return compute()


class Means(NamedTuple):
    """What an experiment is computed with."""

    engine: str
    """One of the engines; empty for an experiment that integrates nothing."""
    jobs: int
    """Threads or processes at a time."""
    report: Callable[[str], None]
    """Takes a line of progress for people."""
    part: Callable[[str, Callable[[], Tree]], Tree] = compute_now
    """``part(name, compute)`` is ``compute()``, kept so that an interrupted run goes on."""


class Row(NamedTuple):
    """A line of a description."""

    name: str
    value: str
    meaning: str
    number: Any = None
    """The value as a number, or a list of numbers, where it is that."""


def module(experiment: str) -> Any:
    """The module of an experiment, imported when it is needed."""
    return importlib.import_module(f"rigidpend.experiments.{experiment}")
