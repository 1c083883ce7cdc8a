"""The protocol: what is timed, in which order, within which budget.

Two passes. The search takes each method alone, at every setting and knob of its grid, and keeps
error and time: the material of the diagrams, and of the choice of a setting. The meeting then
brings the chosen ones together in one process and times them in turn, round by round, so that
what slows the machine slows all of them: ratios come from it and from nothing else.

What a worker is asked for has arguments of JSON: a method's entry is its `knob`, its `setting`
and, over long times, the `part` of the way; for a search, its knobs by problem.
"""

from __future__ import annotations

import contextlib
import importlib
import math
import resource
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.methods import METHODS, PROBLEMS, Method, Setting, spelt
from rigidpend.experiments.bench.problems import ASKED
from rigidpend.experiments.bench.solvers import Crossed, Solver, Task

Line = dict[str, Any]
"""A measurement, as a worker tells it."""
Make = Callable[[Task], Solver]

FAILURES = (ArithmeticError, ImportError, MemoryError, RuntimeError, ValueError)
"""Errors that a method may raise: it found no number, its library is not there or refuses.

Whatever else is raised is a fault of this package's own lines."""
LITTLE = 1e-3
"""The part of the way by which the time of all of it is told, over long times; the least."""
WARM = 8.0
"""Seconds: a first solve that took less, compilation and all, is always followed by a second."""
TRIED = 2
"""Solves by which a method finds out whether several threads serve it."""
GROWTH = 2.0
"""Expected cost of the next knob, relative to the last one."""


def made(name: str, task: Task, entry: Setting, threads: int = 1) -> Solver:
    """A method made ready for a task, with its knob and its setting; imports what it needs."""
    method = METHODS[name]
    if method.runs:
        each = ((run, {**x, "setting": x["setting"] | entry["setting"]}) for run, x in method.runs)
        return compared(task, *(partial(made, run, entry=x, threads=threads) for run, x in each))
    found: Any
    # Each alone, for it may need what is not installed; spelt out, so that the hash of the code
    # that computes finds them.
    match method.family:
        case "ours" | "lie_poisson":
            from rigidpend.experiments.bench import ours as found
        case "heyoka":
            from rigidpend.experiments.bench import heyoka_batches as found
        case "cyrk":
            from rigidpend.experiments.bench import cyrk_compiled as found
        case "diffrax":
            from rigidpend.experiments.bench import diffrax_vmapped as found
        case "scipy":
            from rigidpend.experiments.bench import scipy_abreast as found
    solver: Solver = found.answered(task, entry["knob"], threads, **method.told, **entry["setting"])
    return solver


def compared(task: Task, first: Make, second: Make, third: Make) -> Solver:
    """Cross-check of a peer: run twice, compare, and run the columns that differ a third time.

    A symbol is trusted where two runs agree on it and on all before it. Where the first two differ
    the third decides, if it agrees with one of them. Nothing tells how near an agreement must be,
    as it does for ours: runs of one formulation err alike.
    """
    solvers = [first(task), second(task)]

    def solve() -> Crossed:
        a, b = (solver.read(solver.solve()) for solver in solvers)
        trusted = np.logical_and.accumulate(a.codes == b.codes, axis=0)
        codes, doubtful = a.codes.copy(), np.flatnonzero(~trusted.all(axis=0))
        if doubtful.size:
            # What is compiled for other orbits serves these; only their states are new.
            again = third(task.of(doubtful))
            c = again.read(again.solve())
            for other in (a, b):
                same = np.logical_and.accumulate(other.codes[:, doubtful] == c.codes, axis=0)
                trusted[:, doubtful] |= same
            codes[:, doubtful] = c.codes
        return Crossed(codes, a.time, trusted)

    return Solver(solve)


