"""Experiment `bench`: time, error and trust of our methods and of others."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row, exact_row
from rigidpend.experiments import heyoka_peer
from rigidpend.experiments.bench import layout
from rigidpend.experiments.bench.measuring import choice, problems, records
from rigidpend.experiments.bench.measuring.methods import METHODS
from rigidpend.experiments.bench.measuring.worker import Order, measured
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Dataset, Tree
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.engines import EngineError

if TYPE_CHECKING:
    from rigidpend.experiments.bench.schema import Config

PATIENCE, GRACE = 4, 120
"""A worker is ended after so many budgets, and so many seconds more."""


def compute(config: Config, means: Means) -> Tree:
    """Search for the best setting of each method, let them meet, and count wrong symbols.

    Returns
    -------
    Tree
        A group for each problem, with a record of the search for each method; `meetings`, by
        the number of threads, then by problem; `random_phases`, by J1_0; `many_orbits`.

    Raises
    ------
    EngineError
        heyoka, which makes the references in 113 bits, is not installed.
    """
    if not heyoka_peer.installed():
        raise EngineError("the references need the package heyoka, which is not installed")
    with tempfile.TemporaryDirectory() as folder:
        reference = Path(folder) / "reference.npz"
        np.savez(reference, **_references(config, means))
        groups = _searched(config, str(reference), means)
        met = {
            f"threads_{count}": _met(config, groups, str(reference), count, means)
            for count in config.meeting.threads
        }
    phases = _random_phases(config, means)
    many = _many(config, groups, means)
    return {**groups, "meetings": met, "random_phases": phases, "many_orbits": many}


def describe(config: Config) -> list[Row]:
    """Describe a config in rows, units named."""
    p, search, meeting = config.problem, config.search, config.meeting
    asked = {name: problems.module(name) for name in p.problems}
    return [
        *(Row(name, problem.TITLE, problem.ERROR) for name, problem in asked.items()),
        *(Row(name, METHODS[name].family, METHODS[name].label) for name in p.methods),
        Row("search", f"{search.seconds} s", "a method's budget at a problem, every setting"),
        exact_row("rounds", "of the meeting; the median of their ratios counts", meeting.rounds),
        exact_row("threads", "of the meetings", *meeting.threads),
        exact_row("phases", "random ones for each J1_0, against 113 bits", config.phases.orbits),
    ]


def _references(config: Config, means: Means) -> dict[str, Any]:
    """The truth of every problem, as arrays named PROBLEM.NAME."""
    arrays: dict[str, Any] = {}
    for name in config.problem.problems:
        truth = means.part(f"reference.{name}", partial(_reference, config, name))
        means.report(f"{problems.module(name).TITLE}: reference")
        for key, node in truth.items():
            arrays[f"{name}.{key}"] = node[0]  # type: ignore[index]
    return arrays


def _reference(config: Config, name: str) -> Tree:
    problem = problems.module(name)
    found = problem.reference(problem.task(config.problem))
    return {key: Dataset(values, "", "the truth") for key, values in found.items()}


def _searched(config: Config, reference: str, means: Means) -> dict[str, dict[str, Any]]:
    """The records of every problem; a worker for each method."""
    groups: dict[str, dict[str, Any]] = {name: _titles(name) for name in config.problem.problems}
    for key in config.problem.methods:
        asked = _asked(config, key)
        if not asked:
            continue
        found = means.part(f"search.{key}", partial(_search, config, key, asked, reference))
        for name, record in found.items():
            groups[name][key] = record
        means.report(f"{METHODS[key].label}: {_said(found)}")
    return groups


def _titles(name: str) -> dict[str, Any]:
    problem = problems.module(name)
    return datasets(layout.PROBLEM, {key: getattr(problem, key.upper()) for key in layout.PROBLEM})


def _asked(config: Config, key: str) -> dict[str, list[Any]]:
    """The problems that a method answers, and the knobs it is tried with."""
    method = METHODS[key]
    return {
        name: choice.knobs(method, config.search, problems.module(name).KIND == "long")
        for name in config.problem.problems
        if method.answer(name, problems.module(name).KIND)
    }


def _search(config: Config, key: str, asked: dict[str, list[Any]], reference: str) -> Tree:
    """The records of a method, by problem."""
    method, search = METHODS[key], config.search
    if method.absent():
        return {name: records.absent(method.absent()) for name in asked}
    tried = [{"knobs": knobs} for knobs in asked.values()]
    more: dict[str, Any] = {"problems": tuple(asked), "reference": reference}
    given = search.repeats, search.seconds, len(asked)
    lines, ended = _measured(config, "search", {key: tried}, *given, **more)
    return {
        name: records.searched(lines, ended, name, len(knobs) * len(method.variants))
        for name, knobs in asked.items()
    }


def _measured(
    config: Config,
    work: str,
    methods: dict[str, list[Any]],
    repeats: int,
    seconds: Scalar,
    budgets: int,
    **more: Any,
) -> tuple[list[dict[str, Any]], str]:
    """Measurements of some methods by a worker, within so many budgets, and how that ended."""
    sizes = config.problem.model_dump()
    order = Order(work, methods, sizes, repeats, float(seconds), **more)
    return measured(order, PATIENCE * order.seconds * budgets + GRACE)


def _met(config: Config, groups: Any, reference: str, threads: int, means: Means) -> Tree:
    """The meetings of all problems with so many threads."""
    found = {}
    for name in config.problem.problems:
        chosen = choice.guests(name, _records(groups[name]), config, threads)
        if len(chosen) < 2:
            continue
        made = partial(_meeting, config, name, chosen, reference, threads)
        found[name] = means.part(f"meeting.{threads}.{name}", made)
        title = problems.module(name).TITLE
        means.report(f"{title}, {threads} thread{'s' * (threads > 1)}: {_ended(found[name])}")
    return found


def _meeting(
    config: Config, name: str, chosen: dict[str, Any], reference: str, threads: int
) -> Tree:
    guests, meeting = {key: [entry] for key, entry in chosen.items()}, config.meeting
    given = meeting.rounds, meeting.seconds, len(chosen)
    more: dict[str, Any] = {"problems": (name,), "reference": reference, "threads": threads}
    lines, ended = _measured(config, "meeting", guests, *given, **more)
    found: dict[str, Any] = {
        line["method"]: {
            **records.single(layout.ONE_SETTING | layout.ROUND, line),
            "chosen": layout.CHOSEN.dataset(choice.spelt(chosen[line["method"]])),
        }
        for line in lines
    }
    missing = ", ".join(sorted(set(chosen) - set(found)))
    said = f"{ended or 'no answer'}: {missing}" if missing else records.COMPLETE
    return {**found, "ended": layout.ENDED.dataset(said)}


def _records(group: Data) -> dict[str, dict[str, Any]]:
    """The arrays of the methods' records at a problem, without their meanings."""
    return {
        key: {name: node[0] for name, node in group[key].items()} for key in METHODS if key in group
    }


