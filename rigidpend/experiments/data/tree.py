"""Data of a result: named arrays with their meaning, in groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, TypeAlias, TypedDict


class Dataset(NamedTuple):
    """An array or a text to be stored, with its unit and meaning."""

    values: Any
    units: str
    description: str
    dimensions: tuple[int | str, ...] = ()
    """Names of its dimensions, as the layout has them; empty where it declares none."""
    coordinate: bool = False
    """True if it is the coordinate along its dimension."""


class Coming(NamedTuple):
    """An array that comes in blocks, in the place of its values."""

    shape: tuple[int, ...]
    dtype: Any
    block: tuple[int, ...]
    """Shape of the largest of its blocks."""

    @property
    def ndim(self) -> int:
        return len(self.shape)


class Streamed(dict[str, Any]):
    """A group some arrays of which come in blocks, for memory need not hold them as a whole.

    Parameters
    ----------
    members : mapping
        What comes has :class:`Coming` in the place of its values.
    blocks : iterator
        Blocks by the names of their arrays: where each belongs, and its values. They may be
        computed when they are asked for, once.
    """

    def __init__(
        self, members: Mapping[str, Any], blocks: Iterator[Mapping[str, tuple[Any, Any]]]
    ) -> None:
        super().__init__(members)
        self.blocks = blocks


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
