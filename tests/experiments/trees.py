"""Results as trees of plain arrays, as they are read from a file."""

import copy
import functools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments import compare
from rigidpend.experiments.compare import Difference
from rigidpend.experiments.contract import Means, Piece
from rigidpend.experiments.data import Coming, Field, Layout, Loaded, Streamed, declared
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.results import store
from rigidpend.runs import loading
from rigidpend.runs.parts import packed, unpacked
from tests.cli.calls import REFERENCE

CONFIGS = Path(__file__).parents[2] / "configs"


def settled(node: Field | Layout, tree: Any) -> Any:
    """What an experiment computed, with the blocks that were to come, as it is loaded."""
    if isinstance(tree, str):
        return tree
    if isinstance(node, Field):
        found = np.empty(*tree[:2]) if isinstance(tree, Coming) else np.array(tree)
        return np.char.decode(found) if found.dtype.kind == "S" else found
    made = {name: settled(inner, tree[name]) for name, inner in declared(node, tree).items()}
    for block in tree.blocks if isinstance(tree, Streamed) else ():
        for name, (where, values) in block.items():
            made[name][where] = values
    return made


def asked(name: str, *settings: str) -> Any:
    """The checked content of a shipped config, with settings."""
    [path] = CONFIGS.rglob(f"{name}.yaml")
    return loading.load(path, settings).content


def computed(given: Any, parts: list[str] | None = None, **means: Any) -> Any:
    """What the experiment of a config computes, by the numerics that it asks for.

    Its parts, whose names are added to the list, are as they come back where a run was interrupted.
    """

    def pieces(several: Sequence[Piece]) -> Iterator[Any]:
        for piece in several:
            if parts is not None:
                parts.append(piece.name)
            yield unpacked(packed(piece.compute()))

    means = {"arithmetic": resolve(**given.numerics_asked), "pieces": pieces, **means}
    found = experiments.computation(given.experiment).compute(given, Means(**means))
    return settled(experiments.layout(given.experiment), found)


def reference(name: str) -> Loaded:
    """The stored reference of a config, read once, as each test's own."""
    return copy.deepcopy(shared_reference(name))


@functools.cache
def shared_reference(name: str) -> Loaded:
    """The same for all tests, none of which may change it."""
    return _loaded(REFERENCE / f"{name}.h5")


def _loaded(path: Path) -> Loaded:
    """A sound file, which no other process tries before: test_drawings reads all of them so."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "tried", lambda *_: None)
        # Nothing is held sound for others.
        patch.setattr(store, "SOUND", set())
        return store.load(path)


def differences(experiment: str, stored: Any, fresh: Any) -> list[Difference]:
    """Where two results of an experiment disagree, by what its layout declares."""
    return compare.differences(experiments.layout(experiment), stored, fresh)


def unlike_stored(name: str, fresh: Any, kept: Mapping[Any, Any]) -> set[str]:
    """The arrays in which a result of less is unlike a reference, in places of its dimensions."""
    result = shared_reference(name)
    layout = experiments.layout(result["attributes"]["experiment"])

    def part(node: Field | Layout, data: Any, like: Any) -> Any:
        if not isinstance(node, Field):
            return {key: part(x, data[key], like[key]) for key, x in declared(node, like).items()}
        for axis, size in enumerate(node.dimensions):
            data = np.take(data, kept[size], axis) if size in kept else data
        return data

    found = compare.differences(layout, part(layout, result["data"], fresh), fresh)
    return {x.place.partition("[")[0] for x in found}


def from_file(folder: Path, experiment: str, tree: Any) -> Loaded:
    """What an experiment computed, as it comes back from a result file."""
    path = folder / f"{experiment}.h5"
    store.write(path, experiments.layout(experiment), tree, {"experiment": experiment}, {}, {})
    return _loaded(path)
