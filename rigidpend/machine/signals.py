"""Ctrl-C and SIGTERM on the command line: noted at once, obeyed where work can end.

A Python handler runs between any two instructions of the main thread, also in a destructor or in a
callback from C: an exception raised there is lost, and the program goes on. So the handlers here do
nothing. The system writes the signal's number into a pipe, and a thread reads it. Work checks
:func:`came` where it can end; after a while the process ends whatever it is doing.

In a notebook none of this is installed: Ctrl-C stays Python's `KeyboardInterrupt`.
"""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

SIGNALS = (signal.SIGINT, signal.SIGTERM)
GRACE = 1.5
"""Seconds after a signal in which work can end by itself, before the process ends."""

unfinished: set[str] = set()
"""Temporary files that are being written, which are removed when the process ends."""

_came: list[int] = []
_told: list[str] = []
_telling = threading.Lock()


class Stopped(BaseException):
    """Raised where work can end, after it has been asked to stop."""


def came() -> int:
    """Number of the signal that asks this process to end; 0 if there was none."""
    return _came[0] if _came else 0


def watch() -> None:
    """Watch for Ctrl-C and SIGTERM from now on; for the main thread of a command line.

    Signals that the shell has set to be ignored, as Ctrl-C in the background, stay ignored.
    """
    out, into = os.pipe()
    # The end of the pipe that the system writes to must not block; Windows needs no such setting.
    if os.name == "posix":
        os.set_blocking(into, False)
    signal.set_wakeup_fd(into, warn_on_full_buffer=False)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: None)
    threading.Thread(target=_heed, args=(out,), daemon=True).start()


def conclude(number: int, say: Callable[[str], object], patience: float = -1) -> tuple[int, str]:
    """Report once that a signal ended the work; return the exit code and the sentence.

    If another thread is reporting it, wait for `patience` seconds, or without limit if negative.
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
    """Write to stderr by its number: another thread may hold its lock, and have begun a line."""
    opening = "\n" if os.isatty(2) else ""
    os.write(2, f"{opening}{sentence}\n".encode())


@contextlib.contextmanager
def kept_from_children() -> Iterator[None]:
    """Hide both signals from processes started within, which their parent ends itself."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker

    # Started beforehand, because Python unblocks signals when it starts this process of its own.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
