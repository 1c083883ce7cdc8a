"""Finished parts of a run: used again, never another run's, gone when the result is there."""

from __future__ import annotations

import contextlib
import gc
import os
import shutil
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from rigidpend.experiments.contract import Piece
from rigidpend.experiments.data import Dataset, Tree
from rigidpend.machine import cache, workers
from rigidpend.machine.cache import KeptFileWarning
from rigidpend.machine.files import StoreError
from rigidpend.runs.parts import UNFIT, Parts, packed, sweep, unpacked
from tests.attacks import lot

PART: Tree = {
    "inner": {"x": Dataset(np.array([1.5, np.nan]), "rad", "angles", ("samples",), True)},
    "words": Dataset(np.array([b"left", b"right"]), "1", "sides", ("bodies", 2)),
    "text": Dataset("grüße", "", "a text"),
    "flags": Dataset(np.array([True, False]), "1", "flags"),
    "one": Dataset(np.float64(2.0), "1", "a number"),
}


def not_again() -> Tree:
    raise AssertionError("computed again")


def leaves(tree: Tree, place: str = "") -> dict[str, Dataset]:
    found: dict[str, Dataset] = {}
    for name, node in tree.items():
        inside = f"{place}/{name}"
        found |= {inside: node} if isinstance(node, Dataset) else leaves(node, inside)
    return found


def test_a_kept_part_is_used_again_with_values_types_and_units(tmp_path: Path) -> None:
    Parts(tmp_path / "fig.h5", "a").keep("first", lambda: PART)
    again = leaves(Parts(tmp_path / "fig.h5", "a").keep("first", not_again))
    given = leaves(PART)
    assert set(again) == set(given)
    for name, dataset in given.items():
        assert again[name][1:] == dataset[1:]
        assert np.asarray(again[name].values).dtype.kind == np.asarray(dataset.values).dtype.kind
        np.testing.assert_array_equal(again[name].values, dataset.values)


def test_a_part_of_another_fingerprint_is_not_used(tmp_path: Path) -> None:
    Parts(tmp_path / "fig.h5", "a").keep("first", lambda: PART)
    with pytest.raises(AssertionError, match="computed again"):
        Parts(tmp_path / "fig.h5", "b").keep("first", not_again)


def test_a_damaged_part_is_computed_again(tmp_path: Path) -> None:
    parts = Parts(tmp_path / "fig.h5", "a")
    parts.keep("first", lambda: PART)
    [path] = tmp_path.rglob("first.kept")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.warns(KeptFileWarning, match=f"{path}: damaged; it is made again"):
        assert parts.keep("first", lambda: {"new": PART["one"]}).keys() == {"new"}
    assert parts.keep("first", not_again).keys() == {"new"}


@pytest.mark.parametrize("other", ["second", "first"])
def test_a_part_copied_over_another_is_computed_again(tmp_path: Path, other: str) -> None:
    """Another part of the same run, or the same part of another run."""
    own, copied = (Parts(tmp_path / f"{name}.h5", name) for name in ("fig", other))
    copied.keep("second" if other == "second" else "first", lambda: {"wrong": PART["one"]})
    own.keep("first", lambda: PART)
    [source] = (tmp_path / f".{other}.parts").rglob("*.kept")
    [path] = (tmp_path / ".fig.parts").rglob("*.kept")
    shutil.copy(source, path)
    with pytest.warns(KeptFileWarning, match=f"{path}: of something else than its name says"):
        assert own.keep("first", lambda: PART).keys() == PART.keys()


def test_a_part_that_is_no_tree_is_told_and_computed_again(tmp_path: Path) -> None:
    parts = Parts(tmp_path / "fig.h5", "a")
    parts.keep("first", lambda: PART)
    [path] = tmp_path.rglob("first.kept")
    cache.save_file(path, b"a, part first", b"nothing")
    with pytest.warns(KeptFileWarning, match="no part of a run"):
        assert parts.keep("first", lambda: PART) is PART


def test_whatever_bytes_there_are_they_are_a_part_or_refused() -> None:
    content = packed(PART)
    with lot.drawn("parts") as chance:
        for _ in range(lot.trials(1000)):
            changed = bytearray(content)
            for _ in range(chance.choice([1, 1, 2, 3])):
                at = chance.randrange(len(changed))
                new = chance.choice([b"", chance.randbytes(1), b"99", b",8"])
                changed[at : at + chance.randrange(9)] = new
            with contextlib.suppress(*UNFIT):
                unpacked(bytes(changed))


