"""What is asked besides the figures: results of one's own, sweeps, orbits with a code."""

import json
import shutil
from pathlib import Path

import pytest

from rigidpend import render
from rigidpend.cli import find
from rigidpend.machine import workers
from rigidpend.results import store
from rigidpend.routes import symbolic
from tests.cli.calls import call, succeeded
from tests.config.samples import SMALL, TINY, changed, written
from tests.remembered import remembered
from tests.runs.checkers import altered

SWEEP = ("--sweep", "problem.mu=1e-3,1e-2")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a config of one's own, and the results of its sweep, two at a time."""
    folder = tmp_path_factory.mktemp("swept")
    written(folder, TINY, "mine.yaml")
    done = succeeded(folder, "run", "mine", *SWEEP, "-j", "2", "--json")
    assert [one["status"] for one in json.loads(done.stdout)] == ["computed"] * 2
    return folder


@pytest.mark.slow
def test_a_sweep_has_a_result_for_each_value_the_same_side_by_side_as_one_by_one(
    swept: Path, tmp_path: Path
) -> None:
    succeeded(swept, "run", "mine", *SWEEP, "-j", "1", "--out", str(tmp_path))
    for mu, stored in (("1e-3", "1/1000"), ("1e-2", "1/100")):
        path = swept / "results" / f"mine_mu={mu}.h5"
        assert store.load(path)["config"]["problem"]["mu"] == stored
        assert store.attributes(path)["name"] == f"mine_mu={mu}"
        assert path.with_suffix(".log").is_file()
        one, two = (store.load(x)["data"]["only"] for x in (path, tmp_path / path.name))
        assert all(one[key].tobytes() == two[key].tobytes() for key in one)
    again = call(swept, "run", "mine", "--sweep", "problem.mu=1e-3,0.1", "--json", "-n")
    assert [one["status"] for one in json.loads(again.stdout)] == ["up to date", "planned"]
    listed = {one["name"] for one in json.loads(call(swept, "list", "--json").stdout)}
    assert listed >= {"mine", "mine_mu=1e-3", "mine_mu=1e-2"}


@pytest.mark.slow
def test_a_single_result_can_have_a_name(swept: Path) -> None:
    succeeded(swept, "run", "mine", "--set", "problem.mu=0.1", "--name", "heavy")
    # From then on it is known by this name, and by its file.
    for name in ("heavy", "results/heavy.h5"):
        again = call(swept, "run", name)
        assert again.stderr == f"heavy: {Path('results', 'heavy.h5')} is up to date\n"
        assert "0.1 " in call(swept, "describe", name).stdout
    # Also where all is up to date.
    assert "got ''" in call(swept, "run", "heavy", "--name", "").stderr


