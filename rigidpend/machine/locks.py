"""Locks that tell if another process is at work on a file or folder, and end with it.

The system keeps them with the open file, so that none outlives a killed process. Where there
are none (`fcntl` is absent, or the file system knows no locks), nobody is taken to be gone.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # pragma: no cover
    fcntl = None  # type: ignore[assignment]


NOT_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)
"""Flags for opening a path that may be no regular file or folder."""


def share(handle: int) -> None:
    """Wait for who holds the open file alone, then hold it together with others."""
    if fcntl is not None:
        _locked(handle, fcntl.LOCK_SH)


def hold(handle: int) -> None:
    """Wait for the others, then hold the open file alone."""
    if fcntl is not None:
        _locked(handle, fcntl.LOCK_EX)


def release(handle: int) -> None:
    """Give up the lock, then close.

    To close alone would leave it to copies: a child has one from the fork until it runs another
    program or ends.
    """
    if fcntl is not None:
        _locked(handle, fcntl.LOCK_UN)
    os.close(handle)


def is_at(handle: int, path: str | Path) -> bool:
    """True if an open file or folder is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


@contextmanager
def deserted(path: Path) -> Iterator[bool]:
    """True if nobody holds a file or folder; if so, it is held alone meanwhile."""
    try:
        # Of links and pipes nothing is ours, and none is waited for.
        handle = os.open(path, os.O_RDONLY | NOT_WAITING)
    except OSError:
        yield False
        return
    try:
        yield fcntl is not None and _locked(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    finally:
        release(handle)


def _locked(handle: int, operation: int) -> bool:
    try:
        fcntl.flock(handle, operation)
    except OSError:
        return False
    return True
