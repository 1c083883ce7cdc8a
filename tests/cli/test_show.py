"""`list`, `describe`, `render`: what is shown of configs and results."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from PIL import Image

from rigidpend.results import store
from rigidpend.runs import provenance
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
    # Of another folder of results.
    told = json.loads(call(place, "list", "--out", "none", "--json").stdout)
    [done] = [entry for entry in told if entry["name"] == "a_done"]
    assert (done["status"], done["reason"]) == ("to run", "no result yet")
    assert done["file"] == str(Path("none", "a_done.h5"))


@pytest.mark.slow
def test_what_is_uncertain_is_said_at_the_end_and_in_the_list(place: Path) -> None:
    loaded = store.load(place / "results" / "mine.h5")
    count = (~loaded["data"]["only"]["certain"]).sum()
    doubt = f"{count} of 125 symbols uncertain"
    assert count > 0
    assert (place / "results" / "mine.log").read_text().endswith(f"; {doubt}\n")
    doubts = {x["name"]: x["doubt"] for x in json.loads(call(place, "list", "--json").stdout)}
    assert {name: x for name, x in doubts.items() if x} == {"mine": doubt}
    assert f"up to date; {doubt}" in " ".join(call(place, "list").stdout.split())


@pytest.mark.slow
def test_describe_has_the_rows_and_as_json_the_config_and_its_hash_too(tmp_path: Path) -> None:
    done = call(tmp_path, "describe", "fig4")
    assert (done.returncode, done.stderr) == (0, "")
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    lines = (line.split(maxsplit=1) for line in done.stdout.splitlines()[1:])
    rows = dict(words for words in lines if len(words) == 2)
    assert rows["alpha0"].split()[:2] == ["1.9106332362490186", "rad"]
    assert "  Melnikov zeros      1.5630503595" in done.stdout
    # Of the theory besides.
    assert rows["regime"].split()[0] == "iv"
    done = call(tmp_path, "describe", "fig4", "--json", "--set", "problem.mu=1/3")
    [described] = json.loads(done.stdout)
    assert described["config"]["problem"]["mu"] == "1/3"
    assert described["config_hash"] == provenance.config_hash(described["config"])
    assert {row["name"] for row in described["rows"]} >= {"A", "r", "mu", "alpha0", "h0"}
    everything = json.loads(call(tmp_path, "describe", "all", "--json").stdout)
    told = {one["name"]: {row["name"] for row in one["rows"]} for one in everything}
    assert set(told) >= {"fig1", "fig4", "fig5"}
    # Of a body without weight there is no theory.
    assert [name for name in ("fig1", "fig4") if "Melnikov zeros" in told[name]] == ["fig4"]


@pytest.mark.slow
def test_a_png_says_which_result_it_shows(small: Path) -> None:
    succeeded(small, "run", "small")
    succeeded(small, "render", "small")
    result = small / "results" / "small.h5"
    attributes = store.attributes(result)
    with Image.open(result.with_suffix(".png")) as image:
        told = {key: x for key, x in image.info.items() if isinstance(x, str)}
    # By which a second rendering knows that nothing changed.
    assert len(told.pop("Drawn-From")) == 64
    assert told == {
        "Title": f"rigidpend small, config {attributes['config_hash']}",
        "Experiment": "route_codes",
        "Config-Hash": attributes["config_hash"],
        "Code-Hash": attributes["code_hash"],
        "Engine": attributes["engine"],
    }
