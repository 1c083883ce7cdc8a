"""Cache of what can be made again: compiled code, return maps, in the user's folder.

Each file is sealed with a digest, which is compared before the content is used. Compiled code
with a bit flipped crashes, or gives other numbers: so what is damaged is removed and told, and
made again by whoever needs it.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import sys
import warnings
from pathlib import Path
from typing import NamedTuple

from rigidpend.results import files

MEANING = {
    "integrators": "compiled integrators",
    "kernels": "compiled kernels",
    "maps": "return maps",
}
"""The subfolders of this version; others are of another."""


class DamagedCacheWarning(UserWarning):
    """Warning: a file of the cache was damaged, and was removed."""


class Subfolder(NamedTuple):
    """A subfolder of the cache."""

    path: Path
    meaning: str
    files: list[Path]
    size: int
    """Bytes of all files."""
    damaged: list[Path]
    """Files whose digest does not fit; always empty for a subfolder of another version."""


def user_cache() -> Path:
    """The folder where this user's programs keep what they can make again."""
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def folder() -> Path:
    """The folder of this package's cache."""
    return user_cache() / "rigidpend"


def load(path: Path) -> bytes | None:
    """The content of a file of the cache.

    Returns
    -------
    bytes or None
        None where there is no such file, or where it was damaged: then it is removed, with a
        `DamagedCacheWarning`.
    """
    try:
        stored = files.content(path)
    except (OSError, ValueError):
        return None
    content = files.unsealed(stored)
    if content is None:
        with contextlib.suppress(OSError):
            path.unlink()
        said = f"{path.parent}: a file of this cache was damaged; it is removed and made again"
        warnings.warn(said, DamagedCacheWarning, stacklevel=2)
        return None
    with contextlib.suppress(OSError):
        # The time of the last use, by which `keep_newest` chooses.
        os.utime(path)
    return content


def save(path: Path, content: bytes, most: int) -> None:
    """Keep a content in a file of the cache; nothing is kept where that cannot be written.

    Parameters
    ----------
    path : Path
    content : bytes
    most : int
        Number of files that stay in its folder; those used longest ago are removed.
    """
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        files.replace(path, files.sealed(content), lasting=False)
        _keep_newest(path.parent, most)


def _keep_newest(within: Path, most: int) -> None:
    # Files that begin with a point are being written by others.
    found = [path for path in within.iterdir() if not path.name.startswith(".")]
    if len(found) <= most:
        return
    for path in sorted(found, key=_last_use)[: len(found) - most]:
        with contextlib.suppress(OSError):
            path.unlink()


def _last_use(path: Path) -> float:
    try:
        return path.lstat().st_mtime
    except OSError:
        # Another process has removed it.
        return 0.0


def subfolders() -> list[Subfolder]:
    """All subfolders of the cache, in the order of their names, every digest compared."""
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
    damaged = [one for one in inside if path.name in MEANING and not _is_sound(one)]
    return Subfolder(path, meaning, inside, size, damaged)


def _is_sound(path: Path) -> bool:
    try:
        return files.unsealed(files.content(path)) is not None
    except (OSError, ValueError):
        return False


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
