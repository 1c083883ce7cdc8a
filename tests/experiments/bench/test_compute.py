"""The experiment `bench` in small: what it keeps, what it cuts, and how a run goes on."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rigidpend import render
from rigidpend.cli.measure import bench_command
from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import compute as bench
from rigidpend.experiments.bench import report as reading
from rigidpend.experiments.bench.compute import by_worker
from rigidpend.experiments.bench.methods import METHODS
from rigidpend.experiments.bench.problems import SEED, drawn
from rigidpend.experiments.contract import Means
from rigidpend.orbits.integrate.arithmetic import CLOSED_FORM, EngineError
from rigidpend.results import store
from rigidpend.runs import loading, runner
from tests.experiments.trees import CONFIGS, asked
from tests.orbits.integrate.problems import needs_heyoka

pytestmark = [pytest.mark.slow, needs_heyoka("the references in 113 bits")]
"""Most tests look at the one result of a small run."""

SMALL = [
    "problem.problems=[pendulum, codes]",
    "problem.methods=[closed_form, route_codes, aligned_batch, scipy_dop853, diffrax]",
    "problem.columns=2",
    "problem.n_symbols=2",
    "search.tolerances=[1e-4, 1e-9]",
    "meeting.rounds=2",
    "search.slowest=100",
    "phases.methods=[route_codes, diffrax]",
    "phases.orbits=5",
    "bodies.methods=[route_codes_auto, heyoka_principal, diffrax]",
    "bodies.kept=1",
    "bodies.drawn=1",
    "bodies.orbits=6",
    "bodies.seconds=1",
    "bodies.longest=60",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(autouse=True, scope="module")
def undrawn() -> Any:
    """The figure has tests of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render, "render", lambda _, target: target.write_text("drawn"))
        yield


def here(work: Any, given: Any, budgets: float) -> Any:
    """What a worker would tell, told by this process: each takes a second to begin."""
    return list(work(*given)), ""


def called(folder: Path, *words: str) -> Any:
    settings = [x for setting in SMALL for x in ("--set", setting)]
    return CliRunner().invoke(bench_command, ["--quick", "--out", str(folder), *settings, *words])


@pytest.fixture(scope="module")
def said(folder: Path) -> Any:
    """What the command prints, run in small; diffrax is made absent, closed forms have a worker."""
    with pytest.MonkeyPatch.context() as patch:
        lacking = METHODS["diffrax"]._replace(libraries=("no_such_library",))
        patch.setitem(METHODS, "diffrax", lacking)
        patch.setattr(
            bench, "by_worker", lambda *x: (by_worker if x[1][1] == "closed_form" else here)(*x)
        )
        done = called(folder, "--json")
    assert done.exit_code == 0, done.output
    return done


@pytest.fixture(scope="module")
def data(said: Any, folder: Path) -> Any:
    return store.load(folder / "bench_quick.h5")["data"]


def test_the_command_prints_one_json_document_and_draws(said: Any, folder: Path) -> None:
    found = json.loads(said.stdout)
    assert set(found["data"]) >= {"meetings", "pendulum", "codes", "random_phases"}
    assert found["machine"]["processor"]
    assert (folder / "bench_quick.png").read_text() == "drawn"
    assert "reference" in said.stderr


def test_every_method_that_answers_has_a_record_or_is_said_to_be_absent(
    data: Any, said: Any
) -> None:
    assert set(data["pendulum"]) & set(METHODS) == {"closed_form", "aligned_batch", "diffrax"}
    assert data["codes"]["route_codes"]["wrong_symbols"].tolist() == [0]
    assert data["codes"]["aligned_batch"]["error"][-1] < 1e-3
    assert data["pendulum"]["closed_form"]["error"][0] < 1e-12
    assert data["pendulum"]["aligned_batch"]["tolerance"].tolist() == [1e-4, 1e-9]
    absent = "absent: no_such_library is not installed"
    assert data["pendulum"]["diffrax"] == data["codes"]["diffrax"] == {"ended": absent}
    assert absent in said.stderr
    assert f"diffrax, jitted and vmapped: {absent}." in reading.losses_table(data).note


def test_methods_meet_with_one_thread_and_with_two(data: Any) -> None:
    one, two = data["meetings"]["threads_1"], data["meetings"]["threads_2"]
    both = {"route_codes", "aligned_batch", "ended"}
    assert set(one["codes"]) == set(two["codes"]) == both
    assert set(one["pendulum"]) == {"closed_form", "aligned_batch", "ended"}
    assert "pendulum" not in two, "one alone gains from a second thread"
    assert one["codes"]["route_codes"]["rounds"].shape == (2,)
    assert one["codes"]["ended"] == two["codes"]["ended"] == "complete"


def test_symbols_are_counted_on_random_phases_and_with_bodies_that_are_told(data: Any) -> None:
    for phases in data["random_phases"].values():
        assert set(phases) == {"route_codes"}, "what is absent is left out"
        assert phases["route_codes"]["symbols"] == 5 * 15
        assert phases["route_codes"]["wrong_trusted"] == phases["route_codes"]["undecided"] == 0
    group = data["bodies"]
    assert group["ended"] == "complete"
    assert "diffrax" not in group
    assert group["route_codes_auto"]["orbits"].tolist() == [6] * 2
    assert (group["heyoka_principal"]["symbols"] == group["route_codes_auto"]["symbols"]).all()
    assert group["route_codes_auto"]["wrong_trusted"].tolist() == [0] * 2
    for k, problem in enumerate((*drawn(SEED, 1), *drawn(1, 1))):
        assert [group[f"A{i + 1}"][k] for i in range(3)] == [float(x) for x in problem.body.A]
        assert (group["mu"][k], group["h0"][k]) == (float(problem.body.mu), float(problem.h0))


def test_a_result_that_is_up_to_date_is_not_measured_again(said: Any, folder: Path) -> None:
    again = called(folder)
    assert again.exit_code == 0, again.output
    assert "is up to date" in again.stderr
    assert again.stdout.index("faster than ours") < again.stdout.index("Random phases")


def test_an_interrupted_run_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = ["problem.problems=[pendulum]", "problem.methods=[closed_form, aligned_batch]"]
    few += ["phases.methods=[]", "bodies.kept=0", "bodies.drawn=0"]
    planned = runner.plan(
        loading.load(CONFIGS / "measure" / "bench_quick.yaml", [*SMALL, *few]), tmp_path
    )
    begun: list[str] = []

    def breaking(work: Any, given: Any, budgets: float) -> Any:
        begun.append(f"{work.__name__} {given[1]}")
        if len(begun) in (2, 4):
            raise KeyboardInterrupt
        return here(work, given, budgets)

    monkeypatch.setattr(bench, "by_worker", breaking)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            runner.run(planned, jobs=1, report=lambda _: None)
    # What follows the search of both is their meeting.
    found = ["search closed_form", *["search aligned_batch"] * 2, "meeting pendulum"]
    assert begun == found
    # Without a body that is drawn there is no group of them.
    runner.run(planned, jobs=1, report=lambda _: None)
    assert not store.load(planned.target)["data"].get("bodies")


def test_without_heyoka_there_is_no_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(principal_axes, "installed", lambda: False)
    with pytest.raises(EngineError, match="heyoka"):
        bench.compute(asked("bench_quick"), Means(CLOSED_FORM))
