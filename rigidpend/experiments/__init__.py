"""Experiments: one folder each, with layout, schema, computation and drawing.

:mod:`rigidpend.experiments.contract` says what the files of a folder offer. Each is imported
when it is needed: a list of names imports none, drawing imports no integrator.
"""

from __future__ import annotations

import functools
import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidpend.config.description import Row
    from rigidpend.config.schema import ExperimentConfig
    from rigidpend.experiments.data import Layout, Loaded
    from rigidpend.machine.wording import Table

FOLDER = Path(__file__).parent
"""Folder of the experiments, each in one of its own."""


class UnknownExperiment(ValueError):
    """Error: a name that no experiment has."""


@functools.cache
def names() -> tuple[str, ...]:
    """Names of all experiments, in alphabetical order."""
    return tuple(sorted(file.parent.name for file in FOLDER.glob("*/schema.py")))


def schema(name: str) -> type[ExperimentConfig]:
    """Schema of an experiment's configs; as all here, UnknownExperiment of a name that none has."""
    return _module(name, "schema").Config


def computation(name: str) -> Any:
    """Module that computes an experiment."""
    return _module(name, "compute")


def cost(name: str, config: ExperimentConfig) -> float | None:
    """Estimate of the seconds that a config takes; None where its experiment gives none."""
    estimate = getattr(computation(name), "cost", None)
    return None if estimate is None else float(estimate(config))


def describe(name: str, config: ExperimentConfig) -> list[Row]:
    """Describe a config in rows: what it asks for, and what follows from it.

    What follows is said by its body, by the module that computes it where that has a function
    `describe`, by its estimated cost, and by the theory of its body at its energy.
    """
    from rigidpend.config import description, theory

    problem, own = config.problem, getattr(computation(name), "describe", None)
    body, seconds = getattr(problem, "body", None), cost(name, config)
    found = [
        *description.asked(problem),
        *description.asked(config, apart=("figure", "experiment", "problem", "numerics")),
        *(description.derived_rows(body) if body else ()),
        *(own(config) if own else ()),
        *theory.of(problem),
    ]
    if seconds is not None:
        found.append(description.Row("cost", f"about {seconds:.2g} s", "to compute, as estimated"))
    # What is said twice, as A of a body, is told where and as it was said first.
    told: dict[str, Row] = {}
    for row in found:
        told.setdefault(row.name, row)
    return list(told.values())


def in_pieces(name: str) -> bool:
    """Tell if an experiment is computed in pieces that may go to other machines."""
    return bool(getattr(computation(name), "PIECES", False))


def layout(name: str) -> Layout:
    """Layout of an experiment's results; nothing that computes is imported."""
    return _module(name).LAYOUT


def drawing(name: str) -> Any:
    """Module that draws an experiment."""
    return _module(name, "draw")


def tables(name: str, result: Loaded) -> list[Table]:
    """Tables beside the figure of a stored result; none where its experiment has none."""
    made = getattr(drawing(name), "tables", None)
    return made(result) if made else []


def _module(name: str, part: str = "") -> Any:
    # A name may come from a file of anybody's: only our own modules are imported.
    if name not in names():
        known = ", ".join(names())
        raise UnknownExperiment(f"no such experiment: {name[:80]!r} (known: {known})")
    return importlib.import_module(f"{__name__}.{name}{part and f'.{part}'}")
