"""Configs: found by name, read with places, checked against their schema."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rigidpend.config import complaints, names, overrides, reader, schema
from rigidpend.config.problems import ConfigError, Problem
from rigidpend.config.reader import Document

__all__ = ["Config", "ConfigError", "load", "load_all", "names", "resolved_yaml"]


@dataclass(frozen=True)
class Config:
    """A checked config and the name under which its results are kept."""

    name: str
    experiment: str
    content: Any
    """An instance of the experiment's schema."""

    def resolved(self) -> dict[str, Any]:
        """All values, defaults included, as plain JSON data; numbers exact."""
        return dict(self.content.model_dump(mode="json"))


def resolved_yaml(config: Config) -> str:
    """A config with all its defaults as YAML, which :func:`load` reads as the same config."""
    from rigidpend.config import writer

    return writer.to_yaml(config.resolved())


def load(path: Path, settings: Sequence[str] = ()) -> Config:
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
        document.refuse(document.origin(()), (), "expected keys: figure, experiment, problem")
        raise ConfigError(document.problems)
    for setting in settings:
        try:
            overrides.override(document, setting)
        except ConfigError as error:
            document.problems += error.problems
    experiment = _experiment(document)
    model = schema.of(experiment)
    try:
        content = model.model_validate(document.tree)
    except ValidationError as error:
        raise complaints.config_error(document, model, error.errors()) from None
    if document.problems:
        raise ConfigError(document.problems)
    return Config(path.stem, experiment, content)


def load_all(paths: Sequence[Path], settings: Sequence[str] = ()) -> list[Config]:
    """:func:`load` of each, with what is wrong in any of them said at once."""
    loaded: list[Config] = []
    problems: list[Problem] = []
    for path in paths:
        try:
            loaded.append(load(path, settings))
        except ConfigError as error:
            # A setting that is wrong is wrong for every config: once is enough.
            problems += [problem for problem in error.problems if problem not in problems]
    if problems:
        raise ConfigError(problems)
    return loaded


def _experiment(document: Document) -> str:
    name, known = document.tree.get("experiment"), schema.experiments()
    if isinstance(name, str) and name in known:
        return name
    place = ("experiment",)
    if place not in document.unread:
        message = "required"
        if name is not None:
            message = f"no such experiment: {name!r}{complaints.meant(str(name), known)}"
        document.refuse(document.origin(place), place, f"{message} {complaints.among(known)}")
    raise ConfigError(document.problems)
