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

from rigidpend.experiments.bench.measuring.methods import (
    Answer,
    Method,
    Setting,
    function,
    spelt,
)
from rigidpend.experiments.bench.measuring.tasks import Carrier, Solver, orbits_of

Measured = dict[str, Any]

LOOKS = 20
"""Number of times at which the integrals are looked at, over long times."""
WARM = 8.0
"""Seconds: a first solve that took less, compilation and all, is always followed by a second."""
TRIED = 3
"""Solves by which a method finds out whether several threads serve it."""
GROWTH = 2.0
"""Expected cost of the next knob, relative to the last one."""


class Attempt(NamedTuple):
    """A method with all that is chosen for it at a problem."""

    method: Method
    answer: Answer
    setting: Setting
    knob: Any
    threads: int = 1

    def make(self, task: Any) -> Any:
        """Make it ready for a task."""
        return function(self.answer, self.threads, self.setting)(task, self.knob)

    @property
    def abreast(self) -> bool:
        """True if the method carries all orbits at once."""
        return bool(self.setting.get("abreast", self.method.abreast))


class Stage(NamedTuple):
    """A problem made ready: the task, its truth, and how many orbits a slow method gets."""

    module: Any
    task: Any
    reference: dict[str, Any]
    few: int

    def part(self, abreast: bool) -> tuple[Any, dict[str, Any], float]:
        """The task of a method, its truth, and the factor that scales its time to all orbits."""
        n = self.task.states.shape[1]
        if abreast or n <= self.few:
            return self.task, self.reference, 1.0
        # Spread evenly: no orbit is chosen for what it is.
        columns = np.linspace(0, n - 1, self.few).round().astype(int)
        truth = {name: values[..., columns] for name, values in self.reference.items()}
        return orbits_of(self.task, columns), truth, n / self.few


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Time some work; give the seconds and what it returned."""
    begun = time.perf_counter()
    found = work()
    return time.perf_counter() - begun, found


def solver_of(stage: Stage, task: Any, made: Any, part: float = 1.0) -> Solver:
    """Give what is timed: a solver, or carrying orbits to the end (or a part of the way)."""
    if not isinstance(made, Carrier):
        return Solver(made.solve, made.read)
    looks = LOOKS if stage.module.KIND == "long" else 1
    times = task.end * part * np.arange(1, looks + 1) / looks

    def carry() -> list[Any]:
        made.start()
        found = []
        for moment in times:
            made.to(moment)
            found.append(made.states())
        return found

    return Solver(carry, lambda found: found if looks > 1 else found[-1])


def search(
    stage: Stage, method: Method, answer: Answer, knobs: list[Any], seconds: float, repeats: int
) -> Iterator[Measured]:
    """Try every setting of a method: forms at the middle knob, then each variant at each knob.

    A variant ends where its share of the budget is spent, or would be by the next knob.

    Yields
    ------
    dict
        First ``forms``, what each form took; then a measurement a setting and a knob.
    """
    index, told = _best_form(stage, method, answer, knobs[len(knobs) // 2], repeats)
    yield {"form": index, "forms": told}
    form = method.forms[index]
    for number, variant in enumerate(method.variants):
        spent, share = 0.0, seconds / len(method.variants)
        for knob in knobs:
            trial = Attempt(method, answer, {**form, **variant}, knob)
            line, taken = _measured(stage, trial, repeats, share)
            yield {**line, "setting": float(number)}
            spent += taken
            if spent + GROWTH * line["once"] > share:
                break


def _best_form(
    stage: Stage, method: Method, answer: Answer, knob: Any, repeats: int
) -> tuple[int, str]:
    """The index of the form that took least time at a knob, and what all of them took."""
    if len(method.forms) == 1:
        return 0, ""
    taken = []
    for form in method.forms:
        line, _ = _measured(stage, Attempt(method, answer, form, knob), repeats, 1.0)
        taken.append(line["seconds"])
    best = taken.index(min(taken))
    said = (f"{spelt(f)}: {1e3 * s:.3g} ms" for f, s in zip(method.forms, taken, strict=True))
    return best, f"{'; '.join(said)}; chosen: {spelt(method.forms[best])}"


def _measured(stage: Stage, trial: Attempt, repeats: int, share: float) -> tuple[Measured, float]:
    """One measurement, and the seconds that went into solving."""
    task, truth, scaled = stage.part(trial.abreast)
    prepared, made = timed(lambda: trial.make(task))
    part, tried = _part_of_the_way(stage, task, made, share)
    solver = solver_of(stage, task, made, part)
    first, found = timed(solver.solve)
    errors = stage.module.error(solver.read(found), truth)
    taken: list[float] = []
    while len(taken) < repeats and (sum(taken) + first < share or (not taken and first < WARM)):
        taken.append(timed(solver.solve)[0])
    kept = taken or [first]
    middle = statistics.median(kept)
    line = {
        "knob": float(trial.knob or np.nan),
        **errors,
        "seconds": middle * scaled / part,
        "repeats": float(len(kept)),
        "orbits": float(task.states.shape[1]),
        "part": part,
        "prepare": prepared + max(0.0, first - middle),
        "memory": memory(),
        "once": middle,
    }
    # Preparation is told apart, and no budget pays for it.
    return line, tried + middle * (1 + len(taken))


def _part_of_the_way(stage: Stage, task: Any, made: Any, share: float) -> tuple[float, float]:
    """Part of the way to follow orbits over long times: all of it, or what the budget allows."""
    if stage.module.KIND != "long":
        return 1.0, 0.0
    little = 1e-3
    solver_of(stage, task, made, little).solve()
    taken, _ = timed(solver_of(stage, task, made, little).solve)
    whole = taken / little
    return (1.0 if whole <= share else max(little, 0.5 * share / whole)), taken


class Guest(NamedTuple):
    """A method at the meeting."""

    name: str
    solver: Solver
    truth: dict[str, Any]
    factor: float
    """That scales its time to the whole task."""


def meeting(
    stage: Stage, trials: dict[str, Attempt], parts: dict[str, float], rounds: int, seconds: float
) -> dict[str, Measured]:
    """Time methods in turn, round by round; the order turns too.

    Parameters
    ----------
    trials : dict of Attempt
        By the name of the method.
    parts : dict of float
        How far each goes, over long times: a part of the way.
    rounds : int
    seconds : float
        What one method may take in all: where it is spent, it misses the rounds that are left.

    Returns
    -------
    dict
        By method: errors, and ``rounds``, the seconds of each, NaN where it was not timed.
    """
    guests, found = [], {}
    for name, trial in trials.items():
        task, truth, scaled = stage.part(trial.abreast)
        part = parts.get(name, 1.0)
        threads, solver = _at_its_best(stage, trial, task, part)
        errors = stage.module.error(solver.read(solver.solve()), truth)
        guests.append(Guest(name, solver, truth, scaled / part))
        found[name] = {
            "knob": float(trial.knob or np.nan),
            **errors,
            "orbits": float(task.states.shape[1]),
            "part": part,
            "threads": float(threads),
            "rounds": [math.nan] * rounds,
        }
    spent = dict.fromkeys(trials, 0.0)
    for k in range(rounds):
        turned = guests[k % len(guests) :] + guests[: k % len(guests)]
        for guest in turned:
            if spent[guest.name] > seconds:
                continue
            taken, _ = timed(guest.solver.solve)
            spent[guest.name] += taken
            found[guest.name]["rounds"][k] = taken * guest.factor
    return found


def _at_its_best(stage: Stage, trial: Attempt, task: Any, part: float) -> tuple[int, Solver]:
    """The number of threads that takes a method least time, up to the trial's; its solver.

    Where orbits are few two threads cost more than they save, and no user would take them.
    """
    if trial.threads == 1:
        return 1, solver_of(stage, task, trial.make(task), part)
    found = []
    for threads in (1, trial.threads):
        solver = solver_of(stage, task, trial._replace(threads=threads).make(task), part)
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
