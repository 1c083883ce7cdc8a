"""Wrong symbols on random phases: every method against codes known from 113-bit arithmetic.

The codes are in a file, computed by a program written before this package, which rounds by itself.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.problems import codes
from rigidpend.experiments.bench.measuring.protocol import timed
from rigidpend.experiments.bench.measuring.tasks import RouteTask
from rigidpend.numbers.doubles import Array

STORED = Path(__file__).parent / "random_phases_113bit.json"
"""2,000 phases for each of two starts J1_0, with codes of 15 symbols and the last crossing's t'."""
CHUNK = 250
"""Orbits in one call."""


def starts() -> tuple[str, ...]:
    """The values of J1_0 for which phases are stored."""
    return tuple(_stored()["orbits"])


def counted(
    J1_0: str, make: Callable[[RouteTask], Any], most: int, seconds: float
) -> dict[str, float]:
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
    tally = dict.fromkeys(("symbols", "wrong", "wrong_trusted", "undecided"), 0)
    spent, gaps, done = 0.0, [], 0
    while done < min(most, len(theta2_0)) and spent < seconds:
        columns = slice(done, min(done + CHUNK, most))
        task = codes.from_phases(theta2_0[columns], J1_0, len(true))
        solver = make(task)
        if not done:
            # What is compiled, is compiled before the clock runs.
            solver.solve()
        taken, found = timed(solver.solve)
        answer = solver.read(found)
        wrong = answer.codes != true[:, columns]
        trusted = np.ones_like(wrong) if answer.certain is None else answer.certain
        for name, mask in (
            ("symbols", np.ones_like(wrong)),
            ("wrong", wrong),
            ("wrong_trusted", wrong & trusted),
            ("undecided", ~trusted),
        ):
            tally[name] += int(mask.sum())
        gap = np.abs(answer.time[-1] - last[columns])
        gaps.append(np.where(np.isnan(gap), np.inf, gap))
        spent, done = spent + taken, done + wrong.shape[1]
    middle = float(np.median(np.concatenate(gaps)))
    return {**tally, "orbits": done, "seconds": spent, "last_crossing": middle}


@functools.cache
def _stored() -> Any:
    return json.loads(STORED.read_text(encoding="utf-8"))


@functools.cache
def _truth(J1_0: str) -> tuple[Array, Any, Array]:
    """Phases (n,), codes (15, n) and times t' of the last crossing (n,)."""
    phases, texts, times = zip(*_stored()["orbits"][J1_0], strict=True)
    digits = np.array([[int(digit) for digit in text] for text in texts], dtype=np.uint8)
    return np.array(phases), digits.T, np.array(times)
