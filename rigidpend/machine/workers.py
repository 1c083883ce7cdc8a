"""Parallel workers: threads if the work releases the interpreter's lock, processes if not."""

import math
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import (
    FIRST_EXCEPTION,
    BrokenExecutor,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, contextmanager, suppress
from typing import Any, TypeVar

from rigidpend.machine import leave_garbage
from rigidpend.machine.signals import Stopped, came, kept_from_children
from rigidpend.machine.wording import say_warnings

Result = TypeVar("Result")


CHECK_PERIOD = 0.1
"""Seconds between two checks for a stop while waiting."""

LEAST_PARTS = 4
"""Parts for each process from which processes pay; to start them takes a third of a second."""

SILENCE = 5.0
"""Seconds without a line after which long work reports its state."""

_of_thread = threading.local()
"""Settings of a pool's thread: `stop`, the event that ends it, and `listener`, for its lines."""
_to_parent: Any = None
"""Queue for the lines of this process."""
_hiding = threading.Lock()


def check_stop() -> None:
    """Raise Stopped if this thread's work is to end; engines call it several times a second.

    That is so in a thread of a pool that is being stopped, and in every thread of a command line
    after Ctrl-C or SIGTERM.
    """
    stop = getattr(_of_thread, "stop", None)
    if came() or (stop and stop.is_set()):
        raise Stopped


class Listener:
    """Receiver of lines that long work writes about itself."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say, self._lock, self._last = say, threading.Lock(), time.monotonic()

    def hear(self, line: str | Callable[[], str]) -> None:
        """Take a line; one given as a function only after `SILENCE` seconds without any."""
        with self._lock:
            now = time.monotonic()
            if callable(line) and now - self._last < SILENCE:
                return
            self._last = now
        # Written outside of the lock, so that a slow receiver keeps no other thread waiting.
        self._say(line() if callable(line) else line)


@contextmanager
def listening(say: Callable[[str], object]) -> Iterator[Callable[[str], None]]:
    """Let `say` receive the lines of :func:`note` within, also from threads that work starts.

    Yields a function for lines that are written in any case; they restart the time of silence.
    """
    before, listener = getattr(_of_thread, "listener", None), Listener(say)
    _of_thread.listener = listener
    try:
        yield listener.hear
    finally:
        _of_thread.listener = before


def note(text: Callable[[], str]) -> None:
    """Report the state of long work, if there is a listener and no line came for a while.

    In a notebook and in interactive Python stderr is the listener.
    """
    listener = getattr(_of_thread, "listener", None)
    if listener is None and (hasattr(sys, "ps1") or "ipykernel" in sys.modules):
        listener = _of_thread.listener = Listener(lambda line: print(line, file=sys.stderr))
    if listener is not None:
        listener.hear(text)


class WorkerError(RuntimeError):
    """Error: a worker process ended before its work was done, or could not start."""


def cores() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def spread(array: Any, parts: int, axis: int) -> list[Any]:
    """Split an array into at most `parts` successive pieces of nearly equal length, none empty."""
    # Imported late, because a plan that finds nothing to do does not need it.
    import numpy as np

    pieces = max(1, min(parts, array.shape[axis]))
    return list(np.array_split(array, pieces, axis=axis))


def side_by_side(
    work: Callable[..., Result],
    arguments: tuple[Any, ...],
    holds_interpreter: bool,
    parts: Sequence[Any],
    jobs: int,
    hear: Callable[[str], object] | None = None,
) -> list[Result]:
    """Compute ``work(part, *arguments)`` for each part in parallel; results in order.

    For work in Python, which holds the interpreter's lock, processes compute: then `work` must be a
    function of a module, but not of the user's program, which processes do not read. Otherwise
    threads compute, and the work calls `check_stop` now and then. With one job or part nothing is
    started.

    With a listener for its lines, `work` is called as ``work(part, *arguments, say)``. WorkerError
    if a process was killed, by hand or for lack of memory.
    """
    workers = min(jobs, len(parts))
    if workers > 1 and holds_interpreter:
        return list(_in_processes(work, arguments, parts, workers, hear))
    given = arguments if hear is None else (*arguments, hear)
    if workers <= 1:
        return [_done(work, part, *given) for part in parts]
    stop = threading.Event()
    # In a thread of another pool the wait for results heeds that pool's stop, and sets this one.
    heeded = stop, getattr(_of_thread, "listener", None)
    pool = ThreadPoolExecutor(workers, initializer=_heed, initargs=heeded)
    with _ended(pool, stop.set):
        coming = [pool.submit(work, part, *given) for part in parts]
        while wait(coming, CHECK_PERIOD, FIRST_EXCEPTION).not_done:
            check_stop()
            # An error in any part is raised now, and ends the others.
            for one in filter(Future.done, coming):
                one.result()
        return [one.result() for one in coming]


def worth_processes(parts: int, jobs: int) -> bool:
    """True if there are enough parts for processes, each with one thread, to be worthwhile."""
    return jobs > 1 and parts >= LEAST_PARTS * jobs


def ahead(
    work: Callable[[Any], Result], parts: Sequence[Any], jobs: int
) -> Generator[Result, None, None]:
    """Compute ``work(part)`` for each part in processes, some parts ahead of the one in use.

    Results come in the order of the parts. The first part is computed here, so that things that
    all parts share are made and cached once.
    """
    yield from (_done(work, part) for part in parts[:1])
    yield from _in_processes(work, (), parts[1:], jobs, None, ahead=jobs)


def apart(
    work: Callable[..., Result],
    arguments: tuple[Any, ...],
    hear: Callable[[Any], object] | None = None,
    limit: float = math.inf,
) -> Result:
    """Do work in a process of its own, as :func:`side_by_side` does.

    It is called as ``work(*arguments)``, or with a listener as ``work(*arguments, say)``.

    If it takes more than `limit` seconds, it is ended, and TimeoutError raised.
    """
    first, *rest = arguments
    [found] = _in_processes(work, tuple(rest), [first], 1, hear, limit)
    return found


def _in_processes(
    work: Callable[..., Result],
    arguments: tuple[Any, ...],
    parts: Sequence[Any],
    workers: int,
    hear: Callable[[Any], object] | None,
    limit: float = math.inf,
    ahead: float = math.inf,
) -> Generator[Result, None, None]:
    """Compute in processes: results in the order of the parts, some ahead of the one in use."""
    # Imported late, so that a run without processes does not pay for it.
    from multiprocessing import get_context

    lines = get_context("spawn").SimpleQueue() if hear else None
    given = (*arguments, _say) if hear else arguments
    until = time.monotonic() + limit

    def meanwhile() -> None:
        while hear and lines and not lines.empty():
            hear(lines.get())
        if time.monotonic() > until:
            raise TimeoutError(f"ended at {limit:g} s")

    coming: deque[Future[Result]] = deque()
    with _processes(workers, lines) as pool:
        for part in parts:
            # The pool's processes may start at this moment.
            with kept_from_children(), _program_hidden():
                coming.append(pool.submit(work, part, *given))
            if len(coming) > ahead:
                yield _result(coming.popleft(), meanwhile)
        while coming:
            yield _result(coming.popleft(), meanwhile)


def _processes(count: int, lines: Any) -> AbstractContextManager[Executor]:
    """A pool of processes, with a queue for their lines, or None."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import current_process, get_context

    # Python lets daemonic processes, such as those of multiprocessing.Pool, start no children.
    if current_process().daemon:
        raise WorkerError("this process belongs to a pool and cannot start processes: use jobs=1")
    try:
        # New processes begin in it.
        os.getcwd()
    except FileNotFoundError:
        gone = "the current folder is gone, where processes would begin"
        raise WorkerError(f"{gone}: change to another one, or use jobs=1") from None
    # Not by fork, which would copy locks held by threads that do not exist in the child.
    spawn = get_context("spawn")
    pool = ProcessPoolExecutor(count, spawn, initializer=_follow_parent, initargs=(lines,))

    def end() -> None:
        # Killed, because their results are not needed and they ignore Ctrl-C and SIGTERM.
        for process in list((getattr(pool, "_processes", None) or {}).values()):
            process.kill()

    return _ended(pool, end)


@contextmanager
def _program_hidden() -> Iterator[None]:
    """Keep processes started within from running the user's program, as Python makes them do.

    They need nothing of it; the program would repeat its computation and start further processes.
    """
    program: dict[str, Any] = vars(sys.modules["__main__"])
    with _hiding:
        told = ("__file__", "__spec__")
        # Without a file and a spec of the main module a new process finds no program to run.
        hidden: dict[str, Any] = {name: program.pop(name) for name in told if name in program}
        program["__spec__"] = None
        try:
            yield
        finally:
            program.update(hidden)


def _done(work: Callable[..., Result], *given: Any) -> Result:
    """Do work in this thread, unless a stop was asked for."""
    check_stop()
    return work(*given)


def _result(future: Future[Result], meanwhile: Callable[[], object]) -> Result:
    """Wait for a process's result, unless a stop is asked for."""
    while wait([future], CHECK_PERIOD).not_done:
        check_stop()
        meanwhile()
    meanwhile()
    return future.result()


@contextmanager
def _ended(pool: Executor, end: Callable[[], object]) -> Iterator[Executor]:
    """End a pool at the end of a block, and immediately after an error."""
    try:
        yield pool
    except BrokenExecutor:
        raise WorkerError(
            "a worker process was killed, perhaps for lack of memory; the same command computes"
            " what is missing"
        ) from None
    except BaseException:
        end()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _heed(stop: threading.Event, listener: Listener | None) -> None:
    """Let this thread's work obey the stop event and the listener of the pool."""
    _of_thread.stop, _of_thread.listener = stop, listener


def _follow_parent(to: Any) -> None:
    """Leave Ctrl-C to the parent, and end with it, so that no worker waits for ever.

    Warnings of workers are sentences on stderr.
    """
    global _to_parent
    _to_parent = to
    leave_garbage()
    say_warnings(_warn)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_wait_for_end_of_parent, daemon=True).start()


def _say(line: Any) -> None:
    """Send a line from a process to its listener."""
    _to_parent.put(line)


def _warn(line: str) -> None:
    """Write a warning from a process; on a full disk it is lost."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


def _wait_for_end_of_parent() -> None:
    from multiprocessing import connection, parent_process

    parent = parent_process()
    assert parent is not None
    # The sentinel becomes ready when the parent has ended in whatever way.
    connection.wait([parent.sentinel])
    os._exit(1)
