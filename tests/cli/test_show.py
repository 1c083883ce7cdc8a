"""What is shown of configs and results, and of what is kept and installed here."""

import errno
import json
import re
import shutil
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import h5py
import pytest
from PIL import Image

from rigidpend.machine import cache
from rigidpend.results import store
from rigidpend.runs import provenance, runner
from tests.cli.calls import REFERENCE, call, succeeded
from tests.config.samples import FIG4, SMALL, changed, written


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Configs, good and computed, not computed, bad, one that measures; and results of our own."""
    folder = tmp_path_factory.mktemp("place")
    (folder / "configs" / "measure").mkdir(parents=True)
    for name in ("a_done", "b_changed", "c_new", "measure/m_slow", "e_damaged"):
        written(folder / "configs", SMALL, f"{name}.yaml")
    written(folder / "configs", changed("mu: 0.001", "mu: x", SMALL), "d_bad.yaml")
    written(folder, changed("n_symbols: 3", "n_symbols: 25", SMALL), "mine.yaml")
    written(folder, "services: {}\n", "compose.yaml")
    assert call(folder, "run", "a_done", "b_changed", "mine").returncode == 0
    written(folder / "configs", changed("mu: 0.001", "mu: 1e-2", SMALL), "b_changed.yaml")
    (folder / "results" / "e_damaged.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    shutil.copy(REFERENCE / "fig1.h5", folder / "results" / "other.h5")
    return folder


STATUS = {
    "a_done": "up to date",
    "b_changed": "to run: its config changed: problem.mu from 0.001 to",
    "c_new": "to run: no result yet",
    "m_slow": "to run: no result yet (by name only)",
    "mine": "up to date; ",
}


def test_list_tells_a_refusal_of_the_system_as_other_commands_do(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = PermissionError(errno.EACCES, "Permission denied", "shut/fig1.h5")
    monkeypatch.setattr(runner, "plan", Mock(side_effect=refused))
    reasons = {entry["reason"] for entry in json.loads(call(place, "list", "--json").stdout)}
    assert "shut/fig1.h5: Permission denied" in reasons
    assert not any("Errno" in reason for reason in reasons)


@pytest.mark.slow
def test_list_names_every_config_and_result_with_its_status(place: Path) -> None:
    listed = call(place, "list")
    assert (listed.returncode, listed.stderr) == (0, "")
    lines = listed.stdout.splitlines()
    assert all(len(line) <= 80 for line in lines)
    rows = {line.split()[0]: line for line in lines}
    assert {FIG4.stem, "fig1", "fig2", *STATUS} <= set(rows)
    assert "compose" not in rows
    for name, status in STATUS.items():
        assert rows[name].split()[1] == "route_codes"
        assert f"  {status}" in rows[name]
        assert rows[name].endswith(status) == (name != "mine")
    assert " - " in rows["d_bad"]
    # Folders of configs are headings; this one has no name.
    assert "here" in lines
    said = " ".join(listed.stdout.split())
    assert f"cannot be used: {Path('configs', 'd_bad.yaml')}:7:7: problem.mu: " in said
    assert f"cannot be used: {Path('results', 'e_damaged.h5')}: " in said
    entries = {x["name"]: x for x in json.loads(call(place, "list", "--json").stdout)}
    assert entries["d_bad"]["status"] == "cannot be used"
    assert entries["other"]["experiment"] == "phase_portraits"
    assert entries["other"]["file"] == str(Path("results", "other.h5"))
    assert entries["mine"]["config"] == "mine.yaml"
    names = ("a_done", "m_slow", "mine")
    assert [entries[name]["in_all"] for name in names] == [True, False, False]
    # What is uncertain is said here, and was at the end of its run.
    count = (~store.load(place / "results" / "mine.h5")["data"]["only"]["certain"]).sum()
    doubt = f"{count} of 125 symbols uncertain"
    assert {name: x["doubt"] for name, x in entries.items() if x["doubt"]} == {"mine": doubt}
    assert count > 0
    assert f"up to date; {doubt}" in said
    assert (place / "results" / "mine.log").read_text().endswith(f"; {doubt}\n")
    # Of another folder of results.
    told = json.loads(call(place, "list", "--out", "none", "--json").stdout)
    [done] = [entry for entry in told if entry["name"] == "a_done"]
    assert (done["status"], done["reason"]) == ("to run", "no result yet")
    assert done["file"] == str(Path("none", "a_done.h5"))


@pytest.mark.slow
def test_describe_has_the_rows_and_as_json_the_config_and_its_hash_too(tmp_path: Path) -> None:
    """Which rows each experiment has is told by its own tests."""
    done = call(tmp_path, "describe", "fig4")
    assert (done.returncode, done.stderr) == (0, "")
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    assert re.search(r"^  alpha0 +1\.9106332362490186 +rad$", done.stdout, re.MULTILINE)
    # Of the theory besides.
    assert "  Melnikov zeros      1.5630503595" in done.stdout
    done = call(tmp_path, "describe", "fig4", "--json", "--set", "problem.mu=1/3")
    [described] = json.loads(done.stdout)
    assert described["config"]["problem"]["mu"] == "1/3"
    assert described["config_hash"] == provenance.config_hash(described["config"])
    assert {row["name"] for row in described["rows"]} >= {"A", "r", "mu", "alpha0", "h0"}


@pytest.mark.slow
def test_a_png_says_which_result_it_shows(tmp_path: Path) -> None:
    result = Path(shutil.copy(REFERENCE / "fig2.h5", tmp_path))
    succeeded(tmp_path, "render", "fig2", "--out", ".")
    attributes = store.attributes(result)
    with Image.open(result.with_suffix(".png")) as image:
        told = {key: x for key, x in image.info.items() if isinstance(x, str)}
    # By which a second rendering knows that nothing changed.
    assert len(told.pop("Drawn-From")) == 64
    assert told == {
        "Title": f"rigidpend fig2, config {attributes['config_hash']}",
        "Experiment": "heteroclinic_cycle",
        "Config-Hash": attributes["config_hash"],
        "Code-Hash": attributes["code_hash"],
        "Engine": attributes["engine"],
    }


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return cache.folder()


def test_subfolders_and_files_are_told_and_removed(folder: Path, tmp_path: Path) -> None:
    done = call(tmp_path, "cache")
    assert (done.returncode, done.stdout) == (0, f"{folder}: 0 bytes\n")
    assert json.loads(call(tmp_path, "cache", "--json").stdout)["subfolders"] == []
    for of in (b"a", b"b"):
        cache.save(folder / "maps", of, bytes(1_000_000), 10**7)
    (folder / "old").mkdir()
    (folder / "old" / "cache.db").write_bytes(b"12345")
    head, *rows = call(tmp_path, "cache").stdout.splitlines()
    assert head == f"{folder}: 2.0 MB"
    assert [re.split(" {2,}", row) for row in rows] == [
        ["maps", "2 files", "2.0 MB", "return maps"],
        ["old", "1 file", "5 bytes", "of another version"],
    ]
    told, _ = json.loads(call(tmp_path, "cache", "--json").stdout)["subfolders"]
    assert told["files"] == sorted(map(str, (folder / "maps").iterdir()))
    done = call(tmp_path, "cache", "--clear")
    assert done.stderr == f"{folder}: 2.0 MB removed\n"
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
    monkeypatch.setattr(cache, "subfolders", lambda: [SimpleNamespace(bytes=1.2e7)] * 2)


def doctor(folder: Path, *more: str) -> tuple[int, dict[str, Any]]:
    """The exit code of the command, and what it says by name."""
    done = call(folder, "doctor", "--json", *more)
    return done.returncode, {one["name"]: one for one in json.loads(done.stdout)}


@pytest.mark.usefixtures("of_24_MB")
def test_it_says_what_is_here_and_changes_nothing(tmp_path: Path) -> None:
    code, found = doctor(tmp_path)
    assert code == 0
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
    version, lacking = provenance.version, {library: provenance.MISSING}
    monkeypatch.setattr(provenance, "version", lambda x: lacking.get(x) or version(x))
    ended, told = doctor(tmp_path)
    found = told[library]
    assert (ended, found["state"], found["needed"]) == (code, "absent", code == 3)
    assert found["note"].startswith(said)


@pytest.mark.parametrize("folder", ["file/results", "/proc/results"])
def test_folders_that_cannot_be_written_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    """Of /proc its owner may make files, by its permissions."""
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    code, found = doctor(tmp_path, "--out", folder)
    assert code == 3
    assert found["results"]["note"] == f"{folder}; choose another folder with --out"
    assert "made anew by each run" in found["cache"]["note"]
    assert not found["cache"]["needed"]
