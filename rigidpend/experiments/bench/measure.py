"""Measurements of a worker: the order of timings and their budgets.

First each method is measured alone. The search tries every setting and tolerance of its grid at
Fig. 4 and keeps error and time, for the diagrams and the choice of a setting. Then wrong symbols
are counted on random phases, whose codes are in a file, computed in 113 bits by a program that is
older than this package and shares no rounding with it.

The meeting times the chosen settings in turn in one process, round by round, so that whatever slows
the machine slows all of them: ratios come only from the meeting. Randomly drawn bodies come last.

Each of these is a generator of lines: dictionaries of numbers and lists, which processes exchange.
"""

import json
import math
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import problems, schema
from rigidpend.experiments.bench.methods import METHODS, Entrant, finest, tolerances
from rigidpend.experiments.bench.peers import Make, Solver, ready
from rigidpend.experiments.bench.problems import FIG4, Crossed, Task
from rigidpend.experiments.data import Data
from rigidpend.experiments.principal_axes import judged
from rigidpend.numbers.exact import exact
from rigidpend.routes.choice import expected_seconds
from rigidpend.routes.problem import RouteProblem

Line = dict[str, Any]
"""A measurement, as a worker sends it."""

FAILURES = (ArithmeticError, ImportError, MemoryError, RuntimeError, ValueError)
"""Errors that a method may raise: it finds no number, or its library is missing or refuses.

Any other error is a fault of this package."""
THREADS = 2
"""Threads for randomly drawn bodies; other measurements use one."""
BRIEF = 0.01
"""Seconds of a solve below which its time depends on the processor's caches left by others."""
STORED = Path(__file__).parent / "random_phases_113bit.json"
"""2,000 phases for each of two starts J1_0, with codes of 15 symbols and the last crossing's t'."""
REPEATS = 3
"""Largest number of warm solves, whose median counts."""
CHUNK = 250
"""Random phases in one call."""
PILOT = 16
"""Orbits of a body from which the time of a peer for an orbit is estimated."""
TRUTH = 4.0
"""Time allowed for the truth of a body, over that for a peer."""


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Time a call; return the seconds and its result."""
    begun = time.perf_counter()
    found = work()
    return time.perf_counter() - begun, found


def timed_solver(make: Callable[[], Solver], seconds: float) -> tuple[Crossed, float, float]:
    """Make a method ready, solve twice, and solve again as often as the seconds allow.

    Returns the answer, the seconds to make it ready and to solve, and those of a warm solve: the
    median of those after the first.
    """
    ready_in, solver = timed(make)
    solved_in, found = timed(solver.solve)
    answer, taken = solver.read(found), [timed(solver.solve)[0]]
    while len(taken) < REPEATS and sum(taken) + taken[-1] < seconds:
        taken.append(timed(solver.solve)[0])
    return answer, ready_in + solved_in, statistics.median(taken)


def alone(config: schema.Config, name: str, truth: Data) -> Iterator[Line]:
    """One method: a line for each setting at Fig. 4, then one for each start of random phases."""
    task = problems.fig4(config.problem.columns, config.problem.n_symbols)
    yield from search(task, truth, name, config.search)
    yield from random_phases(config.phases, name, finest(name, config.search))


def search(task: Task, truth: Data, name: str, asked: schema.Search) -> Iterator[Line]:
    """Try every setting of a method: each variant at each tolerance.

    A variant ends when a solve takes longer than the meeting allows. Preparation, mostly
    compilation, does not count.
    """
    slowest = float(asked.slowest)
    for number, setting in enumerate(METHODS[name].variants):
        for tolerance in tolerances(name, asked):
            make = partial(ready, name, task, Entrant(tolerance, setting))
            answer, _, again = timed_solver(make, slowest)
            line = {"tolerance": math.nan if tolerance is None else tolerance, "setting": number}
            yield {**line, "seconds": again, **problems.errors(answer, truth)}
            if again > slowest:
                break


def random_phases(asked: schema.RandomPhases, name: str, entry: Entrant) -> Iterator[Line]:
    """Count the wrong symbols of a method, chunk by chunk; a line for each start J1_0.

    After the asked number of seconds no further chunk begins. A line has the counts of
    :func:`judged`, the ``orbits`` and the ``seconds``.
    """
    for J1_0, stored in json.loads(STORED.read_text(encoding="utf-8"))["orbits"].items():
        phases, texts, _ = zip(*stored[: asked.orbits], strict=True)
        true = np.array([list(map(int, text)) for text in texts], dtype=np.uint8).T
        problem = replace(FIG4, J1_0=exact(J1_0), n_symbols=len(true))
        tally: Counter[str] = Counter()
        spent, done = 0.0, 0
        while done < len(phases) and spent < float(asked.seconds):
            columns = slice(done, done + CHUNK)
            solver = ready(name, problems.from_phases(problem, np.array(phases[columns])), entry)
            if not done:
                # Solved once before the clock runs, so that compilation does not count.
                solver.solve()
            taken, found = timed(solver.solve)
            tally.update(judged(solver.read(found), true[:, columns]))
            spent, done = spent + taken, min(columns.stop, len(phases))
        yield {**tally, "J1_0": J1_0, "orbits": done, "seconds": spent}


def meeting(config: schema.Config, entries: dict[str, Entrant], truth: Data) -> Iterator[Line]:
    """Time several methods in turn at Fig. 4; a line for each, with the times of all rounds."""
    task = problems.fig4(config.problem.columns, config.problem.n_symbols)
    solvers = {name: ready(name, task, entry) for name, entry in entries.items()}
    errors = {name: problems.errors(x.read(x.solve()), truth) for name, x in solvers.items()}
    rounds = in_turn(solvers, config.meeting.rounds, float(config.meeting.seconds))
    for name, error in errors.items():
        yield {"method": name, **error, "rounds": rounds[name]}


def in_turn(solvers: dict[str, Solver], rounds: int, seconds: float) -> dict[str, list[float]]:
    """Time methods in turn, round by round; each round begins with another method.

    A short solve is repeated, and the second time counts. A method that has spent its `seconds`
    misses the remaining rounds: its times there are NaN.
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
    """Call each method with randomly drawn bodies that it has not seen before, and again.

    The first method, ours, follows all orbits, or fewer if it is expected to take longer than
    `longest`; a peer follows as many of them as its time allows, up to the end times found by ours.
    Where two methods differ, principal axes decide who is right.

    A line for each body has its numbers as ``body``, and by method ``first`` and ``again``, in
    seconds, ``orbits`` and the counts of :func:`judged`.
    """
    asked, (own, *peers) = config.bodies, entries
    # Code that serves every body is compiled before the clock runs.
    for n in (1, asked.orbits):
        ready(own, problems.random_routes(FIG4, n), entries[own], THREADS).solve()
    few = problems.random_routes(FIG4, min(PILOT, asked.orbits))
    for name in peers:
        ready(name, few, entries[name], THREADS).solve()
    every = problems.drawn(problems.SEED, asked.kept) + problems.drawn(asked.seed, asked.drawn)
    for problem in every:
        task = problems.random_routes(problem, _in_time(problem, asked.orbits, asked.longest))
        (A, r, mu), starts = problem.body.floats(), (float(problem.h0), float(problem.J1_0))
        yield {"body": [*A, *r[:2], mu, *starts], **_with_body(task, entries, asked)}


