"""Results as trees of plain arrays, as they are read from a file."""

from __future__ import annotations

import copy
import functools
import operator
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend import experiments
from rigidpend.experiments import compare
from rigidpend.experiments.compare import Difference
from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Coming, Loaded, Streamed
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.results import store
from rigidpend.runs import loading
from tests.cli.calls import REFERENCE

CONFIGS = Path(__file__).parents[2] / "configs"


def settled(tree: Any) -> Any:
    """What an experiment computed, with all arrays whose blocks were still to come."""
    if not isinstance(tree, dict):
        coming = isinstance(tree.values, Coming)
        return tree._replace(values=np.empty(*tree.values[:2])) if coming else tree
    found = {name: settled(node) for name, node in tree.items()}
    for block in tree.blocks if isinstance(tree, Streamed) else ():
        for name, (where, values) in block.items():
            found[name].values[where] = values
    return found


def asked(name: str, *settings: str) -> Any:
    """The checked content of a shipped config, with settings."""
    return loading.load(CONFIGS / f"{name}.yaml", settings).content


def computed(given: Any, parts: list[str] | None = None, **means: Any) -> Any:
    """What the experiment of a config computes, by the numerics that it asks for.

    Its parts, whose names are added to the list, are as they come back where a run was interrupted.
    """

    def part(name: str, compute: Callable[[], Any]) -> Any:
        if parts is not None:
            parts.append(name)
        return store.read_part(Path(name), store.part(compute()))

    means = {"arithmetic": resolve(**given.numerics_asked), "part": part, **means}
    return settled(experiments.computation(given.experiment).compute(given, Means(**means)))


def plain(tree: Any) -> Any:
    """The arrays of what an experiment computed, as `store.load` would give them."""
    if isinstance(tree, dict):
        return {name: plain(node) for name, node in tree.items()}
    if isinstance(tree.values, str):
        return tree.values
    found = np.array(tree.values)
    return np.char.decode(found) if found.dtype.kind == "S" else found


def reference(name: str) -> Loaded:
    """The stored reference of a config, read once, as each test's own."""
    return copy.deepcopy(_reference(name))


@functools.cache
def _reference(name: str) -> Loaded:
    return store.load(REFERENCE / f"{name}.h5")


def differences(experiment: str, stored: Any, fresh: Any) -> list[Difference]:
    """Where two results of an experiment disagree, by what its layout declares."""
    return compare.differences(experiments.layout(experiment), stored, fresh)


def from_file(folder: Path, experiment: str, tree: Any) -> Loaded:
    """What an experiment computed, as it comes back from a result file."""
    path = folder / f"{experiment}.h5"
    store.write(path, store.Result({"experiment": experiment}, {}, {}, tree))
    return store.load(path)


def with_change(data: Any, change: Callable[[Any], Any]) -> Any:
    """A copy of the data of a result, changed."""
    other = copy.deepcopy(data)
    change(other)
    return other


def shifted(data: Any, place: tuple[str, ...], by: float, at: int = 0) -> Any:
    """A copy of the data of a result, of which one array is off at an index of its last axis."""

    def change(other: Any) -> None:
        array = functools.reduce(operator.getitem, place, other)
        array[..., at] += np.asarray(by).astype(array.dtype)

    return with_change(data, change)
