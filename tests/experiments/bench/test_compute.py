"""The experiment `bench` in small: what it keeps, what it cuts, and how runs are compared."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from rigidpend.cli import bench as command
from rigidpend.config import loading
from rigidpend.experiments.bench import compute as bench
from rigidpend.experiments.bench.schema import Config
from rigidpend.experiments.contract import Means
from rigidpend.integrate.engines import EngineError
from rigidpend.measure.benchmark import methods, problems, tables
from rigidpend.measure.benchmark.methods import METHODS
from rigidpend.measure.benchmark.worker import measured
from rigidpend.results import store
from rigidpend.run import runner
from tests.config.samples import content as typed
from tests.config.samples import refused
from tests.integrate.problems import needs_heyoka

pytestmark = pytest.mark.slow
"""Most tests look at the one result of a small run, which takes ten seconds."""

CONFIGS = Path(__file__).resolve().parents[3] / "configs" / "measure"
FULL, QUICK = (CONFIGS / f"{name}.yaml" for name in ("bench", "bench_quick"))
SMALL = [
    "problem.problems=[pendulum, codes, long_time]",
    "problem.methods=[closed_form, route_codes, aligned_batch, splitting_2, diffrax]",
    "problem.columns=2",
    "problem.n_symbols=2",
    "problem.periods=5",
    "scaling.methods=[route_codes]",
    "scaling.orbits=[1, 2]",
    "scaling.symbols=[1]",
    "scaling.seconds=5",
    "protocol.repeats=2",
    "protocol.tolerances=[1e-4, 1e-9]",
    "protocol.long_tolerances=[1e-9]",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="module")
def said(folder: Path) -> Any:
    """What the command prints, run in small; diffrax is made absent."""
    patch = pytest.MonkeyPatch()
    lacking = METHODS["diffrax"]._replace(libraries=("no_such_library",))
    patch.setitem(METHODS, "diffrax", lacking)
    settings = [x for setting in SMALL for x in ("--set", setting)]
    done = CliRunner().invoke(
        command.command, ["--quick", "--json", "--out", str(folder), *settings]
    )
    patch.undo()
    assert done.exit_code == 0, done.output
    return done


@pytest.fixture(scope="module")
def data(said: Any, folder: Path) -> Any:
    return store.load(folder / "bench_quick.h5")["data"]


@needs_heyoka
def test_the_command_prints_one_json_document_and_draws(said: Any, folder: Path) -> None:
    found = json.loads(said.stdout)
    assert set(found) >= {"machine", "pendulum", "codes", "long_time", "against_orbits"}
    assert found["machine"]["processor"]
    assert (folder / "bench_quick.png").stat().st_size > 10_000
    assert "reference" in said.stderr


@needs_heyoka
def test_every_method_that_answers_has_a_record(data: Any) -> None:
    assert set(data["pendulum"]) & set(METHODS) == {
        "closed_form", "aligned_batch", "splitting_2", "diffrax"
    }  # fmt: skip
    assert data["codes"]["route_codes"]["wrong_symbols"].tolist() == [0]
    assert data["codes"]["aligned_batch"]["error"][-1] < 1e-3
    assert data["pendulum"]["closed_form"]["error"][0] < 1e-12
    assert data["long_time"]["aligned_batch"]["reach"][-1] == pytest.approx(5)
    for record in (data["pendulum"]["closed_form"], data["codes"]["route_codes"]):
        assert (record["fastest"] <= record["seconds"]).all()
        assert (record["seconds"] <= record["slowest"]).all()
        assert (record["repeats"] >= 2).all()
        assert 0 < record["memory_before"] <= record["memory"].min()
    assert data["scaling"]["orbits"]["route_codes"]["columns"].tolist() == [1, 2]


@needs_heyoka
def test_an_absent_method_is_said_to_be_absent(data: Any, said: Any) -> None:
    for problem in ("pendulum", "codes", "long_time"):
        record = data[problem]["diffrax"]
        assert record == {"ended": "absent: no_such_library is not installed"}
    assert "absent: no_such_library is not installed" in said.stderr
    assert any("absent" in line for line in tables.text(data))


@needs_heyoka
def test_a_result_that_is_up_to_date_is_not_measured_again(said: Any, folder: Path) -> None:
    settings = [x for setting in SMALL for x in ("--set", setting)]
    again = CliRunner().invoke(command.command, ["--quick", "--out", str(folder), *settings])
    assert again.exit_code == 0, again.output
    assert "is up to date" in again.stderr
    assert "time to reach an error" in again.stdout


@needs_heyoka
def test_an_interrupted_run_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = [*SMALL, "problem.problems=[pendulum]", "problem.methods=[closed_form, splitting_2]"]
    planned = runner.plan(loading.load(QUICK, small), tmp_path)
    asked: list[str] = []

    def breaking(order: Any, limit: float) -> Any:
        asked.append(order.method)
        if asked.count("splitting_2") == 1 and order.method == "splitting_2":
            raise KeyboardInterrupt
        return measured(order, limit)

    monkeypatch.setattr(bench, "measured", breaking)
    with pytest.raises(KeyboardInterrupt):
        runner.run(planned, jobs=1, report=lambda _: None)
    runner.run(planned, jobs=1, report=lambda _: None)
    assert asked[:3] == ["closed_form", "splitting_2", "splitting_2"]


@needs_heyoka
def test_a_result_does_not_differ_from_itself_nor_by_its_times(data: Any) -> None:
    fresh = copy.deepcopy(data)
    fresh["codes"]["aligned_batch"]["seconds"] *= 100
    assert bench.differences(data, fresh) == []


@needs_heyoka
def test_a_larger_error_and_a_wrong_symbol_are_found(data: Any) -> None:
    fresh = copy.deepcopy(data)
    fresh["pendulum"]["aligned_batch"]["error"][1] *= 1e3
    fresh["codes"]["route_codes"]["wrong_symbols"][0] = 1
    second, first = bench.differences(data, fresh)
    assert first.startswith("pendulum, aligned_batch: at 1e-09 the error is")
    assert second == "codes, route_codes: at nan 1 symbols are wrong"
    del fresh["codes"]
    assert "problem codes is in one file only" in bench.differences(data, fresh)


def test_without_heyoka_there_is_no_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "default_engine", lambda: "scipy")
    means = Means()
    with pytest.raises(EngineError, match="heyoka"):
        bench.compute(typed(Config, QUICK), means)


@pytest.mark.parametrize("path", [FULL, QUICK], ids=["full", "quick"])
def test_describe_names_problems_and_methods(path: Path) -> None:
    content = typed(Config, path)
    rows = {row.name: row for row in bench.describe(content)}
    assert set(rows) >= {*problems.NAMES, *content.problem.methods}
    assert all(row.meaning for row in rows.values())


def test_the_full_config_asks_for_everything() -> None:
    content = typed(Config, FULL)
    assert content.problem.methods == tuple(methods.METHODS)
    assert content.protocol.repeats >= 5
    assert bench._sizes(content.problem) == problems.Sizes()
    assert float(content.protocol.long_seconds) == 60
    for key, method in METHODS.items():
        knobs = bench._knobs(method, content.protocol, False)
        assert method.knob == "none" or len(knobs) > 8, key
        assert all(x is None or x >= method.finest for x in knobs)


def test_the_cost_is_measured_at_the_loosest_knob_that_gets_all_symbols_right() -> None:
    protocol = typed(Config, FULL).protocol
    knobs = bench._knobs(METHODS["scipy_dop853"], protocol, False)
    wrong = np.ones(len(knobs))
    wrong[9:] = 0
    from rigidpend.results.tree import Dataset

    record = {"wrong_symbols": Dataset(wrong, "1", "")}
    assert bench._good(record, METHODS["scipy_dop853"], protocol) == knobs[9]
    assert bench._good(None, METHODS["scipy_dop853"], protocol) == knobs[-1]
    assert bench._good(None, METHODS["route_codes"], protocol) is None


@pytest.mark.parametrize(
    ("setting", "place", "message"),
    [
        ("problem.methods=[scipy_dop854]", "problem.methods", "no such method: 'scipy_dop854'"),
        ("problem.problems=[code]", "problem.problems", "no such problem: 'code'"),
        ("protocol.tolerances=[1e-9, 1e-3]", "protocol.tolerances", "expected tolerances that"),
        ("protocol.tolerances=[1]", "protocol.tolerances", "a tolerance is at most 0.1"),
        ("protocol.seconds=0", "protocol.seconds", "expected seconds, more than 0"),
        ("protocol.repeats=0", "protocol.repeats", "input should be greater"),
        ("scaling.orbits=[]", "scaling.orbits", "expected at least"),
        ("numerics.engine=scipy", "numerics", "unknown key"),
    ],
)
def test_a_config_that_cannot_be_is_refused(setting: str, place: str, message: str) -> None:
    [found] = refused(FULL, [setting])
    assert ".".join(map(str, found.place)) == place
    assert found.message.startswith(message)
