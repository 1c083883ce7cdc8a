"""Results in HDF5: written completely or not at all, and read with clear errors.

Layout: root attributes have format, experiment and fingerprint; ``/config`` holds the resolved
config, ``/provenance`` where and with what it was made (it varies between equal results), ``/data``
the result, as the experiment's layout declares it. Every dataset has `units` and `description`. A
digest of everything follows the HDF5 part of the file, where HDF5 itself does not look.

There is one way to read a file, whoever made it: as data, and never as more. It must be a regular
file of bounded size. Another process reads it first, because HDF5 can hang or crash on it: the same
bytes of a result once, and not those that this process has written itself. Then its structure is
checked against the layout of its experiment. Only then is a value used. All readers raise the
errors of :func:`opened`.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np
from h5py import h5g

from rigidpend import experiments
from rigidpend.experiments.data import (
    FLOAT,
    TEXT,
    Coming,
    Field,
    Layout,
    Loaded,
    Streamed,
    Tree,
    as_bytes,
    declared,
    fields,
    fixed,
    text,
)
from rigidpend.machine import files
from rigidpend.machine.files import Absent, StoreError, prepare, sealed
from rigidpend.machine.wording import short
from rigidpend.results import structure
from rigidpend.results.damage import intact, tried
from rigidpend.results.structure import Checker, Unfit, told

Attributes: TypeAlias = Mapping[str, Any]
Outline: TypeAlias = dict[str, dict[str, Any]]

FORMAT, FORMAT_VERSION = "rigidpend", 1
"""Mark of a result file, and the version of the format that this program reads."""
LEAST_BYTES, MOST_RATIO = 2**26, 100
"""Bytes that the arrays of any file may have, and further bytes for each byte of the file.

Files of this package have at most some 60 bytes for each, which happens if no orbit returns."""
WORDS = ("name", "figure", "experiment", "config_hash", "code_hash", "engine", "doubt")
"""Root attributes that are texts."""
LONGEST = 1000
"""Largest number of characters of such a text."""
OF_CONFIG = text("", "resolved config, JSON")
CONFIG, DEEPEST = 2**22, 32
"""Largest number of characters of a config, and of its nested brackets."""
SOUND: set[tuple[bytes, int, bool]] = set()
"""Results that this process has found sound, by the layouts of their experiments.

Of each the digest, the bytes that its arrays may have, and whether all its values were read."""
WRITTEN: set[bytes] = set()
"""Digests of the files that this process has written: HDF5 made these, and nobody since then."""


def write(
    path: Path,
    layout: Layout,
    data: Tree,
    attributes: Attributes,
    config: Any,
    provenance: Attributes,
) -> None:
    """Write a result file: in memory first, then under its name in one step.

    The layout declares which data are written, and their meaning. Format and version are added to
    the root attributes; the config is plain data. StoreError if it cannot be written; a file that
    was there before is then untouched.
    """
    with image(layout, data) as file:
        finish(file, path, attributes, config, provenance)


@contextmanager
def image(layout: Layout, data: Tree) -> Iterator[h5py.File]:
    """A result file in memory with the data that a layout declares, for :func:`finish`.

    Data that come in blocks are requested here, one block after the other.
    """
    # A form that HDF5 1.10 can read, whatever version writes it.
    with h5py.File.in_memory(libver=("earliest", "v110")) as file:
        _put(file.create_group("data", track_order=True), layout, data)
        _fill(file["data"], data)
        yield file


def finish(
    file: h5py.File, path: Path, attributes: Attributes, config: Any, provenance: Attributes
) -> None:
    """Add attributes, config and provenance to a file in memory, and write it to its path."""
    prepare(path)
    file.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION, **attributes})
    _put_array(file, "config", OF_CONFIG, json.dumps(config, indent=2))
    file.create_group("provenance").attrs.update(provenance)
    file.flush()
    content = bytes(file.id.get_file_image())
    file.close()
    files.write(path, sealed(content))
    WRITTEN.add(hashlib.sha256(content).digest())


def _put(group: h5py.Group, layout: Layout, data: Tree) -> None:
    """Put the declared data into a group; KeyError if a required member is missing."""
    needed = (name for name, (_, must) in fixed(layout).items() if must)
    held = declared(layout, dict.fromkeys((*data, *needed)))
    for name, node in held.items():
        if isinstance(node, Field):
            _put_array(group, name, node, data[name])
        else:
            # Groups keep the order of the data, which figures and tables follow.
            _put(group.create_group(name, track_order=True), node, data[name])
    _scale(group, {name: node for name, node in held.items() if isinstance(node, Field)})


def _put_array(group: h5py.Group, name: str, field: Field, values: Any) -> None:
    if field.kind == TEXT and not isinstance(values, str):
        values = as_bytes(values)
    how: dict[str, Any] = {"data": values}
    if isinstance(values, Coming):
        how = {"shape": values.shape, "dtype": values.dtype, "chunks": values.block}
    # HDF5 cannot compress single values, or give them a checksum.
    if not isinstance(values, str) and np.ndim(values) and 0 not in np.shape(values):
        how |= {"fletcher32": True, "shuffle": True, "compression": "gzip"}
    group.create_dataset(name, **how).attrs.update(field.meaning)


def _fill(group: h5py.Group, data: Tree) -> None:
    """Write the blocks of a group, then those of its subgroups."""
    for block in data.blocks if isinstance(data, Streamed) else ():
        for name, (where, values) in block.items():
            group[name][where] = values
    for name, inner in group.items():
        if isinstance(inner, h5py.Group):
            _fill(inner, data[name])


def _scale(group: h5py.Group, arrays: Mapping[str, Field]) -> None:
    """Name the dimensions of a group's arrays, and attach the arrays that are their scales."""
    scales = {x.dimensions[0]: key for key, x in arrays.items() if x.coordinate}
    for key in scales.values():
        group[key].make_scale(key)
    for key, array in arrays.items():
        for k, dimension in enumerate(array.dimensions):
            if isinstance(dimension, str):
                group[key].dims[k].label = dimension
            # A scale cannot be attached to itself.
            if scales.get(dimension, key) != key:
                group[key].dims[k].attach_scale(group[scales[dimension]])


