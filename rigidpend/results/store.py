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
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeAlias

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


def write(path: Path, result: Result, *, lasting: bool = True) -> None:
    """Write a result file: in memory first, then under its name in one step.

    Parameters
    ----------
    path : Path
    result : Result
    lasting : bool, optional
        Whether it must outlive a failure of the machine; to wait for the disk takes time.

    Raises
    ------
    StoreError
        It cannot be written; what was there before is untouched.
    """
    with Image(result.data) as image:
        image.write(path, *result[:3], lasting=lasting)


def load(path: Path, layout: Layout | None = None, *, ratio: int = RATIO) -> Loaded:
    """A whole result file as plain data: `attributes`, `config`, `provenance`, `data`.

    Parameters
    ----------
    path : Path
    layout : Layout, optional
        Layout of its data; by default the one that its experiment declares.
    ratio : int, optional
        Bytes that its arrays may have for each byte of the file.

    Raises
    ------
    StoreError
        As :func:`opened`; also where a checksum says that the data changed on disk, or where
        values are not finite that must be.
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
        return _tree(file["data"], {})


def part(tree: Tree) -> bytes:
    """An HDF5 file in memory that holds a part of a result, for :func:`read_part`."""
    # Names of dimensions are no attributes of ours in a file, and a part lacks some of its axes.
    with Image(tree, lasting=False) as image:
        return image.content({}, _dimensions(tree), {})


def read_part(path: Path, content: bytes) -> Tree:
    """A part of a result as it was given to :func:`part`, the names of dimensions included.

    Raises the errors of :func:`opened`.

    Parameters
    ----------
    path : Path
        Where the content was kept.
    content : bytes
    """
    with opened(path, whole=True, part=content) as file, readable(path):
        return _tree(file["data"], json.loads(_plain(file["config"])))


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


def _tree(group: h5py.Group, dimensions: Mapping[str, Any]) -> Tree:
    return {
        name: _tree(node, dimensions.get(name, {}))
        if isinstance(node, h5py.Group)
        else Dataset(
            _values(node),
            node.attrs["units"],
            node.attrs["description"],
            *_meant(*dimensions.get(name, ())),
        )
        for name, node in group.items()
    }


def _meant(dimensions: Sequence[int | str] = (), coordinate: bool = False) -> Any:
    return tuple(dimensions), coordinate


def _dimensions(tree: Tree) -> dict[str, Any]:
    """The names of the dimensions of all arrays, and which are coordinates, in their groups."""
    return {
        name: node[3:] if isinstance(node, Dataset) else _dimensions(node)
        for name, node in tree.items()
    }


def _values(node: h5py.Dataset) -> Any:
    """A dataset's values in the type that they were given in."""
    if h5py.check_string_dtype(node.dtype) and node.shape == ():
        return node.asstr()[()]
    return node[()]


def _features(node: Any) -> dict[str, Any]:
    if not isinstance(node, h5py.Dataset):
        return told(node.attrs)
    # Texts may be of any length.
    kind = node.dtype.kind if node.dtype.kind in "SOU" else node.dtype.str.lstrip("<>|=")
    return {**told(node.attrs), "(kind)": kind, "(dimensions)": node.ndim}


class Image:
    """A result file in memory, for a ``with`` statement: first its data, then what is told of them.

    Data that come in blocks are asked for here, one block after the other.

    Parameters
    ----------
    data : Tree
    lasting : bool, optional
        Whether it is to be kept for long, and small: to compress takes as long as to compute.
    """

    def __init__(self, data: Tree, *, lasting: bool = True) -> None:
        # A form that HDF5 1.10 reads, by whichever version it is written.
        self._file = h5py.File.in_memory(libver=("earliest", "v110"))
        self._lasting = lasting
        try:
            self._put(self._file, "data", data)
            _fill(self._file["data"], data)
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def content(self, attributes: Attributes, config: Any, provenance: Attributes) -> bytes:
        """The bytes of the file, which is closed then."""
        file = self._file
        file.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION})
        file.attrs.update(attributes)
        told = Dataset(json.dumps(config, indent=2), "", "resolved config, JSON")
        self._put(file, "config", told)
        file.create_group("provenance").attrs.update(provenance)
        file.flush()
        image = bytes(file.id.get_file_image())
        file.close()
        return image

    def write(
        self,
        path: Path,
        attributes: Attributes,
        config: Mapping[str, Any],
        provenance: Attributes,
        *,
        lasting: bool = True,
    ) -> None:
        """Write the file (see the function :func:`write`)."""
        prepare(path)
        files.write(path, sealed(self.content(attributes, config, provenance)), lasting=lasting)

    def _put(self, group: h5py.Group, name: str, node: Dataset | Tree) -> None:
        if not isinstance(node, Dataset):
            # Read back in the order of the layout, which figures and tables follow.
            inner = group.create_group(name, track_order=True)
            for key, value in node.items():
                self._put(inner, key, value)
            _scale(inner, {key: x for key, x in node.items() if isinstance(x, Dataset)})
            return
        values: Any = node.values
        how = _storage(values) if self._lasting else {}
        if isinstance(values, Coming):
            made = group.create_dataset(
                name, values.shape, values.dtype, chunks=values.block, **how
            )
        else:
            made = group.create_dataset(name, data=values, **how)
        made.attrs["units"] = node.units
        made.attrs["description"] = node.description


def _fill(group: h5py.Group, node: Tree) -> None:
    """Take in the blocks of a group, then those of the groups inside it."""
    for block in node.blocks if isinstance(node, Streamed) else ():
        for name, (where, values) in block.items():
            group[name][where] = values
    for name, inner in node.items():
        if not isinstance(inner, Dataset):
            _fill(group[name], inner)


def _scale(group: h5py.Group, arrays: Mapping[str, Dataset]) -> None:
    """Name the dimensions of a group's arrays, and tie them to the arrays that are their scales.

    The part of one body has not the dimension of the bodies yet: its arrays stay without names.
    """
    arrays = {key: x for key, x in arrays.items() if len(x.dimensions) == np.ndim(x.values)}
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


def _storage(values: Any) -> dict[str, Any]:
    """Checksums and compression, which arrays can have and single values cannot."""
    if isinstance(values, str) or 0 in np.shape(values) or np.ndim(values) == 0:
        return {}
    return {"fletcher32": True, "shuffle": True, "compression": "gzip"}
