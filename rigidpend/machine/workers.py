"""Parallel workers: threads where the work releases the interpreter, processes where not."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import Any, TypeVar

from rigidpend.machine.signals import Stopped, came, kept_from_children

Result = TypeVar("Result")


PERIOD = 0.1
"""Seconds between two looks whether what is waited for is still wanted."""

SILENCE = 5.0
"""Seconds for which work that takes long says nothing."""

_of_thread = threading.local()
_to_parent: Any = None
"""End of the pipe to who hears a process of :func:`apart`; None elsewhere."""


class _Stop:
    """Wish that the work of a pool ends; the pool's own, or that of the pool that it is in."""

    def __init__(self, outer: _Stop | None) -> None:
        self._outer, self._event = outer, threading.Event()

    def set(self) -> None:
        self._event.set()

    def is_set(self) -> bool:
        return self._event.is_set() or (self._outer is not None and self._outer.is_set())


def check_stop() -> None:
    """End the work of this thread if it is not wanted any more; engines ask some times a second.

    Raises
    ------
    Stopped
        In a thread of a pool that is being stopped, and in all of a command line after Ctrl-C
        or SIGTERM.
    """
    stop = getattr(_of_thread, "stop", None)
    if came() or (stop is not None and stop.is_set()):
        raise Stopped