def _random_phases(config: Config, means: Means) -> Tree:
    """Wrong symbols, by J1_0 and method."""
    groups: dict[str, dict[str, Any]] = {}
    for key in config.phases.methods:
        if METHODS[key].absent():
            continue
        for start, record in means.part(f"phases.{key}", partial(_phases, config, key)).items():
            groups.setdefault(start, {})[key] = record
        means.report(f"random phases: {METHODS[key].label}")
    return groups


def _phases(config: Config, key: str) -> Tree:
    tried, asked = [choice.finest(METHODS[key], config.search)], config.phases
    lines, ended = _measured(config, "phases", {key: tried}, asked.orbits, asked.seconds, 2)
    if ended:
        raise RuntimeError(f"random phases, {METHODS[key].label}: {ended}")
    return {f"J1_0_{line['J1_0']}": records.single(layout.COUNTED, line) for line in lines}


def _many(config: Config, groups: Any, means: Means) -> Tree:
    """Times against the number of orbits, by method."""
    codes, found = _records(groups.get("codes", {})), {}
    for key in config.many.methods:
        if METHODS[key].absent() or not METHODS[key].answer("many", "routes"):
            continue
        entry = choice.best("codes", key, codes, config.search)
        found[key] = means.part(f"many.{key}", partial(_many_of, config, key, entry))
        means.report(f"many orbits, {METHODS[key].label}: {_ended(found[key])}")
    return found


def _many_of(config: Config, key: str, entry: dict[str, Any]) -> Tree:
    numbers = config.many.orbits
    given = config.search.repeats, config.many.seconds, len(numbers)
    lines, ended = _measured(config, "many", {key: [entry]}, *given, numbers=numbers)
    if not lines:
        raise RuntimeError(f"many orbits, {METHODS[key].label}: {ended}")
    return {
        **records.arrays(layout.NUMBERS, lines),
        "chosen": layout.CHOSEN.dataset(choice.spelt(entry)),
        "ended": layout.ENDED.dataset(ended or records.COMPLETE),
    }


def _said(found: Any) -> str:
    """Summary of how the measurements of a method ended, those alike together."""
    said = {name: _ended(record) for name, record in found.items()}
    if len(set(said.values())) == 1:
        return next(iter(said.values()))
    return "; ".join(f"{name} {text}" for name, text in said.items())


def _ended(found: Any) -> str:
    return str(found["ended"].values)
