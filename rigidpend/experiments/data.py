"""Data of results: named arrays in groups, and layouts, by which they are written and checked.

A layout names the fields of a group and the groups inside it::

    LAYOUT = {"<arrays>": {"codes": whole("1", "0 left, 1 right", "symbols", "columns")}}

A name in ``<>`` stands for members of any names, whose number is the dimension of that name; a
member whose name ends in ``?`` may be absent. A dimension has one size throughout a result, but
its own in each member of a ``<>`` group. This module imports nothing that computes, because it is
loaded to read a result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple, TypeAlias, TypedDict

import numpy as np


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
    """A group with arrays that come in blocks, so that memory need not hold them whole.

    Such an array has a :class:`Coming` instead of its values. `blocks` gives, by the name of the
    array, the place of each block and its values, and can be read once; they may be computed then.
    """

    def __init__(
        self, members: Mapping[str, Any], blocks: Iterator[Mapping[str, tuple[Any, Any]]]
    ) -> None:
        super().__init__(members)
        self.blocks = blocks


Data: TypeAlias = Mapping[str, Any]
"""Group of a result: arrays, texts and groups by name."""
Tree: TypeAlias = Data
"""A group as it is computed: arrays may be lists, or come in blocks."""


class Loaded(TypedDict):
    """A result file as plain data."""

    attributes: dict[str, Any]
    config: dict[str, Any]
    """The resolved config, as plain data; numbers are exact texts, or whole numbers."""
    provenance: dict[str, Any]
    data: dict[str, Any]
    """Arrays, texts and groups by name."""


FLOAT, WHOLE, FLAG, TEXT = "doubles", "whole numbers", "true or false", "texts"
"""Kinds of elements of a field, as messages name them."""
ANY = math.inf
"""Bound of a field that is not compared: it depends on the last bit, or on the way of computing."""


Allowed: TypeAlias = "Callable[[str, Data, Data], Any]"
"""Function for the allowed difference of each element, infinite where nothing is compared.

It takes the field's name and the two groups, stored and fresh; a name that a group lacks is looked
up in the enclosing groups. It returns a number, or an array that is broadcast to the values; or,
where allowed differences cannot express what is compared, the list of the `Difference` found."""


class Field(NamedTuple):
    """An array, a number or a text in a result, with its unit and meaning."""

    kind: str
    dimensions: tuple[int | str, ...] = ()
    """Sizes, or names of sizes, to which a number may be added: ``symbols+1``."""
    units: str = ""
    description: str = ""
    gaps: bool = False
    """True if it may hold NaN or infinity."""
    within: float | Allowed = 0.0
    """Allowed difference of doubles between two results; other elements must be equal."""
    symbol: str = ""
    """Letter in the label of an axis, as text of matplotlib."""
    coordinate: bool = False
    """True if it is the coordinate along its dimension."""
    sized: bool = True
    """True if it must have the same shape in both results."""
    among: tuple[int, ...] = ()
    """The values that its elements may have; empty if there are others than a few."""

    @property
    def meaning(self) -> dict[str, str]:
        """The attributes that a file states of it."""
        return {"units": self.units, "description": self.description}


def _field(
    kind: str, units: str, description: str, *dimensions: int | str, **further: Any
) -> Field:
    given = {"dimensions": dimensions, **further}
    return Field(kind, units=units, description=description, **given)


double, whole, flag, text = (partial(_field, kind) for kind in (FLOAT, WHOLE, FLAG, TEXT))
"""Make a field of this kind from its unit, its description, and its dimensions.

These may also be given by name, as what several fields share."""


def as_bytes(texts: Any) -> Any:
    """An array of UTF-8 bytes of fixed width, which HDF5 and parts can store."""
    given = np.asarray(texts)
    return given if given.dtype.kind == "S" else np.char.encode(given.astype(str))


Layout: TypeAlias = Mapping[str, "Field | Layout"]


def held(bound: float | Allowed, layout: Layout) -> Layout:
    """The layout, with this bound for fields of doubles that declare none, in all its groups."""
    made: dict[str, Field | Layout] = {}
    for name, node in layout.items():
        if not isinstance(node, Field):
            made[name] = held(bound, node)
        elif node.kind == FLOAT and node.within == 0.0:
            made[name] = node._replace(within=bound)
        else:
            made[name] = node
    return made


def members(layout: Layout) -> tuple[str, Field | Layout] | None:
    """The dimension and layout of members of any names (``<>``); None if there are none."""
    for name, node in layout.items():
        if name.startswith("<"):
            return name.strip("<>"), node
    return None


def fixed(layout: Layout) -> dict[str, tuple[Field | Layout, bool]]:
    """Members with fixed names, each with True if it is required."""
    return {
        name.removesuffix("?"): (node, not name.endswith("?"))
        for name, node in layout.items()
        if not name.startswith("<")
    }


def declared(layout: Layout, names: Collection[str]) -> dict[str, Field | Layout]:
    """Those of the given names that a layout declares, with their fields or layouts."""
    known, further = {name: node for name, (node, _) in fixed(layout).items()}, members(layout)
    if further:
        known = {**dict.fromkeys(names, further[1]), **known}
    return {name: known[name] for name in names if name in known}


def fields(layout: Layout, data: Data, place: str = "") -> Iterator[tuple[str, Any, Field]]:
    """The values of a group and its subgroups, each with its path and its field."""
    for name, node in declared(layout, data).items():
        inner = f"{place}{name}"
        if isinstance(node, Field):
            yield inner, data[name], node
        else:
            yield from fields(node, data[name], f"{inner}/")
