"""Symbols counted and timed: on random phases, on ever more orbits, and on bodies drawn by lot.

The codes of the random phases are in a file, computed in 113 bits by a program written before this
package, which rounds by itself.
"""

from __future__ import annotations

import functools
import json
import math
import statistics
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import drawn
from rigidpend.experiments.bench.measuring.adapters import made
from rigidpend.experiments.bench.measuring.fields import time_unit
from rigidpend.experiments.bench.measuring.problems import (
    FIG4,
    Crossed,
    Task,
    from_phases,
    judged,
    random_routes,
)
from rigidpend.experiments.bench.measuring.protocol import Line, Make, timed, timed_solver
from rigidpend.experiments.bench.methods import Setting
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem

STORED = Path(__file__).parent / "random_phases_113bit.json"
"""2,000 phases for each of two starts J1_0, with codes of 15 symbols and the last crossing's t'."""
CHUNK = 250
"""Random phases in one call."""
PILOT = 16
"""Orbits of a body by which the time of a peer's orbit is told."""
BLOCK = 8
"""Orbits that are followed so at a time."""


def random_phases(entries: dict[str, Setting], orbits: int, seconds: float) -> Iterator[Line]:
    """Count the symbols of a method that are wrong, chunk by chunk; a line for each start J1_0.

    After so many seconds no further chunk is begun. Told are the counts of :func:`judged`, the
    ``orbits``, the ``seconds``, and ``last_crossing``, the median error of its t'.
    """
    [(name, entry)] = entries.items()
    for J1_0, stored in json.loads(STORED.read_text(encoding="utf-8"))["orbits"].items():
        theta2_0, true, last = _arrays(stored)
        problem = replace(FIG4, J1_0=exact(J1_0), n_symbols=len(true))
        tally: Counter[str] = Counter()
        spent, gaps, done = 0.0, [], 0
        while done < min(orbits, len(theta2_0)) and spent < seconds:
            columns = slice(done, min(done + CHUNK, orbits))
            solver = made(name, from_phases(problem, theta2_0[columns]), entry)
            if not done:
                # What is compiled, is compiled before the clock runs.
                solver.solve()
            taken, found = timed(solver.solve)
            answer = solver.read(found)
            tally.update(judged(answer, true[:, columns]))
            gap = np.abs(answer.time[-1] - last[columns])
            gaps.append(np.where(np.isnan(gap), np.inf, gap))
            spent, done = spent + taken, done + answer.codes.shape[1]
        middle = float(np.median(np.concatenate(gaps)))
        told = {"J1_0": J1_0, "orbits": done, "seconds": spent, "last_crossing": middle}
        yield {**tally, **told}


def many_orbits(
    entries: dict[str, Setting], numbers: list[int], n_symbols: int, repeats: int, seconds: float
) -> Iterator[Line]:
    """Time a method at each of ascending numbers of orbits that its budget allows, one at least.

    The first solve of all carries what is made ready once: tables of maps, compilation. A number
    of orbits may take so many seconds, repetitions included.
    """
    [(name, entry)] = entries.items()
    problem = replace(FIG4, n_symbols=n_symbols)
    for number, after in zip(numbers, [*numbers[1:], 0], strict=True):
        task = random_routes(problem, number)
        found = timed_solver(functools.partial(made, name, task, entry), repeats, seconds, 0.0)
        certain = found.answer.certain
        undecided = 0.0 if certain is None else float((~certain).sum())
        yield {"orbits": float(number), **found.line, "undecided": undecided}
        if found.seconds * after / number > seconds:
            return


