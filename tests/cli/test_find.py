"""`rigidpend find`: what it prints, and what it says where there is no orbit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rigidpend.cli import find
from rigidpend.machine import workers
from rigidpend.routes import symbolic
from tests.cli.calls import call, succeeded
from tests.remembered import remembered

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_a_code_gives_a_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbolic, "find_orbit", remembered(symbolic.find_orbit))
    asked = ("--code", "0^11 1^10", "--digits", "12")
    # As where a search takes long.
    monkeypatch.setattr(workers, "SILENCE", 0)
    done = succeeded(ROOT, "find", "fig4", *asked)
    assert "theta2_0 to" in done.stderr
    # Lines that go on in the next one begin with spaces.
    lines = [line for line in done.stdout.splitlines() if not line.startswith(" ")]
    rows = dict(line.split(maxsplit=1) for line in lines)
    assert rows["address"].startswith(("a 0^11 1^10", "b 0^11 1^10"))
    assert rows["confirmed"].startswith("2 ")
    found = json.loads(call(ROOT, "find", *asked, "--json").stdout)
    assert rows["theta2_0"].startswith(found["theta2_0"])
    assert found["half_turns"] == [11, 10]
    assert len(found["crossing_time"]) == 3


def test_round_phases_are_listed() -> None:
    done = call(ROOT, "find", "fig4", "--code", "011", "--decimals", "1")
    rows = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    found = json.loads(call(ROOT, "find", "--code", "011", "--decimals", "1", "--json").stdout)
    assert rows == {each["theta2_0"]: each["address"] for each in found["phases"]}
    assert found["tried"] == 63
    assert f"{len(rows)} of 63 phases" in done.stderr


def test_many_codes_say_how_many_are_done_and_long_ones_are_cut(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(workers, "SILENCE", 0)
    monkeypatch.setattr(find, "SHOWN", 4)
    codes = [x for code in ("0", "01111", "0", "0^5 1^10") for x in ("--code", code)]
    done = call(tmp_path, "find", *codes, "--digits", "10", "-j", "1")
    assert "1 of 3 codes are done" in done.stderr
    assert "3 of 3 codes are done" in done.stderr
    first, long, none = (line.split()[:2] for line in done.stdout.splitlines()[:3])
    assert (first[0], long[0], none) == ("0", "0...", ["0...", "-"])
    assert done.returncode == 1, "the last has no orbit"


def test_a_proof_that_cannot_be_written_is_told_of_its_own_option(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = call(tmp_path, "find", "--code", "0", "--proof", "file/x.orbit.certificate.h5")
    assert done.returncode == 1
    assert "choose another file with --proof" in done.stderr
    assert "--out" not in done.stderr
