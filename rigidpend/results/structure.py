"""Check of the structure of a result file, before a value is read: as its layout declares.

HDF5 follows links into other files, reads arrays from any file of the user, loads plugins for
unknown filters, and allocates what a header asks for. So a file is used only if each object is
reached by a hard link, its data lie in the file itself, and its type, shape and size are those of
the layout. The low-level interface is used, because it opens nothing by itself.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from h5py import h5a, h5d, h5g, h5i, h5l, h5o, h5s, h5t, h5z

from rigidpend.experiments.data import FLAG, FLOAT, TEXT, WHOLE, Field, Layout, fixed, members
from rigidpend.machine.files import StoreError

OBJECTS, NAME = 20_000, 200
"""Largest number of objects in a file, and length of a name."""
ATTRIBUTES, ATTRIBUTE = 64, 2**16
"""Largest number of attributes of an object, and bytes of one; HDF5 keeps longer ones elsewhere."""
MOST_TEXT_BYTES = 4096
"""Largest number of bytes of a text in an array of texts."""
WHERE = (h5d.COMPACT, h5d.CONTIGUOUS, h5d.CHUNKED)
"""Ways of storage whose bytes lie in the file itself, unlike external and virtual ones."""
FILTERS = (h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32)
"""Filters that `store` writes with; any other could load a plugin."""
TYPES = (
    *((FLOAT, getattr(h5t, f"IEEE_F64{order}")) for order in ("LE", "BE")),
    *(
        (WHOLE, getattr(h5t, f"STD_{sign}{bits}{order}"))
        for sign in "IU"
        for bits in (8, 16, 32, 64)
        for order in ("LE", "BE")
    ),
    (FLAG, h5t.py_create(np.dtype(bool))),
)
"""Types of elements by kind; numbers may have either byte order."""

REFERRING = ("DIMENSION_LIST", "REFERENCE_LIST")
"""Attributes by which HDF5 ties scales to arrays; they refer to objects and are never read."""
MARKS = (*REFERRING, "DIMENSION_LABELS", "CLASS", "NAME")
"""Attributes of dimension scales, besides our own."""


class Unfit(StoreError):
    """Error: a file without the structure of a result; says where and why."""


class Checker:
    """The check of one file, whose arrays may have at most `most_bytes` bytes together."""

    def __init__(self, most_bytes: int) -> None:
        self._left, self._objects = most_bytes, OBJECTS

    def file(self, root: h5g.GroupID, layout: Layout) -> None:
        """Check a whole file against a layout; raise Unfit."""
        top: Layout = {"config": Field(TEXT), "provenance": {}, "data": layout}
        self._group("", root, top, {})

    def _visit(self, place: str, node: Any, layout: Field | Layout, sizes: dict[str, int]) -> None:
        """Check an object against its part of the layout."""
        if not isinstance(layout, Field):
            if isinstance(node, h5d.DatasetID):
                raise Unfit(f"{place} is an array where a group belongs")
            self._group(place, node, layout, sizes)
        elif isinstance(node, h5d.DatasetID):
            attributes(place, node)
            self._dataset(place, node, layout, sizes)
        else:
            raise Unfit(f"{place} is a group where an array belongs")

    def _group(self, place: str, group: h5g.GroupID, layout: Layout, sizes: dict[str, int]) -> None:
        # Groups are followed only as deep as the layout is.
        own, further = fixed(layout), members(layout)
        # Only what the layout names may be in the root; elsewhere the whole file's bound counts.
        found = self._members(place, group, OBJECTS if place else len(own))
        inside = f"{place}/" if place else ""
        for name, (_, needed) in own.items():
            if needed and name not in found:
                raise Unfit(f"{inside}{name} is absent")
        others = [name for name in found if name not in own]
        if others and further is None:
            raise Unfit(f"{inside}{others[0]} is not a part of such results")
        for name in (name for name in found if name in own):
            self._visit(f"{inside}{name}", found[name], own[name][0], sizes)
        if further is not None:
            _same(place, further[0], sizes, len(others))
            for name in others:
                # A copy of the sizes: a dimension first met in a member has its size only there.
                self._visit(f"{inside}{name}", found[name], further[1], dict(sizes))

    def _members(self, place: str, group: h5g.GroupID, most_members: int) -> dict[str, Any]:
        """The objects of a group by name: hard links only, and none too many."""
        attributes(place or "/", group)
        count = group.get_num_objs()
        # Counted before any of them is opened.
        self._objects -= count
        if count > most_members or self._objects < 0:
            raise Unfit(f"{place or '/'} has {count} members, too many")
        found = {}
        for raw in group:
            name = raw.decode("utf-8")
            shown = f"{place}/{name[:NAME]}".lstrip("/")
            if len(name) > NAME or not name.isprintable() or set(name) & set("$\\/"):
                raise Unfit(f"{shown[:60]!r} is not a valid name")
            if group.links.get_info(raw).type != h5l.TYPE_HARD:
                raise Unfit(f"{shown} is a link to somewhere else, which is not followed")
            found[name] = h5o.open(group, raw)
            if h5i.get_type(found[name]) not in (h5i.GROUP, h5i.DATASET):
                raise Unfit(f"{shown} is neither an array nor a group")
        return found

    def _dataset(
        self, place: str, dataset: h5d.DatasetID, field: Field, sizes: dict[str, int]
    ) -> None:
        made, space = dataset.get_create_plist(), dataset.get_space()
        if made.get_layout() not in WHERE or made.get_external_count():
            raise Unfit(f"{place} is stored outside of the file, which is not allowed")
        filters = {made.get_filter(k)[0] for k in range(made.get_nfilters())}
        if not filters <= set(FILTERS):
            raise Unfit(f"{place} is stored through an unknown filter")
        if space.get_simple_extent_type() not in (h5s.SCALAR, h5s.SIMPLE):
            raise Unfit(f"{place} has no shape")
        shape, datatype = space.get_simple_extent_dims(), dataset.get_type()
        width = datatype.get_size()
        size = math.prod(shape) * width
        # Checked before reading, for which HDF5 allocates what the header claims.
        if size > self._left:
            raise Unfit(
                f"{place} is too large: {size:.2g} bytes, together with the arrays before it"
            )
        self._left -= size
        # HDF5 reads whole chunks into memory, however small the array is.
        chunked = made.get_layout() == h5d.CHUNKED
        if chunked and math.prod(made.get_chunk()) * width > self._left:
            raise Unfit(f"{place} is stored in pieces that are too large")
        if kind(datatype, shape) != field.kind:
            raise Unfit(f"{place} does not hold {field.kind}")
        if len(field.dimensions) != len(shape):
            raise Unfit(f"{place} has {len(shape)} dimensions, not {len(field.dimensions)}")
        for dimension, n in zip(field.dimensions, shape, strict=True):
            _same(place, dimension, sizes, n)


def attributes(place: str, node: Any) -> None:
    """Check that all attributes of an object are few, short, and texts or numbers."""
    count = h5a.get_num_attrs(node)
    if count > ATTRIBUTES:
        raise Unfit(f"{place} has {count} attributes, too many")
    for k in range(count):
        one = h5a.open(node, index=k)
        space, datatype = one.get_space(), one.get_type()
        if space.get_simple_extent_type() not in (h5s.SCALAR, h5s.SIMPLE):
            raise Unfit(f"{place} has an attribute without a value")
        shape = space.get_simple_extent_dims()
        if math.prod(shape) * datatype.get_size() > ATTRIBUTE:
            raise Unfit(f"{place} has an attribute that is too large")
        # What ties an array to its scale is never read.
        ties = one.get_name().decode("utf-8", "replace") in REFERRING
        if kind(datatype, ()) not in (FLOAT, WHOLE, TEXT) and not ties:
            raise Unfit(f"{place} has an attribute that is neither a text nor a number")


def told(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of an object that are read: all but the marks of dimension scales."""
    return {name: attrs[name] for name in attrs if name not in MARKS}


def kind(datatype: h5t.TypeID, shape: tuple[int, ...]) -> str:
    """Kind of the elements of an array, as layouts name it; empty for any other."""
    if isinstance(datatype, h5t.TypeStringID):
        short = not datatype.is_variable_str() and datatype.get_size() <= MOST_TEXT_BYTES
        return TEXT if shape == () or short else ""
    return next((name for name, known in TYPES if datatype.equal(known)), "")


def _same(place: str, dimension: int | str, sizes: dict[str, int], n: int) -> None:
    """Refuse a size that is not that of its dimension."""
    name, _, more = str(dimension).partition("+")
    further = int(more or 0)
    # Where a name is met first it gets its size, less what is
    # added: symbols+1 of 16 are 15 symbols.
    expected = dimension if isinstance(dimension, int) else sizes.setdefault(name, n - further)
    if n < further or n != expected + (0 if isinstance(dimension, int) else further):
        raise Unfit(f"{place} has another shape than the rest: {dimension} is {n} here")
