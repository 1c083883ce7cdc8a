"""Configs and results as a plan needs them: found once for the same bytes by the same package.

To check a config takes a third of a second for its libraries alone, to open a result a process of
its own, and most plans find that there is nothing to do.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from rigidpend.config.catalogue import Group
from rigidpend.machine import cache, files
from rigidpend.machine.code_hash import package_digest

if TYPE_CHECKING:
    from rigidpend.config.schema import ExperimentConfig
    from rigidpend.runs.loading import LoadedConfig

OTHER = "of another version"
"""Mark of a result that cannot be read for its format version."""
SECONDS = "seconds"
"""Root attribute of the time that a result took, unless it went on from parts."""
DOUBT = "doubt"
"""Root attribute of what is uncertain."""
TEXTS = ("config_hash", "code_hash", "engine", DOUBT)
"""Root attributes that are texts."""


@dataclass(frozen=True)
class RecalledConfig:
    """A config that was checked before; it is read again when its content is asked for."""

    path: Path
    settings: tuple[str, ...]
    experiment: str
    config_hash: str
    engine: str
    """Engine that computes it; empty where nothing is integrated."""

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


def load_groups(
    paths: Sequence[Path],
    settings: Sequence[str] = (),
    sweeps: Sequence[str] = (),
    name: str | None = None,
) -> Sequence[Group[AnyConfig]]:
    """Recall several configs, or else read them all (see `runs.loading.load_groups`)."""
    given = tuple(settings)
    # A sweep stands for many, and a name of one's own for another result.
    keys = {x: _key(x, x.stem, given) for x in paths if name is None}
    if not sweeps:
        found = {path: entry for path, key in keys.items() if (entry := cache.recall(key))}
        if len(found) == len(paths):
            known = [RecalledConfig(path, given, **entry) for path, entry in found.items()]
            return [Group(each.path, each.name, [each]) for each in known]
    from rigidpend.runs import loading

    groups = loading.load_groups(paths, settings, sweeps, name)
    for group in groups:
        config = group.members[-1]
        if group.path in keys and config.name == group.path.stem:
            told = {key: getattr(config, key) for key in ("experiment", "config_hash", "engine")}
            cache.remember(keys[group.path], told)
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
    key = _key(target)
    found = cache.recall(key) if key else None
    if found is None:
        found = _opened(target)
        if key:
            cache.remember(key, found)
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


def _key(path: Path, *further: Any) -> str:
    """All that follows from a file is found by this key; empty for one that cannot be read."""
    try:
        content = files.content(path)
    except (OSError, ValueError):
        return ""
    return f"{hashlib.sha256(content).hexdigest()} {further} by {package_digest()}"
