"""Time against the number of orbits: codes from random phases, ever more of them.

A method is timed at one number of orbits after the other until the next would go beyond its
budget; its time of an orbit is then that of the most it was timed with. The first solve of all
carries what is made ready once: tables of return maps, compilation.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.measuring.problems import codes
from rigidpend.experiments.bench.measuring.protocol import timed
from rigidpend.experiments.bench.measuring.tasks import RouteTask
from rigidpend.experiments.data.tree import Data


class Extrapolated(NamedTuple):
    """The time of a method for a number of orbits."""

    seconds: float
    """Warm: what is made ready once is there."""
    prepare: float
    """Seconds for that, up to so many orbits."""
    orbits: float
    """The number it was timed with; the time is scaled from it."""


def counted(
    make: Callable[[RouteTask], Any],
    numbers: Sequence[int],
    n_symbols: int,
    repeats: int,
    seconds: float,
) -> Iterator[dict[str, float]]:
    """Time a method at each number of orbits that its budget allows, at one at least.

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
    for number, after in zip(numbers, [*numbers[1:], 0], strict=True):
        task = codes.random_task(number, n_symbols)
        prepared, solver = timed(lambda: make(task))  # noqa: B023
        first, found = timed(solver.solve)
        answer, taken = solver.read(found), [timed(solver.solve)[0]] if first < seconds else []
        while taken and len(taken) < repeats and sum(taken) + taken[-1] < seconds:
            taken.append(timed(solver.solve)[0])
        middle = statistics.median(taken or [first])
        certain = answer.certain
        yield {
            "orbits": float(number),
            "seconds": middle,
            "prepare": prepared + max(0.0, first - middle),
            "repeats": float(len(taken) or 1),
            "undecided": 0.0 if certain is None else float((~certain).sum()),
        }
        if middle * after / number > seconds:
            return


def at(record: Data, number: float) -> Extrapolated:
    """The time of a method for a number of orbits, of what was measured of it."""
    orbits, prepare = np.asarray(record["orbits"]), np.cumsum(record["prepare"])
    k = int(np.flatnonzero(orbits <= number).max(initial=0))
    scaled = float(record["seconds"][k]) * number / float(orbits[k])
    return Extrapolated(scaled, float(prepare[k]), float(orbits[k]))


def crossing(record: Data, other: Data) -> float:
    """The number of orbits from which on a method, made ready and all, beats another; or infinity.

    Between numbers that were measured times are taken to be powers of these.
    """
    numbers = np.geomspace(1, 1e7, 1401)
    own, theirs = ([_interpolated(r, n) for n in numbers] for r in (record, other))
    slower = np.flatnonzero(np.array(own) >= np.array(theirs))
    if not slower.size:
        return 1.0
    return float(numbers[slower[-1] + 1]) if slower[-1] + 1 < len(numbers) else np.inf


def _interpolated(record: Data, number: float) -> float:
    orbits, seconds = np.asarray(record["orbits"]), np.asarray(record["seconds"])
    each = np.exp(np.interp(np.log(number), np.log(orbits), np.log(seconds / orbits)))
    return at(record, number).prepare + float(each) * number
