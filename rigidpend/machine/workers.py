"""Parallel workers: threads where the work releases the interpreter, processes where not."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager, suppress
from typing import Any, TypeVar

from rigidpend.machine import leave_garbage
from rigidpend.machine.signals import Stopped, came, kept_from_children
from rigidpend.machine.wording import say_warnings

Result = TypeVar("Result")


PERIOD = 0.1
"""Seconds between two looks whether what is waited for is still wanted."""

EACH = 4
"""Parts for each process from which on they are worth processes, which take a third of a second."""

SILENCE = 5.0
"""Seconds for which work that takes long says nothing."""

_of_thread = threading.local()
"""Wishes of a pool for its threads: `stops`, events that end work; `listener`, who hears it."""
_to_parent: Any = None
"""Queue to who hears this process."""
_hiding = threading.Lock()


def check_stop() -> None:
    """End the work of this thread if it is not wanted any more; engines ask some times a second.

    It raises Stopped in a thread of a pool that is being stopped, and in all of a command line
    after Ctrl-C or SIGTERM.
    """
    if came() or any(stop.is_set() for stop in getattr(_of_thread, "stops", ())):
        raise Stopped


class Listener:
    """Receiver of what long work says of itself."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say, self._lock, self._last = say, threading.Lock(), time.monotonic()

    def hear(self, line: str | Callable[[], str]) -> None:
        """Take a line; one that is still to be made only after `SILENCE` seconds without any."""
        with self._lock:
            now = time.monotonic()
            if callable(line) and now - self._last < SILENCE:
                return
            self._last = now
        self._say(line() if callable(line) else line)


@contextmanager
def listening(say: Callable[[str], object]) -> Iterator[Callable[[str], None]]:
    """Let `say` take what work says by :func:`note` within, and threads that it starts.

    Gives a function for lines that are said in any case; after one there is silence first.
    """
    before, listener = getattr(_of_thread, "listener", None), Listener(say)
    _of_thread.listener = listener
    try:
        yield listener.hear
    finally:
        _of_thread.listener = before


def note(text: Callable[[], str]) -> None:
    """Say how far long work is, where somebody listens and nothing was said for a while.

    In a notebook, or where Python is used by hand, stderr listens.
    """
    listener = getattr(_of_thread, "listener", None)
    if listener is None and (hasattr(sys, "ps1") or "ipykernel" in sys.modules):
        listener = _of_thread.listener = Listener(lambda line: print(line, file=sys.stderr))
    if listener is not None:
        listener.hear(text)


class WorkerError(RuntimeError):
    """Error: a worker process ended before its work was done, or none may begin."""


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
    hear: Callable[[str], object] | None = None,
) -> list[Result]:
    """Compute ``work(part, *arguments)`` for each part, so many at a time, in their order.

    Where it is Python itself that works, and holds the interpreter, processes do it: then `work` is
    a function of a module, but not of the user's program, which processes do not read. Else threads
    do, and the work calls `check_stop` now and then. With one job or part nothing is started.

    Where something hears the lines that the work says, it is ``work(part, *arguments, say)``.
    WorkerError where a process was killed, by hand or for want of memory.
    """
    workers = min(jobs, len(parts))
    if workers > 1 and holds_interpreter:
        return list(_in_processes(work, arguments, parts, workers, hear))
    given = arguments if hear is None else (*arguments, hear)
    if workers <= 1:
        return [_done(work, part, *given) for part in parts]
    stop = threading.Event()
    heeded = (*getattr(_of_thread, "stops", ()), stop), getattr(_of_thread, "listener", None)
    pool = ThreadPoolExecutor(workers, initializer=_heed, initargs=heeded)
    with _ended(pool, stop.set):
        return [_result(x) for x in [pool.submit(work, part, *given) for part in parts]]


def worth_processes(parts: int, jobs: int) -> bool:
    """True if there are so many parts that they are worth processes, each with one thread."""
    return jobs > 1 and parts >= EACH * jobs


