"""Cached files, each sealed with its origin; and the user's cache, a folder of such files.

Things that can be made again are cached: compiled code, return maps, parts of a run. The name of a
file proves nothing: the file may be a copy of another, or left by other code. So its origin, which
is everything that the content follows from, is stored after the content under one digest, and is
compared when the file is read. A file that does not fit is reported, removed, and made again:
compiled code with a flipped bit would crash, or give other numbers.
"""

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
"""Mark between a content and its origin."""
DIGITS = 12
"""Digits of the length of the origin, at the end of the file."""


class KeptFileWarning(UserWarning):
    """Warning: a cached file is not what it should be, or a file cannot be cached."""


def name_of(of: bytes) -> str:
    """Name for the file of an origin; a fitting name is no proof of the origin."""
    return hashlib.sha256(MARK + of).hexdigest()[:32]


def load_file(path: Path, of: bytes) -> bytes | None:
    """The content of a cached file with the origin `of`.

    None if there is no such file. None with a `KeptFileWarning` if it does not fit: it is damaged,
    of another origin, a link, or no regular file.
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
    """Store a content with its origin, completely or not at all; OSError if that fails."""
    path.parent.mkdir(parents=True, exist_ok=True)
    files.replace(path, files.sealed(content + _record(of)), lasting=False)


def tell(path: Path, reason: str) -> None:
    """Warn that a cached file is not used."""
    warnings.warn(f"{path}: {reason}; it is made again", KeptFileWarning, stacklevel=2)


def _record(of: bytes) -> bytes:
    return MARK + of + b"%0*d" % (DIGITS, len(of))


def reason(error: OSError | ValueError) -> str:
    """Text of an error, without the path that the system adds."""
    return str(getattr(error, "strerror", None) or error)


MEANING = {
    "kernels": "compiled kernels",
    "maps": "return maps",
    "hashes": "hashes of code",
}
"""Meanings of the subfolders of this version; other subfolders belong to other versions."""


class Subfolder(NamedTuple):
    """A subfolder of the cache; a part of the document of ``cache --json``."""

    name: str
    meaning: str
    bytes: int
    """Size of all files together."""
    files: list[Path]


def folder() -> Path:
    """The folder of this package's cache, among those of all programs of this user.

    In the null device, where nothing can be cached, if this user has no home.
    """
    home, given = (Path(x) for x in (os.path.expanduser("~"), os.environ.get("XDG_CACHE_HOME", "")))
    # The specification has relative paths ignored: each working folder would have its own cache.
    home = home if home.is_absolute() else Path(os.devnull)
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "rigidpend"
    return (given if given.is_absolute() else home / ".cache") / "rigidpend"


def load(within: Path, of: bytes) -> bytes | None:
    """The content of a cached file in a subfolder, by its origin (see :func:`load_file`)."""
    path = within / name_of(of)
    content = load_file(path, of)
    if content is not None:
        with contextlib.suppress(OSError):
            # Sets the time of the last use, by which `save` chooses what to remove.
            os.utime(path)
    return content


def save(within: Path, of: bytes, content: bytes, most_bytes: int) -> None:
    """Store a content in a subfolder; a failure is reported once.

    At most `most_bytes` bytes stay in the subfolder: the files used longest ago are removed.
    """
    try:
        save_file(within / name_of(of), of, content)
        # Names of files that are still being written begin with a dot, and of those that a killed
        # process left.
        every = (path for path in within.iterdir() if path.name[0] != "." or files.is_left(path))
        found = [_looked_up(path) for path in every]
        total = sum(size for _, size, _ in found)
        for _, size, path in sorted(found):
            if total > most_bytes:
                path.unlink(missing_ok=True)
                total -= size
    except OSError as error:
        tell_once(f"{folder()}: cannot be written ({reason(error)})")


def _looked_up(path: Path) -> tuple[int, int, Path]:
    """Time of a file's last use, its size, and its path."""
    try:
        found = path.lstat()
    except OSError:
        # Another process has just removed it.
        return 0, 0, path
    return found.st_mtime_ns, found.st_size, path


@functools.cache
def tell_once(said: str) -> None:
    """Give a warning only the first time, because it is the same for all files."""
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
    return Subfolder(path.name, MEANING.get(path.name, "of another version"), size, inside)


def clear() -> None:
    """Remove the whole cache; links are removed, not followed. OSError if that fails."""
    found = folder()
    if found.is_symlink():
        raise NotADirectoryError(errno.ENOTDIR, "a link, which is not followed", str(found))
    if found.is_file():
        raise NotADirectoryError(errno.ENOTDIR, "a file, not a folder: move it away", str(found))
    # Renamed first, because another run may write into the folder meanwhile.
    aside = found.with_name(f".{found.name}.{os.getpid()}.removed")
    with contextlib.suppress(FileNotFoundError):
        found.rename(aside)
        shutil.rmtree(aside)
