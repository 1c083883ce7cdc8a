"""Experiments of one's own: names, results as configs, sweeps, documents of failures."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from rigidpend import render
from rigidpend.results import store
from tests.cli.calls import call, succeeded
from tests.config.samples import SMALL, TINY, changed, written

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
        assert store.config(path)["problem"]["mu"] == stored
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
    by_file, by_name = str(tmp_path / "mine_mu=1e-2.h5"), ("mine_mu=1e-3", "--out", str(tmp_path))
    for given in ((by_file,), by_name):
        assert "4 of 4 symbols" in succeeded(swept, "certify", *given).stdout
    compared = succeeded(swept, "verify", by_file, "--results", str(tmp_path)).stdout
    assert compared.endswith("; 4 symbols are proven\n")
    assert len(list(tmp_path.glob("*.certificate.h5"))) == 2
    assert not list(swept.glob("results/*.certificate.h5"))


@pytest.mark.slow
def test_other_numerics_are_compared_with_the_stored_result(swept: Path) -> None:
    assert call(swept, "run", "mine", "--out", "kept").returncode == 0
    given = ("--reference", "kept", "--set", "numerics.tolerance=1e-13")
    done = call(swept, "verify", "mine", *given)
    assert (done.returncode, done.stdout.count("the same as in")) == (0, 1), done.stdout


def test_a_setting_that_some_configs_do_not_know_is_said_with_their_names(tmp_path: Path) -> None:
    done = call(tmp_path, "run", "fig4", "fig1", "fig2", "-n", "--set", "problem.J1_0=1e-10")
    assert done.returncode == 2
    heads = [line.partition(": --set ")[0] for line in done.stderr.splitlines()]
    assert heads == ["fig1", "fig2"]


def test_zeros_have_no_sign(tmp_path: Path) -> None:
    written(tmp_path, changed("r: [1, 1, 0]", "r: [1, 0, 0]", SMALL), "small.yaml")
    done = call(tmp_path, "describe", "small", "--json")
    assert "-0.0," not in done.stdout.replace("\n", ",")
