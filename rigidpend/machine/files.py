"""Files written whole or not at all, sealed against damage, with nothing left behind for long.

What a killed process left is told by its age: no lock says whether anybody is still at work on it.
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import os
import stat
import time
from pathlib import Path
from typing import Self

from rigidpend.machine import signals
from rigidpend.numbers.checked import ParameterError

CERTIFICATE = ".certificate"
"""Ending of the name of a certificate, behind that of its result."""
SEAL = b"\nrigidpend sha256 "
"""Mark between the content of a file and its digest."""
SEAL_LENGTH = len(SEAL) + 64 + 1
LARGEST = 2**31
"""Bytes of a file that is read, and of what it holds, at most."""
DAY = 86_400.0
"""Seconds without a change after which a file or folder is taken for one that was left behind."""


class StoreError(RuntimeError):
    """A file that cannot be read or written."""

    file: Path | None = None
    """The result or certificate, where that is absent or cannot be used."""

    @classmethod
    def of(cls, file: Path, said: str) -> Self:
        """An error of a result or certificate that is absent or cannot be used."""
        error = cls(f"{file}: {said}")
        error.file = file
        return error


class Absent(StoreError):
    """Error: something that is needed and not there: a result, a reference, a library."""


def afford(field: str, count: int, size: int, what: str) -> None:
    """Refuse so many values of so many bytes where a result would hold more than is read again.

    `field` is the parameter that asks for them, `what` they are in words, with their number.
    Raises ParameterError.
    """
    held, most = (x / 1e9 for x in (count * size, LARGEST))
    if held > most:
        message = f"{what} make a result of about {held:.3g} GB, and {most:.3g} GB is the most"
        raise ParameterError(field, message)


def content(path: Path, *, links: bool = True) -> bytes:
    """Read a file, if it is a regular one and of bearable size.

    Nothing is waited for. OSError as :func:`open`, with ELOOP for a link where none may be;
    ValueError for a pipe, a device or a folder, and for what is too large.
    """
    # Looked at first, for to open a device can have effects; then again, for it may have changed.
    _check_regular(os.stat(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags | (0 if links else getattr(os, "O_NOFOLLOW", 0)))
    with os.fdopen(handle, "rb") as file:
        _check_regular(os.fstat(handle))
        # No more room than it takes: a limit on memory counts what is asked for.
        found = file.read(os.fstat(handle).st_size + 1)
    if len(found) > LARGEST:
        raise ValueError(f"more than {LARGEST} bytes")
    return found


def _check_regular(found: os.stat_result) -> None:
    if not stat.S_ISREG(found.st_mode):
        raise ValueError("not a regular file")
    if found.st_size > LARGEST:
        raise ValueError(f"{found.st_size} bytes, more than {LARGEST}")


def prepare(path: Path, otherwise: str = "choose another folder with --out") -> None:
    """Make the folder of a file to come, so that a long computation does not end in vain.

    StoreError where nothing can be written to it, with what to do otherwise, or a folder is in the
    file's place.
    """
    make_way(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = _temporary(path)
        os.close(handle)
        os.unlink(temporary)
    except OSError as error:
        reason = f"{path.parent} is not writable ({error.strerror})"
        raise StoreError(f"{path}: {reason}; {otherwise}") from None


def make_way(path: Path) -> None:
    """Refuse a folder in the place of a file to come; what is in it is for its owner to judge."""
    if path.is_dir() and not path.is_symlink():
        said = "a folder is in the place of a file: move it away, or remove it if it is not needed"
        raise StoreError(f"{path}: {said}")


def write(path: Path, content: bytes) -> None:
    """Write a file whole, as :func:`replace` does; StoreError in a sentence where that fails.

    Then what was there before is untouched.
    """
    make_way(path)
    try:
        replace(path, content)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None


def replace(path: Path, content: bytes, *, lasting: bool = True) -> None:
    """Give a file new content in one step, so that no reader sees half of it.

    What killed writers of the same file left is removed. What is not `lasting` may be lost when
    the machine fails.
    """
    sweep(path)
    handle, temporary = _temporary(path)
    signals.unfinished.add(temporary)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            if lasting:
                os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
    finally:
        signals.unfinished.discard(temporary)


def twin(path: Path) -> str:
    """Name of a file there that differs in case only, and on some systems is the same file.

    Empty where there is none, or where the file itself is there.
    """
    try:
        names = os.listdir(path.parent)
    except OSError:
        return ""
    alike = [name for name in names if name.casefold() == path.name.casefold()]
    return "" if path.name in alike else next(iter(alike), "")


def sweep(path: Path, least: float = DAY) -> None:
    """Remove what killed writers of a file left beside it, if it is so many seconds old."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        if is_left(left, least):
            with contextlib.suppress(OSError):
                os.unlink(left)


def is_left(path: Path, least: float = DAY) -> bool:
    """True if a file or folder, and no link or pipe, has not changed for so many seconds."""
    try:
        found = path.lstat()
    except OSError:
        return False
    ours = stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)
    return ours and time.time() - found.st_mtime >= least


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
    """A new file beside another, as readable as any that is made here."""
    name = str(path.with_name(f".{path.name}.{os.urandom(4).hex()}.part"))
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    return os.open(name, flags, 0o666), name
