"""Experiments: one folder each, with layout, schema, computation and drawing.

:mod:`rigidpend.experiments.contract` says what the files of a folder offer. Each file is imported
only when it is needed: listing names imports none, and drawing imports no integrator.
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
    """Schema of an experiment's configs.

    A name that no experiment has raises UnknownExperiment, here and in the functions below.
    """
    return _module(name, "schema").Config


def computation(name: str) -> Any:
    """Module that computes an experiment."""
    return _module(name, "compute")


def cost(config: ExperimentConfig) -> float:
    """Estimate of the seconds that a config takes; 0 if its experiment makes no estimate.

    There is none for the engine `scipy` either: estimates are measured with `taylor`, and orbits
    take up to thousands of times as long.
    """
    from rigidpend.orbits.integrate.arithmetic import resolve

    estimate = getattr(computation(config.experiment), "cost", None)
    engine = resolve(config.numerics_asked.get("engine")).engine
    return float(estimate(config)) if estimate and engine == "taylor" else 0.0


def describe(config: ExperimentConfig) -> list[Row]:
    """Describe a config in rows: its parameters, and what follows from them.

    The rows that follow come from the body, from the experiment's `describe` if there is one,
    from the theory of the body at its energy, and from the estimated cost.
    """
    from rigidpend.config import description, theory
    from rigidpend.machine.progress import duration

    problem, own = config.problem, getattr(computation(config.experiment), "describe", None)
    body, seconds = getattr(problem, "body", None), cost(config)
    found = [
        *description.asked(problem),
        *description.asked(config, apart=("figure", "experiment", "problem", "numerics")),
        *(description.derived_rows(body) if body else ()),
        *(own(config) if own else ()),
        *theory.of(problem),
    ]
    if seconds:
        said = f"{seconds:.2g} s" if seconds < 10 else duration(seconds)
        found.append(description.Row("cost", f"about {said}", "to compute, as estimated"))
    # A name that occurs twice, such as A of a body, keeps its first row.
    told: dict[str, Row] = {}
    for row in found:
        told.setdefault(row.name, row)
    return list(told.values())


def layout(name: str) -> Layout:
    """Layout of an experiment's results; nothing that computes is imported."""
    return _module(name).LAYOUT


def drawing(name: str) -> Any:
    """Module that draws an experiment."""
    return _module(name, "draw")


def tables(result: Loaded) -> list[Table]:
    """Tables beside the figure of a stored result."""
    made: list[Table] = drawing(result["attributes"]["experiment"]).tables(result)
    return made


def _module(name: str, part: str = "") -> Any:
    # A name may come from an untrusted file: only the package's own modules are imported.
    if name not in names():
        known = ", ".join(names())
        raise UnknownExperiment(f"no such experiment: {name[:80]!r} (known: {known})")
    return importlib.import_module(f"{__name__}.{name}{part and f'.{part}'}")
