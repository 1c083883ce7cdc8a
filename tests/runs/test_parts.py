"""Finished parts of a run: used again, never another run's, gone when the result is there."""

import errno
import gc
import os
import shutil
import signal
import time
import tracemalloc
from collections.abc import Callable
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.contract import Piece
from rigidpend.experiments.data import Tree
from rigidpend.machine import cache, files, signals, workers
from rigidpend.machine.cache import KeptFileWarning
from rigidpend.machine.files import StoreError
from rigidpend.runs.parts import Parts, packed, remove_leftovers, unpacked

PART: Tree = {
    "inner": {"x": np.array([1.5, np.nan])},
    "words": np.array([b"left", b"right"]),
    "text": "grüße",
    "flags": np.array([True, False]),
    "one": np.float64(2.0),
}


def not_again() -> Tree:
    raise AssertionError("computed again")


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """The place of a result, whose run has a part."""
    Parts(tmp_path / "fig.h5", "a").keep("first", lambda: PART)
    return tmp_path / "fig.h5"


def kept(target: Path) -> Path:
    [path] = target.parent.rglob("first.kept")
    return path


def test_a_kept_part_is_used_again_with_its_values_and_types(target: Path) -> None:
    again = Parts(target, "a").keep("first", not_again)
    assert repr(again) == repr(PART)
    assert type(again["one"]) is np.float64
    assert again["flags"].flags.writeable
    with pytest.raises(AssertionError, match="computed again"):
        Parts(target, "b").keep("first", not_again)
    long: Tree = {"text": "x" * 100_000}
    assert unpacked(packed(long)) == long


def test_after_a_signal_no_further_part_is_begun(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "came", lambda: signal.SIGTERM)
    parts = Parts(target, "a")
    assert parts.keep("first", not_again).keys() == PART.keys()
    with pytest.raises(signals.Stopped):
        parts.keep("second", not_again)


def copied(name: str, run: str) -> Callable[[Path], None]:
    """Write another part, or that of another run, over a part."""

    def change(path: Path) -> None:
        Parts(path.parents[2] / "fig.h5", run).keep(name, lambda: {"wrong": PART["one"]})
        [made] = {*path.parents[1].rglob(f"{name}.kept")} - {path}
        shutil.copy(made, path)

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda path: os.truncate(path, 100), "damaged; it is made again"),
        (
            lambda path: cache.save_file(path, b"a, part first as npy", b"nothing"),
            "no part of a run",
        ),
        (copied("second", "a"), "made for something else than its name says"),
        (copied("first", "b"), "made for something else than its name says"),
    ],
)
def test_a_part_that_is_none_of_its_run_is_told_and_computed_again(
    target: Path, change: Callable[[Path], None], said: str
) -> None:
    parts, path = Parts(target, "a"), kept(target)
    change(path)
    with pytest.warns(KeptFileWarning, match=f"{path}: {said}"):
        assert parts.keep("first", lambda: {"new": PART["one"]}).keys() == {"new"}
    assert parts.keep("first", not_again).keys() == {"new"}


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("other")])
@pytest.mark.parametrize("depth", [0, 1])
def test_what_is_in_the_place_of_a_folder_makes_room_and_a_folder_elsewhere_gets_no_parts(
    target: Path, make: Callable[[Path], None], depth: int
) -> None:
    path = kept(target)
    place = path.parents[1 - depth]
    (place.parent / "other").mkdir()
    shutil.rmtree(place)
    make(place)
    Parts(target, "a").keep("first", lambda: PART)
    assert list((place.parent / "other").iterdir()) == []
    assert path.is_file()


def test_a_run_that_finds_its_parts_gone_keeps_new_ones(target: Path) -> None:
    one, two = (Parts(target, "a") for _ in range(2))
    for parts in (one, two):
        parts.keep("first", not_again)
    one.drop()
    assert list(target.parent.iterdir()) == []
    assert two.keep("first", lambda: {"new": PART["one"]}).keys() == {"new"}
    assert len(two) == 1


