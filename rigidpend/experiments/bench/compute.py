"""Experiment `bench`: time, error and trust of our methods and of others."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import (
    BODY,
    COUNTED,
    ENDED,
    MANY,
    MET,
    OF_BODIES,
    OF_LOT,
    PROBLEM,
    SEARCHED,
    methods,
)
from rigidpend.experiments.bench.methods import METHODS, PROBLEMS, Setting
from rigidpend.experiments.bench.problems import ASKED, SEED
from rigidpend.experiments.bench.worker import measured
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Data, Dataset, Field, Layout, Tree, datasets, named
from rigidpend.orbits.integrate.arithmetic import EngineError

if TYPE_CHECKING:
    from rigidpend.experiments.bench.schema import Config

PATIENCE, GRACE = 4, 240
"""A worker is ended after so many budgets, and so many seconds more."""
COMPLETE = "complete"
Line = dict[str, Any]
Truth = dict[str, dict[str, Any]]
"""Arrays by problem and name, as lists that a worker can be told."""


def compute(config: Config, means: Means) -> Tree:
    """Search for the best setting of each method, let them meet, and count wrong symbols.

    Each worker's measurements are a part, which an interrupted run keeps.

    Returns
    -------
    Tree
        A group for each problem, with a record of the search for each method; `meetings`, by
        the number of threads, then by problem; `random_phases`, by J1_0; `many_orbits`; `bodies`,
        by their list.

    Raises
    ------
    EngineError
        heyoka, which makes the references in 113 bits, is not installed.
    """
    if not principal_axes.installed():
        raise EngineError("the references need the package heyoka, which is not installed")

    def part(name: str, title: str, work: Callable[..., Tree], *given: Any) -> Tree:
        found = means.part(name, partial(work, config, *given))
        means.report(f"{title}: {_said(found)}")
        return found

    problems = config.problem.problems
    truth: Truth = {}
    groups: dict[str, dict[str, Any]] = {}
    for name in problems:
        title = PROBLEMS[name].title
        found: Any = part(f"reference.{name}", f"reference, {title}", _reference, name)
        truth[name] = {key: np.asarray(node[0]).tolist() for key, node in found.items()}
        groups[name] = datasets(PROBLEM, PROBLEMS[name]._asdict())
    for key in config.problem.methods:
        if any(METHODS[key].answer(name) for name in problems):
            found = part(f"search.{key}", METHODS[key].label, _search, key, truth)
            for name, record in found.items():
                groups[name][key] = record
    meetings: dict[str, dict[str, Any]] = {f"threads_{n}": {} for n in config.meeting.threads}
    for name in problems:
        guests = methods.guests(name, _records(groups[name]), config)
        if len(guests) > 1:
            found = part(f"meeting.{name}", PROBLEMS[name].title, _meeting, name, guests, truth)
            for threads, record in found.items():
                meetings[threads][name] = record
    phases: dict[str, dict[str, Any]] = {}
    for key in filter(_there, config.phases.methods):
        found = part(f"phases.{key}", f"random phases, {METHODS[key].label}", _phases, key)
        for start, record in found.items():
            phases.setdefault(start, {})[key] = record
    codes = _records(groups.get("codes", {}))
    many = {
        key: part(f"many.{key}", f"many orbits, {METHODS[key].label}", _many, key, codes)
        for key in filter(_there, config.many.methods)
    }
    asked = config.bodies
    lists = ("kept", SEED, asked.kept), ("drawn", asked.seed, asked.drawn)
    bodies = [
        part(f"bodies.{title}", f"bodies, {title}", _bodies, title, seed, n, codes)
        for title, seed, n in lists
        if n
    ]
    return {
        **groups,
        "meetings": meetings,
        "random_phases": phases,
        "many_orbits": many,
        "bodies": _joined([x for x in bodies if len(x) > 1]),
    }


def describe(config: Config) -> list[Row]:
    """Titles of the problems with what their errors are, and of the methods with whose they are."""
    p = config.problem
    return [
        *(Row(name, PROBLEMS[name].title, PROBLEMS[name].error) for name in p.problems),
        *(Row(name, METHODS[name].family, METHODS[name].label) for name in p.methods),
    ]


def _measured(work: str, budgets: float, **given: Any) -> tuple[list[Line], str]:
    """Measurements by a worker, within so many budgets of `seconds`, and how that ended."""
    given["seconds"] = float(given["seconds"])
    return measured(work, given, PATIENCE * given["seconds"] * budgets + GRACE)


def _told(layout: Layout, row: Mapping[str, Any]) -> Tree:
    """Numbers, texts and lists of those fields of a layout that a row has."""
    return {
        name: field.dataset(row[name] if isinstance(row[name], str) else np.array(row[name], float))
        for name, (field, _) in named(layout).items()
        if name in row and isinstance(field, Field)
    }


def _columns(rows: Sequence[Line]) -> Line:
    """The numbers of rows by their names."""
    return {name: [row[name] for row in rows] for name in (rows[0] if rows else ())}


def _reference(config: Config, name: str) -> Tree:
    """The truth of a problem."""
    asked = ASKED[name]
    found = asked.truth(asked.task(config.problem))
    return {key: Dataset(values, "", "the truth") for key, values in found.items()}


def _there(key: str) -> bool:
    return not _missing(key)


def _missing(key: str) -> str:
    """Name the first of a method's libraries that is not installed; empty where all are."""
    missing = (x for x in METHODS[key].libraries if importlib.util.find_spec(x) is None)
    return next(missing, "")


