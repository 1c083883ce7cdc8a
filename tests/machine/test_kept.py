"""Kept files: used only if they are undamaged and of what is asked for; else told."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rigidpend.machine import cache, files


@pytest.fixture
def one(tmp_path: Path) -> Path:
    """A kept file of ``b"one"``."""
    path = tmp_path / "folder" / "one"
    cache.save_file(path, b"one", b"content")
    return path


def test_a_kept_content_is_given_back_and_its_place_is_made(one: Path) -> None:
    assert cache.load_file(one, b"one") == b"content"
    assert cache.load_file(one.with_name("two"), b"two") is None
    assert cache.load_file(one / "below", b"one") is None


@pytest.mark.parametrize("place", [0, 3, 10, 40, -70, -1])
def test_what_is_damaged_is_told_and_removed(one: Path, place: int) -> None:
    content = bytearray(one.read_bytes())
    content[place] ^= 1
    one.write_bytes(content)
    with pytest.warns(cache.KeptFileWarning, match=f"^{one}: damaged; it is made again$"):
        assert cache.load_file(one, b"one") is None
    assert not one.exists()


@pytest.mark.parametrize("of", [b"two", b"e", b"", b"onerigidpend keeps this for one"])
def test_a_copy_of_another_is_told_and_not_believed_by_its_name(one: Path, of: bytes) -> None:
    copy = one.with_name(cache.name_of(of))
    shutil.copy(one, copy)
    with pytest.warns(cache.KeptFileWarning, match=f"{copy}: of something else than its name says"):
        assert cache.load_file(copy, of) is None
    assert not copy.exists()


def test_no_content_passes_for_what_it_is_of(tmp_path: Path) -> None:
    """Its length is under the digest too."""
    path = tmp_path / "a"
    cache.save_file(path, b"short", b"content" + cache.MARK + b"long, ")
    with pytest.warns(cache.KeptFileWarning):
        assert cache.load_file(path, b"long, " + cache.MARK + b"short") is None


def test_a_sealed_file_that_does_not_say_what_it_is_of_is_told(one: Path) -> None:
    one.write_bytes(files.sealed(b"content"))
    with pytest.warns(cache.KeptFileWarning):
        assert cache.load_file(one, b"one") is None


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (os.mkfifo, "not a regular file"),
        (os.mkdir, "not a regular file"),
        (lambda path: path.symlink_to("one"), "a link, which is not followed"),
        (lambda path: path.symlink_to("/dev/zero"), "not a regular file"),
    ],
)
def test_only_regular_files_are_opened_and_what_is_there_makes_room(
    one: Path, make: Callable[[Path], object], reason: str
) -> None:
    path = one.with_name("two")
    make(path)
    with pytest.warns(cache.KeptFileWarning, match=f"{path}: {reason}"):
        assert cache.load_file(path, b"one") is None
    if not path.is_dir() or path.is_symlink():
        cache.save_file(path, b"one", b"new")
        assert cache.load_file(path, b"one") == b"new"
    assert cache.load_file(one, b"one") == b"content"


def test_a_file_is_sound_under_the_name_of_what_it_is_of_alone(tmp_path: Path) -> None:
    path = tmp_path / cache.name_of(b"one")
    cache.save_file(path, b"one", b"content")
    assert cache.is_sound(path)
    shutil.copy(path, tmp_path / cache.name_of(b"two"))
    (tmp_path / "three").write_bytes(b"")
    (tmp_path / "four").write_bytes(files.sealed(b"content"))
    found = {each.name: cache.is_sound(each) for each in tmp_path.iterdir()}
    assert found == {path.name: True, cache.name_of(b"two"): False, "three": False, "four": False}
