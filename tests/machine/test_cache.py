"""Kept files are used only if undamaged and of what is asked for; the cache is a folder of them."""

import os
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest

from rigidpend.machine import cache, files, signals


@pytest.fixture
def one(tmp_path: Path) -> Path:
    """A kept file of ``b"one"``."""
    path = tmp_path / "folder" / "one"
    cache.save_file(path, b"one", b"content")
    return path


def test_what_is_damaged_or_of_nothing_is_told_and_removed(one: Path) -> None:
    whole = one.read_bytes()
    contents = {files.sealed(b"content"): "made for something else than its name says"}
    for place in (0, 10, len(whole) - 70, len(whole) - 1):
        contents[whole[:place] + b"?" + whole[place + 1 :]] = "damaged"
    for content, said in contents.items():
        one.write_bytes(content)
        with pytest.warns(cache.KeptFileWarning, match=f"^{one}: {said}; it is made again$"):
            assert cache.load_file(one, b"one") is None
        assert not one.exists()


def test_a_copy_of_another_is_told_and_no_content_passes_for_what_it_is_of(one: Path) -> None:
    """Its length is under the digest too."""
    mixed = b"short", b"long, " + cache.MARK + b"short"
    cache.save_file(one.with_name("mixed"), mixed[0], b"content" + cache.MARK + b"long, ")
    others = [(one, of) for of in (b"two", b"e", b"", b"onerigidpend keeps this for one")]
    for source, of in (*others, (one.with_name("mixed"), mixed[1])):
        copy = one.with_name(cache.name_of(of))
        shutil.copy(source, copy)
        said = f"{copy}: made for something else than its name says"
        with pytest.warns(cache.KeptFileWarning, match=said):
            assert cache.load_file(copy, of) is None
        assert not copy.exists()


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
    with pytest.raises(files.StoreError, match="a folder is in the place of a file: move it away"):
        files.write(one.parent, b"")


def test_a_file_that_becomes_a_pipe_before_it_is_opened_is_not_read(
    one: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe, found = one.with_name("two"), one.stat()
    os.mkfifo(pipe)
    with monkeypatch.context() as before:
        before.setattr(os, "stat", lambda _: found)
        with pytest.raises(ValueError, match="not a regular file"):
            files.content(pipe)


def test_a_file_of_just_the_most_bytes_is_read(one: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = one.read_bytes()
    monkeypatch.setattr(files, "MOST_BYTES", len(content))
    assert files.content(one) == content
    monkeypatch.setattr(files, "MOST_BYTES", len(content) - 1)
    with pytest.raises(ValueError, match=f"{len(content)} bytes, more than {len(content) - 1}"):
        files.content(one)


def test_what_is_left_of_a_file_with_any_name_goes_once_it_is_old(tmp_path: Path) -> None:
    """After a day, but for links, however old that is to which they lead."""
    path, ages = tmp_path / "[a-c]*.h5", (files.DAY + 60, files.DAY - 60, 2 * files.DAY)
    ends = f"{path.name}.1", f"{path.name}.2", "b.h5.1"
    old, young, other = (tmp_path / f".{end}.part" for end in ends)
    for each, age in zip((old, young, other), ages, strict=True):
        each.touch()
        os.utime(each, (time.time() - age,) * 2)
    linked = tmp_path / f".{path.name}.3.part"
    linked.symlink_to(other)
    files.write(path, b"content")
    assert sorted(tmp_path.iterdir()) == sorted([path, young, other, linked])
    assert not signals.unfinished


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert cache.folder() == tmp_path / "cache" / "rigidpend"
    return cache.folder()


@pytest.mark.parametrize("given", ["", "relative"])
def test_it_lies_where_the_user_s_programs_keep_theirs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", given)
    for home, found in ((str(tmp_path), tmp_path), ("relative", Path(os.devnull))):
        monkeypatch.setenv("HOME", home)
        for platform, place in (("linux", ".cache"), ("darwin", "Library/Caches")):
            monkeypatch.setattr(sys, "platform", platform)
            assert cache.folder() == found / place / "rigidpend"


def test_a_user_without_a_home_is_told_once_that_nothing_can_be_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    # So it is for a user of whom the system knows nothing, as in a container.
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    cache.tell_once.cache_clear()
    with pytest.warns(cache.KeptFileWarning, match=r"cannot be written \(Not a directory\)"):
        cache.save(cache.folder() / "maps", b"a", b"content", 999)
    # A second warning would be an error here.
    cache.save(cache.folder() / "kernels", b"a", b"content", 999)
    assert cache.load(cache.folder() / "maps", b"a") is None
    assert cache.subfolders() == []


def test_what_is_saved_is_loaded_and_those_used_longest_ago_make_room(folder: Path) -> None:
    maps = folder / "maps"
    cache.save(maps, b"a", b"content", 999)
    assert (cache.load(maps, b"a"), cache.load(maps, b"b")) == (b"content", None)
    assert cache.load(maps / cache.name_of(b"a") / "below", b"a") is None
    for k, of in enumerate((b"a", b"b", b"c")):
        cache.save(maps, of, bytes(1000), 10_000)
        os.utime(maps / cache.name_of(of), (k, k))
    # To be used counts: so it is not the oldest any more.
    assert cache.load(maps, b"a") == bytes(1000)
    # Another process is writing one, and one was killed long ago.
    for name in (".part", ".left"):
        (maps / name).touch()
    os.utime(maps / ".left", (0, 0))
    three = 3 * (maps / cache.name_of(b"a")).stat().st_size
    cache.save(maps, b"d", bytes(1000), three)
    left = {path.name for path in maps.iterdir()}
    assert left == {".part", *(cache.name_of(of) for of in (b"a", b"c", b"d"))}


def test_a_file_that_another_process_removes_meanwhile_is_no_failure(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "iterdir", lambda maps: iter([maps / "gone"]))
    cache.save(folder / "maps", b"a", b"content", -1)
    assert cache.load(folder / "maps", b"a") == b"content"


def test_clearing_removes_what_no_run_can_write_into_any_more_or_fails(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache.save(folder / "maps", b"a", b"content", 999)
    removed: list[Path] = []
    with monkeypatch.context() as within:
        within.setattr(shutil, "rmtree", removed.append)
        cache.clear()
    assert not folder.exists()
    assert removed[0].parent == folder.parent
    folder.mkdir()
    monkeypatch.setattr(Path, "rename", Mock(side_effect=PermissionError))
    with pytest.raises(PermissionError):
        cache.clear()


def test_clearing_follows_no_link(folder: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis").write_text("text")
    cache.save(folder / "maps", b"a", b"content", 999)
    (folder / "linked").symlink_to(mine)
    (folder / "maps" / "linked").symlink_to(mine / "thesis")
    assert [one.name for one in cache.subfolders()] == ["maps"]
    assert len(cache.subfolders()[0].files) == 1
    cache.clear()
    assert list(folder.parent.iterdir()) == []
    assert (mine / "thesis").read_text() == "text"
    cache.clear()
    folder.symlink_to(mine)
    with pytest.raises(NotADirectoryError, match="a link, which is not followed"):
        cache.clear()
    assert (mine / "thesis").read_text() == "text"
    folder.unlink()
    folder.write_text("text")
    with pytest.raises(NotADirectoryError, match="a file, not a folder: move it away"):
        cache.clear()
    assert folder.read_text() == "text"
