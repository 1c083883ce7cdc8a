"""Experiment `bench`: time, error and trust of our methods and of others.

Workers measure, each in a process of its own: with fresh memory, cold caches, and libraries
limited to one thread. A worker runs a generator of `measure` and sends each line at once.
"""

import importlib.util
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import BODY, measure, methods, problems
from rigidpend.experiments.bench.measure import Line
from rigidpend.experiments.bench.methods import METHODS, Entrant
from rigidpend.experiments.bench.schema import Config
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Data, Tree
from rigidpend.machine import wording
from rigidpend.machine.workers import WorkerError, apart
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.arithmetic import EngineError

PATIENCE, GRACE = 4, 240
"""Multiple of a worker's budgets, and further seconds, after which it is ended."""
COMPLETE = "complete"
THREADS = "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"
"""Environment variables that are set to 1, so that only our own threads share the orbits."""


def compute(config: Config, means: Means) -> Tree:
    """Search for the best setting of each method, let them meet, and count wrong symbols.

    Each worker's measurements are a part, which an interrupted run keeps. EngineError if heyoka is
    not installed, which decides who is right with randomly drawn bodies.
    """
    if not principal_axes.installed():
        raise EngineError("the truth needs the package heyoka, which is not installed")

    def part(name: str, work: Callable[..., Tree], *given: Any) -> Any:
        found = means.part(name, partial(work, config, *given))
        means.report(f"{name.replace('.', ' ')}: done")
        return found

    truth = part("truth", _truth)
    alone = {key: part(f"alone.{key}", _alone, key, truth) for key in config.problem.methods}
    records = {key: found["searched"] for key, found in alone.items()}
    meeting = part("meeting", _meeting, methods.guests(records, config), truth)
    counted: dict[str, dict[str, Tree]] = {}
    for key, found in alone.items():
        for start, record in found["counted"].items():
            counted.setdefault(start, {})[key] = record
    bodies = part("bodies", _bodies, records)
    found = {"fig4": records, "meeting": meeting, "random_phases": counted}
    return found | ({"bodies": bodies} if bodies else {})


def _truth(config: Config) -> Tree:
    return problems.truth(problems.fig4(config.problem.columns, config.problem.n_symbols))


def _alone(config: Config, key: str, truth: Data) -> Tree:
    """The search of a method, and the counts of its symbols at random phases, by J1_0."""
    if missing := _missing(key):
        return {"searched": {"ended": f"absent: {missing} is not installed"}, "counted": {}}
    asked = len(METHODS[key].variants) * len(methods.tolerances(key, config.search))
    budgets = asked * float(config.search.slowest) + 2 * float(config.phases.seconds)
    lines, ended = by_worker(measure.alone, (config, key, truth), budgets)
    rows = [line for line in lines if "J1_0" not in line]
    # Counts are stored for both starts or for none, so that rows are comparable.
    done = () if ended else (line for line in lines if "J1_0" in line)
    counted = {f"J1_0_{line['J1_0']}": _numbers(line) for line in done}
    searched = {**_columns(rows), "ended": _cut(ended, len(rows), asked)}
    return {"searched": searched, "counted": counted}


def _meeting(config: Config, guests: dict[str, Entrant], truth: Data) -> Tree:
    """The records of the methods that meet."""
    budgets = len(guests) * float(config.meeting.seconds)
    lines, ended = by_worker(measure.meeting, (config, guests, truth), budgets)
    each = {line["method"]: _numbers(line) for line in lines}
    return {**each, "ended": _cut(ended, len(lines), len(guests))}


def _bodies(config: Config, records: Data) -> Tree:
    """The randomly drawn bodies, and the records of all methods with them."""
    asked, n = config.bodies, config.bodies.kept + config.bodies.drawn
    entries = {}
    for key in (x for x in asked.methods if not _missing(x)):
        entry = methods.best(key, records.get(key, {}), config.search)
        entries[key] = entry._replace(setting=entry.setting | METHODS[key].drawn)
    # Budgets of our method, of peers and of the truth.
    budgets = n * (asked.longest + float(asked.seconds) * (len(entries) - 1 + measure.TRUTH))
    lines, ended = by_worker(measure.bodies, (config, entries), budgets) if n else ([], "")
    if not lines:
        return {}
    bodies = _columns([dict(zip(BODY, line["body"], strict=True)) for line in lines])
    each = {key: _columns([line[key] for line in lines]) for key in entries}
    return {**bodies, "ended": _cut(ended, len(lines), n), **each}


def _missing(key: str) -> str:
    """Name of the first of a method's libraries that is not installed; empty if all are."""
    missing = (x for x in METHODS[key].libraries if importlib.util.find_spec(x) is None)
    return next(missing, "")


def _columns(rows: Sequence[Line]) -> dict[str, Array]:
    """The numbers of rows as arrays, by name."""
    every = [_numbers(row) for row in rows]
    return {name: np.array([row[name] for row in every]) for name in (every[0] if every else ())}


def _numbers(row: Line) -> dict[str, Array]:
    """The numbers and lists of numbers of a row as arrays, by name."""
    return {name: np.array(x, float) for name, x in row.items() if not isinstance(x, str)}


def _cut(wrong: str, done: int, planned: int) -> str:
    """Text on the end of a measurement: complete, at its budget, or what went wrong."""
    cut = wrong or ("cut where it took too long" if done < planned else "")
    return f"{cut}: {done} of {planned}" if cut else COMPLETE


def by_worker(
    work: Callable[..., Iterator[Line]], given: tuple[Any, ...], budgets: float
) -> tuple[list[Line], str]:
    """The lines of a worker, and a text on its end: empty, or what went wrong.

    The worker is ended at :data:`PATIENCE` times the seconds of all its budgets; lines received
    until then are kept.
    """
    lines: list[Line] = []
    before = dict(os.environ)
    with tempfile.TemporaryDirectory() as cache:
        # The cache is empty, so that compilation and return maps are part of the first call.
        os.environ.update(dict.fromkeys(THREADS, "1"), XDG_CACHE_HOME=cache)
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
    """Run a generator in a worker and send its lines; return the method's failure, if any."""
    try:
        for line in work(*given):
            say(line)
    except measure.FAILURES as error:
        return f"failed: {wording.error(error)}"
    return ""
