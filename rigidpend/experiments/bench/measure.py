"""Measurements of a worker: what is timed, in which order, within which budget.

At first each method alone: the search tries every setting and tolerance of its grid at Fig. 4 and
keeps error and time, of which diagrams are made and a setting is chosen; then its symbols are
counted on random phases, whose codes are in a file, computed in 113 bits by a program written
before this package, which rounds by itself.

The meeting brings the chosen ones together in one process and times them in turn, round by round,
so that what slows the machine slows all of them: ratios come from it and from nothing else. At last
there are bodies drawn by lot.

Each work is a generator of lines, of numbers and lists that any process can take.
"""

from __future__ import annotations

import importlib
import json
import math
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import problems, schema
from rigidpend.experiments.bench.methods import METHODS, Entrant, finest, tolerances
from rigidpend.experiments.bench.peers import made
from rigidpend.experiments.bench.problems import FIG4, Crossed, Task
from rigidpend.experiments.bench.solvers import Make, Solver
from rigidpend.experiments.data import Data
from rigidpend.experiments.principal_axes import judged
from rigidpend.numbers.exact import exact
from rigidpend.routes.choice import expected_seconds
from rigidpend.routes.problem import RouteProblem

Line = dict[str, Any]
"""A measurement, as a worker tells it."""

