"""Loading of configs: found by name, read with places, checked against their schema."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rigidpend import experiments
from rigidpend.config import overrides, reader, validation
from rigidpend.config.complaints import Complaint, ConfigError
from rigidpend.config.reader import Document
from rigidpend.config.schema import ExperimentConfig

__all__ = ["ConfigError", "LoadedConfig", "load", "load_all", "resolved_yaml"]


@dataclass(frozen=True)
class LoadedConfig:
    """A checked config and the name under which its results are kept."""

    name: str
    experiment: str
    content: ExperimentConfig
    """Instance of the experiment's schema."""

    def resolved(self) -> dict[str, Any]:
        """All values, defaults included, as plain JSON data; numbers exact."""
        return dict(self.content.model_dump(mode="json"))

    def with_engine(self, engine: str) -> LoadedConfig:
        """The same config, computed by that engine."""
        content: Any = self.content
        numerics = content.numerics.model_copy(update={"engine": engine})
        return replace(self, content=content.model_copy(update={"numerics": numerics}))


def resolved_yaml(config: LoadedConfig) -> str:
    """Write a config with all its defaults as YAML, which :func:`load` reads as the same config."""
    from rigidpend.config import writer

    return writer.to_yaml(config.resolved())


def load(path: Path, settings: Sequence[str] = ()) -> LoadedConfig:
    """Read and check a config.

    Parameters
    ----------
    path : Path
    settings : sequence of str
        Overrides ``a.b=VALUE``, applied in order.

    Raises
    ------
    ConfigError
        With all that is wrong, each with its place in the file.
    """
    document = reader.read(path)
    if not isinstance(document.tree, dict):
        document.refuse(document.origin(()), (), "expected keys: experiment, problem")
        raise ConfigError(document.complaints)
    for setting in settings:
        try:
            overrides.override(document, setting)
        except ConfigError as error:
            document.complaints += error.complaints
    experiment = _experiment(document)
    model = experiments.schema(experiment)
    try:
        content = model.model_validate(document.tree)
    except ValidationError as error:
        raise validation.config_error(document, model, error.errors()) from None
    if document.complaints:
        raise ConfigError(document.complaints)
    return LoadedConfig(path.stem, experiment, content)


def load_all(paths: Sequence[Path], settings: Sequence[str] = ()) -> list[LoadedConfig]:
    """Load several configs; the complaints about all of them are raised together."""
    loaded: list[LoadedConfig] = []
    complaints: list[Complaint] = []
    for path in paths:
        try:
            loaded.append(load(path, settings))
        except ConfigError as error:
            # A setting that is wrong is wrong for every config: once is enough.
            complaints += [new for new in error.complaints if new not in complaints]
    if complaints:
        raise ConfigError(complaints)
    return loaded


def _experiment(document: Document) -> str:
    name, known = document.tree.get("experiment"), experiments.names()
    if isinstance(name, str) and name in known:
        return name
    place = ("experiment",)
    if place not in document.unread:
        message = "required"
        if name is not None:
            message = f"no such experiment: {name!r}{validation.meant(str(name), known)}"
        document.refuse(document.origin(place), place, f"{message} {validation.among(known)}")
    raise ConfigError(document.complaints)