def _search(config: Config, key: str, truth: Truth) -> Tree:
    """The records of a method, by problem."""
    method, problems = METHODS[key], config.problem.problems
    knobs = {
        name: methods.knobs(method, config.search, PROBLEMS[name].kind == "long")
        for name in problems
        if method.answer(name)
    }
    if missing := _missing(key):
        said = f"absent: {missing} is not installed"
        return {name: _told(SEARCHED, {"ended": said}) for name in knobs}
    lines, ended = _measured(
        "search", len(knobs), entries={key: knobs}, truth=truth,
        sizes=config.problem.model_dump(),
        repeats=config.search.repeats, seconds=config.search.seconds,
    )  # fmt: skip
    planned = {name: len(x) * len(method.variants) for name, x in knobs.items()}
    return {name: searched(lines, ended, name, planned[name]) for name in knobs}


def searched(lines: list[Line], ended: str, problem: str, planned: int) -> Tree:
    """The record of a method at a problem, of what a worker told.

    Parameters
    ----------
    lines : list of dict
        All that it told: first the costs of its import.
    ended : str
        What went wrong with the worker; empty where nothing did.
    problem : str
    planned : int
        How many measurements were asked for.
    """
    own = [line for line in lines[1:] if line["problem"] == problem]
    rows = [line for line in own if "knob" in line]
    wrong = next((line["failed"] for line in own if "failed" in line), ended)
    once = {k: v for line in [*lines[:1], *own] for k, v in line.items()}
    ends = {"ended": _cut(wrong, len(rows), planned)}
    return _told(SEARCHED, {**once, **_columns(rows), **ends})


def _cut(wrong: str, done: int, planned: int) -> str:
    """End of a measurement: complete, at its budget, or by what went wrong."""
    cut = wrong or ("cut at the budget" if done < planned else "")
    return f"{cut}: {done} of {planned}" if cut else COMPLETE


def _meeting(config: Config, name: str, guests: dict[str, Setting], truth: Truth) -> Tree:
    """The records of the methods that meet at a problem, by the number of threads."""
    asked = config.meeting
    lines, ended = _measured(
        "meeting", len(guests) * len(asked.threads), entries=guests, problem=name, truth=truth,
        threads=asked.threads, sizes=config.problem.model_dump(),
        repeats=asked.rounds, seconds=asked.seconds,
    )  # fmt: skip
    found: dict[str, dict[str, Any]] = {f"threads_{n}": {} for n in asked.threads}
    for line in lines:
        chosen = methods.spelt(guests[line["method"]])
        told = _told(MET, {**line, "chosen": chosen})
        found[f"threads_{line['most']}"][line["method"]] = told
    for group in found.values():
        group["ended"] = ENDED.dataset(COMPLETE if group else ended)
    # Where a second thread serves nobody there is no meeting.
    return {name: group for name, group in found.items() if len(group) > 1 or ended}


