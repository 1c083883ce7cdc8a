"""`rigidpend cache`, and what a user sees of a damaged one."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from rigidpend.machine import cache
from rigidpend.results import store
from tests.cli.calls import call
from tests.config.samples import SMALL, written


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


@pytest.mark.slow
def test_a_run_with_damaged_code_says_so_and_makes_it_anew(folder: Path, tmp_path: Path) -> None:
    """In processes of their own, for integrators are kept in memory too."""
    written(tmp_path, SMALL, "small.yaml")
    command = [sys.executable, "-m", "rigidpend", "run", "small.yaml", "--force", "-q", "-j", "1"]
    results = []
    for damaged in (False, True, False):
        for path in folder.glob("*/*") if damaged else ():
            content = bytearray(path.read_bytes())
            content[len(content) // 2] ^= 1
            path.write_bytes(content)
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        said = f"rigidpend: warning: {folder}/"
        lines = done.stderr.splitlines()
        assert bool(lines) == damaged
        assert all(line.startswith(said) for line in lines)
        assert all(line.endswith("damaged; it is made again") for line in lines)
        results.append(repr(store.read_tree(tmp_path / "results" / "small.h5")))
    assert results[0] == results[1] == results[2]
