"""Experiment `bench`: time, error and trust of our methods and of others.

What is measured is measured by workers, each a process of its own: fresh memory, cold caches,
libraries of one thread. It does a work of `measure`, and tells each line as soon as it is there.
"""

from __future__ import annotations

import importlib.util
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import BODY, measure, methods
from rigidpend.experiments.bench.measure import Line
from rigidpend.experiments.bench.methods import METHODS, PROBLEMS, Entrant
from rigidpend.experiments.bench.problems import stage
from rigidpend.experiments.bench.schema import Config
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Data, Tree
from rigidpend.machine import wording
from rigidpend.machine.workers import WorkerError, apart
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import EngineError

PATIENCE, GRACE = 4, 240
"""A worker is ended after so many budgets, and so many seconds more."""
COMPLETE = "complete"
ALONE = {
    **dict.fromkeys(
        ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
    ),
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
}
"""The environment that leaves threads to whoever shares the orbits among them."""


def compute(config: Config, means: Means) -> Tree:
    """Search for the best setting of each method, let them meet, and count wrong symbols.

    Each worker's measurements are a part, which an interrupted run keeps. EngineError is raised
    where heyoka, which makes the references in 113 bits, is not installed.
    """
    if not principal_axes.installed():
        raise EngineError("the references need the package heyoka, which is not installed")

    def part(name: str, title: str, work: Callable[..., Tree], *given: Any) -> Any:
        found = means.part(name, partial(work, config, *given))
        means.report(f"{title}: {'; '.join(dict.fromkeys(_ends(found))) or 'done'}")
        return found

    truth = {
        name: part(f"reference.{name}", f"reference, {PROBLEMS[name].title}", _reference, name)
        for name in config.problem.problems
    }
    searched = {
        key: part(f"search.{key}", METHODS[key].label, _search, key, truth)
        for key in config.problem.methods
        if set(METHODS[key].answers) & set(truth)
    }
    records = {name: _turned(searched).get(name, {}) for name in truth}
    met = {}
    for name, group in records.items():
        guests = methods.guests(name, group, config)
        if len(guests) > 1:
            title = PROBLEMS[name].title
            met[name] = part(f"meeting.{name}", title, _meeting, name, guests, truth)
    phases = {
        key: part(f"phases.{key}", f"random phases, {METHODS[key].label}", _phases, key, entry)
        for key, entry in _entries(config, config.phases.methods, {}).items()
    }
    bodies = part("bodies", "bodies drawn by lot", _bodies, records.get("codes", {}))
    told = {x: {"title": PROBLEMS[x].title, "default": PROBLEMS[x].default} for x in truth}
    return {
        **{name: {**told[name], **group} for name, group in records.items()},
        "meetings": {"threads_1": {}, f"threads_{measure.THREADS}": {}, **_turned(met)},
        "random_phases": _turned(phases),
        **({"bodies": bodies} if bodies else {}),
    }


def _reference(config: Config, name: str) -> Tree:
    """The truth of a problem."""
    return stage(name, config.problem).truth


def _search(config: Config, key: str, truth: dict[str, Data]) -> Tree:
    """The records of a method, by problem."""
    problems = [name for name in truth if name in METHODS[key].answers]
    if missing := _missing(key):
        return {name: {"ended": f"absent: {missing} is not installed"} for name in problems}
    asked = len(METHODS[key].variants) * len(methods.tolerances(key, config.search))
    budgets = len(problems) * asked * float(config.search.slowest)
    lines, ended = by_worker(measure.search, (config, key, truth), budgets)
    found: dict[str, Tree] = {}
    for name in problems:
        own = [line for line in lines if line["problem"] == name]
        rows = [line for line in own if "seconds" in line]
        wrong = next((line["failed"] for line in own if "failed" in line), ended)
        found[name] = {**_columns(rows), "ended": _cut(wrong, len(rows), asked)}
    return found


def _meeting(config: Config, name: str, guests: dict[str, Entrant], truth: dict[str, Data]) -> Tree:
    """The records of the methods that meet at a problem, by the number of threads."""
    counts = 1, measure.THREADS
    budgets = len(guests) * len(counts) * float(config.meeting.seconds)
    lines, ended = by_worker(measure.meeting, (config, name, guests, truth), budgets)
    # Where a second thread serves nobody there is no meeting.
    found: dict[str, Any] = {f"threads_{n}": {"ended": ended} for n in counts if ended}
    for line in lines:
        record = {**_numbers(line), "chosen": str(guests[line["method"]])}
        group = found.setdefault(f"threads_{line['most']}", {})
        group |= {"ended": COMPLETE, line["method"]: record}
    return found


