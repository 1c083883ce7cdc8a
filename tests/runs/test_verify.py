"""`verify`: what it finds, how it says so, and that other builds pass."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import h5py
import numpy as np
import pytest

from rigidpend.cli import verify
from rigidpend.experiments import compare
from rigidpend.experiments.shared import TIME_GAP, crossing_tolerance
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem, phase_rate
from rigidpend.runs import certificate_files, loading, references
from tests.cli.calls import Done, call
from tests.config.samples import changed


def called(*arguments: str) -> Done:
    return call(Path.cwd(), "verify", *arguments)


READ = ("configs/small.yaml", "--results", "results")
MEND = "call: rigidpend reference configs/other.yaml --reason WHY"


SAME = "small: the same as in results/reference/small.h5\n"


@pytest.mark.slow
def test_a_recomputed_and_a_read_result_are_the_same_and_files_are_left_as_they_were(
    desk: Path,
) -> None:
    def state() -> Iterator[tuple[Path, int, bytes]]:
        for path in sorted(desk.rglob("*.*")):
            yield path, path.stat().st_mtime_ns, path.read_bytes() if path.is_file() else b""

    before, lines = list(state()), list[str]()
    done = called(*READ)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", SAME)
    config, stored = loading.load(Path("configs/small.yaml")), Path("results/reference/small.h5")
    assert references.verify(config, stored, jobs=1, report=lines.append) == []
    assert any(line.startswith("only: 5 orbits") for line in lines)
    assert list(state()) == before


def edit(file: Any) -> None:
    """Change what the file consists of, its config and its values, in a place of each kind."""
    file.attrs.update({"extra": 1, "tolerance": 1.0})
    del file["data/only/codes"].attrs["description"]
    file["config"][()] = changed('"mu": "1/1000"', '"mu": "1/7"', file["config"].asstr()[()])
    only = file["data/only"]
    only["codes"].attrs["units"] = "rad"
    only["codes"][1, 2] = 1 - only["codes"][1, 2]
    only["crossing_time"][2, 0] = np.nan
    only["theta2_0"][3] += 1e-12


EDITED = (
    "/@extra: stored 1, computed (absent)",
    "/@tolerance: stored 1, computed ",
    "/data/only/codes@units: stored rad, computed 1",
    "/data/only/codes@description: stored (absent), computed ",
    "config/problem/mu: stored 1/7, computed 1/1000",
    "only/codes[1, 2]: stored ",
    "only/crossing_time[2, 0]: stored nan, computed ",
    "only/theta2_0[3]: stored ",
)


def provenance(file: Any) -> None:
    """Change all that tells how a result was made, and the name of its figure."""
    file["config"][()] = changed('"figure": ""', '"figure": "5"', file["config"].asstr()[()])
    told = dict.fromkeys(("name", "code_hash", "reasons"), "another")
    # Tolerances of another engine are others.
    file.attrs.update({**told, "engine": "scipy 1", "tolerance": 1.0})
    file["provenance"].attrs.update({"processor": "another", "further": 1})


ARRAYS = ("bits", "certain", "codes", "crossing_time", "melnikov_zeros", "separatrix", "theta2_0")
OTHER = tuple(
    f"/data/{name}{end} is only {where}"
    for name, where in (("only", "computed"), ("other", "stored"))
    for end in ("", *(f"/{array}" for array in ARRAYS))
)


UNFIT = "rigidpend: results/reference/small.h5: not a result that can be used: "


@pytest.mark.parametrize(
    ("change", "code", "found", "said"),
    [
        (edit, 1, EDITED, ""),
        (provenance, 0, (), ""),
        # What has no counterpart is a difference, and its values are not compared.
        (lambda file: file.move("data/only", "data/other"), 1, OTHER, ""),
        (lambda file: file.create_group("data/only/inner"), 1, None, f"{UNFIT}data/only/inner is"),
        (lambda file: file.pop("data/only/bits"), 1, None, f"{UNFIT}data/only/bits is absent"),
    ],
)
def test_every_change_is_found_and_only_that(
    desk: Path, change: Any, code: int, found: tuple[str, ...] | None, said: str
) -> None:
    with h5py.File(desk / "results" / "reference" / "small.h5", "a") as file:
        change(file)
    done = called(*READ)
    assert done.returncode == code
    lines = done.stdout.splitlines()[1:]
    assert len(lines) == len(found or ())
    for start in found or ():
        assert sum(line.startswith(f"  {start}") for line in lines) == 1, start
    mend = "; call: rigidpend reference configs/small.yaml --reason WHY\n"
    assert done.stderr.startswith(said)
    assert done.stderr.endswith(mend if said else "")
    assert done.stderr.count("\n") == bool(said)
    if code == 0 or found:
        verdict = "differs from results/reference/small.h5\n" if found else SAME[7:]
        assert done.stdout.startswith(f"small: {verdict}")


@pytest.mark.usefixtures("desk")
def test_values_that_no_comparison_takes_are_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    for error in (KeyError("x"), ValueError("x"), ZeroDivisionError("x")):
        monkeypatch.setattr(compare, "differences", Mock(side_effect=error))
        done = called(*READ)
        assert (done.returncode, done.stdout) == (1, "")
        assert "results/reference/small.h5: cannot be compared: " in done.stderr


def test_a_difference_is_told_with_both_values_and_what_is_allowed(desk: Path) -> None:
    with h5py.File(desk / "results" / "reference" / "small.h5", "a") as file:
        right = float(file["data/only/crossing_time"][2, 3])
        file["data/only/crossing_time"][2, 3] = right + 1e-6
    done = called(*READ, "--json")
    assert (done.returncode, done.stderr) == (1, "")
    [[found]] = [one["differences"] for one in json.loads(done.stdout)["results"]]
    assert found["place"] == "only/crossing_time[2, 3]"
    assert float(found["computed"]) == right
    assert float(found["stored"]) == right + 1e-6
    assert found["allowed"] == crossing_tolerance(4)[2]
    assert found["said"].endswith(f"(may differ by {found['allowed']:.2g})")


def test_the_certificate_is_that_beside_the_result_that_is_read(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificate_files, "beside", beside := Mock(return_value=None))
    monkeypatch.setattr(references, "verify", Mock(return_value=[]))
    for given in (READ, READ[:1]):
        assert called(*given).returncode == 0
    asked = [str(call.args[0]) for call in beside.call_args_list]
    assert asked == ["results/small.h5", "results/reference/small.h5"]


def test_what_is_absent_is_said_and_keeps_no_other_from_being_compared(desk: Path) -> None:
    shutil.copy("configs/small.yaml", "configs/other.yaml")
    said = f"results/reference/other.h5: there is no such file; {MEND}"
    done = called("configs/other.yaml", *READ)
    assert (done.returncode, done.stdout, done.stderr) == (3, SAME, f"rigidpend: {said}\n")
    done = called("configs/other.yaml", *READ, "--json")
    document = json.loads(done.stdout)
    assert (done.returncode, document["same"]) == (3, False)
    other, small = document["results"]
    assert (small["name"], small["same"], small["error"]) == ("small", True, None)
    assert (other["name"], other["same"], other["differences"]) == ("other", False, [])
    assert other["error"] == said
    done = called("configs/small.yaml", "--results", "none")
    absent = "none/small.h5: there is no such file; call: rigidpend run small --out none"
    assert (done.returncode, done.stderr) == (3, f"rigidpend: {absent}\n")


def test_a_folder_of_ones_own_hides_no_reference_of_the_package(desk: Path) -> None:
    done = called("fig1", "--json")
    [found] = json.loads(done.stdout)["results"]
    assert found["same"]
    assert found["reference"].endswith("results/reference/fig1.h5")
    assert Path(found["reference"]).is_absolute()


@pytest.mark.slow
def test_all_are_compared_if_none_is_named_and_strays_are_told(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify, "resolve", lambda *_: [Path("configs/small.yaml")])
    assert called("--results", "results").returncode == 0
    shutil.copy("results/reference/small.h5", "results/reference/stray.h5")
    for given in ((), ("all",)):
        done = called(*given, "--results", "results")
        assert done.returncode == 1
        assert done.stderr == "rigidpend: results/reference/stray.h5: no config has this name\n"
    assert called(*READ).returncode == 0


def test_the_tolerance_grows_with_the_passages_and_stays_below_what_symbols_need() -> None:
    allowed = crossing_tolerance(16)[:, 0]
    assert allowed.shape == (16,)
    assert (np.diff(allowed) >= 0).all()
    assert allowed[0] == 1e-12
    assert allowed[-1] == TIME_GAP
    # A symbol turns over when the phase errs by a radian.
    problem = RouteProblem(Body((2, 1, "1.5"), (1, 1, 0), "1e-3"), exact("1.3342"), exact(1e-8), 1)
    assert TIME_GAP * phase_rate(problem) < 0.1