def bodies(
    entries: dict[str, Setting],
    seed: int,
    bodies: int,
    numbers: list[int],
    orbits: int,
    threads: int,
    repeats: int,
    seconds: float,
    longest: float,
) -> Iterator[Line]:
    """Call each method with bodies of a list that it has not seen before, and again.

    The first method, ours, follows all orbits; a peer as many of them as it can in its time, with
    the horizon that ours told. Where two methods differ principal axes in 113 bits tell who is
    right.

    A peer has so many `seconds` of solving at a body, and the truth as many; no further body is
    begun when ours has taken the `longest` time, on average. A line, of a body, has ``first`` and
    ``again``, seconds, ``orbits`` and the counts of :func:`judged`, by method.
    """
    own, *peers = entries
    spent, budget = 0.0, len(numbers) * (longest + seconds * len(entries))
    # What any body needs is compiled before the clock runs.
    for n in (1, orbits):
        made(own, random_routes(FIG4, n), entries[own], threads).solve()
    for name in peers:
        made(name, random_routes(FIG4, min(PILOT, orbits)), entries[name], threads).solve()
    every = drawn.drawn(seed, bodies)
    for k in numbers:
        if spent > budget:
            return
        given = every[k], entries, orbits, threads, repeats, seconds
        taken, found = timed(functools.partial(_with_body, *given))
        spent += taken
        yield found


def _with_body(
    problem: RouteProblem,
    entries: dict[str, Setting],
    orbits: int,
    threads: int,
    repeats: int,
    seconds: float,
) -> dict[str, Any]:
    """Times and counts of each method with one body."""
    own, *peers = entries
    task = from_phases(problem, drawn.phases(orbits))
    ours = timed_solver(lambda: made(own, task, entries[own], threads), repeats, seconds, math.inf)
    answers = {own: ours.answer}
    found: dict[str, Any] = {own: {"orbits": orbits, "first": ours.first, "again": ours.seconds}}
    last = np.nanmax(answers[own].time, initial=0.0)
    task = task._replace(times=np.full((1, orbits), 1.001 * last / time_unit(task.body)))
    for name in peers:
        make = functools.partial(made, name, entry=entries[name], threads=threads)
        found[name], answers[name] = _in_its_time(make, task, repeats, seconds)
    settled, true = _settled(task, answers, seconds)
    for name, answer in answers.items():
        found[name] |= judged(answer, true[:, : min(settled, answer.codes.shape[1])])
    return found


def _in_its_time(
    make: Make, task: Task, repeats: int, seconds: float
) -> tuple[dict[str, float], Crossed]:
    """Times of a peer with as many orbits as it is expected to follow in so many seconds.

    Its first call is with a few of them, to which the others are added at what they take again.
    """
    n = few = min(PILOT, task.states.shape[1])
    pilot = timed_solver(lambda: make(task.of(np.arange(few))), 1, seconds, math.inf)
    answer, middle = pilot.answer, pilot.seconds
    more = min(int(seconds / middle * few), task.states.shape[1])
    if more > few:
        n = more
        all_ = timed_solver(lambda: make(task.of(np.arange(n))), repeats - 1, seconds, 0.0)
        answer, middle = all_.answer, statistics.median([all_.first, *all_.again])
    first = pilot.made + pilot.first + middle * (n - few) / n
    return {"orbits": n, "first": first, "again": middle}, answer


def _settled(task: Task, answers: dict[str, Crossed], seconds: float) -> tuple[int, Any]:
    """The number of orbits whose symbols are known, and the symbols of ours set right.

    Where all agree they are known. Where not, principal axes tell. What is behind the first orbit
    that is not settled in time does not count, or none of the doubtful ones would.
    """
    first, *others = answers.values()
    true, most = first.codes.copy(), max((x.codes.shape[1] for x in others), default=0)
    differ = np.zeros(most, dtype=bool)
    for other in others:
        n = other.codes.shape[1]
        differ[:n] |= (other.codes != true[:, :n]).any(axis=0)
    doubtful, spent = np.flatnonzero(differ), 0.0
    for k in range(0, doubtful.size, BLOCK):
        if spent > seconds:
            return int(doubtful[k]), true
        columns = doubtful[k : k + BLOCK]
        given = task.routes, task.theta2_0[columns], true[:, columns], 1
        taken, (codes, left) = timed(functools.partial(principal_axes.settled, *given))
        true[:, columns], spent = codes, spent + taken
        if left.size:
            return int(columns[left[0]]), true
    return most, true


def _arrays(stored: Any) -> tuple[Array, Any, Array]:
    """Phases (n,), codes (15, n) and times t' of the last crossing (n,)."""
    phases, texts, times = zip(*stored, strict=True)
    digits = np.array([[int(digit) for digit in text] for text in texts], dtype=np.uint8)
    return np.array(phases), digits.T, np.array(times)