class Listener:
    """Receiver of what long work says of itself, at most a line in `SILENCE` seconds."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say, self._lock, self._last = say, threading.Lock(), time.monotonic()

    def hear(self, text: Callable[[], str]) -> None:
        """Take a line, which is made only if it is due."""
        now = time.monotonic()
        if now - self._last < SILENCE or not self._lock.acquire(blocking=False):
            return
        try:
            self._last = now
            self._say(text())
        finally:
            self._lock.release()

    def heard(self, text: str) -> None:
        """Take a line that is said in any case."""
        with self._lock:
            self._last = time.monotonic()
        self._say(text)


@contextmanager
def listening(say: Callable[[str], object]) -> Iterator[Callable[[str], None]]:
    """Let `say` take what work says by :func:`note` within, and threads that it starts.

    Gives a function for lines that are said in any case; after one there is silence first.
    """
    before, listener = getattr(_of_thread, "listener", None), Listener(say)
    _of_thread.listener = listener
    try:
        yield listener.heard
    finally:
        _of_thread.listener = before


def note(text: Callable[[], str]) -> None:
    """Say how far long work is, where somebody listens and nothing was said for a while.

    In a notebook, or where Python is used by hand, stderr listens.
    """
    listener = getattr(_of_thread, "listener", None)
    if listener is None and by_hand():
        listener = _of_thread.listener = Listener(lambda line: print(line, file=sys.stderr))
    if listener is not None:
        listener.hear(text)


def by_hand() -> bool:
    """True in a notebook, and where Python asks for each line."""
    return hasattr(sys, "ps1") or "ipykernel" in sys.modules


class WorkerError(RuntimeError):
    """Error: a worker process ended before its work was done."""


def cores() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def spread(array: Any, parts: int, axis: int) -> list[Any]:
    """Split an array into at most `parts` successive pieces of nearly equal length, none empty."""
    # Imported here: a plan that finds nothing to do has no use for it.
    import numpy as np

    pieces = max(1, min(parts, array.shape[axis]))
    return list(np.array_split(array, pieces, axis=axis))


def side_by_side(
    work: Callable[..., Result],
    arguments: tuple[Any, ...],
    holds_interpreter: bool,
    parts: Sequence[Any],
    jobs: int,
) -> list[Result]:
    """Compute ``work(part, *arguments)`` for each part, results in the order of the parts.

    Parameters
    ----------
    work : callable
        A function of a module, for a process must find it by name.
    arguments : tuple
        Its further arguments.
    holds_interpreter : bool
        Whether it is Python itself that works: then processes, else threads. In these the work
        calls `check_stop` now and then, so that it can be ended.
    parts : sequence
    jobs : int
        How many at a time; with 1, or one part, nothing is started.

    Raises
    ------
    WorkerError
        A process was killed, by hand or for want of memory.
    """
    workers = min(jobs, len(parts))
    if workers <= 1:
        return [_done(work, part, *arguments) for part in parts]
    stop = _Stop(getattr(_of_thread, "stop", None))
    with _ended(
        _processes(workers) if holds_interpreter else _threads(workers, stop), stop
    ) as pool:
        with kept_from_children():
            futures = [pool.submit(work, part, *arguments) for part in parts]
        return [_result(future) for future in futures]


def ahead(
    work: Callable[[Any], Result], parts: Sequence[Any], jobs: int
) -> Generator[Result, None, None]:
    """Compute ``work(part)`` for each part in threads, so many ahead of the one that is used.

    Results come in the order of the parts. The first is computed alone: it makes what all share.
    """
    stop = _Stop(getattr(_of_thread, "stop", None))
    with _ended(_threads(jobs, stop), stop) as pool:
        coming: deque[Future[Result]] = deque()
        for number, part in enumerate(parts):
            coming.append(pool.submit(_done, work, part))
            if number == 0 or len(coming) > jobs:
                yield _result(coming.popleft())
        while coming:
            yield _result(coming.popleft())


def apart(
    work: Callable[..., Result], arguments: tuple[Any, ...], hear: Callable[[str], object]
) -> Result:
    """Do ``work(*arguments, say)`` in a process of its own; `hear` takes here what it says there.

    Raises
    ------
    WorkerError
        The process was killed.
    """
    from multiprocessing import get_context

    here, there = get_context("spawn").Pipe(duplex=False)
    stop = _Stop(getattr(_of_thread, "stop", None))
    with here, there, _ended(_processes(1, there), stop) as pool:
        with kept_from_children():
            future = pool.submit(_heard, work, arguments)
        line: str | None = ""
        # The last word is None: the result follows at once. Who is killed says none.
        while line is not None:
            check_stop()
            over = future.done()
            if here.poll(0 if over else PERIOD):
                if (line := here.recv()) is not None:
                    hear(line)
            elif over:
                break
        return _result(future)


def _done(work: Callable[..., Result], *given: Any) -> Result:
    """Do work in this thread, if it is still wanted."""
    check_stop()
    return work(*given)


def _result(future: Future[Result]) -> Result:
    """Wait for a result as long as it is wanted."""
    while wait([future], PERIOD).not_done:
        check_stop()
    return future.result()


@contextmanager
def _ended(pool: Executor, stop: _Stop) -> Iterator[Executor]:
    """End a pool with what it is for, at once where that fails."""
    try:
        yield pool
    except BrokenExecutor:
        raise WorkerError(
            "a worker process was killed, perhaps for want of memory; what is finished is kept:"
            " the same command again continues"
        ) from None
    except BaseException:
        stop.set()
        _end_processes(pool)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _threads(workers: int, stop: _Stop) -> Executor:
    given = stop, getattr(_of_thread, "listener", None)
    return ThreadPoolExecutor(workers, initializer=_heed, initargs=given)


def _processes(workers: int, to: Any = None) -> Executor:
    # Imported here: a run that needs no process does not pay for it.
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    # A fork would copy the locks of threads that do not run in the child.
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(
        workers, mp_context=spawn, initializer=_follow_parent, initargs=(to,)
    )


def _heed(stop: _Stop, listener: Listener | None) -> None:
    """Let this thread's work end when the event is set, and be heard by who hears the pool's."""
    _of_thread.stop, _of_thread.listener = stop, listener


def _follow_parent(to: Any) -> None:
    """Leave Ctrl-C to the parent, and end with it: else its workers would wait for ever."""
    global _to_parent
    _to_parent = to
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_wait_for_end_of_parent, daemon=True).start()


def _heard(work: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    """Do work of :func:`apart` where it is done; that no more is said is the last word."""
    try:
        return work(*arguments, _to_parent.send)
    finally:
        _to_parent.send(None)


def _wait_for_end_of_parent() -> None:
    from multiprocessing import connection, parent_process

    parent = parent_process()
    assert parent is not None
    # The sentinel is ready when the parent has ended, however it did.
    connection.wait([parent.sentinel])
    os._exit(1)


def _end_processes(pool: Executor) -> None:
    """End the processes of a pool at once: what they compute is not wanted any more."""
    for process in list((getattr(pool, "_processes", None) or {}).values()):
        # It is deaf to the others.
        process.kill()
