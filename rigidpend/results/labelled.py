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

    datasets = {path: _dataset(*group) for path, *group in _groups("/", data, layout)}
    made = xarray.DataTree.from_dict(datasets)
    made.attrs.update(attributes)
    return made


def _groups(
    path: str, data: Mapping[str, Any], layout: Layout
) -> Iterator[tuple[str, Mapping[str, Any], Mapping[str, Field]]]:
    """Groups by their paths, each with its arrays and what is declared of these."""
    nodes = declared(layout, data)
    fields = {key: node for key, node in nodes.items() if isinstance(node, Field)}
    yield path, {key: data[key] for key in fields}, fields
    for key, node in nodes.items():
        if not isinstance(node, Field):
            yield from _groups(f"{path.rstrip('/')}/{key}", data[key], node)


def _dataset(data: Mapping[str, Any], fields: Mapping[str, Field]) -> xarray.Dataset:
    import xarray

    variables = {
        key: xarray.Variable(
            # A dimension that is a mere size is named after its array.
            [str(size) if isinstance(size, str) else f"{key}_{k}" for k, size in dims],
            np.asarray(data[key]),
            {"units": field.units, "description": field.description},
        )
        for key, field in fields.items()
        for dims in [list(enumerate(field.dimensions))]
    }
    coordinates = [key for key, field in fields.items() if field.coordinate]
    return xarray.Dataset(variables).set_coords(coordinates)
