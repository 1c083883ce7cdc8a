"""`verify`: what it finds, how it says so, and that other builds pass."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from rigidpend.cli import main, verify
from rigidpend.experiments.compare import Difference
from rigidpend.experiments.shared import APART, crossing_tolerance
from rigidpend.machine.progress import tell_nobody
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.results import store
from rigidpend.routes.problem import RouteProblem, phase_rate
from rigidpend.runs import loading, regression, runner
from tests.config.samples import SMALL, changed, written


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a config, its reference and a result of it, all not to be changed."""
    desk = tmp_path_factory.mktemp("desk")
    (desk / "configs").mkdir()
    loaded = loading.load(written(desk / "configs", SMALL, "small.yaml"))
    regression.renew(loaded, desk / "results" / "reference" / "small.h5", "first", jobs=1)
    runner.run(runner.plan(loaded, desk / "results"), jobs=1, report=tell_nobody)
    return desk


@pytest.fixture
def copy(desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same for one test alone, as the working directory."""
    shutil.copytree(desk, tmp_path / "desk")
    monkeypatch.chdir(tmp_path / "desk")
    return tmp_path / "desk"


def called(*arguments: str) -> Any:
    return CliRunner().invoke(main, ["verify", *arguments])


READ = ("configs/small.yaml", "--results", "results")
MEND = "call: rigidpend reference configs/other.yaml --reason WHY"


@pytest.mark.slow
def test_a_recomputed_and_a_read_result_are_the_same(copy: Path) -> None:
    for arguments in (READ, READ[:1]):
        done = called(*arguments)
        assert (done.exit_code, done.stderr) == (0, "")
        assert done.stdout == "small: the same as in results/reference/small.h5\n"


def set_to(place: str, index: Any, change: Callable[[Any], Any]) -> Callable[[Any], None]:
    def act(file: Any) -> None:
        file[place][index] = change(file[place][index])

    return act


def more(file: Any) -> None:
    file.create_group("data/only/inner")


def less(file: Any) -> None:
    del file["data/only/bits"]


def other_kind(file: Any) -> None:
    values = file["data/only/codes"][()]
    attributes = dict(file["data/only/codes"].attrs)
    del file["data/only/codes"]
    file["data/only/codes"] = values.astype("i8")
    file["data/only/codes"].attrs.update(attributes)


def other_mu(file: Any) -> None:
    file["config"][()] = changed('"mu": "1/1000"', '"mu": "1/7"', file["config"].asstr()[()])


def attribute(place: str, name: str, value: Any = None) -> Callable[[Any], None]:
    def act(file: Any) -> None:
        file[place].attrs.pop(name, None)
        if value is not None:
            file[place].attrs[name] = value

    return act


CODES = "data/only/codes"
TIME = "data/only/crossing_time"
CHANGES: list[dict[str, Any]] = [
    {
        "/@engine: stored (absent), computed (present)": attribute("/", "engine"),
        "/@extra: stored 1, computed (absent)": attribute("/", "extra", 1),
        "/@figure: stored 5, computed ": attribute("/", "figure", "5"),
        "/data/only@note: stored hello, computed (absent)": attribute("data/only", "note", "hello"),
        "/data/only/codes@description: stored (absent), computed symbols": attribute(
            CODES, "description"
        ),
        "/data/only/codes@units: stored rad, computed 1": attribute(CODES, "units", "rad"),
        "config/problem/mu: stored 1/7, computed 1/1000": other_mu,
        "only/codes[1, 2]: stored ": set_to(CODES, (1, 2), lambda x: 1 - x),
        "only/crossing_time[0, 1]: stored ": set_to(TIME, (0, 1), lambda x: x + 1e-11),
        "only/melnikov_zeros[1]: stored ": set_to("data/only/melnikov_zeros", 1, lambda x: -x),
        "only/separatrix[0, 4]: stored 3, computed 2": set_to(
            "data/only/separatrix", (0, 4), lambda _: 3
        ),
        "only/theta2_0[3]: stored ": set_to("data/only/theta2_0", 3, lambda x: x + 1e-12),
    },
    {
        "/@tolerance: stored 0.5, computed ": attribute("/", "tolerance", 0.5),
        "/data/only/codes@(kind): stored i8, computed u1": other_kind,
        "only/crossing_time[3, 1]: stored ": set_to(TIME, (3, 1), lambda x: x + 1e-5),
    },
    {"only/crossing_time[2, 0]: stored nan, computed ": set_to(TIME, (2, 0), lambda _: np.nan)},
]
"""Changes of one file, each with the line on it."""


@pytest.mark.slow
@pytest.mark.parametrize("changes", CHANGES)
def test_every_change_is_found_and_only_that(copy: Path, changes: dict[str, Any]) -> None:
    with h5py.File(copy / "results" / "reference" / "small.h5", "a") as file:
        for change in changes.values():
            change(file)
    done = called(*READ)
    assert done.exit_code == 1
    head, *found = done.stdout.splitlines()
    assert head == "small: differs from results/reference/small.h5"
    assert len(found) == len(changes)
    for said in changes:
        assert sum(line.startswith(f"  {said}") for line in found) == 1, said


@pytest.mark.parametrize(
    ("said", "change"),
    [
        ("data/only/inner is not a part of such results", more),
        ("data/only/bits is absent", less),
    ],
)
def test_a_reference_that_is_made_otherwise_is_said_to_be(
    copy: Path, said: str, change: Any
) -> None:
    with h5py.File(copy / "results" / "reference" / "small.h5", "a") as file:
        change(file)
    done = called(*READ)
    assert (done.exit_code, done.stdout) == (1, "")
    place = "rigidpend: results/reference/small.h5: not a result that can be used: "
    mend = "call: rigidpend reference configs/small.yaml --reason WHY"
    assert done.stderr == f"{place}{said}; {mend}\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["code_hash", "engine", "reasons"])
def test_what_made_a_result_is_not_compared(copy: Path, name: str) -> None:
    with h5py.File(copy / "results" / "reference" / "small.h5", "a") as file:
        file.attrs[name] = "taylor (another version)" if name == "engine" else "another"
        file["provenance"].attrs["processor"] = "another"
        file["provenance"].attrs["further"] = 1
    assert called(*READ).exit_code == 0


def test_the_worst_element_is_named_with_both_values_and_what_is_allowed(copy: Path) -> None:
    with h5py.File(copy / "results" / "reference" / "small.h5", "a") as file:
        times = file["data/only/crossing_time"]
        right = float(times[2, 3])
        # Not the largest gap is the worst, but the one furthest beyond what is allowed.
        times[3, 0] += 2e-6
        times[2, 3] += 1e-6
    done = called(*READ, "--json")
    assert (done.exit_code, done.stderr) == (1, "")
    [one] = json.loads(done.stdout)["results"]
    [found] = one["differences"]
    assert found["place"] == "only/crossing_time[2, 3]"
    assert float(found["computed"]) == right
    assert float(found["stored"]) == right + 1e-6
    assert found["allowed"] == crossing_tolerance(4)[2]
    assert found["said"].endswith(f"(may differ by {found['allowed']:.2g}, 2 of 20 differ)")


def test_json_is_one_document_whatever_happens(copy: Path) -> None:
    shutil.copy("configs/small.yaml", "configs/other.yaml")
    done = called("configs/small.yaml", "configs/other.yaml", "--json", "--results", "results")
    document = json.loads(done.stdout)
    assert (done.exit_code, document["same"]) == (3, False)
    small, other = document["results"]
    assert (small["name"], small["same"], small["error"]) == ("small", True, None)
    assert (other["name"], other["same"], other["differences"]) == ("other", False, [])
    assert other["error"] == f"results/reference/other.h5: there is no such file; {MEND}"


def test_one_absent_reference_does_not_keep_the_others_from_being_compared(copy: Path) -> None:
    shutil.copy("configs/small.yaml", "configs/other.yaml")
    done = called("configs/other.yaml", *READ)
    assert done.exit_code == 3
    assert done.stdout == "small: the same as in results/reference/small.h5\n"
    said = f"results/reference/other.h5: there is no such file; {MEND}"
    assert done.stderr == f"rigidpend: {said}\n"


def test_a_folder_of_ones_own_hides_no_reference_of_the_package(copy: Path) -> None:
    done = called("fig1", "--json")
    [found] = json.loads(done.stdout)["results"]
    assert found["same"]
    assert found["reference"].endswith("results/reference/fig1.h5")
    assert Path(found["reference"]).is_absolute()


@pytest.mark.slow
def test_all_are_compared_if_none_is_named_and_strays_are_told(
    copy: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify, "resolve", lambda *_: [Path("configs/small.yaml")])
    assert called("--results", "results").exit_code == 0
    shutil.copy("results/reference/small.h5", "results/reference/stray.h5")
    for given in ((), ("all",)):
        done = called(*given, "--results", "results")
        assert done.exit_code == 1
        assert done.stderr == "rigidpend: results/reference/stray.h5: no config has this name\n"
    assert called(*READ).exit_code == 0


def test_a_result_is_of_a_config_with_other_numerics_but_not_of_another_problem(copy: Path) -> None:
    """By what is asked, in whatever order: only the settings of numerics may be others."""
    own, stored = Path("configs/small.yaml"), Path("results/small.h5")
    assert regression.is_of(loading.load(own, ["numerics.precisions=[53, 106, 200]"]), stored)
    assert not regression.is_of(loading.load(own, ["problem.mu=0.002"]), stored)
    assert not regression.is_of(loading.load(own), Path("results/absent.h5"))


@pytest.mark.parametrize(
    ("difference", "size"),
    [
        (Difference("a", 1.0, 3.0), 2.0),
        (Difference("a", np.nan, 3.0), np.inf),
        (Difference("a", "one", "other"), np.inf),
        ("a is only stored", np.inf),
    ],
)
def test_what_is_no_number_is_a_difference_that_no_error_of_an_engine_excuses(
    difference: str, size: float
) -> None:
    assert regression._size(difference) == size


@pytest.mark.slow
def test_two_engines_are_compared_and_agree(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    engines = []
    verified = regression.verify

    def noted(config: Any, stored: Path, *, fresh: Path, **more: Any) -> list[str]:
        of = store.load(stored)["config"], store.load(fresh)["config"]
        engines.append([one["numerics"]["engine"] for one in of])
        return verified(config, stored, fresh=fresh, **more)

    monkeypatch.setattr(regression, "verify", noted)
    loaded = loading.load(Path("configs/small.yaml"))
    assert regression.verify_by_engines(loaded, jobs=1).differences == []
    assert engines == [["taylor", "scipy"]]


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", ["auto", "1e-7"])
def test_a_referee_accuses_of_what_is_more_than_its_own_error(
    copy: Path, monkeypatch: pytest.MonkeyPatch, tolerance: str
) -> None:
    """At 1e-7 DOP853 errs by more than is allowed; at its own tolerance it sees a late time."""
    compute = runner.run

    def late(planned: Any, **more: Any) -> str:
        told = compute(planned, **more)
        if planned.config.engine == "taylor" and tolerance == "auto":
            with h5py.File(planned.target, "a") as file:
                file["data/only/crossing_time"][2, 1] += 1e-6
        return told

    monkeypatch.setattr(regression, "run", late)
    given = ("--set", "problem.mu=0.002", "--set", f"numerics.tolerance={tolerance}", "--json")
    done = called("configs/small.yaml", *given)
    [found] = json.loads(done.stdout)["results"]
    if tolerance == "auto":
        assert done.exit_code == 1
        assert [one["place"] for one in found["differences"]] == ["only/crossing_time[2, 1]"]
    else:
        assert done.exit_code == 3
        assert found["differences"] == []
        assert found["tolerances"] == [1e-7, 1e-6]
        places = {one["place"].partition("[")[0] for one in found["undecided"]}
        assert places == {"only/crossing_time", "only/certain"}


@pytest.mark.slow
def test_files_are_left_as_they_were(copy: Path) -> None:
    def state() -> Iterator[tuple[Path, int, bytes]]:
        for path in sorted(copy.rglob("*.*")):
            yield path, path.stat().st_mtime_ns, path.read_bytes() if path.is_file() else b""

    before = list(state())
    assert called(*READ[:1]).exit_code == 0
    assert list(state()) == before


def test_the_tolerance_grows_with_the_passages_and_stays_below_what_symbols_need() -> None:
    allowed = crossing_tolerance(16)[:, 0]
    assert allowed.shape == (16,)
    assert (np.diff(allowed) >= 0).all()
    assert allowed[0] == 1e-12
    assert allowed[-1] == APART
    # A symbol turns over when the phase errs by a radian.
    problem = RouteProblem(Body((2, 1, "1.5"), (1, 1, 0), "1e-3"), exact("1.3342"), exact(1e-8), 1)
    assert APART * phase_rate(problem) < 0.1


def test_a_result_read_in_place_of_one_computed_must_be_there(copy: Path) -> None:
    done = called("configs/small.yaml", "--results", "none")
    assert done.exit_code == 3
    mend = "call: rigidpend run small --out none"
    assert done.stderr == f"rigidpend: none/small.h5: there is no such file; {mend}\n"
    assert store.attributes(copy / "results" / "small.h5")["name"] == "small"
