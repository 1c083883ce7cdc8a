"""Symbols counted and timed: on random phases, on ever more orbits, and on bodies drawn by lot.

The codes of the random phases are in a file, computed in 113 bits by a program written before this
package, which rounds by itself.
"""

from __future__ import annotations

import functools
import json
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.experiments import heyoka_peer, principal_axes
from rigidpend.experiments.bench import drawn
from rigidpend.experiments.bench.measuring.adapters import made
from rigidpend.experiments.bench.measuring.fields import time_unit
from rigidpend.experiments.bench.measuring.problems import (
    FIG4,
    Crossed,
    Task,
    from_phases,
    random_routes,
)
from rigidpend.experiments.bench.measuring.protocol import Make, again, timed
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
TRUTH_BITS = 64, 113
"""Precisions in principal axes that say who is right where two methods differ."""
BLOCK = 8
"""Orbits that are followed so at a time."""


def starts() -> tuple[str, ...]:
    """The values of J1_0 for which phases are stored."""
    return tuple(_stored()["orbits"])


def on_random_phases(J1_0: str, make: Make, most: int, seconds: float) -> dict[str, float]:
    """Count the symbols of a method that are wrong, chunk by chunk.

    Parameters
    ----------
    J1_0 : str
        One of :func:`starts`.
    make : callable
        Makes a method ready for a task.
    most : int
        How many phases at most.
    seconds : float
        After which no further chunk is begun.

    Returns
    -------
    dict
        ``symbols`` compared, ``wrong`` among them, ``wrong_trusted`` of those that the method
        vouches for (all, where nothing is cross-checked), ``undecided``, ``orbits``, ``seconds``,
        and ``last_crossing``, the median error of its t'.
    """
    theta2_0, true, last = _truth(J1_0)
    problem = replace(FIG4, J1_0=exact(J1_0), n_symbols=len(true))
    tally = dict.fromkeys(("symbols", "wrong", "wrong_trusted", "undecided"), 0)
    spent, gaps, done = 0.0, [], 0
    while done < min(most, len(theta2_0)) and spent < seconds:
        columns = slice(done, min(done + CHUNK, most))
        solver = make(from_phases(problem, theta2_0[columns]))
        if not done:
            # What is compiled, is compiled before the clock runs.
            solver.solve()
        taken, found = timed(solver.solve)
        answer = solver.read(found)
        for name, number in judged(answer, true[:, columns]).items():
            tally[name] += number
        gap = np.abs(answer.time[-1] - last[columns])
        gaps.append(np.where(np.isnan(gap), np.inf, gap))
        spent, done = spent + taken, done + answer.codes.shape[1]
    middle = float(np.median(np.concatenate(gaps)))
    return {**tally, "orbits": done, "seconds": spent, "last_crossing": middle}


def judged(answer: Crossed, true: Any) -> dict[str, int]:
    """Numbers of symbols: of all, of wrong ones, of those vouched for, and of undecided ones."""
    wrong = answer.codes != true
    trusted = np.ones_like(wrong) if answer.certain is None else answer.certain
    masks = {"symbols": wrong | True, "wrong": wrong, "wrong_trusted": wrong & trusted}
    return {name: int(mask.sum()) for name, mask in {**masks, "undecided": ~trusted}.items()}


def on_ever_more_orbits(
    make: Make, numbers: Sequence[int], n_symbols: int, repeats: int, seconds: float
) -> Iterator[dict[str, float]]:
    """Time a method at each number of orbits that its budget allows, at one at least.

    The first solve of all carries what is made ready once: tables of maps, compilation.

    Parameters
    ----------
    make : callable
        Makes a method ready for a task.
    numbers : sequence of int
        Of orbits, ascending.
    n_symbols, repeats : int
    seconds : float
        What a number of orbits may take, repetitions included.

    Yields
    ------
    dict
        ``orbits``; ``seconds``, warm, the median; ``prepare``, what the first solve took beyond;
        ``repeats``; ``undecided``, symbols that the method does not vouch for.
    """
    problem = replace(FIG4, n_symbols=n_symbols)
    for number, after in zip(numbers, [*numbers[1:], 0], strict=True):
        task = random_routes(problem, number)
        prepared, solver = timed(lambda: make(task))  # noqa: B023
        first, found = timed(solver.solve)
        certain, taken = solver.read(found).certain, again(solver.solve, repeats, first, seconds)
        middle = statistics.median(taken or [first])
        yield {
            "orbits": float(number),
            "seconds": middle,
            "prepare": prepared + max(0.0, first - middle),
            "repeats": float(len(taken) or 1),
            "undecided": 0.0 if certain is None else float((~certain).sum()),
        }
        if middle * after / number > seconds:
            return