def _records(group: Data) -> dict[str, dict[str, Any]]:
    """The arrays of the methods' records at a problem, without their meanings."""
    return {
        key: {name: node[0] for name, node in group[key].items()} for key in METHODS if key in group
    }


def _phases(config: Config, key: str) -> Tree:
    """The records of a method on random phases, by J1_0."""
    entries, asked = {key: methods.best("codes", key, {}, config.search)}, config.phases
    given: Any = {"entries": entries, "orbits": asked.orbits, "seconds": asked.seconds}
    lines, ended = _measured("phases", 2, **given)
    if ended:
        raise RuntimeError(f"random phases, {METHODS[key].label}: {ended}")
    return {f"J1_0_{line['J1_0']}": _told(COUNTED, line) for line in lines}


def _many(config: Config, key: str, codes: Data) -> Tree:
    """The record of a method at ever more orbits, with its setting for the codes of Fig. 4."""
    entry = methods.best("codes", key, codes, config.search)
    numbers, seconds = config.many.orbits, config.many.seconds
    lines, ended = _measured(
        "many", len(numbers), entries={key: entry}, numbers=numbers, seconds=seconds,
        n_symbols=config.problem.n_symbols, repeats=config.search.repeats,
    )  # fmt: skip
    if not lines:
        raise RuntimeError(f"many orbits, {METHODS[key].label}: {ended}")
    texts = {"chosen": methods.spelt(entry), "ended": ended or COMPLETE}
    return _told(MANY, {**_columns(lines), **texts})


def _bodies(config: Config, title: str, seed: int, n: int, codes: Data) -> Tree:
    """The bodies of a list, and the records of all methods with them."""
    asked, entries = config.bodies, {}
    for key in filter(_there, asked.methods):
        entry = methods.best("codes", key, codes, config.search)
        entries[key] = {**entry, "setting": {**entry["setting"], **METHODS[key].of_bodies}}
    # Of peers and of the truth, and of ours.
    budgets = n * (len(entries) + asked.longest / float(asked.seconds))
    lines, ended = _measured(
        "bodies", budgets, entries=entries, seed=seed, bodies=n, orbits=asked.orbits,
        threads=asked.threads, repeats=asked.repeats, seconds=asked.seconds, longest=asked.longest,
    )  # fmt: skip
    bodies = [dict(zip(BODY, [title == "kept", *x["body"]], strict=True)) for x in lines]
    each = {
        key: _told(OF_BODIES, _columns([line[key] for line in lines]))
        for key in (entries if lines else ())
    }
    ends = {"ended": _cut(ended, len(lines), n)}
    return {**_told(OF_LOT, {**_columns(bodies), **ends}), **each}


def _joined(parts: list[Any]) -> Any:
    """Trees of arrays as one, end to end; of texts one that is not `COMPLETE`."""
    if not parts or not isinstance(parts[0], Dataset):
        return {
            name: _joined([part[name] for part in parts]) for part in parts[:1] for name in part
        }
    first: Any = parts[0]
    if isinstance(first.values, str):
        return next((x for x in parts if x.values != COMPLETE), first)
    return first._replace(values=np.concatenate([part.values for part in parts]))


def _said(found: Mapping[str, Any]) -> str:
    """The ways in which measurements ended; of several records those alike together."""
    each = {name: _said(x) for name, x in found.items() if isinstance(x, Mapping)}
    if "ended" in found:
        return str(found["ended"].values)
    if len(set(each.values())) > 1:
        return "; ".join(f"{name} {text}" for name, text in each.items())
    return next(iter(each.values()), "done")