@pytest.mark.slow
def test_a_result_is_a_config_for_every_command(
    swept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(render, "PIXELS", 300)
    result = "results/mine_mu=1e-2.h5"
    assert call(swept, "verify", result).stdout == f"mine_mu=1e-2: the same as in {result}\n"
    # With other numerics too, and not with another problem.
    for setting, code in (("numerics.tolerance=1e-13", 0), ("problem.J1_0=1e-9", 1)):
        done = call(swept, "verify", result, "--set", setting)
        assert (done.returncode, done.stdout.count("the same as in")) == (code, 1 - code)
    assert "mu: 0.01 " in call(swept, "describe", result, "--resolved").stdout
    succeeded(swept, "report", result, "--to", "one.html")
    page = (swept / "one.html").read_text()
    assert page.count("<section") == 2
    assert "Route codes: mine_mu=1e-2" in page
    assert "A = (2, 1, 1.5), r along (1, 1, 0), mu = 0.01" in page
    assert "Fig. 4" not in page.partition('id="departures"')[0]


@pytest.mark.slow
def test_the_proof_of_a_result_is_written_beside_it(swept: Path, tmp_path: Path) -> None:
    """By its file or by its name: there a figure and a comparison look for it."""
    for name in ("mine_mu=1e-2", "mine_mu=1e-3"):
        shutil.copy(swept / "results" / f"{name}.h5", tmp_path)
    by_file = str(tmp_path / "mine_mu=1e-2.h5")
    by_name = ("mine_mu=1e-3", "--out", str(tmp_path), "-j", "1")
    for given in ((by_file,), by_name):
        assert "4 of 4 symbols" in succeeded(swept, "certify", *given).stdout
    compared = succeeded(swept, "verify", by_file, "--results", str(tmp_path)).stdout
    assert compared.endswith("; 4 symbols are proven\n")
    assert len(list(tmp_path.glob("*.certificate.h5"))) == 2
    assert not list(swept.glob("results/*.certificate.h5"))
    # A symbol that is proven to be another is a contradiction.
    file = tmp_path / "mine_mu=1e-2.certificate.h5"
    symbol = store.load(tmp_path / "mine_mu=1e-2.h5")["data"]["only"]["codes"][1, 0]
    altered(file, file, lambda opened: opened["data/only/codes"].__setitem__((1, 0), 1 - symbol))
    done = call(swept, "verify", by_file, "--results", str(tmp_path), "--json")
    [[found]] = [one["differences"] for one in json.loads(done.stdout)["results"]]
    assert (done.returncode, "symbol 2 of column 0" in found["said"]) == (1, True)
    parts = ("only", str(1 - symbol), str(symbol))
    assert (found["place"], found["stored"], found["computed"]) == parts


def test_zeros_have_no_sign(tmp_path: Path) -> None:
    written(tmp_path, changed("r: [1, 1, 0]", "r: [1, 0, 0]", SMALL), "small.yaml")
    done = call(tmp_path, "describe", "small", "--json")
    assert "-0.0," not in done.stdout.replace("\n", ",")


def test_a_code_gives_a_phase(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbolic, "find_orbit", remembered(symbolic.find_orbit))
    asked = ("--code", "0^12 1^11", "--digits", "12")
    # As where a search takes long.
    monkeypatch.setattr(workers, "SILENCE", 0)
    done = succeeded(tmp_path, "find", "fig4", *asked)
    assert "theta2_0 to" in done.stderr
    # Lines that go on in the next one begin with spaces.
    lines = [line for line in done.stdout.splitlines() if not line.startswith(" ")]
    rows = dict(line.split(maxsplit=1) for line in lines)
    assert rows["address"].startswith(("a 0^12 1^11", "b 0^12 1^11"))
    assert rows["confirmed"].startswith("2 ")
    found = json.loads(call(tmp_path, "find", *asked, "--json").stdout)
    assert rows["theta2_0"].startswith(found["theta2_0"])
    assert len(found["theta2_0"].partition(".")[2]) in (11, 12)
    assert found["half_turns"] == [12, 11]
    assert len(found["crossing_time"]) == 3


def test_round_phases_are_listed(tmp_path: Path) -> None:
    done = call(tmp_path, "find", "fig4", "--code", "011", "--decimals", "1")
    rows = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    found = json.loads(call(tmp_path, "find", "--code", "011", "--decimals", "1", "--json").stdout)
    assert rows == {each["theta2_0"]: each["address"] for each in found["phases"]}
    assert found["tried"] == 63
    assert f"{len(rows)} of 63 phases" in done.stderr


def test_many_codes_say_how_many_are_done_and_long_ones_are_cut(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(workers, "SILENCE", 0)
    monkeypatch.setattr(find, "SHOWN", 4)
    codes = [x for code in ("0", "0^12 1^11", "0", "0^5 1^10") for x in ("--code", code)]
    done = call(tmp_path, "find", *codes, "--digits", "10", "-j", "1")
    assert "1 of 3 codes are done" in done.stderr
    assert "3 of 3 codes are done" in done.stderr
    first, long, none = (line.split()[:2] for line in done.stdout.splitlines()[:3])
    assert (first[0], long[0], none) == ("0", "0...", ["0...", "-"])
    assert done.returncode == 1, "the last has no orbit"
