"""Memory of what was found out before, kept on disk, by the digest of what it follows from.

An entry is found by the content of all that decides it, so none is ever out of date; one that is
missing, or damaged, is found out again.
"""

from __future__ import annotations

import contextlib
import functools
import json
from pathlib import Path
from typing import Any

from rigidpend.results import files
from rigidpend.results.cache import user_cache

MOST = 2000
"""Entries at most, some 300 bytes each; then those that are not in use go."""


class Memory:
    """Entries of this process and of earlier ones.

    Parameters
    ----------
    name : str
        Name of the file without its ending.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.used: dict[str, Any] = {}
        self.new = False

    @functools.cached_property
    def kept(self) -> dict[str, Any]:
        """Entries of earlier processes."""
        with contextlib.suppress(OSError, ValueError, AttributeError):
            content = files.unsealed(self._path().read_bytes())
            if content is not None:
                return dict(json.loads(content).items())
        return {}

    def get(self, key: str) -> Any:
        """Take an entry out of the memory; None where there is none."""
        if key not in self.used and key in self.kept:
            self.used[key] = self.kept[key]
        return self.used.get(key)

    def put(self, key: str, entry: Any) -> None:
        """Keep an entry, which JSON can hold, from now on."""
        self.new |= self.kept.get(key) != entry
        self.used[key] = entry

    def save(self) -> None:
        """Write new entries; where that is not possible nothing is kept."""
        if not self.new:
            return
        every = {**self.kept, **self.used}
        content = json.dumps(every if len(every) <= MOST else self.used).encode()
        with contextlib.suppress(OSError, files.StoreError):
            self._path().parent.mkdir(parents=True, exist_ok=True)
            files.replace(self._path(), files.sealed(content), lasting=False)
        self.new = False

    def _path(self) -> Path:
        return user_cache() / "rigidpend" / f"{self.name}.json"
