"""Cache of what was read in source files: reading them anew would take a third of a second."""

from __future__ import annotations

import hashlib
from collections.abc import Callable

from rigidpend.machine.memory import Memory

Entry = tuple[str, list[str]]
"""Digest of a source's code, and the names that it imports."""


class CodeCache:
    """Entries of sources, by their content and that of the module that reads them.

    Parameters
    ----------
    reader : bytes
        Source of what reads: another one has entries of its own.
    """

    def __init__(self, reader: bytes) -> None:
        self.reader, self.memory = hashlib.sha256(reader), Memory("code")

    def entry(self, source: bytes, read: Callable[[bytes], Entry]) -> Entry:
        """Take what is known of a source, or else read it."""
        hashed = self.reader.copy()
        hashed.update(source)
        key = hashed.hexdigest()
        found = self.memory.get(key)
        if found is None:
            found = read(source)
            self.memory.put(key, found)
        code, names = found
        return code, names

    def save(self) -> None:
        """Keep new entries."""
        self.memory.save()
