"""What a config can ask for: one module an experiment, named as in the config.

Each has ``compute(config, engine, jobs) -> Tree``, from the checked content of a config to the
data of its result file, and ``describe(config) -> list[Table]`` for people.
"""

from __future__ import annotations

import importlib
from typing import Any, NamedTuple


class Row(NamedTuple):
    """A line of a description."""

    name: str
    value: str
    meaning: str


def module(experiment: str) -> Any:
    """The module of an experiment, imported when it is needed."""
    return importlib.import_module(f"rigidpend.experiments.{experiment}")
