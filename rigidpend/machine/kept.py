"""Kept files: what can be made again, each with what it is of, sealed with a digest.

A file's name proves nothing: it may be a copy of another, or left by other code. So all that a
content follows from stands behind it, whole, under the digest, and is compared when it is read.
What does not fit is told, removed, and made again by whoever needs it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import warnings
from pathlib import Path

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


def load(path: Path, of: bytes) -> bytes | None:
    """The content of a kept file.

    Parameters
    ----------
    path : Path
    of : bytes
        All that the content follows from.

    Returns
    -------
    bytes or None
        None where there is no such file, and where it does not fit: it is damaged, of something
        else, a link, or no regular file. Then a `KeptFileWarning` says so.
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
    tell(path, "damaged" if inner is None else "of something else than its name says")
    return None


def save(path: Path, of: bytes, content: bytes) -> None:
    """Keep a content in a file, whole or not at all.

    Raises
    ------
    OSError
        It cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    files.replace(path, files.sealed(content + _record(of)), lasting=False)


def is_sound(path: Path) -> bool:
    """True if a file is undamaged, and has the name of what it is of (see `name_of`)."""
    try:
        inner = files.unsealed(files.content(path, links=False)) or b""
        length = int(inner[-DIGITS:])
    except (OSError, ValueError):
        return False
    of = inner[-DIGITS - length : -DIGITS]
    return inner.endswith(_record(of)) and path.name == name_of(of)


def tell(path: Path, reason: str) -> None:
    """Warn that a kept file is not used."""
    warnings.warn(f"{path}: {reason}; it is made again", KeptFileWarning, stacklevel=2)


def _record(of: bytes) -> bytes:
    return MARK + of + b"%0*d" % (DIGITS, len(of))


def reason(error: OSError | ValueError) -> str:
    """Reason of an error, without the path that the system adds."""
    return str(getattr(error, "strerror", None) or error)
