"""Experiment `bench`: time, error and trust of our methods and of others."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.config.description import Row
from rigidpend.experiments import heyoka_peer
from rigidpend.experiments.bench import drawn, layout, methods
from rigidpend.experiments.bench.measuring.problems import ASKED
from rigidpend.experiments.bench.measuring.worker import measured
from rigidpend.experiments.bench.methods import METHODS, PROBLEMS
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data.layout import Field, Layout, datasets, named
from rigidpend.experiments.data.tree import Data, Dataset, Tree
from rigidpend.orbits.integrate.arithmetic import EngineError

if TYPE_CHECKING:
    from rigidpend.experiments.bench.schema import Config

PATIENCE, GRACE = 4, 120
"""A worker is ended after so many budgets, and so many seconds more."""
BODIES_AT_ONCE = 20
"""Bodies of a worker, whose measurements an interrupted run keeps."""
COMPLETE = "complete"
Line = dict[str, Any]
Truth = dict[str, dict[str, Any]]
"""Arrays by problem and name."""


def compute(config: Config, means: Means) -> Tree:
    """Search for the best setting of each method, let them meet, and count wrong symbols.

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
    if not heyoka_peer.installed():
        raise EngineError("the references need the package heyoka, which is not installed")
    truth = _truth(config, means)
    groups = _searched(config, truth, means)
    counts = config.meeting.threads
    return {
        **groups,
        "meetings": {f"threads_{n}": _met(config, groups, truth, n, means) for n in counts},
        "random_phases": _random_phases(config, means),
        "many_orbits": _many(config, groups, means),
        "bodies": _bodies(config, groups, means),
    }


def describe(config: Config) -> list[Row]:
    """Titles of the problems with what their errors are, and of the methods with whose they are."""
    p = config.problem
    return [
        *(Row(name, PROBLEMS[name].title, PROBLEMS[name].error) for name in p.problems),
        *(Row(name, METHODS[name].family, METHODS[name].label) for name in p.methods),
    ]


def _measured(work: str, budgets: int, **given: Any) -> tuple[list[Line], str]:
    """Measurements by a worker, within so many budgets of `seconds`, and how that ended."""
    given["seconds"] = float(given["seconds"])
    return measured(work, given, PATIENCE * given["seconds"] * budgets + GRACE)


def _part(means: Means, name: str, title: str, work: Callable[..., Tree], *given: Any) -> Tree:
    """A part of the measurements, kept for an interrupted run; tells how it ended."""
    found = means.part(name, partial(work, *given))
    means.report(f"{title}: {_said(found)}")
    return found


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


def _truth(config: Config, means: Means) -> Truth:
    """The truth of every problem, in lists that a worker can be told."""
    found = {}
    for name in config.problem.problems:
        part: Any = means.part(f"reference.{name}", partial(_reference, config, name))
        means.report(f"{PROBLEMS[name].title}: reference")
        found[name] = {key: np.asarray(node[0]).tolist() for key, node in part.items()}
    return found


def _reference(config: Config, name: str) -> Tree:
    asked = ASKED[name]
    found = asked.truth(asked.task(config.problem))
    return {key: Dataset(values, "", "the truth") for key, values in found.items()}


def _searched(config: Config, truth: Truth, means: Means) -> dict[str, dict[str, Any]]:
    """The records of every problem; a worker for each method."""
    problems = config.problem.problems
    groups: dict[str, dict[str, Any]] = {
        name: datasets(layout.PROBLEM, PROBLEMS[name]._asdict()) for name in problems
    }
    for key in config.problem.methods:
        method = METHODS[key]
        knobs = {
            name: methods.knobs(method, config.search, PROBLEMS[name].kind == "long")
            for name in problems
            if method.answer(name)
        }
        if knobs:
            given = config, key, knobs, truth
            found = _part(means, f"search.{key}", method.label, _search, *given)
            for name, record in found.items():
                groups[name][key] = record
    return groups


