"""Work side by side: threads where the work releases the interpreter, processes where not."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")


def cores() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def spread(array: Any, parts: int, axis: int) -> list[Any]:
    """The array in at most `parts` successive pieces of nearly equal length, none empty."""
    pieces = max(1, min(parts, array.shape[axis]))
    return list(np.array_split(array, pieces, axis=axis))


def side_by_side(
    work: Callable[..., Result],
    arguments: tuple[Any, ...],
    holds_interpreter: bool,
    parts: Sequence[Any],
    jobs: int,
) -> list[Result]:
    """``work(part, *arguments)`` for each part, results in the order of the parts.

    Parameters
    ----------
    work : callable
        A function of a module, for a process must find it by name.
    arguments : tuple
        Its further arguments.
    holds_interpreter : bool
        Whether it is Python itself that works: then processes, else threads.
    parts : sequence
    jobs : int
        How many at a time; with 1, or one part, nothing is started.
    """
    workers = min(jobs, len(parts))
    if workers <= 1:
        return [work(part, *arguments) for part in parts]
    pool = _pool(workers, holds_interpreter)
    try:
        futures = [pool.submit(work, part, *arguments) for part in parts]
        return [future.result() for future in futures]
    except BaseException:
        _stop(pool)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _pool(workers: int, holds_interpreter: bool) -> Executor:
    if not holds_interpreter:
        return ThreadPoolExecutor(workers)
    # Imported here: a run that needs no process does not pay for it.
    import multiprocessing

    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, mp_context=spawn, initializer=_ignore_interruption)


def _ignore_interruption() -> None:
    """Leave Ctrl-C to the parent, which ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _stop(pool: Executor) -> None:
    """End the processes of a pool at once: what they compute is not wanted any more."""
    for process in list((getattr(pool, "_processes", None) or {}).values()):
        process.terminate()
