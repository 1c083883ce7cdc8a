"""What a certificate may ask for of memory and steps, and a proof of work and words."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import Body, certify_codes
from rigidpend.results import store
from rigidpend.routes.certified import codes
from rigidpend.routes.certified.pieces import ORBIT_STEPS
from rigidpend.runs import certificate_files as storage
from rigidpend.runs import loading
from tests.attacks import lot
from tests.config.samples import FIG4
from tests.processes import python

NAME = "bomb.certificate.h5"
SETTINGS = ["problem.n_symbols=1", "problem.arrays={one: {start: 0, step: 1, count: 1}}"]
RESOLVED = loading.load(FIG4, SETTINGS).resolved()
CONFIG = {key: RESOLVED[key] for key in ("experiment", "problem")}
CHECKED = f"""
import resource, sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from pathlib import Path
import h5py
import rigidpend.runs.certificates as certificates
from scripts import check_certificate
used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 2**29, used + 2**29))
for name in sys.argv[1:]:
    try:
        certificates.check(Path(name), jobs=1, report=print)
    except certificates.store.StoreError as error:
        print(error)
    try:
        list(check_certificate.check(Path(name)))
    except check_certificate.Refused as error:
        print(error)
"""
"""Both checkers, with half a gigabyte more than they need for themselves."""


def bomb(steps: int, terms: int) -> dict[str, Any]:
    """The fields of a certificate of many steps that are all zeros, which compress to nothing."""
    made = {
        "theta2_0": np.array([b"0"]),
        "codes": np.array([[0]], dtype=np.uint8),
        "steps": np.array([steps], dtype=np.uint32),
        "half_lengths": np.full(steps, 1 << 20, dtype=np.uint64),
        "step_bits": np.full(steps, 60, dtype=np.uint16),
        "terms": np.full(steps, terms, dtype=np.uint16),
        "widths": np.ones(6 * steps * terms, dtype=np.uint16),
        "digits": np.zeros(6 * steps * terms, dtype=np.uint8),
    }
    assert made.keys() == {*storage.FIELDS, *storage.PROOF}
    return made


def written(folder: Path, fields: dict[str, Any]) -> Path:
    path = folder / NAME
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        file.attrs.update({"format": "rigidpend", "format_version": 1})
        node = file.create_dataset("config", data=json.dumps(CONFIG))
        node.attrs.update({"units": "", "description": "resolved config, JSON"})
        file.create_group("provenance")
        group = file.create_group("data/one", track_order=True)
        for name, values in fields.items():
            made = group.create_dataset(name, data=values, compression="gzip", shuffle=True)
            field = {**storage.FIELDS, **storage.PROOF}[name]
            made.attrs.update({"units": field.units, "description": field.description})
    return path


def sizes() -> list[tuple[int, int]]:
    """Steps and terms of bombs: many of one, many of both, and some by lot."""
    with lot.drawn("bombs") as chance:
        drawn = [round(10 ** chance.uniform(3.5, 6)) for _ in range(lot.trials(0, 0.005))]
    return [(1_000_000, 1), (4_000, 500), *((n, 2_000_000 // n) for n in drawn)]


@pytest.mark.slow
def test_a_bomb_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    # Some kilobytes, of which millions of numbers would be made: in lists, a gigabyte.
    names = []
    for k, size in enumerate(sizes()):
        path = written(tmp_path, bomb(*size))
        assert path.stat().st_size < 2**20
        names.append(path.rename(tmp_path / f"{k}.{NAME}").name)
    done = python(tmp_path, "-c", CHECKED, *names)
    assert (done.returncode, done.stderr) == (0, "")
    said = done.stdout.splitlines()
    assert len(said) == 2 * len(names)
    for line in said:
        assert any(x in line for x in ("too large", "steps", "coefficients", "size allows")), line


def test_more_than_its_bytes_can_hold_or_a_prover_takes_is_refused(tmp_path: Path) -> None:
    most = written(tmp_path, bomb(1000, 1)).stat().st_size // storage.EACH
    for steps, terms, said in (
        (1000, 1, rf"1000 steps, .* has {most} at most"),
        (50, 1000, r"300000 coefficients, .* at most"),
    ):
        with pytest.raises(store.StoreError, match=said):
            storage.read(written(tmp_path, bomb(steps, terms)))
    with pytest.raises(store.StoreError, match=f"number of steps of an orbit is {ORBIT_STEPS + 1}"):
        storage.unpacked(bomb(ORBIT_STEPS + 1, 1))


def test_numbers_out_of_range_are_refused_with_their_names() -> None:
    good = bomb(2, 3)
    for name, wrong, said in (
        ("half_lengths", 2**63, "half-length"),
        ("half_lengths", 0, "half-length"),
        ("step_bits", 60_000, "bits of a step is 60000, not 1 to 4096"),
        ("terms", 0, "terms of a step is 0"),
        ("terms", 4097, "terms of a step is 4097"),
        ("widths", 0, "width of a coefficient is 0"),
        ("widths", 1025, "width of a coefficient is 1025"),
    ):
        bad = {**good, name: good[name] * 0 + good[name].dtype.type(wrong)}
        with pytest.raises(store.StoreError, match=said):
            storage.unpacked(bad)
    assert len(storage.unpacked(good)[0]) == 2


@pytest.mark.slow
def test_work_without_hope_is_not_begun_and_its_size_is_said() -> None:
    # Beside a symmetric body a passage takes thousands of units of time, and so of bits.
    body = Body(A=("1.8869", "0.943", "1.886"), r=(1, 1, 0), mu="0.001")
    found = certify_codes(body, ["3.8153"], h0="0.11", J1_0="1e-40", n_symbols=2)
    assert found.status == ["undecided"]
    assert "asks for about" in found.reason[0]
    assert "times the work that an orbit may take" in found.reason[0]
    assert not found.proven.any()


def test_a_proof_ends_where_its_work_is_spent(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []
    monkeypatch.setattr(codes, "MOST_WORK", 4 * 60**2)
    monkeypatch.setattr(codes, "BETWEEN", 0.0)
    body = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
    found = certify_codes(
        body, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=2, bits=60, report=lines.append
    )
    assert found.status == ["undecided"]
    assert "no more work than these" in found.reason[0]
    assert lines
    assert all(x.startswith("theta2_0 = 0.3: step ") and " to go" in x for x in lines)


def test_what_is_left_follows_from_what_was_done(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 10.0, 11.0, 30.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    lines: list[str] = []
    # Bits fall to nothing, so that 30 steps from 100 bits cost a third of 30 x 100^2.
    seen = codes.ProofProgress("x", 30, 100, lines.append)
    assert seen.step(100)
    assert seen.step(100)
    assert seen.step(100)
    assert lines == [
        "x: step 1 of about 30, 100 bits left, about 90 s to go",
        "x: step 3 of about 30, 100 bits left, about 70 s to go",
    ]
