"""Cache of what was read in source files: reading them anew would take a third of a second.

An entry is found by the content of a source and of the module that reads it, so none is ever
out of date.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
from collections.abc import Callable
from pathlib import Path

from rigidpend.integrate.compile_cache import user_cache
from rigidpend.results import files

MOST = 2000
"""Entries at most, some 300 bytes each; then those that are not in use go."""

Entry = tuple[str, list[str]]
"""Digest of a source's code, and the names that it imports."""


class CodeCache:
    """Entries of this process and of earlier ones.

    Parameters
    ----------
    reader : bytes
        Source of what reads: another one has entries of its own.
    """

    def __init__(self, reader: bytes) -> None:
        self.reader = hashlib.sha256(reader)
        self.used: dict[str, Entry] = {}
        self.new = False

    @functools.cached_property
    def kept(self) -> dict[str, Entry]:
        """Entries of earlier processes."""
        with contextlib.suppress(OSError, ValueError, AttributeError):
            content = files.unsealed(_path().read_bytes())
            if content is not None:
                return {key: (code, names) for key, (code, names) in json.loads(content).items()}
        return {}

    def entry(self, source: bytes, read: Callable[[bytes], Entry]) -> Entry:
        """Take what is known of a source, or else read it."""
        hashed = self.reader.copy()
        hashed.update(source)
        key = hashed.hexdigest()
        if key not in self.used:
            self.new |= key not in self.kept
            self.used[key] = self.kept.get(key) or read(source)
        return self.used[key]

    def save(self) -> None:
        """Keep new entries; where the cache cannot be written nothing is kept."""
        if not self.new:
            return
        every = {**self.kept, **self.used}
        content = json.dumps(every if len(every) <= MOST else self.used).encode()
        with contextlib.suppress(OSError, files.StoreError):
            _path().parent.mkdir(parents=True, exist_ok=True)
            files.replace(_path(), files.sealed(content), lasting=False)
        self.new = False


def _path() -> Path:
    return user_cache() / "rigidpend" / "code.json"
