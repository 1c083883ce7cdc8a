"""Files written whole or not at all, sealed against damage, with nothing left behind."""

from __future__ import annotations

import contextlib
import glob
import hashlib
import os
import tempfile
from pathlib import Path

from rigidpend.results import locks

SEAL = b"\nrigidpend sha256 "
SEAL_LENGTH = len(SEAL) + 64 + 1


class StoreError(RuntimeError):
    """A file that cannot be read or written."""


def prepare(path: Path) -> None:
    """Make the folder of a file to come, so that a long computation does not end in vain.

    Raises
    ------
    StoreError
        The folder cannot be made, or nothing can be written to it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = _temporary(path)
        os.unlink(temporary)
        os.close(handle)
    except OSError as error:
        reason = f"{path.parent} is not writable ({error.strerror})"
        raise StoreError(f"{path}: {reason}; choose another folder with --out") from None


def replace(path: Path, content: bytes, *, lasting: bool = True) -> None:
    """Give a file new content in one step, so that no reader sees half of it.

    What killed writers of the same file left is removed; who still writes is not disturbed.
    What is not `lasting` may be lost when the machine fails.
    """
    sweep(path)
    handle, temporary = _temporary(path)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            if lasting:
                os.fsync(file.fileno())
            # mkstemp keeps others out; a result is as readable as any file made here.
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


def sweep(path: Path) -> None:
    """Remove what killed writers of a file left beside it."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        with locks.deserted(left) as free, contextlib.suppress(OSError):
            if free:
                os.unlink(left)


def sealed(content: bytes) -> bytes:
    """The content with its digest behind it."""
    return content + _seal(content)


def unsealed(content: bytes) -> bytes | None:
    """The content in front of its digest; None where there is no digest, or not its own."""
    inner = content[:-SEAL_LENGTH]
    return inner if content[-SEAL_LENGTH:] == _seal(inner) else None


def _seal(content: bytes) -> bytes:
    return SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"


def _temporary(path: Path) -> tuple[int, str]:
    """A new file beside another, locked for as long as it is open."""
    while True:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        locks.hold(handle)
        if locks.is_at(handle, name):
            return handle, name
        # Another run took it for one left behind, before it was locked.
        os.close(handle)


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
