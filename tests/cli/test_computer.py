"""`cache` and `doctor`: what is kept and installed here, what is missing, and what that costs."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from types import SimpleNamespace

import h5py
import pytest

from rigidpend.machine import cache
from rigidpend.runs import provenance
from tests.cli.calls import call, succeeded


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache.folder()


def test_subfolders_files_and_damage_are_told_and_removed(folder: Path, tmp_path: Path) -> None:
    done = call(tmp_path, "cache")
    assert (done.returncode, done.stdout) == (0, f"{folder}: 0 bytes\n")
    assert json.loads(call(tmp_path, "cache", "--json").stdout)["subfolders"] == []
    for of in (b"a", b"b"):
        cache.save(folder / "maps", of, bytes(1_000_000), 10**7)
    _, spoilt = sorted((folder / "maps").iterdir())
    spoilt.write_bytes(b"else")
    head, row, bad = call(tmp_path, "cache").stdout.splitlines()
    assert head == f"{folder}: 1.0 MB"
    assert row.split("  ") == ["maps", "2 files, 1 damaged", "1.0 MB", "return maps"]
    assert bad == f"{spoilt}  4 bytes  damaged"
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


@pytest.fixture
def of_24_MB(monkeypatch: pytest.MonkeyPatch) -> None:
    """To look through the true one takes longer than all else."""
    monkeypatch.setattr(cache, "subfolders", lambda: [SimpleNamespace(size=1.2e7)] * 2)


@pytest.mark.usefixtures("of_24_MB")
def test_it_says_what_is_here_and_changes_nothing(tmp_path: Path) -> None:
    done = succeeded(tmp_path, "doctor", "--json")
    found = {one["name"]: one for one in json.loads(done.stdout)}
    assert found["h5py"]["state"] == h5py.__version__
    assert not any(one["needed"] for one in found.values())
    assert found["results"]["state"] == "ready"
    assert found["cache"]["state"] == "24 MB"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("of_24_MB")
@pytest.mark.parametrize(
    ("library", "code", "said"),
    [
        ("llvmlite", 3, "every run needs it: python -m pip install --force-reinstall rigidpend"),
        ("xarray", 0, "no results as labelled arrays, result.data; python -m pip install"),
    ],
)
def test_what_is_missing_is_said_with_its_cost_and_its_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str, code: int, said: str
) -> None:
    version = provenance.version
    monkeypatch.setattr(
        provenance, "version", lambda name: provenance.ABSENT if name == library else version(name)
    )
    done = call(tmp_path, "doctor", "--json")
    [found] = [one for one in json.loads(done.stdout) if one["name"] == library]
    assert (done.returncode, found["state"], found["needed"]) == (code, "absent", code == 3)
    assert found["note"].startswith(said)


def test_folders_that_cannot_be_written_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    done = call(tmp_path, "doctor", "--out", "file/results", "--json")
    found = {one["name"]: one for one in json.loads(done.stdout)}
    assert done.returncode == 3
    assert found["results"]["note"] == "file/results; choose another folder with --out"
    assert "made anew by each run" in found["cache"]["note"]
    assert not found["cache"]["needed"]
