"""Kept files, each with what it is of, sealed; the cache, a folder of the user's of them.

What can be made again is kept: compiled code, return maps, parts of a run. A file's name proves
nothing: it may be a copy of another, or left by other code. So all that a content follows from
stands behind it, whole, under the digest, and is compared when it is read. What does not fit is
told, removed, and made again by whoever needs it: compiled code with a bit flipped crashes, or
gives other numbers.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import os
import shutil
import sys
import warnings
from pathlib import Path
from typing import NamedTuple

from rigidpend.machine import files

MARK = b"\nrigidpend keeps this for "
"""Mark between a content and what it is of."""
DIGITS = 12
"""Digits of the length of what it is of, which stand at the end."""


class KeptFileWarning(UserWarning):
    """Warning: a kept file is not what it should be, or one cannot be kept."""


def name_of(of: bytes) -> str:
    """Name for the file of what follows from something; that it fits is no proof."""
    return hashlib.sha256(MARK + of).hexdigest()[:32]


def load_file(path: Path, of: bytes) -> bytes | None:
    """The content of a kept file of something, which is all that the content follows from.

    None where there is no such file, and where it does not fit: it is damaged, of something else, a
    link, or no regular file. Then a `KeptFileWarning` says so.
    """
    try:
        stored = files.content(path, links=False)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:
        is_link = isinstance(error, OSError) and error.errno == errno.ELOOP
        tell(path, "a link, which is not followed" if is_link else reason(error))
        return None
    inner, record = files.unsealed(stored), _record(of)
    if inner is not None and inner.endswith(record):
        return inner[: -len(record)]
    with contextlib.suppress(OSError):
        path.unlink()
    tell(path, "damaged" if inner is None else "made for something else than its name says")
    return None


def save_file(path: Path, of: bytes, content: bytes) -> None:
    """Keep a content in a file, whole or not at all; OSError where it cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    files.replace(path, files.sealed(content + _record(of)), lasting=False)


def tell(path: Path, reason: str) -> None:
    """Warn that a kept file is not used."""
    warnings.warn(f"{path}: {reason}; it is made again", KeptFileWarning, stacklevel=2)


def _record(of: bytes) -> bytes:
    return MARK + of + b"%0*d" % (DIGITS, len(of))


def reason(error: OSError | ValueError) -> str:
    """Reason of an error, without the path that the system adds."""
    return str(getattr(error, "strerror", None) or error)


MEANING = {
    "kernels": "compiled kernels",
    "maps": "return maps",
    "hashes": "hashes of code",
}
"""The subfolders of this version; others are of another."""


class Subfolder(NamedTuple):
    """A subfolder of the cache."""

    path: Path
    meaning: str
    files: list[Path]
    size: int
    """Bytes of all files."""


def user_cache() -> Path:
    """The folder where this user's programs keep what they can make again."""
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def folder() -> Path:
    """The folder of this package's cache."""
    return user_cache() / "rigidpend"


def load(within: Path, of: bytes) -> bytes | None:
    """The content of the file of a subfolder that is of something (see :func:`load_file`)."""
    path = within / name_of(of)
    content = load_file(path, of)
    if content is not None:
        with contextlib.suppress(OSError):
            # The time of the last use, by which `save` chooses.
            os.utime(path)
    return content


def save(within: Path, of: bytes, content: bytes, most: int) -> None:
    """Keep a content in a subfolder; where it cannot be written that is told, once.

    At most so many bytes stay in the subfolder: the files used longest ago are removed.
    """
    try:
        save_file(within / name_of(of), of, content)
        # Files that begin with a point are being written by others.
        found = [_looked_up(path) for path in within.iterdir() if path.name[0] != "."]
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total > most:
                path.unlink(missing_ok=True)
                total -= size
    except OSError as error:
        tell_once(f"{folder()}: cannot be written ({reason(error)})")


def _looked_up(path: Path) -> tuple[int, int, Path]:
    """Time of a file's last use, and its size."""
    try:
        found = path.lstat()
    except OSError:
        # Another process has removed it.
        return 0, 0, path
    return found.st_mtime_ns, found.st_size, path


@functools.cache
def tell_once(said: str) -> None:
    """Warn of what is the same for all files, the first time."""
    end = "compiled code and maps are made again at each run; XDG_CACHE_HOME names another folder"
    warnings.warn(f"{said}: {end}", KeptFileWarning, stacklevel=3)


def subfolders() -> list[Subfolder]:
    """All subfolders of the cache, in the order of their names."""
    try:
        found = sorted(x for x in folder().iterdir() if x.is_dir() and not x.is_symlink())
    except OSError:
        return []
    return [_looked_at(path) for path in found]


def _looked_at(path: Path) -> Subfolder:
    inside = sorted(one for one in path.rglob("*") if one.is_file() and not one.is_symlink())
    size = sum(one.lstat().st_size for one in inside)
    return Subfolder(path, MEANING.get(path.name, "of another version"), inside, size)


def clear() -> None:
    """Remove the whole cache; links are removed, not followed. OSError where that fails."""
    found = folder()
    if found.is_symlink():
        raise NotADirectoryError(errno.ENOTDIR, "a link, which is not followed", str(found))
    # Put aside first: another run may write into it meanwhile.
    aside = found.with_name(f".{found.name}.{os.getpid()}.removed")
    with contextlib.suppress(FileNotFoundError):
        found.rename(aside)
        shutil.rmtree(aside)
