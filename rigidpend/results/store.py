"""Results in HDF5: written whole or not at all, read with a clear word where they are unfit.

Layout: root attributes say format, experiment and fingerprint; ``/config`` holds the resolved
config, ``/provenance`` what ran where (it varies between equal results), ``/data`` the result,
as the experiment's layout declares it. Every dataset has `units` and `description`. A digest of
all stands behind the HDF5 file, where HDF5 itself does not look.

There is one way to read: regular files of bounded size, tried in a process of its own, each
object inside the file and as declared, before a value is used. What reads raises the errors of
:func:`opened`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import h5py
import numpy as np

from rigidpend.experiments.data import Coming, Dataset, Layout, Loaded, Streamed, Tree
from rigidpend.machine import files
from rigidpend.machine.files import StoreError, prepare, sealed
from rigidpend.results.opening import (
    FORMAT,
    FORMAT_VERSION,
    RATIO,
    OtherVersion,
    check_values,
    opened,
    read_config,
    readable,
)
from rigidpend.results.structure import told

__all__ = [
    "FORMAT_VERSION",
    "OtherVersion",
    "Result",
    "StoreError",
    "load",
    "opened",
    "prepare",
    "write",
]

Attributes: TypeAlias = Mapping[str, Any]


class Result(NamedTuple):
    """A result file's content."""

    attributes: Attributes
    """Attributes of the root; format and version are added."""
    config: Mapping[str, Any]
    """The resolved config, as plain data."""
    provenance: Attributes
    data: Tree


def write(path: Path, result: Result) -> None:
    """Write a result file: in memory first, then under its name in one step.

    StoreError where it cannot be written: what was there before is untouched.
    """
    with image(result.data) as file:
        finish(file, path, *result[:3])


def load(path: Path, layout: Layout | None = None, *, ratio: int = RATIO) -> Loaded:
    """A whole result file as plain data: `attributes`, `config`, `provenance`, `data`.

    Layout, ratio and errors are those of :func:`opened`; StoreError also where a checksum says that
    the data changed on disk, or where values are not finite that must be.
    """
    with opened(path, whole=True, layout=layout, ratio=ratio) as file, readable(path):
        loaded: Loaded = {
            "attributes": dict(file.attrs),
            "config": read_config(_plain(file["config"])),
            "provenance": dict(file["provenance"].attrs),
            "data": _plain(file["data"]),
        }
        check_values(loaded, layout)
        return loaded


def read_tree(path: Path) -> Tree:
    """The data of a result file as they were given to :func:`write`, units and meaning.

    Raises the errors of :func:`opened`.
    """
    with opened(path, whole=True) as file, readable(path):
        return _tree(file["data"])


def config(path: Path) -> dict[str, Any]:
    """The config that a result file was made from, as plain data.

    Raises the errors of :func:`opened`.
    """
    with opened(path, whole=True) as file, readable(path):
        return read_config(_plain(file["config"]))


def attributes(path: Path) -> dict[str, Any]:
    """The root attributes of a result file.

    Raises the errors of :func:`opened`.
    """
    with opened(path) as file, readable(path):
        return dict(file.attrs)


def outline(path: Path, layout: Layout | None = None) -> dict[str, dict[str, Any]]:
    """Every object of a result file by its place, ``/`` first, with its attributes.

    Datasets have two more, ``(kind)`` of their numbers and ``(dimensions)``. The layout is that
    of :func:`load`. Raises the errors of :func:`opened`.
    """
    with opened(path, layout=layout) as file, readable(path):
        found = {"/": dict(file.attrs)}
        file.visititems(lambda name, node: found.update({f"/{name}": _features(node)}))
        return found


def _plain(node: Any) -> Any:
    """A dataset's values, or a group's as a dict in their order."""
    if isinstance(node, h5py.Dataset):
        return node.asstr()[()] if h5py.check_string_dtype(node.dtype) else node[()]
    return {name: _plain(inner) for name, inner in node.items()}


def _tree(group: h5py.Group) -> Tree:
    return {
        name: _tree(node)
        if isinstance(node, h5py.Group)
        else Dataset(
            # A text as one, but texts in an array as they were given.
            node[()] if node.shape else _plain(node),
            node.attrs["units"],
            node.attrs["description"],
        )
        for name, node in group.items()
    }


def _features(node: Any) -> dict[str, Any]:
    if not isinstance(node, h5py.Dataset):
        return told(node.attrs)
    # Texts may be of any length.
    kind = node.dtype.kind if node.dtype.kind in "SOU" else node.dtype.str.lstrip("<>|=")
    return {**told(node.attrs), "(kind)": kind, "(dimensions)": node.ndim}


@contextmanager
def image(data: Tree) -> Iterator[h5py.File]:
    """A result file in memory that has its data, for :func:`finish`.

    Data that come in blocks are asked for here, one block after the other.
    """
    # A form that HDF5 1.10 reads, by whichever version it is written.
    with h5py.File.in_memory(libver=("earliest", "v110")) as file:
        _put(file, "data", data)
        _fill(file["data"], data)
        yield file


def finish(
    file: h5py.File, path: Path, attributes: Attributes, config: Any, provenance: Attributes
) -> None:
    """Put into a result file what is told of its data, and write it as :func:`write` does."""
    prepare(path)
    file.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION})
    file.attrs.update(attributes)
    _put(file, "config", Dataset(json.dumps(config, indent=2), "", "resolved config, JSON"))
    file.create_group("provenance").attrs.update(provenance)
    file.flush()
    content = bytes(file.id.get_file_image())
    file.close()
    files.write(path, sealed(content))


def _put(group: h5py.Group, name: str, node: Dataset | Tree) -> None:
    if not isinstance(node, Dataset):
        # Read back in the order of the layout, which figures and tables follow.
        inner = group.create_group(name, track_order=True)
        for key, value in node.items():
            _put(inner, key, value)
        _scale(inner, {key: x for key, x in node.items() if isinstance(x, Dataset)})
        return
    values: Any = node.values
    how: dict[str, Any] = {"data": values}
    if isinstance(values, Coming):
        how = {"shape": values.shape, "dtype": values.dtype, "chunks": values.block}
    # Single values can have no checksum, and are not compressed.
    if not isinstance(values, str) and np.ndim(values) and 0 not in np.shape(values):
        how |= {"fletcher32": True, "shuffle": True, "compression": "gzip"}
    group.create_dataset(name, **how).attrs.update(
        {"units": node.units, "description": node.description}
    )


def _fill(group: h5py.Group, node: Tree) -> None:
    """Take in the blocks of a group, then those of the groups inside it."""
    for block in node.blocks if isinstance(node, Streamed) else ():
        for name, (where, values) in block.items():
            group[name][where] = values
    for name, inner in node.items():
        if not isinstance(inner, Dataset):
            _fill(group[name], inner)


def _scale(group: h5py.Group, arrays: Mapping[str, Dataset]) -> None:
    """Name the dimensions of a group's arrays, and tie them to the arrays that are their scales."""
    scales = {x.dimensions[0]: key for key, x in arrays.items() if x.coordinate}
    for key in scales.values():
        group[key].make_scale(key)
    for key, array in arrays.items():
        for k, dimension in enumerate(array.dimensions):
            if isinstance(dimension, str):
                group[key].dims[k].label = dimension
            # No array is a scale of itself.
            if scales.get(dimension, key) != key:
                group[key].dims[k].attach_scale(group[scales[dimension]])