def of_bodies(
    bodies: Sequence[RouteProblem],
    entries: dict[str, Setting],
    orbits: int,
    threads: int,
    repeats: int,
    seconds: float,
    longest: float,
) -> Iterator[dict[str, Any]]:
    """Call each method with bodies that it has not seen before, and again.

    The first method, ours, follows all orbits; a peer as many of them as it can in its time, with
    the horizon that ours told. Where two methods differ principal axes in 113 bits tell who is
    right.

    Parameters
    ----------
    bodies : sequence of RouteProblem
    entries : dict of dict
        Knob and setting of each method; ours first.
    orbits, threads, repeats : int
    seconds : float
        Of solving, a peer's budget at a body; as much for the truth.
    longest : float
        Of ours at a body, on average: no further body is begun when all this time is spent.

    Yields
    ------
    dict
        By method: ``first`` and ``again``, seconds; ``orbits``; and the counts of :func:`judged`.
    """
    own, *peers = entries
    spent, budget = 0.0, len(bodies) * (longest + seconds * len(entries))
    # What any body needs is compiled before the clock runs.
    for n in (1, orbits):
        made(own, random_routes(FIG4, n), entries[own], threads).solve()
    for name in peers:
        made(name, random_routes(FIG4, min(PILOT, orbits)), entries[name], threads).solve()
    for problem in bodies:
        if spent > budget:
            return
        given = problem, entries, orbits, threads, repeats, seconds
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
    solver = made(own, task, entries[own], threads)
    first, answer = timed(solver.solve)
    answers = {own: solver.read(answer)}
    warm = statistics.median(again(solver.solve, repeats, first, seconds, sure=True))
    found: dict[str, Any] = {own: {"orbits": orbits, "first": first, "again": warm}}
    last = np.nanmax(answers[own].time, initial=0.0)
    task = task._replace(times=np.full((1, orbits), 1.001 * last / time_unit(task.body)))
    for name in peers:
        make = functools.partial(made, name, entry=entries[name], threads=threads)
        found[name], answers[name] = _in_its_time(make, task, repeats, seconds)
    settled, true = _settled(task, answers, seconds)
    for name, answer in answers.items():
        n = min(settled, answer.codes.shape[1])
        certain = None if answer.certain is None else answer.certain[:, :n]
        part = Crossed(answer.codes[:, :n], answer.time[:, :n], certain)
        found[name] |= judged(part, true[:, :n])
    return found


def _in_its_time(
    make: Make, task: Task, repeats: int, seconds: float
) -> tuple[dict[str, float], Crossed]:
    """Times of a peer with as many orbits as it is expected to follow in so many seconds.

    Its first call is with a few of them, to which the others are added at what they take again.
    """
    n = few = min(PILOT, task.states.shape[1])
    prepared, solver = timed(lambda: make(task.of(np.arange(few))))
    first, answer = timed(solver.solve)
    taken = [timed(solver.solve)[0]]
    more = min(int(seconds / taken[0] * few), task.states.shape[1])
    if more > few:
        n, solver = more, make(task.of(np.arange(more)))
        warm, answer = timed(solver.solve)
        taken = [warm, *again(solver.solve, repeats - 1, warm, seconds)]
    middle = statistics.median(taken)
    told = {"orbits": n, "first": prepared + first + middle * (n - few) / n, "again": middle}
    return told, solver.read(answer)


def _settled(task: Task, answers: dict[str, Crossed], seconds: float) -> tuple[int, Any]:
    """The number of orbits whose symbols are known, and the symbols of ours set right.

    Where all agree they are known. Where not they are followed in principal axes: in 64 bits, and
    in 113, whose word is final, where these differ from ours. What is behind the first orbit that
    is not settled in time does not count, or none of the doubtful ones would.
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
        for bits in filter(heyoka_peer.offers, TRUTH_BITS):
            phases = [exact(float(x)) for x in task.theta2_0[columns]]
            work = functools.partial(principal_axes.codes, task.routes, phases, bits=bits, jobs=1)
            taken, codes = timed(work)
            spent += taken
            if bits == TRUTH_BITS[-1]:
                true[:, columns] = codes
            columns = columns[(codes != true[:, columns]).any(axis=0)]
            if not columns.size:
                break
        else:
            return int(columns[0]), true
    return most, true


@functools.cache
def _stored() -> Any:
    return json.loads(STORED.read_text(encoding="utf-8"))


@functools.cache
def _truth(J1_0: str) -> tuple[Array, Any, Array]:
    """Phases (n,), codes (15, n) and times t' of the last crossing (n,)."""
    phases, texts, times = zip(*_stored()["orbits"][J1_0], strict=True)
    digits = np.array([[int(digit) for digit in text] for text in texts], dtype=np.uint8)
    return np.array(phases), digits.T, np.array(times)
