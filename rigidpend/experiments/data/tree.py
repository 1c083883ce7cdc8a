"""Data of a result: named arrays with their meaning, in groups."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias, TypedDict


class Dataset(NamedTuple):
    """An array or a text to be stored, with its unit and meaning."""

    values: Any
    units: str
    description: str
    dimensions: tuple[int | str, ...] = ()
    """Names of its dimensions, as the layout has them; empty where it declares none."""


Tree: TypeAlias = Mapping[str, "Dataset | Tree"]
Data: TypeAlias = Mapping[str, Any]
"""Group of a stored result, loaded: arrays, texts and groups by name."""


class Loaded(TypedDict):
    """A result file as plain data."""

    attributes: dict[str, Any]
    config: dict[str, Any]
    """The resolved config, as plain data; numbers are texts, exact, or whole."""
    provenance: dict[str, Any]
    data: dict[str, Any]
    """Arrays, texts and groups by name."""