def ahead(
    work: Callable[[Any], Result], parts: Sequence[Any], jobs: int
) -> Generator[Result, None, None]:
    """Compute ``work(part)`` for each part in processes, so many ahead of the one that is used.

    Results come in the order of the parts. The first is computed here: it makes, and keeps, what
    all share.
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

    It is ``work(*arguments)``, or ``work(*arguments, say)`` where something hears it.

    Raises TimeoutError where it takes more than `limit` seconds, and ends it.
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
    """Compute in processes: results in the order of the parts, so many ahead of the one in use."""
    # Imported here: a run that needs no process does not pay for it.
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
            coming.append(_begun(pool, work, part, *given))
            if len(coming) > ahead:
                yield _result(coming.popleft(), meanwhile)
        while coming:
            yield _result(coming.popleft(), meanwhile)


def _processes(count: int, lines: Any) -> AbstractContextManager[Executor]:
    """A pool of processes, with the queue by which they are heard, or None."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import current_process, get_context

    if current_process().daemon:
        raise WorkerError("this process belongs to a pool and cannot start processes: use jobs=1")
    # A fork would copy the locks of threads that do not run in the child.
    spawn = get_context("spawn")
    pool = ProcessPoolExecutor(count, spawn, initializer=_follow_parent, initargs=(lines,))

    def end() -> None:
        # At once: what they compute is not wanted any more, and they are deaf to the others.
        for process in list((getattr(pool, "_processes", None) or {}).values()):
            process.kill()

    return _ended(pool, end)


def _begun(pool: Executor, work: Callable[..., Result], *given: Any) -> Future[Result]:
    """Give work to a pool, whose processes may begin now."""
    with kept_from_children(), _program_hidden():
        return pool.submit(work, *given)


@contextmanager
def _program_hidden() -> Iterator[None]:
    """Let processes begun within not run the user's program, with which Python lets them begin.

    They need nothing of it, and it would compute once more, and begin processes of its own.
    """
    program: dict[str, Any] = vars(sys.modules["__main__"])
    with _hiding:
        told = ("__file__", "__spec__")
        hidden: dict[str, Any] = {name: program.pop(name) for name in told if name in program}
        program["__spec__"] = None
        try:
            yield
        finally:
            program.update(hidden)


def _done(work: Callable[..., Result], *given: Any) -> Result:
    """Do work in this thread, if it is still wanted."""
    check_stop()
    return work(*given)


def _result(future: Future[Result], meanwhile: Callable[[], object] = lambda: None) -> Result:
    """Wait for a result as long as it is wanted."""
    while wait([future], PERIOD).not_done:
        check_stop()
        meanwhile()
    meanwhile()
    return future.result()


@contextmanager
def _ended(pool: Executor, end: Callable[[], object]) -> Iterator[Executor]:
    """End a pool with what it is for, at once where that fails."""
    try:
        yield pool
    except BrokenExecutor:
        raise WorkerError(
            "a worker process was killed, perhaps for lack of memory; finished parts are kept,"
            " and the same command continues"
        ) from None
    except BaseException:
        end()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _heed(stops: tuple[threading.Event, ...], listener: Listener | None) -> None:
    """Let this thread's work end when an event is set, and be heard by who hears the pool's."""
    _of_thread.stops, _of_thread.listener = stops, listener


def _follow_parent(to: Any) -> None:
    """Leave Ctrl-C to the parent, and end with it: else its workers would wait for ever.

    What they warn of are sentences on stderr.
    """
    global _to_parent
    _to_parent = to
    leave_garbage()
    say_warnings(_warn)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_wait_for_end_of_parent, daemon=True).start()


def _say(line: Any) -> None:
    """Say something from a process."""
    _to_parent.put(line)


def _warn(line: str) -> None:
    """Say a warning from a process; a full disk loses it."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)


def _wait_for_end_of_parent() -> None:
    from multiprocessing import connection, parent_process

    parent = parent_process()
    assert parent is not None
    # The sentinel is ready when the parent has ended, however it did.
    connection.wait([parent.sentinel])
    os._exit(1)
