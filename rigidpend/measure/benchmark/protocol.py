"""How a method is measured: warm, medians, preparation apart, within a budget of time.

A measurement is a dict of plain numbers. `prepare` is what making ready and the first solve
took beyond a warm solve: compilation, mostly.
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

from rigidpend.measure.benchmark.problems.long_time import integrals
from rigidpend.measure.benchmark.tasks import Flow, Motion

Measured = dict[str, float]
Make = Callable[[Any, Any], Any]

SHORT, MANY = 0.05, 25
"""Seconds up to which a quick solve is repeated on, at most so many times."""
WARM = 2.0
"""Seconds: a first solve that took less, compilation and all, is always followed by a second."""
STRIDE = 500.0
"""Periods between looks at the clock and at the integrals, over long times."""


class Protocol(NamedTuple):
    """How well it is measured."""

    repeats: int
    """Of each solve, where the budget allows; the median counts."""
    seconds: float
    """Of solving, preparation apart: after them no further knob is tried."""


class Clock:
    """Time since it was made."""

    def __init__(self) -> None:
        self.start = time.perf_counter()

    def read(self) -> float:
        return time.perf_counter() - self.start


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """How long it takes, and what it gives."""
    clock = Clock()
    found = work()
    return clock.read(), found


def measure(
    task: Any,
    make: Make,
    knobs: list[Any],
    protocol: Protocol,
    error: Callable[[Any], Measured],
) -> Iterator[Measured]:
    """Measure a method knob by knob, loosest first, until the budget is spent.

    A knob that is the first to get every symbol right is decisive: it is repeated as often
    as asked for, whatever the budget.
    """
    spent, decided = 0.0, False
    for knob in knobs:
        if spent > protocol.seconds:
            return
        prepared, answer = timed(lambda: make(task, knob))  # noqa: B023
        first, found, work, read = _first(task, answer)
        errors = error(read(found))
        decisive = errors.get("wrong_symbols") == 0 and not decided
        decided |= decisive
        # An even share of the budget, so that every knob has its turn.
        left = math.inf if decisive else protocol.seconds / len(knobs)
        taken: list[float] = []
        while _go_on(taken, first, protocol.repeats, left):
            taken.append(timed(work)[0])
        # Where there is no time for a second, the first counts, preparation and all.
        kept = taken or [first]
        middle = statistics.median(kept)
        spent += middle * (len(taken) + 1)
        yield {
            "knob": float(knob or np.nan),
            **errors,
            "seconds": middle,
            "fastest": min(kept),
            "slowest": max(kept),
            "repeats": float(len(kept)),
            "prepare": prepared + max(0.0, first - middle),
            "memory": memory(),
        }


def _go_on(taken: list[float], first: float, repeats: int, left: float) -> bool:
    """Whether there is time to solve once more, and need to."""
    if len(taken) < repeats:
        return sum(taken) + (taken[-1] if taken else first) <= left or (not taken and first < WARM)
    return sum(taken) < SHORT and len(taken) < MANY


def _first(task: Any, answer: Any) -> tuple[float, Any, Callable[[], Any], Any]:
    """The first solve: its time, what it gives, how to repeat it and how to read it."""
    if not isinstance(answer, Flow):
        taken, found = timed(answer.solve)
        return taken, found, answer.solve, answer.read

    def carry() -> None:
        answer.start()
        answer.to(task.end)

    taken, _ = timed(carry)
    return taken, answer.states(), carry, lambda states: states


def measure_long(
    task: Motion,
    make: Make,
    knobs: list[Any],
    protocol: Protocol,
    error: Callable[[Any], Measured],
) -> Iterator[Measured]:
    """Follow orbits as far as the task goes, or as far as an even share of the budget carries.

    A knob with which the whole task is expected within the budget is carried through. `seconds`
    is what the whole task takes: extrapolated from `reach`, in periods, where it
    was not reached.
    """
    share = protocol.seconds / len(knobs)
    for knob in knobs:
        prepared, flow = timed(lambda: make(task, knob))  # noqa: B023
        flow.start()
        first, _ = timed(lambda: flow.to(task.period))  # noqa: B023
        taken, reach, drift = _followed(task, flow, share, protocol.seconds)
        rates = [taken / reach]
        clock = Clock()
        while len(rates) < protocol.repeats and clock.read() + taken < share:
            again, as_far, _ = _followed(task, flow, share, share)
            rates.append(again / as_far)
        whole = task.end / task.period
        yield {
            "knob": float(knob or np.nan),
            **error(drift),
            "seconds": statistics.median(rates) * whole,
            "fastest": min(rates) * whole,
            "slowest": max(rates) * whole,
            "repeats": float(len(rates)),
            "reach": reach,
            "asked": whole,
            "prepare": prepared + first,
            "memory": memory(),
        }


def _followed(task: Motion, flow: Flow, limit: float, most: float) -> tuple[float, float, Any]:
    """Time taken, periods reached, and the integrals (3, k, n) on the way.

    It ends at the limit, unless the rest is expected within `most`.
    """
    flow.start()
    seconds, reached, stride, found = 0.0, 0.0, 1.0, []
    whole = task.end / task.period
    while reached < whole and (seconds < limit or seconds / reached * whole < most):
        # The first strides are short, for methods that are slow.
        reached, stride = min(whole, reached + stride), min(STRIDE, 2 * stride)
        taken, _ = timed(lambda: flow.to(reached * task.period))  # noqa: B023
        seconds += taken
        found.append(integrals(task.body, flow.states()))
    return seconds, reached, np.array(found).transpose(1, 0, 2)


def memory() -> float:
    """The peak of this process so far, MB."""
    # What getrusage tells begins with the peak of the parent, from before it became this one.
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # Linux counts in kB, macOS in bytes.
    return peak / (1024**2 if sys.platform == "darwin" else 1024)