def _search(config: Config, key: str, knobs: dict[str, list[Any]], truth: Truth) -> Tree:
    """The records of a method, by problem."""
    if missing := _missing(key):
        said = f"absent: {missing} is not installed"
        return {name: _told(layout.SEARCHED, {"ended": said}) for name in knobs}
    lines, ended = _measured(
        "search", len(knobs), entries={key: knobs}, truth=truth,
        sizes=config.problem.model_dump(),
        repeats=config.search.repeats, seconds=config.search.seconds,
    )  # fmt: skip
    variants = len(METHODS[key].variants)
    return {name: searched(lines, ended, name, len(x) * variants) for name, x in knobs.items()}


def _missing(key: str) -> str:
    """Name the first of a method's libraries that is not installed; empty where all are."""
    missing = (x for x in METHODS[key].libraries if importlib.util.find_spec(x) is None)
    return next(missing, "")


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
    said = f"{len(rows)} of {planned}"
    cut = f"cut at the budget: {said}" if len(rows) < planned else COMPLETE
    once = {k: v for line in [*lines[:1], *own] for k, v in line.items()}
    ends = {"ended": f"{wrong}: {said}" if wrong else cut}
    return _told(layout.SEARCHED, {**once, **_columns(rows), **ends})


def _met(config: Config, groups: Any, truth: Truth, threads: int, means: Means) -> Tree:
    """The meetings of all problems with so many threads."""
    found = {}
    for name in config.problem.problems:
        chosen = methods.guests(name, _records(groups[name]), config, threads)
        if len(chosen) > 1:
            title = f"{PROBLEMS[name].title}, {threads} thread{'s' * (threads > 1)}"
            given = config, name, chosen, truth, threads
            found[name] = _part(means, f"meeting.{threads}.{name}", title, _meeting, *given)
    return found


def _meeting(config: Config, name: str, chosen: dict[str, Any], truth: Truth, threads: int) -> Tree:
    lines, ended = _measured(
        "meeting", len(chosen), entries=chosen, problem=name, truth=truth, threads=threads,
        sizes=config.problem.model_dump(),
        repeats=config.meeting.rounds, seconds=config.meeting.seconds,
    )  # fmt: skip
    spelt = {key: methods.spelt(entry) for key, entry in chosen.items()}
    names = [line["method"] for line in lines]
    rows = zip(names, lines, strict=True)
    found = {key: _told(layout.MET, {**line, "chosen": spelt[key]}) for key, line in rows}
    missing = ", ".join(sorted(set(chosen) - set(names)))
    said = f"{ended or 'no answer'}: {missing}" if missing else COMPLETE
    return {**found, "ended": layout.ENDED.dataset(said)}


def _records(group: Data) -> dict[str, dict[str, Any]]:
    """The arrays of the methods' records at a problem, without their meanings."""
    return {
        key: {name: node[0] for name, node in group[key].items()} for key in METHODS if key in group
    }


def _random_phases(config: Config, means: Means) -> Tree:
    """Wrong symbols, by J1_0 and method."""
    groups: dict[str, dict[str, Any]] = {}
    for key in _there(config.phases.methods):
        for start, record in means.part(f"phases.{key}", partial(_phases, config, key)).items():
            groups.setdefault(start, {})[key] = record
        means.report(f"random phases: {METHODS[key].label}")
    return groups


def _there(keys: Sequence[str]) -> Iterator[str]:
    """Those methods whose libraries are installed."""
    return (key for key in keys if not _missing(key))


def _phases(config: Config, key: str) -> Tree:
    entries, asked = {key: methods.finest(key, config.search)}, config.phases
    given: Any = {"entries": entries, "orbits": asked.orbits, "seconds": asked.seconds}
    lines, ended = _measured("phases", 2, **given)
    if ended:
        raise RuntimeError(f"random phases, {METHODS[key].label}: {ended}")
    return {f"J1_0_{line['J1_0']}": _told(layout.COUNTED, line) for line in lines}


def _entries(config: Config, groups: Any, keys: Sequence[str]) -> dict[str, methods.Setting]:
    """Knob and setting of those methods that are there, by the search at the codes of Fig. 4."""
    codes = _records(groups.get("codes", {}))
    return {key: methods.best("codes", key, codes, config.search) for key in _there(keys)}


