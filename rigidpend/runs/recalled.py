"""States of results as earlier plans found them: of the same bytes, by the same package.

To check a config takes a third of a second for its libraries alone, to open a result a process of
its own, and most plans find that there is nothing to do.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rigidpend.machine import cache, files
from rigidpend.machine.code_hash import package_digest
from rigidpend.runs import parts, provenance, runner
from rigidpend.runs.runner import Plan, State

if TYPE_CHECKING:
    from rigidpend.runs.loading import LoadedConfig

ENGINES = ("taylor", "scipy")


def state(path: Path, folder: Path, settings: Sequence[str] = ()) -> State | None:
    """Recall the state of a config's result in a folder; None where a plan has to find it.

    As a plan does, it tidies up what a killed run left beside a result that is up to date.
    """
    target = folder / f"{path.stem}.h5"
    key = _key(path, target, settings)
    found = cache.recall(key) if key else None
    if found is None or (found["reason"] and files.twin(target)):
        return None
    if not found["reason"]:
        parts.sweep(target)
    return State(path.stem, target=target, **found)


def plan(config: LoadedConfig, path: Path, folder: Path, settings: Sequence[str] = ()) -> Plan:
    """Plan a config that was read from a file with settings, and keep what :func:`state` recalls.

    A sweep stands for many configs, and a name of one's own for another result: these are not kept.
    """
    planned = runner.plan(config, folder)
    key = _key(path, planned.target, settings)
    if key and config.name == path.stem:
        told = ("experiment", "fingerprint", "reason", "doubt")
        cache.remember(key, {name: getattr(planned, name) for name in told})
    return planned


def _key(path: Path, target: Path, settings: Sequence[str]) -> str:
    """All that a state follows from; empty where a file cannot be read."""
    try:
        contents = [files.content(x) for x in (path, target) if x is path or x.exists()]
    except (OSError, ValueError):
        return ""
    digests = [hashlib.sha256(content).hexdigest() for content in contents]
    engines = [provenance.engine_name(engine) for engine in ENGINES]
    return f"{path.name} {digests} {[*settings]} {engines} by {package_digest()}"