class OtherVersion(StoreError):
    """Error: a result file of another format version."""


@contextmanager
def opened(
    path: Path, *, whole: bool = False, layout: Layout | None = None, ratio: int = MOST_RATIO
) -> Iterator[h5py.File]:
    """A result file, open for reading, with its structure checked.

    The default layout is that of its experiment. With `whole` another process reads all its values
    first. Its arrays may have `ratio` bytes for each byte of the file. StoreError if there is no
    file, or it is not HDF5, damaged, of another format version, or not as its layout declares.
    """
    with readable(path):
        image = intact(files.content(path))
        most = min(files.MOST_BYTES, max(LEAST_BYTES, ratio * len(image)))

        def checked(file: h5py.File) -> None:
            _check(path, file, most, layout)

        def trial() -> None:
            with h5py.File.in_memory(image) as file:
                checked(file)
                file.visititems(lambda _, node: _look(node, whole))

        digest = hashlib.sha256(image).digest()
        # The structure is checked before any value is touched, in the trial and here.
        read_before = layout is None and (digest, most, whole) in SOUND
        if not read_before and digest not in WRITTEN:
            tried(trial, len(image), most)
        # The same bytes that were tried, whatever happens to the file meanwhile.
        file = h5py.File.in_memory(image)
    with file:
        with readable(path):
            checked(file)
        if layout is None:
            SOUND.update((digest, most, each) for each in {whole, False})
        yield file


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn errors of a file into a StoreError with a plain sentence."""
    try:
        yield
    except FileNotFoundError:
        raise Absent.of(path, "there is no such file") from None
    except Unfit as error:
        raise StoreError.of(path, f"not a result that can be used: {error}") from None
    except StoreError:
        raise
    except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
        said = error.strerror if isinstance(error, OSError) else None
        reason = short(said or error) or type(error).__name__
        raise StoreError.of(path, f"not a readable HDF5 file: {reason}") from None


def _look(node: Any, whole: bool) -> None:
    told(node.attrs)
    if whole and isinstance(node, h5py.Dataset):
        node[()]


def _check(path: Path, file: h5py.File, most_bytes: int, layout: Layout | None) -> None:
    """Check the root attributes of a file, then its structure."""
    root = h5g.open(file.id, b"/")
    structure.attributes("/", root)
    given = dict(file.attrs)
    # In a foreign file attributes may have any type and shape.
    if not isinstance(given.get("format"), str) or given["format"] != FORMAT:
        raise StoreError.of(path, "an HDF5 file, but not a result of rigidpend")
    version: Any = given.get("format_version")
    if not np.array_equal(version, FORMAT_VERSION):
        said = f"its format version is {short(version, 60)}, this program reads {FORMAT_VERSION}"
        raise OtherVersion.of(path, said)
    for word in WORDS:
        if not isinstance(given.get(word, ""), str) or len(given.get(word, "")) > LONGEST:
            raise Unfit(f"its attribute {word} is not a short text")
    if layout is None and "experiment" not in given:
        raise Unfit("it does not name its experiment")
    try:
        Checker(most_bytes).file(root, layout or experiments.layout(given["experiment"]))
    except experiments.UnknownExperiment as error:
        raise Unfit(str(error)) from None


def load(path: Path, layout: Layout | None = None, *, ratio: int = MOST_RATIO) -> Loaded:
    """A whole result file as plain data: `attributes`, `config`, `provenance`, `data`.

    Layout, ratio and errors are those of :func:`opened`; StoreError also if a checksum shows that
    data changed on disk, or if values are not finite where they must be, or none of those allowed.
    """
    with opened(path, whole=True, layout=layout, ratio=ratio) as file, readable(path):
        return _loaded(file, layout)


def load_outlined(
    path: Path, layout: Layout | None = None, *, ratio: int = MOST_RATIO
) -> tuple[Loaded, Outline]:
    """A file as :func:`load` returns it, and its :func:`outline`."""
    with opened(path, whole=True, layout=layout, ratio=ratio) as file, readable(path):
        return _loaded(file, layout), outline(file)


def _loaded(file: h5py.File, layout: Layout | None) -> Loaded:
    """The whole of an open file as plain data (see :func:`load`)."""
    found: Loaded = {
        "attributes": dict(file.attrs),
        "config": read_config(_plain(file["config"])),
        "provenance": dict(file["provenance"].attrs),
        "data": _plain(file["data"]),
    }
    declared = layout or experiments.layout(found["attributes"]["experiment"])
    for place, values, field in fields(declared, found["data"]):
        if field.kind == FLOAT and not (field.gaps or np.isfinite(values).all()):
            raise Unfit(f"data/{place} has a number that is not finite")
        if field.among and not np.isin(values, field.among).all():
            raise Unfit(f"data/{place} has another number than {', '.join(map(str, field.among))}")
    return found


def attributes(path: Path) -> dict[str, Any]:
    """The root attributes of a result file."""
    with opened(path) as file, readable(path):
        return dict(file.attrs)


def outline(file: h5py.File) -> Outline:
    """The attributes of every object of an open file, by its path, ``/`` first.

    Datasets have two more entries, ``(kind)`` of their numbers and ``(dimensions)``.
    """
    found = {"/": dict(file.attrs)}
    file.visititems(lambda name, node: found.update({f"/{name}": _features(node)}))
    return found


def read_config(text: str) -> dict[str, Any]:
    """Read the config of a result; Unfit if it is no JSON object, or too long or too deep."""
    try:
        found = json.loads(text) if len(text) <= CONFIG else None
        depth = _depth(found)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise Unfit("its config is not a JSON object")
    if depth > DEEPEST:
        raise Unfit(f"its config has more than {DEEPEST} brackets inside each other")
    return found


def _depth(node: Any) -> int:
    """Depth of nested brackets."""
    inner = node.values() if isinstance(node, dict) else node if isinstance(node, list) else None
    return 0 if inner is None else 1 + max(map(_depth, inner), default=0)


def _plain(node: Any) -> Any:
    """A dataset's values, or a group's as a dict in their order."""
    if isinstance(node, h5py.Dataset):
        return node.asstr()[()] if h5py.check_string_dtype(node.dtype) else node[()]
    return {name: _plain(inner) for name, inner in node.items()}


def _features(node: Any) -> dict[str, Any]:
    if not isinstance(node, h5py.Dataset):
        return told(node.attrs)
    # The length of texts is no difference of structure.
    kind = node.dtype.kind if node.dtype.kind in "SOU" else node.dtype.str.lstrip("<>|=")
    return {**told(node.attrs), "(kind)": kind, "(dimensions)": node.ndim}
