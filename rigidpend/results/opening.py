"""The one way to open a result file, whoever made it: as data, and never as more.

A file is read if it is a regular one of bounded size. Another process tries it, for HDF5 can
hang or crash on it; then its structure is held against the layout of its experiment. Only
then is a value used.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5g

from rigidpend import experiments
from rigidpend.experiments.data import FLOAT, NUMBER, Layout, Loaded, fields
from rigidpend.machine import files
from rigidpend.machine.files import Absent, StoreError
from rigidpend.machine.wording import short
from rigidpend.results.damage import grant, intact, tried
from rigidpend.results.structure import Checker, Unfit, attributes, told

FORMAT, FORMAT_VERSION = "rigidpend", 1
"""Mark of a result file, and the version of the form that this program reads."""
LEAST, RATIO = 2**26, 100
"""Bytes that the arrays of any file may have, and how many for each byte of the file.

A file of this package has at most some 60, where no orbit returns."""
WORDS = ("name", "figure", "experiment", "config_hash", "code_hash", "engine", "doubt")
"""Root attributes that are texts."""
LONGEST = 1000
"""Characters of each."""


class OtherVersion(StoreError):
    """A result file of another format version."""


@contextmanager
def opened(
    path: Path, *, whole: bool = False, layout: Layout | None = None, ratio: int = RATIO
) -> Iterator[h5py.File]:
    """A result file, open for reading; its structure is checked.

    Parameters
    ----------
    path : Path
    whole : bool, optional
        Whether its values are to be read: then another process has read them before.
    layout : Layout, optional
        Layout of its data; by default the one that its experiment declares.
    ratio : int, optional
        Bytes that its arrays may have for each byte of the file.

    Raises
    ------
    StoreError
        There is none, it is no HDF5, it is damaged, of another format version, or not made as
        the results of its experiment.
    """
    with readable(path):
        image = intact(files.content(path))
        most = min(files.LARGEST, max(LEAST, ratio * len(image)))

        def checked(file: h5py.File) -> int:
            return _check(path, file, most, layout)

        def trial() -> None:
            with h5py.File.in_memory(image) as file:
                grant(checked(file))
                file.visititems(lambda _, node: _look(node, whole))

        tried(trial, len(image), most)
        # The very bytes that were tried, whatever happens to the file meanwhile.
        file = h5py.File.in_memory(image)
    with file:
        with readable(path):
            checked(file)
        yield file


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Say in our words what is wrong with a file."""
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


def _check(path: Path, file: h5py.File, most: int, layout: Layout | None) -> int:
    """Check what a file says that it is, then whether it is made so; the number of its objects."""
    root = h5g.open(file.id, b"/")
    attributes("/", root)
    given = dict(file.attrs)
    # A foreign file may have anything here, of any type and shape.
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
        raise Unfit("it does not say of which experiment")
    try:
        return Checker(most).file(root, layout or experiments.layout(given["experiment"]))
    except experiments.UnknownExperiment as error:
        raise Unfit(str(error)) from None


CONFIG, DEEPEST = 2**22, 32
"""Characters of a config, and its brackets inside each other, at most."""


def check_values(loaded: Loaded, layout: Layout | None = None) -> None:
    """Refuse a loaded result, as Unfit, with a number that is not finite and must be."""
    layout = layout or experiments.layout(loaded["attributes"]["experiment"])
    for place, values, field in fields(layout, loaded["data"]):
        if field.kind in (FLOAT, NUMBER) and not (field.gaps or np.isfinite(values).all()):
            raise Unfit(f"data/{place} has a number that is not finite")


def read_config(text: str) -> dict[str, Any]:
    """Read the config of a result; Unfit if it is no JSON object, or too long or too deep."""
    try:
        found = json.loads(text) if len(text) <= CONFIG else None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise Unfit("its config is no JSON object")
    if _depth(found) > DEEPEST:
        raise Unfit(f"its config has more than {DEEPEST} brackets inside each other")
    return found


def _depth(node: Any) -> int:
    """Count the brackets inside each other; none is entered that is too deep."""
    # Level by level: recursion could be exhausted by a file made for that.
    level, depth = [node], 0
    while level and depth <= DEEPEST:
        inner = [x.values() if isinstance(x, dict) else x for x in level]
        level = [x for each in inner for x in each if isinstance(x, dict | list)]
        depth += 1
    return depth