class Stage(NamedTuple):
    """A problem made ready."""

    task: Task
    truth: dict[str, Any]
    error: Callable[[Any, Any], dict[str, float]]
    long: bool = False
    """True if a slow method goes a part of the way."""

    def part(self, share: float) -> Task:
        """The task, of a part of the way."""
        return self.task._replace(times=share * self.task.times)

    def told(self, entry: Setting, part: float, answer: Any) -> Line:
        """Error of an answer, with its knob and the part of the way that it went."""
        errors, orbits = self.error(answer, self.truth), self.task.states.shape[1]
        knob = float(entry["knob"] or np.nan)
        return {"knob": knob, **errors, "orbits": float(orbits), "part": part}


def stage(problem: str, sizes: dict[str, Any], truth: dict[str, Any]) -> Stage:
    """A problem of those sizes, with its truth, which comes in lists."""
    task = ASKED[problem].task(SimpleNamespace(**sizes))
    arrays = {name: np.array(values) for name, values in truth[problem].items()}
    return Stage(task, arrays, ASKED[problem].error, PROBLEMS[problem].kind == "long")


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Time some work; give the seconds and what it returned."""
    begun = time.perf_counter()
    found = work()
    return time.perf_counter() - begun, found


class Timed(NamedTuple):
    """A method that was made ready, solved a first time, and again."""

    answer: Any
    made: float
    """Seconds in which it was made ready."""
    first: float
    """Seconds of the first solve."""
    seconds: float
    """A warm solve: the median of those further ones; the first one where there is none."""
    again: tuple[float, ...]
    """Seconds of the further solves."""

    @property
    def line(self) -> Line:
        """The times that are told: to prepare takes what goes beyond a warm solve."""
        prepare = self.made + max(0.0, self.first - self.seconds)
        repeats = float(len(self.again) or 1)
        return {"seconds": self.seconds, "repeats": repeats, "prepare": prepare}


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
    middle = statistics.median(taken or [first])
    return Timed(answer, prepared, first, middle, tuple(taken))


def search(
    entries: dict[str, dict[str, list[Any]]],
    sizes: dict[str, Any],
    truth: dict[str, Any],
    repeats: int,
    seconds: float,
) -> Iterator[Line]:
    """One method at each problem; first what its import cost."""
    [(name, tried)] = entries.items()
    before = memory()
    libraries = METHODS[name].libraries
    imported, _ = timed(lambda: [importlib.import_module(x) for x in libraries])
    yield {"import": imported, "memory_before": before}
    for problem, knobs in tried.items():
        try:
            for line in settings(stage(problem, sizes, truth), name, knobs, repeats, seconds):
                yield {"problem": problem, **line}
        except FAILURES as error:
            # The other problems are still to be measured.
            yield {"problem": problem, "failed": said(error)}


def said(error: Exception) -> str:
    """An error in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def settings(
    given: Stage, name: str, knobs: list[Any], repeats: int, seconds: float
) -> Iterator[Line]:
    """Try every setting of a method: forms at the middle knob, then each variant at each knob.

    A variant ends where its share of the budget is spent, or would be by the next knob. The first
    line has ``forms``, what each form took; then a line is a measurement.
    """
    method = METHODS[name]
    index, told = _best_form(given, name, method, knobs[len(knobs) // 2], repeats)
    yield {"form": index, "forms": told}
    for number, variant in enumerate(method.variants):
        spent, share = 0.0, seconds / len(method.variants)
        for knob in knobs:
            entry = {"knob": knob, "setting": {**method.forms[index], **variant}}
            line, taken = measured(given, name, entry, repeats, share)
            yield {**line, "setting": float(number)}
            spent += taken
            if spent + GROWTH * line["once"] > share:
                break


def _best_form(given: Stage, name: str, method: Method, knob: Any, repeats: int) -> tuple[int, str]:
    """The index of the form that took least time at a knob, and what all of them took."""
    if len(method.forms) == 1:
        return 0, ""
    entries = [{"knob": knob, "setting": {**x, **method.variants[0]}} for x in method.forms]
    taken = [measured(given, name, entry, repeats, 1.0)[0]["seconds"] for entry in entries]
    best = taken.index(min(taken))
    each = (f"{spelt(f)}: {1e3 * s:.3g} ms" for f, s in zip(method.forms, taken, strict=True))
    return best, f"{'; '.join(each)}; chosen: {spelt(method.forms[best])}"


def measured(
    given: Stage, name: str, entry: Setting, repeats: int, share: float
) -> tuple[Line, float]:
    """One measurement, and the seconds that went into solving."""
    part, tried = part_of_the_way(given, lambda task: made(name, task, entry), share)
    found = timed_solver(lambda: made(name, given.part(part), entry), repeats, share, WARM)
    line = {
        **given.told(entry, part, found.answer),
        **found.line,
        "seconds": found.seconds / part,
        "memory": memory(),
        "once": found.seconds,
    }
    # Preparation is told apart, and no budget pays for it.
    return line, tried + found.seconds * (1 + len(found.again))


def part_of_the_way(given: Stage, make: Make, share: float) -> tuple[float, float]:
    """Part of the way to follow orbits over long times: all of it, or what the budget allows."""
    if not given.long:
        return 1.0, 0.0
    solver = make(given.part(LITTLE))
    solver.solve()
    taken, _ = timed(solver.solve)
    whole = taken / LITTLE
    return (1.0 if whole <= share else max(LITTLE, 0.5 * share / whole)), taken


def meeting(
    entries: dict[str, Setting],
    sizes: dict[str, Any],
    truth: dict[str, Any],
    repeats: int,
    seconds: float,
    threads: list[int],
    problem: str,
) -> Iterator[Line]:
    """Several methods in turn at one problem, with so many threads at most, then with more.

    A line is a method with `most` threads, and has the times of all rounds.
    """
    given = stage(problem, sizes, truth)
    alone: dict[str, Solver] = {}
    for most in threads:
        there = {k: x for k, x in entries.items() if most == 1 or METHODS[k].threads}
        if len(there) > 1:
            for name, line in met(given, there, most, repeats, seconds, alone).items():
                yield {"method": name, "most": most, **line}


def met(
    given: Stage,
    entries: dict[str, Setting],
    most: int,
    rounds: int,
    seconds: float,
    alone: dict[str, Solver],
) -> dict[str, Line]:
    """Time methods in turn, round by round; the order turns too.

    A method that has spent its `seconds` misses the rounds that are left: its ``rounds`` are NaN.
    `alone` keeps the solvers of one thread from one meeting to the next.
    """
    solvers: dict[str, Callable[[], Any]] = {}
    found: dict[str, Line] = {}
    for name, entry in entries.items():
        part = entry.get("part", 1.0)
        used, solver = _at_its_best(name, entry, given.part(part), most, alone)
        solvers[name], told = solver.solve, given.told(entry, part, solver.read(solver.solve()))
        found[name] = {**told, "threads": float(used), "rounds": [math.nan] * rounds}
    spent, names = dict.fromkeys(entries, 0.0), list(entries)
    for k in range(rounds):
        turned = names[k % len(names) :] + names[: k % len(names)]
        for name in turned:
            if spent[name] <= seconds:
                taken, _ = timed(solvers[name])
                spent[name] += taken
                found[name]["rounds"][k] = taken / found[name]["part"]
    return found


def _at_its_best(
    name: str, entry: Setting, task: Task, most: int, alone: dict[str, Solver]
) -> tuple[int, Solver]:
    """The number of threads that takes a method least time, up to the most; its solver.

    Where orbits are few two threads cost more than they save, and no user would take them.
    """
    if name not in alone:
        alone[name] = made(name, task, entry)
    if most == 1:
        return 1, alone[name]
    found = []
    for threads, solver in ((1, alone[name]), (most, made(name, task, entry, most))):
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
