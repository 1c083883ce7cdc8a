"""Memory of what was found out before, kept on disk, by the digest of what it follows from.

An entry is found by the content of all that decides it, so none is ever out of date; one that is
missing, or damaged, is found out again.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

from rigidpend.machine import cache

MOST = 2000
"""Entries at most, some 300 bytes each; then those that are not in use go."""
BYTES = 10_000_000
"""Bytes of all memories, of which there are three."""


class Memory:
    """Entries of this process and of earlier ones.

    Parameters
    ----------
    name : str
        What it is a memory of.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.used: dict[str, Any] = {}
        self.new = False

    @functools.cached_property
    def kept(self) -> dict[str, Any]:
        """Entries of earlier processes."""
        content = cache.load(_folder(), self._of)
        return {} if content is None else dict(json.loads(content))

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
        """Write new entries, if that is possible."""
        if not self.new:
            return
        every = {**self.kept, **self.used}
        content = json.dumps(every if len(every) <= MOST else self.used).encode()
        cache.save(_folder(), self._of, content, BYTES)
        self.new = False

    @property
    def _of(self) -> bytes:
        return f"memory of {self.name}".encode()


def _folder() -> Path:
    return cache.folder() / "plans"
