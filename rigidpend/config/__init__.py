"""Configs: found by name, read with places, checked against their schema."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rigidpend.config import complaints, names, reader, schema
from rigidpend.config.reader import ConfigError, Document, Problem

__all__ = ["Config", "ConfigError", "load", "names"]


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
        problem = Problem(document.origin(()), (), "expected keys: figure, experiment, problem")
        raise ConfigError([problem])
    for setting in settings:
        reader.override(document, setting)
    experiment = _experiment(document)
    model = schema.of(experiment)
    try:
        content = model.model_validate(document.tree)
    except ValidationError as error:
        raise complaints.config_error(document, model, error.errors()) from None
    return Config(path.stem, experiment, content)


def _experiment(document: Document) -> str:
    name, known = document.tree.get("experiment"), schema.experiments()
    if isinstance(name, str) and name in known:
        return name
    place = ("experiment",)
    message = "required"
    if name is not None:
        message = f"no such experiment: {name!r}{complaints.meant(str(name), known)}"
    raise ConfigError(
        [Problem(document.origin(place), place, f"{message} {complaints.among(known)}")]
    )
