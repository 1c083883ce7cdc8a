"""Labelled arrays: a result as an xarray tree, each array with its dimensions, unit and meaning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.experiments.data import Field, Layout, declared

if TYPE_CHECKING:
    import xarray


def tree(data: Mapping[str, Any], layout: Layout, attributes: Mapping[str, Any]) -> xarray.DataTree:
    """Label the loaded data of a result as its layout declares; attributes are those of the root.

    There is a node for each group; units and description are attributes of each array.
    ModuleNotFoundError where xarray, of the extra `notebook`, is not installed.
    """
    import xarray

    made = xarray.DataTree.from_dict(dict(_groups("", data, layout)))
    made.attrs.update(attributes)
    return made


def _groups(
    path: str, data: Mapping[str, Any], layout: Layout
) -> Iterator[tuple[str, xarray.Dataset]]:
    """A group and those inside it, with their paths."""
    import xarray

    variables, coordinates = {}, []
    for key, node in declared(layout, data).items():
        if not isinstance(node, Field):
            yield from _groups(f"{path}/{key}", data[key], node)
            continue
        # A dimension that is a mere size is named after its array.
        sizes = enumerate(node.dimensions)
        dims = [size if isinstance(size, str) else f"{key}_{k}" for k, size in sizes]
        meaning = {"units": node.units, "description": node.description}
        variables[key] = xarray.Variable(dims, np.asarray(data[key]), meaning)
        coordinates += [key] if node.coordinate else []
    yield path or "/", xarray.Dataset(variables).set_coords(coordinates)