def test_dropped_parts_leave_nothing(tmp_path: Path) -> None:
    for fingerprint in ("a", "b"):
        with Parts(tmp_path / "fig.h5", fingerprint) as parts:
            parts.keep("first", lambda: PART)
    Parts(tmp_path / "fig.h5", "a").drop()
    assert list(tmp_path.iterdir()) == []


def test_a_copy_of_the_open_folder_that_a_child_has_holds_nothing(tmp_path: Path) -> None:
    """Between fork and exec a child has one: git is started for each result."""
    with Parts(tmp_path / "fig.h5", "a") as parts:
        parts.keep("first", lambda: PART)
        assert parts._handle is not None
        copy = os.dup(parts._handle)
        parts.drop()
        os.close(copy)
    assert list(tmp_path.iterdir()) == []


def test_parts_that_another_run_uses_stay_until_it_drops_them(tmp_path: Path) -> None:
    one, two = (Parts(tmp_path / "fig.h5", "a") for _ in range(2))
    one.keep("first", lambda: PART)
    two.keep("first", not_again)
    one.drop()
    assert two.keep("first", not_again).keys() == PART.keys()
    two.drop()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_place_of_a_part_is_refused_before_the_part_is_computed(
    tmp_path: Path,
) -> None:
    target = tmp_path / "fig.h5"
    Parts(target, "a").keep("first", lambda: PART)
    [place] = tmp_path.rglob("first.kept")
    place.unlink()
    place.mkdir()
    with pytest.raises(StoreError, match="kept: a folder is in the place of a file: move it"):
        Parts(target, "a").keep("first", not_again)


def test_a_run_goes_on_though_another_removed_the_folder(tmp_path: Path) -> None:
    one = Parts(tmp_path / "fig.h5", "a")
    one.keep("first", lambda: PART)
    one.drop()
    assert one.keep("first", lambda: {"new": PART["one"]}).keys() == {"new"}
    assert len(one) == 1


def test_sweep_leaves_a_living_run_alone(tmp_path: Path) -> None:
    with Parts(tmp_path / "fig.h5", "a") as parts:
        parts.keep("first", lambda: PART)
        sweep(tmp_path / "fig.h5")
        assert parts.keep("first", not_again).keys() == PART.keys()
    sweep(tmp_path / "fig.h5")
    assert list(tmp_path.iterdir()) == []


def test_a_part_leaves_memory_when_it_is_let_go(tmp_path: Path) -> None:
    """At once, for a long run looks for garbage seldom: whether it was kept now or read again."""
    gc.collect()
    gc.disable()
    try:
        tracemalloc.start()
        for _ in range(2):
            parts = Parts(tmp_path / "fig.h5", "a")
            for k in range(8):
                large: Tree = {"x": Dataset(np.zeros(100_000), "1", "numbers")}
                parts.keep(str(k), lambda large=large: large)  # type: ignore[misc]
        assert tracemalloc.get_traced_memory()[0] < 2 * 800_000
    finally:
        tracemalloc.stop()
        gc.enable()


def numbered(k: int) -> Tree:
    return {"x": Dataset(np.array([k, os.getpid()]), "1", "its number, and who made it")}


@pytest.mark.slow
def test_many_pieces_go_to_processes_and_come_in_their_order(tmp_path: Path) -> None:
    """But for the first, those that are kept, and a kept one that is damaged."""
    parts = Parts(tmp_path / "fig.h5", "a")
    parts.keep("4", lambda: numbered(40))
    parts.keep("6", lambda: numbered(60))
    [path] = tmp_path.rglob("6.kept")
    path.write_bytes(path.read_bytes()[:100])
    pieces = [Piece(str(k), numbered, (k,)) for k in range(2 + workers.EACH * 2)]
    with pytest.warns(KeptFileWarning):
        found = [leaves(tree)["/x"].values for tree in parts.in_order(pieces, 2)]
    assert [x[0] for x in found] == [0, 1, 2, 3, 40, 5, 6, 7, 8, 9]
    here = [k for k, x in enumerate(found) if x[1] == os.getpid()]
    assert 0 in here
    assert 9 not in here
    assert len(parts) == len(pieces)
    again = [leaves(tree)["/x"].values for tree in parts.in_order(pieces, 2)]
    np.testing.assert_array_equal(again, found)
