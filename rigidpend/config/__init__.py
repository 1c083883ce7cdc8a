"""Configs: found by name, read with places, checked against their schema."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from rigidpend.config import names, reader, schema
from rigidpend.config.reader import ConfigError, Document, Place, Problem

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
        problems = [_problem(document, model, item) for item in error.errors()]
        raise ConfigError(problems) from None
    return Config(path.stem, experiment, content)


def _experiment(document: Document) -> str:
    name, known = document.tree.get("experiment"), schema.experiments()
    if isinstance(name, str) and name in known:
        return name
    place = ("experiment",)
    message = "required"
    if name is not None:
        message = f"no such experiment: {name!r}{_meant(str(name), known)}"
    raise ConfigError([Problem(document.origin(place), place, f"{message} {_known(known)}")])


def _problem(document: Document, model: type[BaseModel], error: Any) -> Problem:
    """A schema's complaint, with the place where the value was written."""
    place: Place = _written(error["loc"])
    if error["type"] == "physics":
        place = (*place, error["ctx"]["field"])
        return Problem(document.origin(place), place, error["ctx"]["message"])
    if error["type"] == "extra_forbidden":
        siblings = _fields(model, place[:-1])
        message = f"unknown key{_meant(str(place[-1]), siblings)} {_known(siblings)}"
        return Problem(document.origin(place, of_key=True), place, message)
    if error["type"] == "missing":
        return Problem(document.origin(place), place, "required")
    return Problem(document.origin(place), place, _plain(error))


def _written(location: Sequence[Any]) -> Place:
    """The part of a schema's location that is in the file: not the branch of a union."""
    return tuple(x for x in location if isinstance(x, int) or str(x).isidentifier())


def _plain(error: Any) -> str:
    """A schema's message in plain words."""
    if "error" in error.get("ctx", {}):
        return str(error["ctx"]["error"])
    if error["type"] == "model_type":
        return "expected keys with values" + _got(error["input"])
    message = str(error["msg"])
    return message[0].lower() + message[1:] + _got(error["input"])


def _got(value: Any) -> str:
    return f", got {value!r}" if isinstance(value, str | int) else ""


def _fields(kind: Any, place: Place) -> list[str]:
    """The keys that a schema knows at a place."""
    for key in place:
        field = getattr(kind, "model_fields", {}).get(str(key))
        kind = field.annotation if field else next(iter(get_args(kind)[1:]), None)
    return list(getattr(kind, "model_fields", ()))


def _meant(word: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(word, list(known), 1, cutoff=0.5)
    return f"; did you mean {close[0]}?" if close else ""


def _known(words: Iterable[str]) -> str:
    return f"(known: {', '.join(words)})"
