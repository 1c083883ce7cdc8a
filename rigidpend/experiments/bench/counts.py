"""Symbols counted and timed: on random phases, on ever more orbits, and on bodies drawn by lot.

The codes of the random phases are in a file, computed in 113 bits by a program written before this
package, which rounds by itself.
"""

from __future__ import annotations

import json
import math
import statistics
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench.methods import Setting
from rigidpend.experiments.bench.problems import FIG4, drawn, from_phases, judged, random_routes
from rigidpend.experiments.bench.protocol import Line, Make, made, timed, timed_solver
from rigidpend.experiments.bench.solvers import Crossed, Task, time_unit
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Array
from rigidpend.routes.choice import expected_seconds
from rigidpend.routes.problem import RouteProblem

STORED = Path(__file__).parent / "random_phases_113bit.json"
"""2,000 phases for each of two starts J1_0, with codes of 15 symbols and the last crossing's t'."""
CHUNK = 250
"""Random phases in one call."""
PILOT = 16
"""Orbits of a body by which the time of a peer's orbit is told."""
TRUTH = 4.0
"""Time of the truth at a body, over that of a peer."""
DEARER = 30.0
"""Time of an orbit in principal axes in 113 bits, over that in 64: 20 to 37 on four bodies."""


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
        found = timed_solver(partial(made, name, task, entry), repeats, seconds, 0.0)
        certain = found.answer.certain
        undecided = 0.0 if certain is None else float((~certain).sum())
        yield {"orbits": float(number), **found.line, "undecided": undecided}
        if found.seconds * after / number > seconds:
            return


def bodies(
    entries: dict[str, Setting],
    seed: int,
    bodies: int,
    orbits: int,
    threads: int,
    repeats: int,
    seconds: float,
    longest: float,
) -> Iterator[Line]:
    """Call each method with bodies drawn by lot that it has not seen before, and again.

    The first method, ours, follows all orbits, fewer where it is expected to take longer than the
    `longest` time; a peer as many of them as it can in its time, with the horizon that ours told.
    Where two methods differ principal axes tell who is right.

    A peer has so many `seconds` of solving at a body, the truth four times as many; no further body
    is begun when the time of all is spent. A line, of a body, has its numbers
    as ``body``, and by method ``first`` and ``again``, seconds, ``orbits`` and the counts of
    :func:`judged`.
    """
    own, *peers = entries
    spent, budget = 0.0, bodies * (longest + seconds * (len(peers) + TRUTH * bool(peers)))
    # What any body needs is compiled before the clock runs.
    for n in (1, orbits):
        made(own, random_routes(FIG4, n), entries[own], threads).solve()
    for name in peers:
        made(name, random_routes(FIG4, min(PILOT, orbits)), entries[name], threads).solve()
    for problem in drawn(seed, bodies):
        if spent > budget:
            return
        task = random_routes(problem, _in_time(problem, orbits, longest))
        taken, found = timed(partial(_with_body, task, entries, threads, repeats, seconds))
        spent += taken
        (A, r, mu), starts = problem.body.floats(), (float(problem.h0), float(problem.J1_0))
        yield {"body": [*A, *r[:2], mu, *starts], **found}


def _in_time(problem: RouteProblem, orbits: int, seconds: float) -> int:
    """As many of the orbits as ours is expected to follow in so many seconds of a core."""
    while orbits > PILOT and expected_seconds(problem, orbits) > seconds:
        orbits //= 2
    return orbits


def _with_body(
    task: Task, entries: dict[str, Setting], threads: int, repeats: int, seconds: float
) -> dict[str, Any]:
    """Times and counts of each method with one body."""
    own, *peers = entries
    orbits = task.states.shape[1]
    ours = timed_solver(lambda: made(own, task, entries[own], threads), repeats, seconds, math.inf)
    answers = {own: ours.answer}
    found: dict[str, Any] = {own: {"orbits": orbits, "first": ours.first, "again": ours.seconds}}
    last = np.nanmax(answers[own].time, initial=0.0)
    task = task._replace(times=np.full((1, orbits), 1.001 * last / time_unit(task.body)))
    for name in peers:
        make = partial(made, name, entry=entries[name], threads=threads)
        found[name], answers[name] = _in_its_time(make, task, repeats, seconds)
    settled, true = _settled(task, answers, TRUTH * seconds)
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
        taken, codes = timed(partial(_told, task.of([k]), true[:, [k]], seconds))
        if codes is None:
            return k, true
        true[:, [k]], spent = codes, spent + taken
    return most, true


def _told(orbit: Task, doubted: Any, seconds: float) -> Any:
    """The symbols of an orbit in doubt, (n_symbols, 1); None where they would take too long.

    64 bits tell where they agree with those that were found otherwise; else 113 do.
    """
    for bits in filter(principal_axes.offers, principal_axes.TRUTH_BITS):
        given = orbit.routes, orbit.theta2_0
        taken, codes = timed(partial(principal_axes.codes, *given, bits=bits, jobs=1))
        if bits == principal_axes.TRUTH_BITS[-1] or (codes == doubted).all():
            return codes
        if DEARER * taken > seconds:
            return None
    return None


def _arrays(stored: Any) -> tuple[Array, Any, Array]:
    """Phases (n,), codes (15, n) and times t' of the last crossing (n,)."""
    phases, texts, times = zip(*stored, strict=True)
    digits = np.array([[int(digit) for digit in text] for text in texts], dtype=np.uint8)
    return np.array(phases), digits.T, np.array(times)