def _phases(config: Config, key: str, entry: Entrant) -> Tree:
    """The records of a method on random phases, by J1_0."""
    budgets = 2 * float(config.phases.seconds)
    lines, ended = by_worker(measure.random_phases, (config, key, entry), budgets)
    if ended:
        raise RuntimeError(f"random phases, {METHODS[key].label}: {ended}")
    return {f"J1_0_{line['J1_0']}": _numbers(line) for line in lines}


def _bodies(config: Config, codes: Data) -> Tree:
    """The bodies drawn by lot, and the records of all methods with them."""
    asked, n = config.bodies, config.bodies.kept + config.bodies.drawn
    entries = _entries(config, asked.methods, codes)
    for key, entry in entries.items():
        if METHODS[key].family == "heyoka":
            # It is compiled once for all of them.
            entries[key] = entry._replace(setting={**entry.setting, "parameters": True})
    # Of ours, of peers and of the truth.
    budgets = n * (asked.longest + float(asked.seconds) * (len(entries) - 1 + measure.TRUTH))
    lines, ended = by_worker(measure.bodies, (config, entries), budgets) if n else ([], "")
    if not lines:
        return {}
    bodies = _columns([dict(zip(BODY, line["body"], strict=True)) for line in lines])
    each = {key: _columns([line[key] for line in lines]) for key in entries}
    return {**bodies, "ended": _cut(ended, len(lines), n), **each}


def _entries(config: Config, keys: Sequence[str], codes: Data) -> dict[str, Entrant]:
    """The methods that are there, each with its setting for the codes of Fig. 4."""
    return {
        key: methods.best("codes", key, codes.get(key, {}), config.search)
        for key in keys
        if not _missing(key)
    }


def _missing(key: str) -> str:
    """Name the first of a method's libraries that is not installed; empty where all are."""
    missing = (x for x in METHODS[key].libraries if importlib.util.find_spec(x) is None)
    return next(missing, "")


def _turned(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Groups in groups, the inner names outside."""
    found: dict[str, dict[str, Any]] = {}
    for outer, group in groups.items():
        for inner, node in group.items():
            found.setdefault(inner, {})[outer] = node
    return found


def _columns(rows: Sequence[Line]) -> dict[str, Array]:
    """The numbers of rows by their names."""
    every = [_numbers(row) for row in rows]
    return {name: np.array([row[name] for row in every]) for name in (every[0] if every else ())}


def _numbers(row: Line) -> dict[str, Array]:
    """The numbers of a row, and its lists of them."""
    return {name: np.array(x, float) for name, x in row.items() if not isinstance(x, str)}


def _cut(wrong: str, done: int, planned: int) -> str:
    """End of a measurement: complete, at its budget, or by what went wrong."""
    cut = wrong or ("cut where it took too long" if done < planned else "")
    return f"{cut}: {done} of {planned}" if cut else COMPLETE


def _ends(found: Tree) -> Iterator[str]:
    """The ways in which the measurements of a tree ended."""
    for name, node in found.items():
        if isinstance(node, Mapping):
            yield from _ends(node)
        elif name == "ended":
            yield node


def by_worker(
    work: Callable[..., Iterator[Line]], given: tuple[Any, ...], budgets: float
) -> tuple[list[Line], str]:
    """The lines that a worker tells of its work, and how it ended: empty, or what went wrong.

    It is ended at :data:`PATIENCE` times the seconds of all its budgets; what it has measured
    until then is kept.
    """
    lines: list[Line] = []
    before = dict(os.environ)
    with tempfile.TemporaryDirectory() as cache:
        # The cache is empty: what is compiled is compiled there, what is built is built.
        os.environ.update(ALONE, XDG_CACHE_HOME=cache)
        try:
            return lines, apart(_tell, (work, given), lines.append, PATIENCE * budgets + GRACE)
        except TimeoutError as late:
            return lines, str(late)
        except WorkerError as crash:
            return lines, f"failed: {crash}"
        finally:
            os.environ.clear()
            os.environ.update(before)


def _tell(work: Callable[..., Iterator[Line]], given: tuple[Any, ...], say: Any) -> str:
    """Do work in a worker and say its lines; how it failed, if the method did."""
    try:
        for line in work(*given):
            say(line)
    except measure.FAILURES as error:
        return f"failed: {wording.error(error)}"
    return ""
