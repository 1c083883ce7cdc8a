"""Configs and results that were read before: what a plan needs of them, without opening them again.

To check a config takes a third of a second for its libraries alone, to open a result a process of
its own, and most plans find that there is nothing to do. What is recalled was found out of the
same bytes by the same code; whoever needs more of a config reads it then.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rigidpend import __version__, experiments
from rigidpend.config.catalogue import Group
from rigidpend.machine import files
from rigidpend.machine.code_hash import code_hash_of, inside
from rigidpend.machine.memory import Memory
from rigidpend.runs import provenance

if TYPE_CHECKING:
    from rigidpend.config.schema import ExperimentConfig
    from rigidpend.runs.loading import LoadedConfig

OTHER = "of another version"
"""Mark of a result that cannot be read for its format version."""
SECONDS = "seconds"
"""Root attribute of the time that a result took, unless it went on from parts."""
DOUBT = "doubt"
"""Root attribute of what is uncertain."""
TEXTS = ("config_hash", "code_hash", "engine", "experiment", DOUBT)
"""Root attributes that are texts."""


class Kind(NamedTuple):
    """A kind of files that are recalled."""

    name: str
    reader: tuple[str, str]
    """The module that reads them, whatever it imports included."""
    part: str
    """The part of an experiment by which they are read."""
    fits: Callable[[Path, bytes], bool]
    """True if a file can be recalled, by its place and content."""


# A config in a result is read as that result is.
CONFIGS = Kind(
    "configs", ("runs", "loading.py"), "schema", lambda path, _: path.suffix in (".yaml", ".yml")
)
RESULTS = Kind(
    "results", ("results", "opening.py"), "layout", lambda _, x: files.unsealed(x) is not None
)


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
        return self._loaded.content

    def resolved(self) -> dict[str, Any]:
        """All values, defaults included, as plain JSON data; numbers exact."""
        return self._loaded.resolved()

    @functools.cached_property
    def _loaded(self) -> LoadedConfig:
        from rigidpend.runs import loading

        loaded = loading.load(self.path, self.settings)
        if loaded.config_hash != self.config_hash:
            raise files.StoreError(f"{self.name}: its config was changed meanwhile; run it again")
        return loaded


AnyConfig: TypeAlias = "LoadedConfig | RecalledConfig"


def load(path: Path, settings: Sequence[str] = ()) -> AnyConfig:
    """Recall a config, or else read it, and remember it (see `runs.loading.load`)."""
    found = _config(path, settings)
    if found is not None:
        return found
    from rigidpend.runs import loading

    loaded = loading.load(path, settings)
    _remember_config(path, settings, loaded)
    return loaded


def load_groups(
    paths: Sequence[Path],
    settings: Sequence[str] = (),
    sweeps: Sequence[str] = (),
    name: str | None = None,
) -> Sequence[Group[AnyConfig]]:
    """Recall several configs, or else read them all (see `runs.loading.load_groups`)."""
    if not sweeps and name is None:
        known = [found for path in paths if (found := _config(path, settings)) is not None]
        if len(known) == len(paths):
            return [Group(each.path, each.name, [each]) for each in known]
    from rigidpend.runs import loading

    groups = loading.load_groups(paths, settings, sweeps, name)
    for group in groups if name is None else ():
        if len(group.members) == 1 and group.members[0].name == group.path.stem:
            _remember_config(group.path, settings, group.members[0])
    return groups


def facts(target: Path) -> dict[str, Any]:
    """Attributes of the result in a place that a plan depends on; empty where there is none.

    Raises
    ------
    StoreError
        There is a file in its place that is no result of ours, or is damaged.
    """
    if not target.exists():
        return {}
    files.make_way(target)
    key = key_of(RESULTS, target)
    found = _recalled(RESULTS, key)
    if found is None:
        found = _opened(target)
        if OTHER not in found:
            _remember(RESULTS, key, found)
    return dict(found)


def _opened(target: Path) -> dict[str, Any]:
    from rigidpend.results import store

    try:
        attributes = store.attributes(target)
    except store.OtherVersion:
        return {OTHER: True}
    except store.StoreError as error:
        raise store.StoreError(f"{error}; move it away, or overwrite it with --force") from None
    texts = {name: str(attributes[name]) for name in TEXTS if name in attributes}
    return texts | {name: float(attributes[name]) for name in (SECONDS,) if name in attributes}


def _config(path: Path, settings: Sequence[str]) -> RecalledConfig | None:
    entry = _recalled(CONFIGS, key_of(CONFIGS, path, *settings))
    if entry is None:
        return None
    told = entry["experiment"], entry["config_hash"], entry["engine"]
    return RecalledConfig(path, tuple(settings), *told)


def _remember_config(path: Path, settings: Sequence[str], config: LoadedConfig) -> None:
    """Keep what a plan needs of a config; one with a sweep of its own stands for many."""
    if config.sweeps:
        return
    entry = {
        "experiment": config.experiment,
        "config_hash": config.config_hash,
        "engine": config.engine_asked,
    }
    _remember(CONFIGS, key_of(CONFIGS, path, *settings), entry)


def _recalled(kind: Kind, key: str) -> dict[str, Any] | None:
    """The entry of a key, where the experiment reads such files as it did then."""
    entry = memory_of(kind.name).get(key) if key else None
    return entry if entry and entry["by"] == part_code(entry["experiment"], kind.part) else None


def _remember(kind: Kind, key: str, entry: dict[str, Any]) -> None:
    if key:
        memory_of(kind.name).put(key, {**entry, "by": part_code(entry["experiment"], kind.part)})
        memory_of(kind.name).save()


@functools.cache
def memory_of(name: str) -> Memory:
    """The memory of a kind of files."""
    return Memory(name)


def key_of(kind: Kind, path: Path, *settings: str) -> str:
    """Digest of a file, its name, settings, and the code that reads; empty if it does not fit."""
    try:
        content = files.content(path)
    except (OSError, ValueError):
        return ""
    if not kind.fits(path, content):
        return ""
    told = repr((__version__, reader_code(*kind.reader), path.stem, settings))
    return hashlib.sha256(told.encode() + b"\0" + content).hexdigest()


@functools.cache
def reader_code(*place: str) -> str:
    """Digest of a module that reads files, and of all that it imports."""
    return code_hash_of(inside(*place))


@functools.cache
def part_code(experiment: str, part: str) -> str:
    """Digest of a part of an experiment; empty for one that is not there."""
    known = experiment in experiments.names()
    return provenance.code_hash_of_part(experiment, part) if known else ""