@pytest.mark.parametrize("remove", [remove_leftovers, lambda target: Parts(target, "a").drop()])
@pytest.mark.parametrize("age", [files.DAY - 60, files.DAY + 60])
def test_parts_of_another_fingerprint_go_once_no_run_has_added_to_them_for_long(
    target: Path, remove: Callable[[Path], None], age: float
) -> None:
    Parts(target, "a").drop()
    Parts(target, "b").keep("first", lambda: PART)
    folder, then = kept(target).parent, time.time() - age
    os.utime(folder, (then, then))
    remove(target)
    assert list(target.parent.iterdir()) == ([folder.parent] if age < files.DAY else [])


def test_old_folders_elsewhere_to_which_a_link_leads_are_left(target: Path) -> None:
    folder = kept(target).parent
    os.utime(folder, (0, 0))
    folder.parent.symlink_to(folder.parent.rename(target.parent / "elsewhere"))
    remove_leftovers(target)
    assert folder.is_dir()


def test_a_run_that_fails_before_its_first_part_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(AssertionError):
        Parts(tmp_path / "fig.h5", "a").keep("first", not_again)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_place_of_a_part_is_refused_before_the_part_is_computed(
    target: Path,
) -> None:
    place = kept(target)
    place.unlink()
    place.mkdir()
    parts, said = Parts(target, "a"), "kept: a folder is in the place of a file: move it"
    with pytest.raises(StoreError, match=said):
        parts.keep("first", not_again)
    with pytest.raises(StoreError, match=said):
        next(parts.in_order([Piece("first", not_again)]))


def test_a_part_for_which_there_is_no_room_is_one_sentence(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = OSError(errno.ENOSPC, "No space left on device")
    monkeypatch.setattr(files, "replace", Mock(side_effect=full))
    with pytest.raises(StoreError, match=r"second\.kept: cannot be written: No space left"):
        Parts(target, "a").keep("second", lambda: PART)


def test_a_part_leaves_memory_when_it_is_let_go(tmp_path: Path) -> None:
    """At once, for a long run looks for garbage seldom: whether it was kept now or read again."""
    gc.collect()
    gc.disable()
    try:
        tracemalloc.start()
        for _ in range(2):
            parts = Parts(tmp_path / "fig.h5", "a")
            for k in range(8):
                large: Tree = {"x": np.zeros(100_000)}
                parts.keep(str(k), lambda large=large: large)  # type: ignore[misc]
        assert tracemalloc.get_traced_memory()[0] < 2 * 800_000
    finally:
        tracemalloc.stop()
        gc.enable()


def numbered(k: int) -> Tree:
    return {"x": np.array([k, os.getpid()])}


@pytest.mark.slow
def test_many_pieces_go_to_processes_and_come_in_their_order(tmp_path: Path) -> None:
    """But for the first, those that are kept, and a kept one that is damaged."""
    parts = Parts(tmp_path / "fig.h5", "a")
    parts.keep("4", lambda: numbered(40))
    parts.keep("6", lambda: numbered(60))
    [path] = tmp_path.rglob("6.kept")
    path.write_bytes(path.read_bytes()[:100])
    pieces = [Piece(str(k), partial(numbered, k)) for k in range(2 + workers.LEAST_PARTS * 2)]
    with pytest.warns(KeptFileWarning):
        found = [tree["x"] for tree in parts.in_order(pieces, 2)]
    assert [x[0] for x in found] == [0, 1, 2, 3, 40, 5, 6, 7, 8, 9]
    here = [k for k, x in enumerate(found) if x[1] == os.getpid()]
    assert 0 in here
    assert 9 not in here
    assert len(parts) == len(pieces)
    all_kept = [piece._replace(compute=not_again) for piece in pieces]
    again = [tree["x"] for tree in parts.in_order(all_kept, 2)]
    np.testing.assert_array_equal(again, found)
