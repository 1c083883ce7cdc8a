"""`rigidpend cache`, and what a user sees of a damaged one."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import pytest

from rigidpend.machine import cache
from tests.cli.calls import call


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache.folder()


def test_an_empty_cache_is_told(folder: Path, tmp_path: Path) -> None:
    done = call(tmp_path, "cache")
    assert (done.returncode, done.stdout) == (0, f"{folder}: 0 bytes\n")
    assert json.loads(call(tmp_path, "cache", "--json").stdout)["subfolders"] == []


def test_subfolders_files_and_damage_are_told_and_removed(folder: Path, tmp_path: Path) -> None:
    for of in (b"a", b"b"):
        cache.save(folder / "maps", of, bytes(1_000_000), 10**7)
    good, spoilt = sorted((folder / "maps").iterdir())
    spoilt.write_bytes(b"else")
    head, row, bad = call(tmp_path, "cache").stdout.splitlines()
    assert head == f"{folder}: 1.0 MB"
    assert row.split("  ") == ["maps", "2 files, 1 damaged", "1.0 MB", "return maps"]
    assert bad == f"{spoilt}  4 bytes  damaged"
    *_, first, second = call(tmp_path, "cache", "--files").stdout.splitlines()
    assert (first, second) == (f"{good}  1.0 MB", bad)
    [told] = json.loads(call(tmp_path, "cache", "--json").stdout)["subfolders"]
    assert told["damaged"] == [str(spoilt)]
    done = call(tmp_path, "cache", "--clear")
    assert done.stderr == f"{folder}: 1.0 MB removed\n"
    assert not folder.exists()


def test_a_kept_file_that_is_damaged_is_said_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def damaged() -> list[cache.Subfolder]:
        warnings.warn("one.map: damaged; it is made again", cache.KeptFileWarning, stacklevel=1)
        return []

    monkeypatch.setattr(cache, "subfolders", damaged)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        done = call(tmp_path, "cache")
    assert done.stderr == "rigidpend: warning: one.map: damaged; it is made again\n"
