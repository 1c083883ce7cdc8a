"""Logs beside the results: `NAME.log` has the messages of the last run of NAME."""

import contextlib
import datetime
import tempfile
import threading
import traceback
from collections.abc import Mapping
from pathlib import Path


class Logs:
    """The logs of one command, written line by line.

    Each log is beside the result file of its name, and all begin with the same line. A log that
    cannot be written is left out, so that the computation goes on.
    """

    def __init__(self, targets: Mapping[str, Path], opening: str) -> None:
        self._logs = {name: target.with_suffix(".log") for name, target in targets.items()}
        self._opening, self._begun = opening, dict[str, bool]()
        self._lock = threading.Lock()

    def path(self, name: str) -> Path | None:
        """The log of a name, if something was written to it."""
        return self._logs[name] if self._begun.get(name) else None

    def failure(self, name: str, error: BaseException) -> Path:
        """Write an error with its traceback, and return the file."""
        return self._logs[name] if self.hear(name, _trace(error)) else elsewhere(error)

    def hear(self, name: str, text: str) -> bool:
        """Write a line to the log of a name; False if it cannot be written."""
        path = self._logs[name]
        with self._lock, contextlib.suppress(OSError):
            if name not in self._begun:
                self._begun[name] = False
                path.parent.mkdir(parents=True, exist_ok=True)
                # A new file, so that nothing is written through an existing link or into a pipe.
                path.unlink(missing_ok=True)
                _write(path, "x", self._opening)
                self._begun[name] = True
            if self._begun[name]:
                _write(path, "a", text)
                return True
        return False


def _write(path: Path, mode: str, text: str) -> None:
    now = datetime.datetime.now().astimezone().isoformat(timespec="milliseconds")
    with path.open(mode, encoding="utf-8", errors="replace") as file:
        file.write(f"{now} {text}\n")


def elsewhere(error: BaseException) -> Path:
    """Write an error with its traceback to a file of its own in the system's temporary folder."""
    with tempfile.NamedTemporaryFile(
        "w", encoding="utf-8", errors="replace", prefix="rigidpend-", suffix=".log", delete=False
    ) as log:
        log.write(_trace(error))
    return Path(log.name)


def _trace(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))
