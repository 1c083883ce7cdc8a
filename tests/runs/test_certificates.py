"""Certificates: written, read, checked again, and caught where they were changed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend.machine.progress import tell_nobody
from rigidpend.results import store
from rigidpend.routes.certified.pieces import Step
from rigidpend.runs import certificate_files as storage
from rigidpend.runs import certificates, loading
from scripts import check_certificate
from tests.cli.calls import call, succeeded
from tests.config.samples import SMALL, changed, written

TINY = changed("count: 5", "count: 2", changed("n_symbols: 3", "n_symbols: 2", SMALL))
FILE = "tiny.certificate.h5"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("certified")
    written(made, TINY, "tiny.yaml")
    assert call(made, "run", "tiny.yaml", "--out", ".").returncode == 0
    done = succeeded(made, "certify", "tiny.yaml", "--out", ".", "-j", "1")
    assert done.stdout == "tiny: only: 4 of 4 symbols of 2 orbits proven\n"
    return made


def test_a_certificate_holds_what_is_proven_exactly_of_which_orbits(folder: Path) -> None:
    told = storage.read(folder / FILE)
    group = told["data"]["only"]
    assert [str(x) for x in group["theta2_0"]] == ["1", "1.1"]
    assert set(told["attributes"]) == {"format", "format_version"}
    assert told["config"]["problem"]["n_symbols"] == len(group["codes"]) == 2
    result = store.load(folder / "tiny.h5")["data"]["only"]
    assert np.array_equal(group["codes"], result["codes"])
    assert told["provenance"]["version_python_flint"]
    assert not list(folder.glob(".*"))


@pytest.mark.slow
def test_a_certificate_may_have_a_name_of_its_own(folder: Path, tmp_path: Path) -> None:
    given = ("--set", "problem.J1_0=1e-9", "--name", "lower", "-j", "1")
    done = call(folder, "certify", "tiny.yaml", *given, "--out", str(tmp_path))
    assert done.stdout == "lower: only: 4 of 4 symbols of 2 orbits proven\n", done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["lower.certificate.h5"]
    done = call(folder, "certify", "tiny.yaml", "fig4", *given)
    assert (done.returncode, "--name is for one config" in done.stderr) == (2, True)


def test_it_is_checked_again_without_integration(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("rigidpend.routes.certified.approximation", "rigidpend.orbits.integrate"):
        monkeypatch.setattr(
            f"{name}.Approximation" if "cert" in name else f"{name}.crossings", None
        )
    done = succeeded(folder, "certify", "--check", FILE, "-j", "1", "--json")
    [[found]] = json.loads(done.stdout).values()
    assert found == {"array": "only", "orbits": 2, "symbols": 4, "proven": 4, "undecided": []}


def test_what_is_up_to_date_is_left_alone(folder: Path) -> None:
    before = (folder / FILE).stat().st_mtime_ns
    done = call(folder, "certify", "tiny.yaml", "--out", ".", "-j", "1")
    assert "up to date" in done.stderr
    assert (folder / FILE).stat().st_mtime_ns == before


def altered(certificate: Path, target: Path, change: Callable[[Any], object]) -> Path:
    """A copy of a certificate with a change, without its seal."""
    image = certificate.read_bytes()
    with h5py.File.in_memory(image[: image.rindex(b"\nrigidpend sha256 ")]) as file:
        change(file)
        file.flush()
        target.write_bytes(file.id.get_file_image())
    return target


class Proving(Exception):
    """A proof that begins."""


@pytest.mark.parametrize(
    ("setting", "code"), [("problem.J1_0=1e-9", ""), ("problem.mu=0.001", "x")]
)
def test_another_problem_and_other_code_are_proven_anew(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, setting: str, code: str
) -> None:
    def begin(*_: Any) -> None:
        raise Proving

    (tmp_path / FILE).write_bytes((folder / FILE).read_bytes())
    config = loading.load(written(tmp_path, TINY, "tiny.yaml"), [setting])
    monkeypatch.setattr(certificates, "Parts", begin)
    if code:
        monkeypatch.setattr(certificates, "code_hash_of", lambda _: code)
    with pytest.raises(Proving):
        certificates.certify(config, tmp_path, jobs=1, report=tell_nobody)


def test_steps_survive_packing() -> None:
    step = Step(3 << 30, 70, [[(-1) ** j * (1 << 9 * j) - i for j in range(5)] for i in range(6)])
    orbits = [[step], [], [step, step._replace(bits=9)]]
    assert storage.unpacked(storage.packed(orbits)) == orbits


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ("", 2, ""),
        (f"tiny.yaml --check {FILE}", 2, ""),
        ("fig1", 2, "no route codes to prove"),
        ("fig4_zoom --out .", 3, "rigidpend run fig4_zoom"),
        ("--check tiny.h5", 1, "tiny.h5: neither a certificate, which rigidpend certify writes"),
        ("--check absent.h5", 3, ""),
    ],
)
def test_wrong_usage_and_what_is_no_certificate_are_said(
    folder: Path, arguments: str, code: int, said: str
) -> None:
    done = call(folder, "certify", *arguments.split())
    assert (done.returncode, said in done.stderr) == (code, True)


@pytest.mark.slow
def test_both_checkers_prove_a_zoom_by_a_factor_of_many_digits(tmp_path: Path) -> None:
    """As it is kept: a quotient of whole numbers."""
    zoom = ("fig4_zoom", "--set", "problem.levels=2", "--set", "problem.count=3")
    given = (*zoom, "--set", "problem.n_symbols=1", "--name", "zoom", "--out", ".", "-j", "1")
    for command in ("run", "certify"):
        done = call(tmp_path, command, *given)
        assert done.returncode == 0, done.stderr
    file = tmp_path / "zoom.certificate.h5"
    assert len(storage.read(file)["config"]["problem"]["factor"]) > 20
    done = call(tmp_path, "certify", "--check", file.name)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("3 of 3 symbols of 3 orbits proven") == 2
    *_, last = check_certificate.check(file)
    assert last == "proven: 6 symbols, all that the certificate claims"


@pytest.mark.parametrize("place", ["start", "step"])
def test_a_number_of_a_grid_is_one_by_itself(place: str) -> None:
    """Not only between brackets."""
    grid = {"start": "0", "step": "1", "count": 1, place: "0) + (1"}
    problem = {"experiment": "route_codes", "problem": {"arrays": {"one": grid}}}
    with pytest.raises(check_certificate.Refused, match="is no number"):
        check_certificate.phases_of(problem, {})


@pytest.mark.slow
def test_verify_counts_what_is_proven_and_finds_a_contradiction(
    folder: Path, tmp_path: Path
) -> None:
    written(tmp_path, TINY, "tiny.yaml")
    for name in ("tiny.h5", FILE):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    arguments = ("verify", "tiny.yaml", "--reference", ".", "--results", ".")
    done = succeeded(tmp_path, *arguments)
    assert "4 symbols are proven" in done.stdout

    def turn_a_symbol(file: Any) -> None:
        file["data/only/codes"][1, 0] ^= 1

    altered(folder / FILE, tmp_path / FILE, turn_a_symbol)
    done = call(tmp_path, *arguments)
    assert done.returncode == 1
    assert "symbol 2 of column 0 is proven to be another" in done.stdout


def test_a_single_route_is_held_against_its_proof_too(folder: Path) -> None:
    certificate = storage.read(folder / FILE)
    group = certificate["data"]["only"]
    proof = {"codes": group["codes"][:, :1], "theta2_0": group["theta2_0"][:1]}
    one: Any = {**certificate, "data": {"only": proof}}
    route = {
        "codes": proof["codes"][:, 0].copy(),
        "certain": np.ones(2, dtype=bool),
        "theta2_0": np.float64(1),
    }
    result: Any = {"config": certificate["config"], "data": {"only": route}}
    assert storage.contradictions(result, one) == []
    assert storage.marked(result, one)["data"]["only"]["proven"].tolist() == [True, True]
    route["codes"][1] ^= 1
    assert len(storage.contradictions(result, one)) == 1
    assert storage.marked(result, one)["data"]["only"]["proven"].tolist() == [True, False]
    # A level of a zoom is told by its centre, to the last digit.
    level = {key: x for key, x in route.items() if key != "theta2_0"} | {"centre": "1"}
    levels: Any = {**result, "data": {"levels": {"only": level}}}
    marked = storage.marked(levels, one)["data"]["levels"]["only"]["proven"]
    assert marked.tolist() == [True, False]
    level["centre"] = f"1.{30 * '0'}1"
    assert "proven" not in storage.marked(levels, one)["data"]["levels"]["only"]
    assert storage.contradictions(levels, one) == ["only: the certificate is of another centre"]