def _in_time(problem: RouteProblem, orbits: int, seconds: float) -> int:
    """Number of orbits that our method is expected to follow in some seconds of a core."""
    while orbits > PILOT and expected_seconds(problem, orbits) > seconds:
        orbits //= 2
    return orbits


def _with_body(task: Task, entries: dict[str, Entrant], asked: schema.Bodies) -> dict[str, Any]:
    """Times and counts of each method with one body."""
    (own, *peers), seconds, orbits = entries, float(asked.seconds), task.states.shape[1]
    make = partial(ready, own, task, entries[own], THREADS)
    answer, first, again = timed_solver(make, seconds)
    answers = {own: answer}
    found: dict[str, Any] = {own: {"orbits": orbits, "first": first, "again": again}}
    # Peers need an end time: the last crossing that ours found, and a little more.
    last = np.nanmax(answer.crossing_time, initial=0.0)
    task = task._replace(end=1.001 * last / problems.time_unit(task.problem.body))
    for name in peers:
        make = partial(ready, name, entry=entries[name], threads=THREADS)
        found[name], answers[name] = _in_its_time(make, task, seconds)
    settled, true = _settled(task, answers, TRUTH * seconds)
    for name, answer in answers.items():
        found[name] |= judged(answer, true[:, : min(settled, answer.codes.shape[1])])
    return found


def _in_its_time(make: Make, task: Task, seconds: float) -> tuple[dict[str, float], Crossed]:
    """Times of a peer with as many orbits as it is expected to follow in its seconds.

    Its first call has a few of them; the time of the other orbits in a second call is added.
    """
    n = few = min(PILOT, task.states.shape[1])
    answer, first, again = timed_solver(lambda: make(task.of(np.arange(few))), seconds)
    more = min(int(seconds / again * few), task.states.shape[1])
    if more > few:
        n = more
        answer, _, again = timed_solver(lambda: make(task.of(np.arange(n))), seconds)
    return {"orbits": n, "first": first + again * (n - few) / n, "again": again}, answer


def _settled(task: Task, answers: dict[str, Crossed], seconds: float) -> tuple[int, Any]:
    """The number of orbits whose symbols are known, and our symbols corrected.

    Symbols on which all methods agree are known; others are found in principal axes. Orbits after
    the first one that no time is left for do not count: keeping only those on which methods agree
    would leave out just the doubtful ones.
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
        taken, (codes, doubtful) = timed(
            partial(principal_axes.settled, *orbit, 1, seconds=seconds)
        )
        if doubtful.size:
            return k, true
        true[:, [k]], spent = codes, spent + taken
    return most, true
