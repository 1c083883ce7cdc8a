"""Several threads: the orbits shared out among as many copies of a method.

It serves every method that leaves Python's lock while it computes. Others gain nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import Carrier


def shared_out(make: Callable[[Any], Any], states: Any, threads: int) -> Any:
    """Call ``make(states)`` with the columns of `states` shared out among threads.

    Parameters
    ----------
    make : callable
        Gives a `Carrier`, or a function without arguments that returns an array, or a named
        tuple of arrays, with the orbits last.
    states : (d, n) array
    threads : int
    """
    if threads == 1:
        return make(states)
    parts = [make(part) for part in np.array_split(states, threads, axis=1) if part.shape[1]]
    pool = ThreadPoolExecutor(len(parts))
    if isinstance(parts[0], Carrier):
        return _carriers(parts, pool)
    return lambda: _joined(list(pool.map(lambda solve: solve(), parts)))


def _carriers(parts: Sequence[Carrier], pool: ThreadPoolExecutor) -> Carrier:
    return Carrier(
        lambda: [part.start() for part in parts],
        lambda time: list(pool.map(lambda part: part.to(time), parts)),
        lambda: np.concatenate([part.states() for part in parts], axis=1),
    )


def _joined(found: list[Any]) -> Any:
    if isinstance(found[0], tuple):
        made: Any = type(found[0])
        return made(*(np.concatenate(each, axis=-1) for each in zip(*found, strict=True)))
    return np.concatenate(found, axis=-1)
