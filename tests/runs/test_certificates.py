"""Certificates: written, read, checked again, and caught where they were changed."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import h5py
import numpy as np
import pytest

from rigidpend.results import store
from rigidpend.routes.certified.pieces import Step
from rigidpend.runs import certificate_files as storage
from rigidpend.runs import certificates, loading
from scripts import check_certificate
from tests.cli.calls import call, succeeded
from tests.config.samples import TINY, written

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


def test_it_is_checked_again_without_integration(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigidpend.routes.certified.approximation.Approximation", None)
    monkeypatch.setattr("rigidpend.orbits.integrate.crossings", None)
    done = succeeded(folder, "certify", "--check", FILE, "-j", "1", "--json")
    [[found]] = json.loads(done.stdout).values()
    assert found == {"array": "only", "orbits": 2, "symbols": 4, "proven": 4, "undecided": []}


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
    ("setting", "code", "anew"),
    [("problem.mu=0.001", "", False), ("problem.J1_0=1e-9", "", True), ("figure=4", "x", True)],
)
def test_only_another_problem_or_other_code_is_proven_anew(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    setting: str,
    code: str,
    anew: bool,
) -> None:
    (tmp_path / FILE).write_bytes((folder / FILE).read_bytes())
    config = loading.load(written(tmp_path, TINY, "tiny.yaml"), [setting])
    monkeypatch.setattr(certificates, "Parts", Mock(side_effect=Proving))
    if code:
        monkeypatch.setattr(certificates, "code_hash_of", lambda _: code)
    told: list[str] = []
    with pytest.raises(Proving) if anew else contextlib.nullcontext():
        certificates.certify(config, tmp_path, jobs=1, report=told.append)
    assert ["is up to date" in line for line in told] == [True] * (not anew)


def test_steps_survive_packing() -> None:
    step = Step(3 << 30, 70, [[(-1) ** j * (1 << 9 * j) - i for j in range(5)] for i in range(6)])
    orbits = [[step], [], [step, step._replace(bits=9)]]
    assert storage.unpacked(storage.packed(orbits)) == orbits


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


def test_symbols_are_marked_and_held_against_their_own_proof_alone(folder: Path) -> None:
    certificate = storage.read(folder / FILE)
    stated = certificate["config"] | {"figure": "", "numerics": {"precisions": [53]}}

    def told(group: Any, proof: Any = certificate, where: str = "data", **config: Any) -> Any:
        """What is marked in an array, or level, of a result, and what contradicts its proof."""
        data = {"only": group} if where == "data" else {where: {"only": group}}
        result: Any = {"config": {**stated, **config}, "data": data}
        marked = storage.marked(result, proof)["data"]
        marks = marked.get(where, marked)["only"].get("proven")
        said = storage.contradictions(result, proof)
        return None if marks is None else marks.tolist(), said

    codes = certificate["data"]["only"]["codes"].copy()
    only = {"codes": codes, "certain": codes < 2, "theta2_0": np.array([1, 1.1])}
    assert told(only) == ([[True, True], [True, True]], [])
    other = {**only, "theta2_0": np.array([1, 1.7])}
    assert told(other) == (None, ["only: the certificate is of other phases"])
    [of_another_body] = told(only, problem=stated["problem"] | {"mu": "1/500"})[1]
    assert "another problem" in of_another_body
    assert told(only, problem={})[0] is None
    codes[1, 0] ^= 1
    said = ["only: symbol 2 of column 0 is proven to be another"]
    assert told(only) == ([[True, True], [False, True]], said)
    assert told({**only, "certain": codes > 1})[1] == []
    # What neither knows is not proven.
    proven, unknown = certificate["data"]["only"], {"codes": codes * 0 + 255}
    nothing = {**certificate, "data": {"only": {**proven, **unknown}}}
    assert told({**only, **unknown}, nothing) == ([[False, False], [False, False]], [])
    # A single route, and a level of a zoom, which is told by its centre to the last digit.
    single = {"codes": proven["codes"][:, :1], "theta2_0": proven["theta2_0"][:1]}
    one = {**certificate, "data": {"only": single}}
    route = {"codes": codes[:, 0], "certain": np.ones(2, dtype=bool), "theta2_0": np.float64(1)}
    assert told(route, one) == ([True, False], said)
    level = {"codes": codes[:, 0], "certain": route["certain"], "centre": "1"}
    assert told(level, one, "levels") == ([True, False], said)
    level["centre"] = f"1.{30 * '0'}1"
    assert told(level, one, "levels") == (None, ["only: the certificate is of another centre"])
