"""Ctrl-C and SIGTERM on the command line: noted at once, heeded where work can end.

A handler of Python's runs between any two instructions of the main thread, be it in a destructor
or in a function that a library in C calls: what is raised there is lost, and the program goes on.
So the handlers here do nothing. The system puts the signal's number into a pipe, a thread reads
it, work looks at :func:`came` where it can end, and the process ends whatever it does meanwhile.

In a notebook nothing of this is installed: there Ctrl-C is Python's `KeyboardInterrupt`.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

SIGNALS = (signal.SIGINT, signal.SIGTERM)
GRACE = 1.5
"""Seconds that work has to end by itself after a signal, before the process does."""

unfinished: set[str] = set()
"""Files that are being written, not yet under their names: none of them stays behind."""

_came: list[int] = []
_told: list[str] = []
_telling = threading.Lock()


class Stopped(BaseException):
    """Work that is not wanted any more ends, at a place where it can."""


def came() -> int:
    """Number of the signal that asks this process to end; 0 if there was none."""
    return _came[0] if _came else 0


def watch() -> None:
    """From now on let no Ctrl-C and no SIGTERM be lost; for the main thread of a command line.

    What a shell has told to be ignored, as Ctrl-C in the background, stays ignored.
    """
    out, into = os.pipe()
    # A handler must not wait; on Windows it need not be said.
    if os.name == "posix":
        os.set_blocking(into, False)
    signal.set_wakeup_fd(into, warn_on_full_buffer=False)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: None)
    threading.Thread(target=_heed, args=(out,), daemon=True).start()


def conclude(number: int, say: Callable[[str], object], patience: float = -1) -> tuple[int, str]:
    """Say once that a signal ended the work; the exit code and the sentence.

    Another thread may be about to say it: that is waited for so many seconds, or without end if the
    number is negative.
    """
    word = "terminated" if number == signal.SIGTERM else "interrupted"
    sentence = f"{word}; finished results are kept"
    if _telling.acquire(timeout=patience):
        with contextlib.suppress(OSError):
            if not _told:
                say(sentence)
            if came():
                _told.append(sentence)
        _telling.release()
    return 128 + number, sentence


def _heed(out: int) -> None:
    """Wait for a signal, let work end, then end the process."""
    while (number := os.read(out, 1)[0]) not in SIGNALS:
        pass
    _came.append(number)
    time.sleep(GRACE)
    code, _ = conclude(number, _write, patience=0.1)
    for path in list(unfinished):
        with contextlib.suppress(OSError):
            os.unlink(path)
    os._exit(code)


def _write(sentence: str) -> None:
    """Write on stderr, whose lock another thread may hold; a terminal may have a line open."""
    opening = "\n" if os.isatty(2) else ""
    os.write(2, f"{opening}{sentence}\n".encode())


@contextlib.contextmanager
def kept_from_children() -> Iterator[None]:
    """Hide both signals from processes begun within: they are for their parent, which ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    # A process of Python's own, at whose start it lets signals in again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