def _many(config: Config, groups: Any, means: Means) -> Tree:
    """Times against the number of orbits, by method."""
    found = {}
    for key, entry in _entries(config, groups, config.many.methods).items():
        title = f"many orbits, {METHODS[key].label}"
        found[key] = _part(means, f"many.{key}", title, _many_of, config, key, entry)
    return found


def _many_of(config: Config, key: str, entry: dict[str, Any]) -> Tree:
    numbers, seconds = config.many.orbits, config.many.seconds
    lines, ended = _measured(
        "many", len(numbers), entries={key: entry}, numbers=numbers, seconds=seconds,
        n_symbols=config.problem.n_symbols, repeats=config.search.repeats,
    )  # fmt: skip
    if not lines:
        raise RuntimeError(f"many orbits, {METHODS[key].label}: {ended}")
    texts = {"chosen": methods.spelt(entry), "ended": ended or COMPLETE}
    return _told(layout.MANY, {**_columns(lines), **texts})


def _bodies(config: Config, groups: Any, means: Means) -> Tree:
    """Times with bodies drawn by lot, those that are kept and those of the seed."""
    asked, parts = config.bodies, []
    entries = _entries(config, groups, asked.methods)
    for title, seed, n in (("kept", drawn.SEED, asked.kept), ("drawn", asked.seed, asked.drawn)):
        for k in range(0, n, BODIES_AT_ONCE):
            numbers = tuple(range(k, min(k + BODIES_AT_ONCE, n)))
            given = config, title == "kept", seed, n, numbers, entries
            said = f"bodies, {title}, from {k}"
            parts.append(_part(means, f"bodies.{title}.{k}", said, _some_bodies, *given))
    measured = [part for part in parts if len(part) > 1]
    said = next((x for x in map(_ended, parts) if x != COMPLETE), COMPLETE)
    return {**_joined(measured), "ended": layout.ENDED.dataset(said)} if measured else {}


def _some_bodies(config: Config, kept: bool, seed: int, n: int, numbers: Any, entries: Any) -> Tree:
    """The bodies of those numbers in their list, and the records of all methods with them."""
    asked = config.bodies
    # Of peers and of the truth, and of ours.
    budgets = len(numbers) * (len(entries) + math.ceil(asked.longest / float(asked.seconds)))
    lines, ended = _measured(
        "bodies", budgets, entries=entries, seed=seed, bodies=n, numbers=numbers,
        orbits=asked.orbits, threads=asked.threads, repeats=asked.repeats,
        seconds=asked.seconds, longest=asked.longest,
    )  # fmt: skip
    cut = ended or ("" if len(lines) == len(numbers) else "cut at the budget")
    said = {"ended": f"{cut}: {len(lines)} of {len(numbers)}" if cut else COMPLETE}
    rows, every = [], drawn.drawn(seed, n)
    for k in numbers[: len(lines)]:
        (A, r, mu), problem = every[k].body.floats(), every[k]
        values = kept, *A, *r[:2], mu, float(problem.h0), float(problem.J1_0)
        rows.append(dict(zip(layout.BODY, values, strict=True)))
    each = {
        key: _told(layout.OF_BODIES, _columns([line[key] for line in lines]))
        for key in (entries if lines else ())
    }
    return {**_told(layout.OF_LOT, {**_columns(rows), **said}), **each}


def _joined(parts: list[Any]) -> Any:
    """Trees of arrays as one, end to end."""
    first: Any = parts[0]
    if isinstance(first, Dataset):
        return first._replace(values=np.concatenate([part.values for part in parts]))
    return {name: _joined([part[name] for part in parts]) for name in first if name != "ended"}


def _said(found: Mapping[str, Any]) -> str:
    """The ways in which measurements ended; of several records those alike together."""
    if "ended" in found:
        return _ended(found)
    said = {name: _ended(record) for name, record in found.items()}
    if len(set(said.values())) == 1:
        return next(iter(said.values()))
    return "; ".join(f"{name} {text}" for name, text in said.items())


def _ended(found: Any) -> str:
    return str(found["ended"].values)
