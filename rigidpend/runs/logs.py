"""Logs beside the results: `NAME.log` holds what was said of the last run of NAME, as it went."""

from __future__ import annotations

import contextlib
import datetime
import tempfile
import threading
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Self, TextIO


class Logs:
    """The logs of one command, written line by line; to be used in a ``with`` statement.

    Each stands beside the result file of its name, and begins with the same line. A log that cannot
    be written is left out: it is no reason not to compute.
    """

    def __init__(self, targets: Mapping[str, Path], opening: str) -> None:
        self._targets, self._opening = targets, opening
        self._files: dict[str, TextIO | None] = {}
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for file in self._files.values():
            if file is not None:
                # What does not fit fails here once more.
                with contextlib.suppress(OSError):
                    file.close()

    def path(self, name: str) -> Path | None:
        """The log of a name, if something was written to it."""
        return _beside(self._targets[name]) if self._files.get(name) else None

    def failure(self, name: str, error: BaseException) -> Path:
        """Write an error with its traceback; where, is returned."""
        if self.hear(name, _trace(error)):
            return _beside(self._targets[name])
        return elsewhere(error)

    def hear(self, name: str, text: str) -> bool:
        """Take a line into the log of a name; False where it cannot be written."""
        with self._lock:
            if name not in self._files:
                self._files[name] = _opened(_beside(self._targets[name]))
                self._put(name, self._opening)
            return self._put(name, text)

    def _put(self, name: str, text: str) -> bool:
        file = self._files[name]
        if file is None:
            return False
        try:
            file.write(f"{_now()} {text}\n")
            file.flush()
        except OSError:
            return False
        return True


def elsewhere(error: BaseException) -> Path:
    """Write an error with its traceback to a file of its own in the folder for such."""
    with tempfile.NamedTemporaryFile(
        "w", encoding="utf-8", errors="replace", prefix="rigidpend-", suffix=".log", delete=False
    ) as log:
        log.write(_trace(error))
    return Path(log.name)


def _trace(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))


def _beside(target: Path) -> Path:
    return target.with_suffix(".log")


def _opened(path: Path) -> TextIO | None:
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        # A new file, so that nothing is written through a link or into a pipe in its place.
        path.unlink(missing_ok=True)
        return path.open("x", encoding="utf-8", errors="replace")
    return None


def _now() -> str:
    return datetime.datetime.now().astimezone().isoformat(timespec="milliseconds")
