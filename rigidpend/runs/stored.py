"""Facts that a plan needs of a result file, remembered by the digest of the whole file.

The file is read and its digest compared each time. HDF5 opens it, in a process of its own, only
if these very bytes have not been looked at before by this code.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path
from typing import Any

from rigidpend import __version__
from rigidpend.machine import files
from rigidpend.machine.code_hash import code_hash_of, inside
from rigidpend.machine.memory import Memory
from rigidpend.runs import provenance

OTHER = "of another version"
"""Mark of a result that cannot be read for its format version."""
SECONDS = "seconds"
"""Root attribute of the time that a result took, unless it went on from parts."""
DOUBT = "doubt"
"""Root attribute of what is uncertain."""
TEXTS = ("config_hash", "code_hash", "engine", "experiment", DOUBT)
"""Root attributes that are texts."""


def facts(target: Path) -> dict[str, Any]:
    """Attributes of the result in a place that a plan depends on; empty where there is none.

    Raises
    ------
    StoreError
        There is a file in its place that is no result of ours, or is damaged.
    """
    if not target.exists():
        return {}
    key = _key(target)
    found = _memory().get(key) if key else None
    if found is None or found["layout"] != _layout(found["experiment"]):
        found = _looked_up(target)
        if key and OTHER not in found:
            _memory().put(key, {**found, "layout": _layout(found["experiment"])})
            _memory().save()
    return dict(found)


def _looked_up(target: Path) -> dict[str, Any]:
    from rigidpend.results import store

    try:
        attributes = store.attributes(target)
    except store.OtherVersion:
        return {OTHER: True}
    except store.StoreError as error:
        raise store.StoreError(f"{error}; move it away, or overwrite it with --force") from None
    texts = {name: str(attributes[name]) for name in TEXTS if name in attributes}
    return texts | {name: float(attributes[name]) for name in (SECONDS,) if name in attributes}


@functools.cache
def _memory() -> Memory:
    return Memory("results")


def _key(target: Path) -> str:
    """Digest of a file and of the code that opens it; empty for one that is not sealed."""
    try:
        content = files.content(target)
    except (OSError, ValueError):
        return ""
    if files.unsealed(content) is None:
        return ""
    told = f"{__version__} {_opening()} ".encode()
    return hashlib.sha256(told + hashlib.sha256(content).digest()).hexdigest()


@functools.cache
def _opening() -> str:
    return code_hash_of(inside("results", "opening.py"))


@functools.cache
def _layout(experiment: str) -> str:
    """Digest of the layout that an experiment declares."""
    from rigidpend import experiments

    if experiment not in experiments.names():
        return ""
    return provenance.code_hash_of_part(experiment, "layout")
