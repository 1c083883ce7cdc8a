"""Experiment `bench`: time, error and trust of our methods and of others."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row, exact_row
from rigidpend.experiments import heyoka_peer
from rigidpend.experiments.bench.layout import PROBLEM
from rigidpend.experiments.bench.measuring import choice, problems, records
from rigidpend.experiments.bench.measuring.methods import METHODS
from rigidpend.experiments.bench.measuring.tasks import Sizes
from rigidpend.experiments.bench.measuring.worker import Order, measured
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.layout import datasets
from rigidpend.experiments.data.tree import Data, Dataset, Tree
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
        problem = problems.module(name)
        task = problem.task(_sizes(config))
        truth = means.part(
            f"reference.{name}",
            lambda: {k: Dataset(v, "", "the truth") for k, v in problem.reference(task).items()},  # noqa: B023
        )
        means.report(f"{problem.TITLE}: reference")
        for key, node in truth.items():
            arrays[f"{name}.{key}"] = node[0]  # type: ignore[index]
    return arrays


def _searched(config: Config, reference: str, means: Means) -> dict[str, dict[str, Any]]:
    """The records of every problem; a worker for each method."""
    groups: dict[str, dict[str, Any]] = {name: _titles(name) for name in config.problem.problems}
    for key in config.problem.methods:
        asked = _asked(config, key)
        if not asked:
            continue
        found = means.part(f"search.{key}", lambda: _search(config, key, asked, reference))  # noqa: B023
        for name, record in found.items():
            groups[name][key] = record
        means.report(f"{METHODS[key].label}: {_said(found)}")
    return groups


def _titles(name: str) -> dict[str, Any]:
    problem = problems.module(name)
    return datasets(PROBLEM, {name: getattr(problem, name.upper()) for name in PROBLEM})


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
    method = METHODS[key]
    if method.absent():
        return {name: records.absent(method.absent()) for name in asked}
    seconds = float(config.search.seconds)
    order = Order(
        "search",
        list(asked),
        {key: [{"knobs": knobs} for knobs in asked.values()]},
        _sizes(config)._asdict(),
        config.problem.few,
        config.search.repeats,
        seconds,
        reference,
    )
    lines, ended = measured(order, PATIENCE * seconds * len(asked) + GRACE)
    return {
        name: records.searched(lines, ended, name, len(knobs) * len(method.variants))
        for name, knobs in asked.items()
    }


def _met(config: Config, groups: Any, reference: str, threads: int, means: Means) -> Tree:
    """The meetings of all problems with so many threads."""
    found = {}
    for name in config.problem.problems:
        chosen = choice.guests(name, _records(groups[name]), config, threads)
        if len(chosen) < 2:
            continue
        order = Order(
            "meeting",
            [name],
            {key: [entry] for key, entry in chosen.items()},
            _sizes(config)._asdict(),
            config.problem.few,
            config.meeting.rounds,
            float(config.meeting.seconds),
            reference,
            threads,
        )
        found[name] = means.part(f"meeting.{threads}.{name}", lambda: _meeting(order))  # noqa: B023
        title = problems.module(name).TITLE
        means.report(f"{title}, {threads} thread{'s' * (threads > 1)}: {_ended(found[name])}")
    return found


def _meeting(order: Order) -> Tree:
    limit = PATIENCE * order.seconds * len(order.methods) + GRACE
    lines, ended = measured(order, limit)
    found: dict[str, Any] = {
        line["method"]: records.met(line, choice.spelt(order.methods[line["method"]][0]))
        for line in lines
    }
    missing = ", ".join(sorted(set(order.methods) - set(found)))
    said = f"{ended or 'no answer'}: {missing}" if missing else records.COMPLETE
    return {**found, "ended": records.ENDED._replace(values=said)}


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
        found = means.part(f"phases.{key}", lambda: _phases(config, key))  # noqa: B023
        for start, record in found.items():
            groups.setdefault(start, {})[key] = record
        means.report(f"random phases: {METHODS[key].label}")
    return groups


def _phases(config: Config, key: str) -> Tree:
    seconds = float(config.phases.seconds)
    order = Order(
        "phases",
        [],
        {key: [choice.finest(METHODS[key], config.search)]},
        {},
        config.problem.few,
        config.phases.orbits,
        seconds,
    )
    lines, ended = measured(order, PATIENCE * 2 * seconds + GRACE)
    if ended:
        raise RuntimeError(f"random phases, {METHODS[key].label}: {ended}")
    return {f"J1_0_{line['J1_0']}": records.counted(line) for line in lines}


def _many(config: Config, groups: Any, means: Means) -> Tree:
    """Times against the number of orbits, by method."""
    codes, found = _records(groups.get("codes", {})), {}
    for key in config.many.methods:
        if METHODS[key].absent() or not METHODS[key].answer("many", "routes"):
            continue
        entry = choice.best("codes", key, codes, config.search)
        found[key] = means.part(f"many.{key}", lambda: _many_of(config, key, entry))  # noqa: B023
        means.report(f"many orbits, {METHODS[key].label}: {_ended(found[key])}")
    return found


def _many_of(config: Config, key: str, entry: dict[str, Any]) -> Tree:
    numbers, few, seconds = config.many.orbits, config.problem.few, float(config.many.seconds)
    sizes, repeats = _sizes(config)._asdict(), config.search.repeats
    order = Order("many", [], {key: [entry]}, sizes, few, repeats, seconds, numbers=numbers)
    lines, ended = measured(order, PATIENCE * seconds * len(numbers) + GRACE)
    if not lines:
        raise RuntimeError(f"many orbits, {METHODS[key].label}: {ended}")
    return records.many(lines, ended, choice.spelt(entry))


def _sizes(config: Config) -> Sizes:
    return Sizes(*(getattr(config.problem, name) for name in Sizes._fields))


def _said(found: Any) -> str:
    """Summary of how the measurements of a method ended, those alike together."""
    said = {name: str(record["ended"].values) for name, record in found.items()}
    if len(set(said.values())) == 1:
        return next(iter(said.values()))
    return "; ".join(f"{name} {text}" for name, text in said.items())


def _ended(found: Any) -> str:
    return str(found["ended"].values)
