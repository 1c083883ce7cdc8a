"""Configs that were read before: what a plan needs of them, without reading them again.

To check a config takes a third of a second for its libraries alone, and most plans find that there
is nothing to do. What is recalled was found out of the same text by the same code; whoever needs
more of the config than this reads it then.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidpend import __version__, experiments
from rigidpend.config.groups import Group
from rigidpend.machine import files
from rigidpend.machine.code_hash import code_hash_of, inside
from rigidpend.machine.memory import Memory
from rigidpend.runs import provenance

if TYPE_CHECKING:
    from rigidpend.config.schema import ExperimentConfig
    from rigidpend.runs.loading import LoadedConfig


@dataclass(frozen=True)
class RecalledConfig:
    """A config that was checked before; it is read again when its content is asked for."""

    path: Path
    settings: tuple[str, ...]
    experiment: str
    config_hash: str
    engine_asked: str | None
    """Engine that it asks for; None for any, empty where nothing is integrated."""

    @property
    def name(self) -> str:
        return self.path.stem

    @property
    def content(self) -> ExperimentConfig:
        return self.loaded.content

    @functools.cached_property
    def loaded(self) -> LoadedConfig:
        """The config as it is in its file now."""
        from rigidpend.runs import loading

        return loading.load(self.path, self.settings)

    def resolved(self) -> dict[str, Any]:
        """All values, defaults included, as plain JSON data; numbers exact."""
        return self.loaded.resolved()


AnyConfig: TypeAlias = "LoadedConfig | RecalledConfig"


def load(path: Path, settings: Sequence[str] = ()) -> AnyConfig:
    """Recall a config, or else read it, and remember it (see `config.loading.load`)."""
    found = _recalled(path, settings)
    if found is not None:
        return found
    from rigidpend.runs import loading

    loaded = loading.load(path, settings)
    _remember(path, settings, loaded)
    return loaded


def load_groups(
    paths: Sequence[Path],
    settings: Sequence[str] = (),
    sweeps: Sequence[str] = (),
    name: str | None = None,
) -> Sequence[Group[AnyConfig]]:
    """Recall several configs, or else read them all (see `config.loading.load_groups`)."""
    if not sweeps and name is None:
        known = [found for path in paths if (found := _recalled(path, settings)) is not None]
        if len(known) == len(paths):
            return [Group(each.path, each.name, [each]) for each in known]
    from rigidpend.runs import loading

    groups = loading.load_groups(paths, settings, sweeps, name)
    for group in groups if name is None else ():
        if len(group.members) == 1 and group.members[0].name == group.path.stem:
            _remember(group.path, settings, group.members[0])
    return groups


def _recalled(path: Path, settings: Sequence[str]) -> RecalledConfig | None:
    key = _key(path, settings)
    entry = _memory().get(key) if key else None
    if not entry or entry["experiment"] not in experiments.names():
        return None
    if entry["schema"] != _schema(entry["experiment"]):
        return None
    return RecalledConfig(
        path, tuple(settings), entry["experiment"], entry["config_hash"], entry["engine"]
    )


def _remember(path: Path, settings: Sequence[str], config: AnyConfig) -> None:
    """Keep what a plan needs of a config; one with a sweep of its own stands for many."""
    from rigidpend.runs.loading import LoadedConfig

    key = _key(path, settings)
    if not key or not isinstance(config, LoadedConfig) or config.sweeps:
        return
    entry = {
        "experiment": config.experiment,
        "schema": _schema(config.experiment),
        "config_hash": provenance.config_hash(config.resolved()),
        "engine": config.engine_asked,
    }
    _memory().put(key, entry)
    _memory().save()


@functools.cache
def _memory() -> Memory:
    return Memory("configs")


def _key(path: Path, settings: Sequence[str]) -> str:
    """Digest of a file, the settings, and the code that reads; empty for what is no such file."""
    if path.suffix not in (".yaml", ".yml"):
        return ""
    try:
        content = files.content(path)
    except (OSError, ValueError):
        return ""
    told = repr((__version__, _reader(), path.stem, tuple(settings)))
    return hashlib.sha256(told.encode() + b"\0" + content).hexdigest()


@functools.cache
def _reader() -> str:
    return code_hash_of(inside("runs", "loading.py"))


@functools.cache
def _schema(experiment: str) -> str:
    return provenance.code_hash_of_part(experiment, "schema")
