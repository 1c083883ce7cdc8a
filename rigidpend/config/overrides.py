"""Settings of the command line: ``a.b=VALUE`` as if it were written in the file."""

from __future__ import annotations

import re
from typing import Any

from rigidpend.config import reader
from rigidpend.config.complaints import Complaint, ConfigError, Origin, Place
from rigidpend.config.reader import MAX_DEPTH, Document

INDEXED = re.compile(r"\[(\w+)\]")
"""An index as other languages write it."""


def override(document: Document, setting: str, origin: Origin | None = None) -> None:
    """Apply a setting ``a.b=VALUE`` to a document, as if it were written there.

    Complaints about it name its origin, the option ``--set`` if none is given.

    Raises
    ------
    ConfigError
        It has no such form, or leads through something that has no entries.
    """
    origin = origin or Origin(f"--set {setting}")
    path, equals, written = setting.partition("=")
    if not equals or not all(path.split(".")):
        raise ConfigError([Complaint(origin, (), "expected KEY.KEY=VALUE, as in problem.mu=1e-3")])
    indexed = INDEXED.sub(r".\1", path)
    if indexed != path:
        message = f"an entry of a list is written {indexed}={written}"
        raise ConfigError([Complaint(origin, (), message)])
    # The reader's bound, which a setting would pass by: recursion follows the depth.
    if path.count(".") >= MAX_DEPTH:
        message = f"more than {MAX_DEPTH} keys inside each other"
        raise ConfigError([Complaint(origin, (), message)])
    # Nothing is no value, and not YAML's null either.
    value = reader.value(written, origin) if written else ""
    place: Place = ()
    holder = document.tree
    *outer, last = path.split(".")
    for word in outer:
        holder, place = _entry(document, holder, word, place, origin)
    key = _key(holder, last, place, origin)
    holder[key] = value
    place = (*place, key)
    # What the file said at this place and below is gone: complaints go to the option.
    for origins in (document.keys, document.values):
        for old in [old for old in origins if old[: len(place)] == place]:
            del origins[old]
    document.keys[place] = document.values[place] = document.settings[place] = origin


def _entry(
    document: Document, holder: Any, text: str, place: Place, origin: Origin
) -> tuple[Any, Place]:
    """Value under a key, made if it is missing, and its place."""
    key = _key(holder, text, place, origin)
    inner = (*place, key)
    if isinstance(holder, dict) and key not in holder:
        holder[str(key)] = {}
        document.keys[inner] = document.values[inner] = origin
    return holder[key], inner


def _key(holder: Any, text: str, place: Place, origin: Origin) -> str | int:
    if isinstance(holder, dict):
        return text
    if isinstance(holder, list) and text in map(str, range(len(holder))):
        return int(text)
    kind = f"a list of {len(holder)}" if isinstance(holder, list) else "a single value"
    raise ConfigError([Complaint(origin, place, f"has no entry {text!r}: it is {kind}")])
