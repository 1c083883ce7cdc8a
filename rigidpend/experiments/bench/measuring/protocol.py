"""The protocol: what is timed, in which order, within which budget.

Two passes. The search takes each method alone, at every setting and knob of its grid, and keeps
error and time: the material of the diagrams, and of the choice of a setting. The meeting then
brings the chosen ones together in one process and times them in turn, round by round, so that
what slows the machine slows all of them: ratios come from it and from nothing else.
"""

from __future__ import annotations

import contextlib
import math
import resource
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.measuring.adapters import made
from rigidpend.experiments.bench.measuring.problems import Task
from rigidpend.experiments.bench.measuring.solvers import Solver
from rigidpend.experiments.bench.methods import METHODS, Method, Setting, spelt

Measured = dict[str, Any]
Make = Callable[[Task], Solver]

LITTLE = 1e-3
"""The part of the way by which the time of all of it is told, over long times; the least."""
WARM = 8.0
"""Seconds: a first solve that took less, compilation and all, is always followed by a second."""
TRIED = 3
"""Solves by which a method finds out whether several threads serve it."""
GROWTH = 2.0
"""Expected cost of the next knob, relative to the last one."""


class Stage(NamedTuple):
    """A problem made ready."""

    task: Task
    truth: dict[str, Any]
    error: Callable[[Any, Any], dict[str, float]]
    long: bool = False
    """True if a slow method goes a part of the way."""


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Time some work; give the seconds and what it returned."""
    begun = time.perf_counter()
    found = work()
    return time.perf_counter() - begun, found


def again(
    solve: Callable[[], Any], repeats: int, first: float, seconds: float, sure: bool = False
) -> list[float]:
    """Times of further solves, as many as some seconds allow after a first one; one if sure."""
    taken = [timed(solve)[0]] if sure else []
    while len(taken) < repeats and sum(taken) + (taken or [first])[-1] < seconds:
        taken.append(timed(solve)[0])
    return taken


def search(
    stage: Stage, name: str, knobs: list[Any], seconds: float, repeats: int
) -> Iterator[Measured]:
    """Try every setting of a method: forms at the middle knob, then each variant at each knob.

    A variant ends where its share of the budget is spent, or would be by the next knob.

    Yields
    ------
    dict
        First ``forms``, what each form took; then a measurement a setting and a knob.
    """
    method = METHODS[name]
    index, told = _best_form(stage, name, method, knobs[len(knobs) // 2], repeats)
    yield {"form": index, "forms": told}
    form = method.forms[index]
    for number, variant in enumerate(method.variants):
        spent, share = 0.0, seconds / len(method.variants)
        for knob in knobs:
            entry = {"knob": knob, "setting": {**form, **variant}}
            line, taken = measured(stage, name, entry, repeats, share)
            yield {**line, "setting": float(number)}
            spent += taken
            if spent + GROWTH * line["once"] > share:
                break


def _best_form(stage: Stage, name: str, method: Method, knob: Any, repeats: int) -> tuple[int, str]:
    """The index of the form that took least time at a knob, and what all of them took."""
    if len(method.forms) == 1:
        return 0, ""
    entries = [{"knob": knob, "setting": {**x, **method.variants[0]}} for x in method.forms]
    taken = [measured(stage, name, entry, repeats, 1.0)[0]["seconds"] for entry in entries]
    best = taken.index(min(taken))
    said = (f"{spelt(f)}: {1e3 * s:.3g} ms" for f, s in zip(method.forms, taken, strict=True))
    return best, f"{'; '.join(said)}; chosen: {spelt(method.forms[best])}"


def measured(
    stage: Stage, name: str, entry: Setting, repeats: int, share: float
) -> tuple[Measured, float]:
    """One measurement, and the seconds that went into solving."""
    part, tried = part_of_the_way(stage, lambda task: made(name, task, entry), share)
    task = stage.task._replace(times=part * stage.task.times)
    prepared, solver = timed(lambda: made(name, task, entry))
    first, found = timed(solver.solve)
    errors = stage.error(solver.read(found), stage.truth)
    taken = again(solver.solve, repeats, first, share, sure=first < WARM)
    middle = statistics.median(taken or [first])
    line = {
        "knob": float(entry["knob"] or np.nan),
        **errors,
        "seconds": middle / part,
        "repeats": float(len(taken) or 1),
        "orbits": float(task.states.shape[1]),
        "part": part,
        "prepare": prepared + max(0.0, first - middle),
        "memory": memory(),
        "once": middle,
    }
    # Preparation is told apart, and no budget pays for it.
    return line, tried + middle * (1 + len(taken))


def part_of_the_way(stage: Stage, make: Make, share: float) -> tuple[float, float]:
    """Part of the way to follow orbits over long times: all of it, or what the budget allows."""
    if not stage.long:
        return 1.0, 0.0
    solver = make(stage.task._replace(times=LITTLE * stage.task.times))
    solver.solve()
    taken, _ = timed(solver.solve)
    whole = taken / LITTLE
    return (1.0 if whole <= share else max(LITTLE, 0.5 * share / whole)), taken


def meeting(
    stage: Stage, entries: dict[str, Setting], threads: int, rounds: int, seconds: float
) -> dict[str, Measured]:
    """Time methods in turn, round by round; the order turns too.

    Parameters
    ----------
    stage : Stage
    entries : dict of dict
        By the name of the method: knob and setting, and over long times the part of the way.
    threads, rounds : int
    seconds : float
        What one method may take in all: where it is spent, it misses the rounds that are left.

    Returns
    -------
    dict
        By method: errors, and ``rounds``, the seconds of each, NaN where it was not timed.
    """
    solvers: dict[str, Callable[[], Any]] = {}
    found: dict[str, Measured] = {}
    for name, entry in entries.items():
        part = entry.get("part", 1.0)
        task = stage.task._replace(times=part * stage.task.times)
        used, solver = _at_its_best(name, entry, task, threads)
        solvers[name] = solver.solve
        found[name] = {
            "knob": float(entry["knob"] or np.nan),
            **stage.error(solver.read(solver.solve()), stage.truth),
            "orbits": float(task.states.shape[1]),
            "part": part,
            "threads": float(used),
            "rounds": [math.nan] * rounds,
        }
    spent, names = dict.fromkeys(entries, 0.0), list(entries)
    for k in range(rounds):
        turned = names[k % len(names) :] + names[: k % len(names)]
        for name in turned:
            if spent[name] <= seconds:
                taken, _ = timed(solvers[name])
                spent[name] += taken
                found[name]["rounds"][k] = taken / found[name]["part"]
    return found


def _at_its_best(name: str, entry: Setting, task: Task, most: int) -> tuple[int, Solver]:
    """The number of threads that takes a method least time, up to the most; its solver.

    Where orbits are few two threads cost more than they save, and no user would take them.
    """
    if most == 1:
        return 1, made(name, task, entry)
    found = []
    for threads in (1, most):
        solver = made(name, task, entry, threads)
        solver.solve()
        found.append((min(timed(solver.solve)[0] for _ in range(TRIED)), threads, solver))
    _, threads, solver = min(found, key=lambda one: one[0])
    return threads, solver


def memory() -> float:
    """The peak of this process so far, MB."""
    # What getrusage tells begins with the peak of the parent, from before it became this one.
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # Linux counts in kB, macOS in bytes.
    return peak / (1024**2 if sys.platform == "darwin" else 1024)
