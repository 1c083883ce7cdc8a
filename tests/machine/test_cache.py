"""The cache: kept files, bounded, listed and removed without following a link."""

from __future__ import annotations

import errno
import os
import shutil
import sys
from pathlib import Path

import pytest

from rigidpend.machine import cache, files


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of the test's own."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert cache.folder() == tmp_path / "cache" / "rigidpend"
    return cache.folder()


def test_it_lies_where_the_user_s_programs_keep_theirs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    assert cache.folder() == tmp_path / ".cache" / "rigidpend"
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cache.folder() == tmp_path / "Library" / "Caches" / "rigidpend"


def test_what_is_saved_is_loaded_by_what_it_is_of(folder: Path) -> None:
    cache.save(folder / "maps", b"a", b"content", 999)
    assert cache.load(folder / "maps", b"a") == b"content"
    assert cache.load(folder / "maps", b"b") is None


def test_those_used_longest_ago_make_room(folder: Path) -> None:
    maps = folder / "maps"
    for k, of in enumerate((b"a", b"b", b"c")):
        cache.save(maps, of, bytes(1000), 10_000)
        os.utime(maps / cache.name_of(of), (k, k))
    # To be used counts: so it is not the oldest any more.
    assert cache.load(maps, b"a") == bytes(1000)
    cache.save(maps, b"d", bytes(1000), 4000)
    left = {path.name for path in maps.iterdir()}
    assert left == {cache.name_of(of) for of in (b"a", b"c", b"d")}


def test_a_folder_that_cannot_be_written_is_told_once(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files, "replace", full)
    said = rf"^{folder}: nothing can be kept there \(No space left on device\)"
    with pytest.warns(cache.KeptFileWarning, match=said):
        cache.save(folder / "maps", b"a", b"content", 999)
    # A second warning would be an error here.
    cache.save(folder / "kernels", b"a", b"content", 999)
    assert cache.load(folder / "maps", b"a") is None


def test_every_subfolder_is_told_with_what_is_damaged(folder: Path) -> None:
    assert cache.subfolders() == []
    cache.save(folder / "maps", b"a", b"content", 999)
    cache.save(folder / "integrators", b"b", b"content", 999)
    cache.save(folder / "kernels", b"a", b"content", 999)
    (folder / "integrators" / cache.name_of(b"b")).write_bytes(b"something")
    shutil.copy(folder / "maps" / cache.name_of(b"a"), folder / "kernels" / cache.name_of(b"c"))
    (folder / "old").mkdir()
    (folder / "old" / "cache.db").write_bytes(b"12345")
    found = {one.path.name: one for one in cache.subfolders()}
    assert list(found) == ["integrators", "kernels", "maps", "old"]
    assert [len(one.files) for one in found.values()] == [1, 2, 1, 1]
    # A copy under another name is as unfit as what was overwritten.
    assert [len(one.damaged) for one in found.values()] == [1, 1, 0, 0]
    assert found["old"].size == 5
    assert found["old"].meaning == "of another version"


def test_clearing_follows_no_link(folder: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis").write_text("text")
    cache.save(folder / "maps", b"a", b"content", 999)
    (folder / "linked").symlink_to(mine)
    (folder / "maps" / "linked").symlink_to(mine / "thesis")
    assert [one.path.name for one in cache.subfolders()] == ["maps"]
    assert len(cache.subfolders()[0].files) == 1
    cache.clear()
    assert list(folder.parent.iterdir()) == []
    assert (mine / "thesis").read_text() == "text"
    cache.clear()
    folder.symlink_to(mine)
    with pytest.raises(NotADirectoryError, match="a link, which is not followed"):
        cache.clear()
    assert (mine / "thesis").read_text() == "text"
