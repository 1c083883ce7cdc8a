"""The experiment `bench` in small: what it keeps, what it cuts, and how a run goes on."""

import json
from pathlib import Path
from types import SimpleNamespace
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

SMALL = [
    "problem.methods=[route_codes, aligned_batch, cyrk]",
    "problem.columns=2",
    "problem.n_symbols=2",
    "search.tolerances=[1e-4, 1e-9]",
    "search.slowest=100",
    "meeting.rounds=2",
    "meeting.seconds=50",
    "phases.orbits=5",
    "phases.seconds=50",
    "bodies.methods=[route_codes, heyoka_principal, cyrk]",
    "bodies.kept=1",
    "bodies.drawn=1",
    "bodies.orbits=6",
    "bodies.seconds=1",
    "bodies.longest=60",
]
BUDGETS = {
    # Tolerances, and the slowest that is waited for; then two starts of random phases.
    "alone route_codes": 100.0 + 2 * 50.0,
    "alone aligned_batch": 2 * 100.0 + 2 * 50.0,
    "meeting": 2 * 50.0,
    # Two bodies: ours, one peer, and the truth, which has four times as long.
    "bodies": 2 * (60.0 + 1.0 + 4.0),
}


def here(work: Any, given: Any, _: float) -> Any:
    """What a worker would tell, told by this process: each takes a second to begin."""
    return list(work(*given)), ""


def named(work: Any, given: Any) -> str:
    return " ".join([work.__name__, *(x for x in given[1:2] if isinstance(x, str))])


def called(folder: Path, *words: str) -> Any:
    settings = [x for setting in SMALL for x in ("--set", setting)]
    done = CliRunner().invoke(bench_command, ["--quick", "--out", str(folder), *settings, *words])
    assert done.exit_code == 0, done.output
    return done


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A small run, and its command once more.

    CyRK is made absent, `route_codes` has a worker; the figure has tests of its own.
    """
    folder, budgets = tmp_path_factory.mktemp("bench"), {}

    def counted(work: Any, given: Any, budget: float) -> Any:
        name = named(work, given)
        budgets[name] = budget
        return (by_worker if name == "alone route_codes" else here)(work, given, budget)

    with pytest.MonkeyPatch.context() as patch:
        lacking = METHODS["cyrk"]._replace(libraries=("no_such_library",))
        patch.setitem(METHODS, "cyrk", lacking)
        patch.setattr(bench, "by_worker", counted)
        patch.setattr(render, "render", lambda _, target: target.write_text("drawn"))
        said, again = called(folder, "--json"), called(folder)
    data, figure = store.load(folder / "bench_quick.h5")["data"], folder / "bench_quick.png"
    return SimpleNamespace(said=said, again=again, data=data, figure=figure, budgets=budgets)


def test_the_command_prints_one_json_document_and_draws(ran: Any) -> None:
    found = json.loads(ran.said.stdout)
    assert set(found["data"]) == {"fig4", "meeting", "random_phases", "bodies"}
    assert ran.again.stdout.startswith(f"{found['machine']['processor']}, ")
    assert ran.figure.read_text() == "drawn"
    assert "truth: done" in ran.said.stderr
    # What is up to date is not measured again.
    assert "is up to date" in ran.again.stderr
    assert ran.again.stdout.index("faster than ours") < ran.again.stdout.index("Random phases")


def test_a_worker_has_a_budget_for_all_that_it_measures(ran: Any) -> None:
    assert ran.budgets == BUDGETS


def test_every_method_has_a_record_or_is_said_to_be_absent(ran: Any) -> None:
    found = ran.data["fig4"]
    assert found["route_codes"]["wrong_symbols"].tolist() == [0]
    assert found["aligned_batch"]["tolerance"].tolist() == [1e-4, 1e-9]
    loose, tight = found["aligned_batch"]["error"]
    assert tight < min(loose / 50, 1e-3)
    absent = "absent: no_such_library is not installed"
    assert found["cyrk"] == {"ended": absent}
    assert f"CyRK, compiled by numba: {absent}." in reading.losses_table(ran.data).note


def test_methods_meet_and_their_symbols_are_counted(ran: Any) -> None:
    """On random phases and with bodies; what is absent is left out."""
    meeting = ran.data["meeting"]
    assert set(meeting) == {"route_codes", "aligned_batch", "ended"}
    assert meeting["route_codes"]["rounds"].shape == (2,)
    assert meeting["ended"] == "complete"
    for phases in ran.data["random_phases"].values():
        assert set(phases) == {"route_codes", "aligned_batch"}
        assert phases["route_codes"]["symbols"] == 5 * 15
        assert phases["route_codes"]["wrong_trusted"] == phases["route_codes"]["undecided"] == 0
    group = ran.data["bodies"]
    assert group["ended"] == "complete"
    assert "cyrk" not in group
    assert group["route_codes"]["orbits"].tolist() == [6] * 2
    assert (group["heyoka_principal"]["symbols"] == group["route_codes"]["symbols"]).all()
    assert group["route_codes"]["wrong_trusted"].tolist() == [0] * 2
    for k, problem in enumerate((*drawn(SEED, 1), *drawn(1, 1))):
        assert [group[f"A{i + 1}"][k] for i in range(3)] == [float(x) for x in problem.body.A]
        assert (group["mu"][k], group["h0"][k]) == (float(problem.body.mu), float(problem.h0))


def test_an_interrupted_run_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = ["problem.methods=[route_codes, aligned_batch]", "bodies.kept=0", "bodies.drawn=0"]
    config = loading.load(CONFIGS / "measure" / "bench_quick.yaml", [*SMALL, *few])
    planned, begun = runner.plan(config, tmp_path), []

    def breaking(work: Any, given: Any, budgets: float) -> Any:
        begun.append(named(work, given))
        if len(begun) in (2, 4):
            raise KeyboardInterrupt
        return ([], "late") if work.__name__ == "meeting" else here(work, given, budgets)

    monkeypatch.setattr(bench, "by_worker", breaking)
    monkeypatch.setattr(render, "render", lambda *_: None)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            runner.run(planned, jobs=1, report=lambda _: None)
    runner.run(planned, jobs=1, report=lambda _: None)
    # What follows both is their meeting.
    assert begun == ["alone route_codes", *["alone aligned_batch"] * 2, "meeting", "meeting"]
    data = store.load(planned.target)["data"]
    assert data["meeting"] == {"ended": "late: 0 of 2"}
    # Without a body that is drawn there is no group of them.
    assert not data.get("bodies")


def test_without_heyoka_there_is_no_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(principal_axes, "installed", lambda: False)
    with pytest.raises(EngineError, match="heyoka"):
        bench.compute(asked("bench_quick"), Means(CLOSED_FORM))
