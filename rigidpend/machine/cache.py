"""Cache of what can be made again: compiled code, return maps, in the user's folder.

Each file is a kept one (see `kept`), under the name of what it is of. Compiled code with a bit
flipped crashes, or gives other numbers: so what does not fit is never used.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import json
import os
import shutil
import sys
import warnings
from pathlib import Path
from typing import Any, NamedTuple

from rigidpend.machine import kept

MEANING = {
    "integrators": "compiled integrators",
    "kernels": "compiled kernels",
    "maps": "return maps",
    "plans": "what plans found out",
}
"""The subfolders of this version; others are of another."""
PLANS = 500_000
"""Bytes of all that plans found out, of which each takes some 500."""


class Subfolder(NamedTuple):
    """A subfolder of the cache."""

    path: Path
    meaning: str
    files: list[Path]
    size: int
    """Bytes of all files."""
    damaged: list[Path]
    """Files that do not fit; always empty for a subfolder of another version."""


def user_cache() -> Path:
    """The folder where this user's programs keep what they can make again."""
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def folder() -> Path:
    """The folder of this package's cache."""
    return user_cache() / "rigidpend"


def load(within: Path, of: bytes) -> bytes | None:
    """The content of the file of a subfolder that is of something (see `kept.load`)."""
    path = within / kept.name_of(of)
    content = kept.load(path, of)
    if content is not None:
        with contextlib.suppress(OSError):
            # The time of the last use, by which `_bound` chooses.
            os.utime(path)
    return content


def save(within: Path, of: bytes, content: bytes, most: int) -> None:
    """Keep a content in a subfolder; where it cannot be written that is told, once.

    Parameters
    ----------
    within : Path
        The subfolder.
    of : bytes
        All that the content follows from.
    content : bytes
    most : int
        Bytes that stay in the subfolder; the files used longest ago are removed.
    """
    path = within / kept.name_of(of)
    try:
        kept.save(path, of, content)
        _bound(within, most)
    except OSError as error:
        tell_once(f"{folder()}: nothing can be kept there ({kept.reason(error)})")


def recall(of: str) -> Any:
    """Recall what an earlier process found to follow from something; None where none did."""
    content = load(folder() / "plans", of.encode())
    return None if content is None else json.loads(content)


def remember(of: str, found: Any) -> None:
    """Keep what follows from something, which JSON can hold, for :func:`recall`."""
    save(folder() / "plans", of.encode(), json.dumps(found).encode(), PLANS)


@functools.cache
def tell_once(said: str) -> None:
    """Warn of what is the same for all files, the first time."""
    end = "what takes long is made again at each run; XDG_CACHE_HOME names another folder"
    warnings.warn(f"{said}: {end}", kept.KeptFileWarning, stacklevel=3)


def _bound(within: Path, most: int) -> None:
    # Files that begin with a point are being written by others.
    found = [(path, _looked_up(path)) for path in within.iterdir() if path.name[0] != "."]
    total = sum(size for _, (_, size) in found)
    for path, (_, size) in sorted(found, key=lambda one: one[1]):
        if total <= most:
            break
        with contextlib.suppress(OSError):
            path.unlink()
        total -= size


def _looked_up(path: Path) -> tuple[int, int]:
    """Time of a file's last use, and its size."""
    try:
        found = path.lstat()
    except OSError:
        # Another process has removed it.
        return 0, 0
    return found.st_mtime_ns, found.st_size


def subfolders() -> list[Subfolder]:
    """All subfolders of the cache, in the order of their names, every file compared."""
    try:
        found = sorted(path for path in folder().iterdir() if _is_own_folder(path))
    except OSError:
        return []
    return [_looked_at(path) for path in found]


def _is_own_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _looked_at(path: Path) -> Subfolder:
    inside = sorted(one for one in path.rglob("*") if one.is_file() and not one.is_symlink())
    meaning = MEANING.get(path.name, "of another version")
    size = sum(one.lstat().st_size for one in inside)
    # How another version seals its files is not known here.
    damaged = [one for one in inside if path.name in MEANING and not kept.is_sound(one)]
    return Subfolder(path, meaning, inside, size, damaged)


def clear() -> None:
    """Remove the whole cache; links are removed, not followed.

    Raises
    ------
    OSError
        A file or folder cannot be removed.
    """
    found = folder()
    if found.is_symlink():
        raise NotADirectoryError(errno.ENOTDIR, "a link, which is not followed", str(found))
    # Put aside first: another run may write into it meanwhile.
    aside = found.with_name(f".{found.name}.{os.getpid()}.removed")
    with contextlib.suppress(FileNotFoundError):
        found.rename(aside)
        shutil.rmtree(aside)
