"""Files written completely or not at all, with digests against damage, and without old leftovers.

Leftovers of killed processes are recognised by their age, since there are no locks.
"""

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
"""Ending of the name of a certificate, after the name of its result."""
SEAL = b"\nrigidpend sha256 "
"""Mark between the content of a file and its digest."""
SEAL_LENGTH = len(SEAL) + 64 + 1
MOST_BYTES = 2**31
"""Largest number of bytes of a file that is read, and of its arrays."""
DAY = 86_400.0
"""Seconds without a change after which a file or folder counts as left behind."""


class StoreError(RuntimeError):
    """Error: a file that cannot be read or written."""

    file: Path | None = None
    """The result or certificate that is absent or cannot be used, if it is one."""

    @classmethod
    def of(cls, file: Path, said: str) -> Self:
        """Make an error on a result or certificate that is absent or cannot be used."""
        error = cls(f"{file}: {said}")
        error.file = file
        return error


class Absent(StoreError):
    """Error: something needed is absent: a result, a reference, a library."""


def afford(field: str, count: int, size: int, what: str) -> None:
    """Refuse `count` values of `size` bytes if no result that is read again can hold them.

    `field` is the parameter that asks for them, `what` describes them with their number.
    Raises ParameterError.
    """
    held, most = (x / 1e9 for x in (count * size, MOST_BYTES))
    if held > most:
        message = f"{what} make a result of about {held:.3g} GB, and {most:.3g} GB is the most"
        raise ParameterError(field, message)


def content(path: Path, *, links: bool = True) -> bytes:
    """Read a regular file of at most `MOST_BYTES` bytes.

    Never blocks. OSError as :func:`open`, with ELOOP for a link unless `links`; ValueError for a
    pipe, a device or a folder, and for a file that is too large.
    """
    # Checked before opening, which can affect a device, and again after, as it may have changed.
    _check_regular(os.stat(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags | (0 if links else getattr(os, "O_NOFOLLOW", 0)))
    with os.fdopen(handle, "rb") as file:
        found = os.fstat(handle)
        _check_regular(found)
        # No more than the size is requested, which is what a limit on memory counts.
        return file.read(found.st_size)


def _check_regular(found: os.stat_result) -> None:
    if not stat.S_ISREG(found.st_mode):
        raise ValueError("not a regular file")
    if found.st_size > MOST_BYTES:
        raise ValueError(f"{found.st_size} bytes, more than {MOST_BYTES}")


def prepare(path: Path, otherwise: str = "choose another folder with --out") -> None:
    """Make the folder of a future file, so that a long computation does not end in vain.

    StoreError if the folder cannot be written to, with the advice `otherwise`, or if a folder is in
    the file's place.
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
    """Refuse a folder in the place of a future file; only its owner may remove it."""
    if path.is_dir() and not path.is_symlink():
        said = "a folder is in the place of a file: move it away, or remove it if it is not needed"
        raise StoreError(f"{path}: {said}")


def write(path: Path, content: bytes) -> None:
    """Write a file completely, as :func:`replace` does; StoreError with a sentence if that fails.

    After a failure the previous file is untouched.
    """
    make_way(path)
    try:
        replace(path, content)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None


def replace(path: Path, content: bytes, *, lasting: bool = True) -> None:
    """Give a file new content in one step, so that no reader sees half of it.

    Leftovers of killed writers of the same file are removed. Without `lasting` the content may be
    lost when the machine fails.
    """
    remove_leftovers(path)
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
    """Name of a file that differs from a path only in case, which some systems ignore.

    Empty if there is none, or if the file itself exists.
    """
    try:
        names = os.listdir(path.parent)
    except OSError:
        return ""
    alike = [name for name in names if name.casefold() == path.name.casefold()]
    return "" if path.name in alike else next(iter(alike), "")


def remove_leftovers(path: Path, least_age: float = DAY) -> None:
    """Remove leftovers of killed writers of a file, if at least `least_age` seconds old."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        if is_left(left, least_age):
            with contextlib.suppress(OSError):
                os.unlink(left)


def is_left(path: Path, least_age: float = DAY) -> bool:
    """True if a file or folder (no link or pipe) has not changed for `least_age` seconds."""
    try:
        found = path.lstat()
    except OSError:
        return False
    ours = stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)
    return ours and time.time() - found.st_mtime >= least_age


def sealed(content: bytes) -> bytes:
    """The content followed by its digest."""
    return content + _seal(content)


def unsealed(content: bytes) -> bytes | None:
    """The content before a digest; None if there is no digest, or if it does not fit."""
    inner = content[:-SEAL_LENGTH]
    return inner if content[-SEAL_LENGTH:] == _seal(inner) else None


def _seal(content: bytes) -> bytes:
    return SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"


def _temporary(path: Path) -> tuple[int, str]:
    """A new temporary file beside another, with the usual permissions of new files."""
    name = str(path.with_name(f".{path.name}.{os.urandom(4).hex()}.part"))
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    return os.open(name, flags, 0o666), name
