"""Data of results: named arrays in groups, and layouts, by which they are written and checked.

A layout names the fields of a group and the groups inside it::

    LAYOUT = {"<arrays>": {"codes": whole("1", "0 left, 1 right", "symbols", "columns")}}

A name in ``<>`` stands for members of any names, as many as the dimension of that name; one
that ends in ``?`` may be absent. A dimension has one size throughout, but in each member of
such a group its own. Nothing that computes is imported: whoever reads a result reads this first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypedDict

import numpy as np

if TYPE_CHECKING:
    import xarray

    from rigidpend.experiments.compare import Difference


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

    These have :class:`Coming` in the place of their values. The blocks, where each belongs and
    its values by the name of the array, may be computed when they are asked for, once.
    """

    def __init__(
        self, members: Mapping[str, Any], blocks: Iterator[Mapping[str, tuple[Any, Any]]]
    ) -> None:
        super().__init__(members)
        self.blocks = blocks


Data: TypeAlias = Mapping[str, Any]
"""Group of a result: arrays, texts and groups by name."""
Tree: TypeAlias = Data
"""The same as it is computed: arrays may be lists, or come in blocks."""


class Loaded(TypedDict):
    """A result file as plain data."""

    attributes: dict[str, Any]
    config: dict[str, Any]
    """The resolved config, as plain data; numbers are texts, exact, or whole."""
    provenance: dict[str, Any]
    data: dict[str, Any]
    """Arrays, texts and groups by name."""


FLOAT, WHOLE, FLAG, TEXT = "double", "whole", "flag", "text"
NUMBER = "number"
"""Kinds of elements of a field; a number is a double or whole."""
ANY = math.inf
"""Bound of a field that is not compared: it hangs on the last bit, or tells how, not what."""


Allowed: TypeAlias = "Callable[[str, Data, Data], Any]"
"""Allowed difference of each element, infinite where nothing is compared.

It follows from the field's name and the two groups, stored and fresh, in which a name that a group
has not is looked up in those around it: a number, or an array to be broadcast to the values."""


class Bound(NamedTuple):
    """A comparison of a field in two results, where allowed differences do not say it."""

    apart: Callable[[str, Data, Data], list[Difference]]
    """From the field's name and the two groups, as in :data:`Allowed`, to where they differ."""
    sized: bool = True
    """True if the field has to be of one shape in both."""


class Field(NamedTuple):
    """An array, a number or a text in a result, with its unit and meaning."""

    kind: str
    dimensions: tuple[int | str, ...] = ()
    """Sizes, or names of sizes, which may have a number added: ``symbols+1``."""
    units: str = ""
    description: str = ""
    gaps: bool = False
    """True if it may hold NaN or infinity."""
    within: float | Allowed | Bound = 0.0
    """Difference that doubles may have in two results; other elements must be the same."""
    symbol: str = ""
    """Letter by which axes call it, as matplotlib sets it."""
    coordinate: bool = False
    """True if it is the coordinate along its dimension."""


def _field(
    kind: str, units: str, description: str, *dimensions: int | str, **further: Any
) -> Field:
    return Field(kind, dimensions, units, description, **further)


double, whole, flag, text = (partial(_field, kind) for kind in (FLOAT, WHOLE, FLAG, TEXT))
"""Fields of these kinds: of their unit, their description, then their dimensions."""


def as_bytes(texts: Any) -> Any:
    """An array of texts in UTF-8, of a width that HDF5 and parts keep."""
    given = np.asarray(texts)
    return given if given.dtype.kind == "S" else np.char.encode(given.astype(str))


Layout: TypeAlias = Mapping[str, "Field | Layout"]
Fields: TypeAlias = Mapping[str, Field]


def held(bound: float | Allowed | Bound, fields: Fields) -> dict[str, Field]:
    """The fields, with a bound for those of doubles that have none of their own."""
    return {
        name: field._replace(within=bound)
        if field.kind in (FLOAT, NUMBER) and field.within == 0.0
        else field
        for name, field in fields.items()
    }


def members(layout: Layout) -> tuple[str, Field | Layout] | None:
    """The dimension that counts members of any names, and what each is; None without such."""
    for name, node in layout.items():
        if name.startswith("<"):
            return name.strip("<>"), node
    return None


def named(layout: Layout) -> dict[str, tuple[Field | Layout, bool]]:
    """Members with a name of their own, each with True if it must be there."""
    return {
        name.removesuffix("?"): (node, not name.endswith("?"))
        for name, node in layout.items()
        if not name.startswith("<")
    }


def declared(layout: Layout, names: Collection[str]) -> dict[str, Field | Layout]:
    """Those of some names that a layout declares, with what it says of them."""
    known, further = {name: node for name, (node, _) in named(layout).items()}, members(layout)
    if further:
        known = {**dict.fromkeys(names, further[1]), **known}
    return {name: known[name] for name in names if name in known}


def fields(layout: Layout, data: Data, place: str = "") -> Iterator[tuple[str, Any, Field]]:
    """The values of a group and of those inside it, each with its place and its field."""
    for name, node in declared(layout, data).items():
        inner = f"{place}{name}"
        if isinstance(node, Field):
            yield inner, data[name], node
        else:
            yield from fields(node, data[name], f"{inner}/")


def labelled(data: Data, layout: Layout, attributes: Mapping[str, Any]) -> xarray.DataTree:
    """A result as an xarray tree; attributes are those of its root.

    There is a node for each group; each array has its dimensions, its unit and its description.
    ModuleNotFoundError where xarray, of the extra `notebook`, is not installed.
    """
    import xarray

    made = xarray.DataTree.from_dict(dict(_datasets("", data, layout)))
    made.attrs.update(attributes)
    return made


def _datasets(path: str, data: Data, layout: Layout) -> Iterator[tuple[str, xarray.Dataset]]:
    """A group and those inside it, with their paths."""
    import xarray

    variables, coordinates = {}, []
    for key, node in declared(layout, data).items():
        if not isinstance(node, Field):
            yield from _datasets(f"{path}/{key}", data[key], node)
            continue
        # A dimension that is a mere size is named after its array.
        sizes = enumerate(node.dimensions)
        dims = [size if isinstance(size, str) else f"{key}_{k}" for k, size in sizes]
        meaning = {"units": node.units, "description": node.description}
        variables[key] = xarray.Variable(dims, np.asarray(data[key]), meaning)
        coordinates += [key] if node.coordinate else []
    yield path or "/", xarray.Dataset(variables).set_coords(coordinates)
