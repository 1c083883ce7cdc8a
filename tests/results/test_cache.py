"""The cache: sealed files, bounded, listed and removed without following a link."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from rigidpend.results import cache


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


def test_what_is_saved_is_loaded(folder: Path) -> None:
    cache.save(folder / "maps" / "a", b"content", 9)
    assert cache.load(folder / "maps" / "a") == b"content"
    assert cache.load(folder / "maps" / "b") is None


@pytest.mark.parametrize("place", [0, 3, 10, -1])
def test_what_is_damaged_is_removed_and_told(folder: Path, place: int) -> None:
    path = folder / "kernels" / "a"
    cache.save(path, b"content", 9)
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)
    with pytest.warns(cache.DamagedCacheWarning, match=str(path.parent)):
        assert cache.load(path) is None
    assert not path.exists()


def test_a_pipe_is_no_file_of_the_cache(folder: Path) -> None:
    folder.mkdir(parents=True)
    os.mkfifo(folder / "a")
    assert cache.load(folder / "a") is None


def test_those_used_longest_ago_make_room(folder: Path) -> None:
    for k, name in enumerate("abc"):
        cache.save(folder / "maps" / name, name.encode(), 3)
        os.utime(folder / "maps" / name, (k, k))
    assert cache.load(folder / "maps" / "a") == b"a"
    cache.save(folder / "maps" / "d", b"d", 3)
    assert sorted(path.name for path in (folder / "maps").iterdir()) == ["a", "c", "d"]


def test_every_subfolder_is_told_with_what_is_damaged(folder: Path) -> None:
    assert cache.subfolders() == []
    cache.save(folder / "maps" / "a", b"content", 9)
    cache.save(folder / "integrators" / "b", b"content", 9)
    (folder / "integrators" / "b").write_bytes(b"something")
    (folder / "old").mkdir()
    (folder / "old" / "cache.db").write_bytes(b"12345")
    found = {one.path.name: one for one in cache.subfolders()}
    assert list(found) == ["integrators", "maps", "old"]
    assert [len(one.files) for one in found.values()] == [1, 1, 1]
    assert [len(one.damaged) for one in found.values()] == [1, 0, 0]
    assert found["old"].size == 5
    assert found["old"].meaning == "of another version"


def test_clearing_follows_no_link(folder: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis").write_text("text")
    cache.save(folder / "maps" / "a", b"content", 9)
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