FAILURES = (ArithmeticError, ImportError, MemoryError, RuntimeError, ValueError)
"""Errors that a method may raise: it found no number, its library is not there or refuses.

Whatever else is raised is a fault of this package's own lines."""
WARM = 8.0
"""Seconds: a first solve that took less, compilation and all, is always followed by a second."""
THREADS = 2
"""Threads with bodies drawn by lot; all else takes one."""
BRIEF = 0.01
"""Seconds: a solve that takes less finds the caches of the processor as others left them."""
STORED = Path(__file__).parent / "random_phases_113bit.json"
"""2,000 phases for each of two starts J1_0, with codes of 15 symbols and the last crossing's t'."""
REPEATS = 3
"""Warm solves at most, whose median counts."""
CHUNK = 250
"""Random phases in one call."""
PILOT = 16
"""Orbits of a body by which the time of a peer's orbit is told."""
TRUTH = 4.0
"""Time of the truth at a body, over that of a peer."""


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Time some work; give the seconds and what it returned."""
    begun = time.perf_counter()
    found = work()
    return time.perf_counter() - begun, found


class Timed(NamedTuple):
    """A method that was made ready, solved a first time, and again; all times are seconds."""

    answer: Any
    made: float
    first: float
    again: list[float]

    @property
    def seconds(self) -> float:
        """A warm solve: the median of the further ones; the first one where there is none."""
        return statistics.median(self.again or [self.first])


def timed_solver(make: Callable[[], Solver], repeats: int, seconds: float, warm: float) -> Timed:
    """Make a method ready and solve, and again as often as some seconds allow.

    Once more at least where the first solve took less than `warm` seconds.
    """
    prepared, solver = timed(make)
    first, found = timed(solver.solve)
    answer = solver.read(found)
    taken = [timed(solver.solve)[0]] if first < warm else []
    while len(taken) < repeats and sum(taken) + (taken or [first])[-1] < seconds:
        taken.append(timed(solver.solve)[0])
    return Timed(answer, prepared, first, taken)


def alone(config: schema.Config, name: str, truth: Data) -> Iterator[Line]:
    """One method: a line for each setting at Fig. 4, then one for each start of random phases."""
    for library in METHODS[name].libraries:
        # What is imported before is not counted as a method's preparation.
        importlib.import_module(library)
    task = problems.fig4(config.problem.columns, config.problem.n_symbols)
    yield from search(task, truth, name, config.search)
    yield from random_phases(config.phases, name, finest(name, config.search))


def search(task: Task, truth: Data, name: str, asked: schema.Search) -> Iterator[Line]:
    """Try every setting of a method: each variant at each tolerance.

    A variant ends where it takes longer than any meeting would wait, preparation not counted: it is
    compilation, mostly.
    """
    slowest = float(asked.slowest)
    for number, setting in enumerate(METHODS[name].variants):
        for tolerance in tolerances(name, asked):
            make = partial(made, name, task, Entrant(tolerance, setting))
            found = timed_solver(make, REPEATS, slowest, WARM)
            line = {"tolerance": math.nan if tolerance is None else tolerance, "setting": number}
            errors = problems.errors(found.answer, truth)
            yield {**line, "seconds": found.seconds, **errors}
            if found.seconds > slowest:
                break


def random_phases(asked: schema.RandomPhases, name: str, entry: Entrant) -> Iterator[Line]:
    """Count the symbols of a method that are wrong, chunk by chunk; a line for each start J1_0.

    After so many seconds no further chunk is begun. Told are the counts of :func:`judged`, the
    ``orbits`` and the ``seconds``.
    """
    for J1_0, stored in json.loads(STORED.read_text(encoding="utf-8"))["orbits"].items():
        phases, texts, _ = zip(*stored[: asked.orbits], strict=True)
        true = np.array([list(map(int, text)) for text in texts], dtype=np.uint8).T
        problem = replace(FIG4, J1_0=exact(J1_0), n_symbols=len(true))
        tally: Counter[str] = Counter()
        spent, done = 0.0, 0
        while done < len(phases) and spent < float(asked.seconds):
            columns = slice(done, done + CHUNK)
            solver = made(name, problems.from_phases(problem, np.array(phases[columns])), entry)
            if not done:
                # What is compiled, is compiled before the clock runs.
                solver.solve()
            taken, found = timed(solver.solve)
            tally.update(judged(solver.read(found), true[:, columns]))
            spent, done = spent + taken, min(columns.stop, len(phases))
        yield {**tally, "J1_0": J1_0, "orbits": done, "seconds": spent}


def meeting(config: schema.Config, entries: dict[str, Entrant], truth: Data) -> Iterator[Line]:
    """Several methods in turn at Fig. 4; a line is a method, and has the times of all rounds."""
    task = problems.fig4(config.problem.columns, config.problem.n_symbols)
    solvers = {name: made(name, task, entry) for name, entry in entries.items()}
    errors = {name: problems.errors(x.read(x.solve()), truth) for name, x in solvers.items()}
    rounds = in_turn(solvers, config.meeting.rounds, float(config.meeting.seconds))
    for name, error in errors.items():
        yield {"method": name, **error, "rounds": rounds[name]}


def in_turn(solvers: dict[str, Solver], rounds: int, seconds: float) -> dict[str, list[float]]:
    """Time methods in turn, round by round; the order turns too.

    A short solve is made twice, and the second one counts. A method that has spent its `seconds`
    misses the rounds that are left: its times are NaN.
    """
    found = {name: [math.nan] * rounds for name in solvers}
    spent, names = dict.fromkeys(solvers, 0.0), list(solvers)
    for k in range(rounds):
        for name in names[k % len(names) :] + names[: k % len(names)]:
            if spent[name] <= seconds:
                taken, _ = timed(solvers[name].solve)
                spent[name] += taken
                if taken < BRIEF:
                    taken, _ = timed(solvers[name].solve)
                    spent[name] += taken
                found[name][k] = taken
    return found


def bodies(config: schema.Config, entries: dict[str, Entrant]) -> Iterator[Line]:
    """Call each method with bodies drawn by lot that it has not seen before, and again.

    The first method, ours, follows all orbits, fewer where it is expected to take longer than the
    `longest` time; a peer as many of them as it can in its time, with the horizon that ours told.
    Where two methods differ principal axes tell who is right.

    A line, of a body, has its numbers as ``body``, and by method ``first`` and ``again``, seconds,
    ``orbits`` and the counts of :func:`judged`.
    """
    asked, (own, *peers) = config.bodies, entries
    # What any body needs is compiled before the clock runs.
    for n in (1, asked.orbits):
        made(own, problems.random_routes(FIG4, n), entries[own], THREADS).solve()
    few = problems.random_routes(FIG4, min(PILOT, asked.orbits))
    for name in peers:
        made(name, few, entries[name], THREADS).solve()
    every = problems.drawn(problems.SEED, asked.kept) + problems.drawn(asked.seed, asked.drawn)
    for problem in every:
        task = problems.random_routes(problem, _in_time(problem, asked.orbits, asked.longest))
        (A, r, mu), starts = problem.body.floats(), (float(problem.h0), float(problem.J1_0))
        yield {"body": [*A, *r[:2], mu, *starts], **_with_body(task, entries, asked)}


def _in_time(problem: RouteProblem, orbits: int, seconds: float) -> int:
    """As many of the orbits as ours is expected to follow in so many seconds of a core."""
    while orbits > PILOT and expected_seconds(problem, orbits) > seconds:
        orbits //= 2
    return orbits


def _with_body(task: Task, entries: dict[str, Entrant], asked: schema.Bodies) -> dict[str, Any]:
    """Times and counts of each method with one body."""
    (own, *peers), seconds, orbits = entries, float(asked.seconds), task.states.shape[1]
    make = partial(made, own, task, entries[own], THREADS)
    ours = timed_solver(make, REPEATS, seconds, math.inf)
    answers = {own: ours.answer}
    found: dict[str, Any] = {own: {"orbits": orbits, "first": ours.first, "again": ours.seconds}}
    last = np.nanmax(ours.answer.time, initial=0.0)
    task = task._replace(end=1.001 * last / problems.time_unit(task.problem.body))
    for name in peers:
        make = partial(made, name, entry=entries[name], threads=THREADS)
        found[name], answers[name] = _in_its_time(make, task, seconds)
    settled, true = _settled(task, answers, TRUTH * seconds)
    for name, answer in answers.items():
        found[name] |= judged(answer, true[:, : min(settled, answer.codes.shape[1])])
    return found


def _in_its_time(make: Make, task: Task, seconds: float) -> tuple[dict[str, float], Crossed]:
    """Times of a peer with as many orbits as it is expected to follow in so many seconds.

    Its first call is with a few of them, to which the others are added at what they take again.
    """
    n = few = min(PILOT, task.states.shape[1])
    pilot = timed_solver(lambda: make(task.of(np.arange(few))), 1, seconds, math.inf)
    answer, middle = pilot.answer, pilot.seconds
    more = min(int(seconds / middle * few), task.states.shape[1])
    if more > few:
        n = more
        all_ = timed_solver(lambda: make(task.of(np.arange(n))), REPEATS - 1, seconds, 0.0)
        answer, middle = all_.answer, statistics.median([all_.first, *all_.again])
    first = pilot.made + pilot.first + middle * (n - few) / n
    return {"orbits": n, "first": first, "again": middle}, answer


def _settled(task: Task, answers: dict[str, Crossed], seconds: float) -> tuple[int, Any]:
    """The number of orbits whose symbols are known, and the symbols of ours set right.

    Where all agree they are known. Where not, principal axes tell. What is behind the first orbit
    for which there is no time does not count, or none of the doubtful ones would.
    """
    first, *others = answers.values()
    true, most = first.codes.copy(), max((x.codes.shape[1] for x in others), default=0)
    differ = np.zeros(most, dtype=bool)
    for other in others:
        n = other.codes.shape[1]
        differ[:n] |= (other.codes != true[:, :n]).any(axis=0)
    spent = 0.0
    for k in map(int, np.flatnonzero(differ)):
        if spent > seconds:
            return k, true
        orbit = task.problem, task.theta2_0[[k]], true[:, [k]]
        taken, (codes, doubtful) = timed(partial(principal_axes.settled, *orbit, 1, seconds))
        if doubtful.size:
            return k, true
        true[:, [k]], spent = codes, spent + taken
    return most, true
