"""How it is measured: search within its budget, meeting in turn, symbols counted, the worker."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import compute, measure, problems
from rigidpend.experiments.bench.methods import METHODS, Entrant, Method
from rigidpend.experiments.bench.problems import FIG4, Crossed, Stage, Task
from rigidpend.experiments.bench.solvers import Solver
from rigidpend.experiments.contract import Means
from rigidpend.experiments.principal_axes import judged
from rigidpend.machine.workers import WorkerError
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.codes import codes_of
from tests.cli.calls import REFERENCE
from tests.experiments.trees import asked
from tests.remembered import remembered

SHORT = replace(FIG4, n_symbols=2)


def asking(**parts: Any) -> Any:
    made = {k: SimpleNamespace(**x) if isinstance(x, dict) else x for k, x in parts.items()}
    return SimpleNamespace(**made)


def given() -> Stage:
    """A problem of six orbits, of which any answer is right."""
    task = Task("motion", FIG4.body, np.arange(36.0).reshape(6, 6), np.full(6, 10.0))
    return Stage(task, {}, lambda _, __: {"error": 0.0})


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The clock of all timings, which goes on only when it is told to: the machine may be busy."""
    now = [0.0]
    for module in (measure, principal_axes):
        monkeypatch.setattr(module, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    return now


@pytest.fixture
def napping(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Any:
    """Methods that take as long as their entry says; what was made, and solved, is kept."""
    kept: Any = SimpleNamespace(made=[], solved=[])

    def make(name: str, task: Task, entry: Entrant, threads: int = 1) -> Solver:
        setting = entry.setting
        kept.made.append((name, threads))
        naps = setting.get("naps", {}).get(threads, setting.get("nap", 0.0)) + (
            entry.tolerance or 0.0
        )
        queue = iter(setting.get("queue", ()))

        def solve() -> None:
            kept.solved.append((name, threads))
            clock[0] += next(queue, naps)

        return Solver(solve)

    monkeypatch.setattr(measure, "made", make)
    return kept


def test_a_variant_is_tried_at_every_tolerance_until_it_takes_longer_than_a_meeting_waits(
    monkeypatch: pytest.MonkeyPatch, napping: Any
) -> None:
    """What took too long is told too; the other variant begins anew."""
    variants = {"nap": 0.01}, {"nap": 0.002}
    monkeypatch.setitem(METHODS, "napping", Method("napping", "others", variants=variants))

    def lines(slowest: float) -> Any:
        asked: Any = SimpleNamespace(tolerances=[0.001, 0.0005, 0.0001], slowest=slowest)
        rows = list(measure.settings(given(), "napping", asked))
        return [(row["setting"], row["tolerance"], pytest.approx(row["seconds"])) for row in rows]

    first = [(0, 0.001, 0.011), (0, 0.0005, 0.0105), (0, 0.0001, 0.0101)]
    second = [(1, 0.001, 0.003), (1, 0.0005, 0.0025), (1, 0.0001, 0.0021)]
    assert lines(9.0) == [*first, *second]
    assert lines(0.0109) == [*first[:1], *second]


def test_the_median_of_several_solves_counts_and_not_the_fastest(
    monkeypatch: pytest.MonkeyPatch, napping: Any
) -> None:
    """Solves of 1, 5 and 2 seconds by the clock, behind one that warms up."""
    variants = ({"queue": (7.0, 1.0, 5.0, 2.0)},)
    monkeypatch.setitem(METHODS, "queued", Method("queued", "others", (), None, (), variants))
    asked: Any = SimpleNamespace(slowest=1e9)
    [line] = measure.settings(given(), "queued", asked)
    assert line["seconds"] == 2.0


def meeting(monkeypatch: pytest.MonkeyPatch, settings: Any, seconds: float) -> Any:
    """Four rounds of methods that take so long, of which `single` uses one thread."""
    for name in settings:
        monkeypatch.setitem(METHODS, name, Method(name, "others", threads=name != "single"))
    monkeypatch.setattr(problems, "stage", lambda *_: given())
    entries = {name: Entrant(None, x) for name, x in settings.items()}
    config = asking(meeting={"rounds": 4, "seconds": seconds}, problem=None)
    return list(measure.meeting(config, "free_body", entries, {"free_body": {}}))


def test_with_two_threads_a_method_takes_one_where_that_is_faster(
    monkeypatch: pytest.MonkeyPatch, napping: Any
) -> None:
    """Solvers of one thread are made once; who gains nothing from a second one stays away."""
    naps = {"lone": {1: 0.1, 2: 0.4}, "shared": {1: 0.4, 2: 0.3}, "single": {1: 0.2}}
    settings = {name: {"naps": x} for name, x in naps.items()}
    found = meeting(monkeypatch, settings, 9.0)
    two_threads = [("lone", 2), ("shared", 2)]
    assert [(x["method"], x["most"]) for x in found] == [*((x, 1) for x in naps), *two_threads]
    first = [name for name, _ in napping.solved[:9]]
    turned = ["shared", "single", "lone"]
    assert first == [*naps, *naps, *turned], "all warm up; then the order turns"
    last = napping.solved[-8:]
    assert last.count(("lone", 1)) == last.count(("shared", 2)) == 4
    assert napping.made == [*((x, 1) for x in naps), *two_threads]


def test_who_has_spent_his_time_misses_the_rounds_that_are_left(
    monkeypatch: pytest.MonkeyPatch, napping: Any
) -> None:
    slow, quick, *_ = meeting(monkeypatch, {"slow": {"nap": 0.03}, "quick": {"nap": 0.001}}, 0.05)
    assert np.isnan(slow["rounds"]).tolist() == [False, False, True, True]
    assert quick["rounds"] == pytest.approx([0.001] * 4)


def test_a_short_solve_counts_when_it_has_been_made_in_its_turn_before(
    monkeypatch: pytest.MonkeyPatch, napping: Any
) -> None:
    """What takes 10 ms and more counts at once; the first solve of all warms up."""
    queue = (1.0, 0.0099, 0.001, 0.0099, 0.002, 0.0101, 0.0099, 0.003)
    found = meeting(monkeypatch, {"short": {"queue": queue}, "long": {"nap": 0.02}}, 9.0)
    assert found[0]["rounds"] == pytest.approx([0.001, 0.002, 0.0101, 0.003])
    assert found[1]["rounds"] == pytest.approx([0.02] * 4)


def searching(*tolerances: Any) -> Any:
    sizes, search = {"orbits": 2, "turns": 1}, {"tolerances": tolerances, "slowest": 1.0}
    config = asking(problem=sizes, search=search)
    return config, "scipy_dop853", {"pendulum": {"states": np.ones((6, 2))}}


def test_a_failure_of_a_method_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wrong = ZeroDivisionError("no number")

    def make(_: str, task: Task, entry: Entrant) -> Solver:
        if entry.tolerance == 1e-6:
            raise wrong
        return Solver(lambda: task.states)

    monkeypatch.setattr(measure, "made", make)
    measured, failed = measure.search(*searching(1e-3, 1e-6))
    assert measured["tolerance"] == 1e-3, "what was measured before"
    assert failed["failed"] == "ZeroDivisionError: no number"


def test_a_worker_says_how_a_method_failed_and_ends_by_a_fault_of_ours(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def at_once(work: Any, given: Any, hear: Any, _: float) -> str:
        try:
            return work(*given, hear)
        except TypeError as error:
            return f"raised: {error}"

    def failing(error: Exception) -> Any:
        yield {"x": 1.0}
        raise error

    monkeypatch.setattr(compute, "apart", at_once)
    for error, ended in (
        (ValueError("no number"), "failed: ValueError: no number"),
        (TypeError("a slip"), "raised: a slip"),
    ):
        assert compute.by_worker(failing, (error,), 1.0) == ([{"x": 1.0}], ended)


@pytest.mark.parametrize(
    ("error", "ended"),
    [
        (None, ""),
        (TimeoutError("ended at 3 s"), "ended at 3 s"),
        (WorkerError("it was killed"), "failed: it was killed"),
    ],
)
def test_a_worker_s_end_is_told_and_what_it_had_is_kept(
    monkeypatch: pytest.MonkeyPatch, error: Exception | None, ended: str
) -> None:
    before = dict(os.environ)

    def apart(work: Any, given: Any, hear: Any, limit: float) -> str:
        hear({"x": given})
        assert limit == compute.PATIENCE * 2.0 + compute.GRACE
        assert os.environ["OMP_NUM_THREADS"] == "1"
        assert not list(Path(os.environ["XDG_CACHE_HOME"]).iterdir())
        if error:
            raise error
        return ""

    monkeypatch.setattr(compute, "apart", apart)
    assert compute.by_worker(iter, ("x",), 2.0) == ([{"x": (iter, ("x",))}], ended)
    assert dict(os.environ) == before


def test_a_worker_has_a_budget_for_each_setting_at_each_problem_and_for_each_guest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    several = METHODS["aligned_batch"]._replace(variants=({}, {}, {}))
    monkeypatch.setitem(METHODS, "aligned_batch", several)
    monkeypatch.setattr(principal_axes, "installed", lambda: True)
    # Closed forms answer one of the problems, and have no tolerance.
    told: dict[tuple[str, str], float] = {}
    line = {"tolerance": 1e-9, "setting": 0, "error": 0.0, "seconds": 0.1}

    def late(work: Any, given: Any, budgets: float) -> Any:
        told[work.__name__, given[1]] = budgets
        found = [line | {"problem": x} for x in given[2]] if work is measure.search else []
        return found, "late"

    def part(name: str, work: Any) -> Any:
        return {} if name.startswith("reference.") else work()

    monkeypatch.setattr(compute, "by_worker", late)
    few = ["problem.problems=[free_body, pendulum]", "problem.methods=[closed_form, aligned_batch]"]
    few += ["phases.methods=[]", "bodies.kept=0", "bodies.drawn=0", "meeting.seconds=0.5"]
    config = asked("bench_quick", *few, "search.tolerances=[1e-3, 1e-9]", "search.slowest=0.5")
    met = compute.compute(config, Means(part=part))["meetings"]
    assert told == {
        ("search", "closed_form"): 0.5,
        ("search", "aligned_batch"): 6.0,
        ("meeting", "pendulum"): 2.0,
    }
    late_one = {"pendulum": {"ended": "late"}}
    assert met == {"threads_1": late_one, "threads_2": late_one}


def sleeping(clock: list[float], each: float, n_symbols: int) -> Any:
    """A method that takes so many seconds for an orbit, and doubts the first one."""

    def made(_: str, task: Task, __: Any) -> Solver:
        n = task.states.shape[1]

        def solve() -> Crossed:
            clock[0] += n * each
            codes, certain = np.zeros((n_symbols, n), dtype=np.uint8), np.arange(n) > 0
            return Crossed(codes, np.zeros((n_symbols + 1, n)), certain[None])

        return Solver(solve)

    return made


ROUTES = remembered(codes_of)


def route(task: Task, turned: int = -1) -> Crossed:
    """What integration finds, with one symbol of the column `turned` turned over."""
    found = ROUTES(task.problem, task.theta2_0, resolve())
    codes = found.codes.copy()
    if turned in range(codes.shape[1]):
        codes[1, turned] ^= 1
    return Crossed(codes, found.crossing_time, found.certain)


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Any:
    """Lines of methods with bodies; the method `wrong` errs in column 3; who was called with what.

    Each orbit takes 2 ms by the clock, the first time with a body so many seconds more; in
    principal axes an orbit takes `dear`, and in 64 bits is told `rough`, if that is not right.
    """

    def run(names: str, *sizes: float, **more: Any) -> Any:
        seen, called = set(), []

        def made(name: str, task: Task, entry: Any, threads: int) -> Solver:
            def solve() -> Crossed:
                n = task.states.shape[1]
                called.append((name, n, float(task.times.max())))
                anew = (name, task.body) not in seen
                clock[0] += 2e-3 * n + more.get("first", 0.0) * anew
                seen.add((name, task.body))
                return route(task, 3 if name == more.get("wrong") else -1)

            return Solver(solve)

        def told(problem: Any, phases: Any, *, bits: int, jobs: int) -> Any:
            clock[0] += more.get("dear", 0.01)
            right = route(problems.from_phases(problem, phases)).codes
            return 1 - right if bits == 64 and more.get("rough") else right

        monkeypatch.setattr(measure, "made", made)
        offered = more.get("bits", (64, 113))
        monkeypatch.setattr(principal_axes, "offers", offered.__contains__)
        monkeypatch.setattr(principal_axes, "codes", told)
        bodies = more.get("bodies", [SHORT])
        monkeypatch.setattr(problems, "drawn", lambda _, n: bodies[:n])
        asked = dict(zip(("orbits", "seconds", "longest"), sizes, strict=True))
        config = asking(bodies={"kept": len(bodies), "drawn": 0, "seed": 0, **asked})
        return list(measure.bodies(config, dict.fromkeys(names.split(), Entrant()))), called

    return run


@pytest.mark.parametrize(("wrong", "rough"), [("peer", True), ("ours", False)])
def test_where_two_methods_differ_more_bits_tell_which_is_right(
    lines: Any, wrong: str, rough: bool
) -> None:
    [line], called = lines("ours peer", 40, 0.061, 1.0, wrong=wrong, rough=rough, dear=8e-3)
    # Sixteen orbits of a pilot take 32 ms: 61 ms are enough for thirty.
    assert (line["ours"]["orbits"], line["peer"]["orbits"]) == (40, 30)
    for name in ("ours", "peer"):
        assert line[name]["symbols"] == 2 * line["peer"]["orbits"], "what both computed"
        assert (line[name]["wrong_trusted"], line[name]["undecided"]) == (name == wrong, 0)
    assert (line["peer"]["first"], line["peer"]["again"]) == pytest.approx((0.06, 0.06))
    assert line["body"] == [2, 1, 1.5, *[0.5**0.5] * 2, 0.001, 1.3342, 1e-8]
    # Both are called with another body first: what any body needs is not told of this one.
    assert [x[:2] for x in called[:3]] == [("ours", 1), ("ours", 40), ("peer", 16)]
    last = route(problems.random_routes(SHORT, 40)).time.max()
    end = called[-1][2] * problems.time_unit(SHORT.body)
    assert last < end < 1.01 * last, "the horizon of a peer"


@pytest.mark.parametrize(
    ("seconds", "more"),
    [
        (-1.0, {}),
        # Thirty times 41 ms, in 113 bits, are more than four times 0.3 s.
        (0.3, {"rough": True, "dear": 0.041}),
        # 113 bits may not be offered, nor 64.
        (1.0, {"rough": True, "bits": (64,)}),
        (1.0, {"bits": ()}),
    ],
)
def test_what_nobody_could_settle_in_time_is_not_counted(
    lines: Any, seconds: float, more: Any
) -> None:
    [line], _ = lines("ours peer", 20, seconds, 9.0, wrong="peer", **more)
    assert line["peer"]["orbits"] > 3
    for name in ("ours", "peer"):
        # Column 3 is the first in doubt: what is behind it would be without its like.
        assert (line[name]["symbols"], line[name]["wrong_trusted"]) == (2 * 3, 0)


def test_a_first_call_that_takes_longer_than_a_peer_may_is_followed_by_another(lines: Any) -> None:
    """Ours builds maps in its first call with a body."""
    other = replace(SHORT, body=Body((2, 1, "1.4"), (1, 1, 0), "0.001"))
    [line], _ = lines("ours", 3, 0.15, 9.0, first=5.0, bodies=[other])
    assert (line["ours"]["first"], line["ours"]["again"]) == pytest.approx((5.006, 0.006))


@pytest.mark.parametrize(("longest", "n"), [(0.04, 40), (0.039, 20), (1e-3, 10)])
def test_ours_follows_as_many_orbits_as_it_is_expected_to_in_its_time(
    lines: Any, monkeypatch: pytest.MonkeyPatch, longest: float, n: int
) -> None:
    """An orbit is expected to take 1 ms; few are followed in any case."""
    monkeypatch.setattr(measure, "expected_seconds", lambda _, orbits: 1e-3 * orbits)
    [line], _ = lines("ours", 40, 9.0, longest)
    assert line["ours"]["orbits"] == n


def phases(made: Any, monkeypatch: pytest.MonkeyPatch, chunk: int, *sizes: float) -> Any:
    monkeypatch.setattr(measure, "made", made)
    monkeypatch.setattr(measure, "CHUNK", chunk)
    config = asking(phases=dict(zip(("orbits", "seconds"), sizes, strict=True)))
    return list(measure.random_phases(config, "x", Entrant()))


def test_symbols_of_random_phases_are_held_against_113_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A symbol turned over in each chunk is one wrong symbol of each."""
    lines = phases(lambda _, task, __: Solver(lambda: route(task, 2)), monkeypatch, 20, 40, 1e9)
    assert [line["J1_0"] for line in lines] == ["1e-6", "1e-10"]
    for line in lines:
        assert (line["orbits"], line["symbols"]) == (40, 600)
        assert (line["wrong_trusted"], line["undecided"]) == (2, 0)


@pytest.mark.parametrize(("seconds", "orbits"), [(5.9, 30), (6.1, 40), (99, 45)])
def test_no_further_chunk_of_random_phases_is_begun_after_the_time_that_there_is(
    monkeypatch: pytest.MonkeyPatch, clock: list[float], seconds: float, orbits: int
) -> None:
    """An orbit takes 0.2 s; what is solved before the clock runs does not count."""
    for line in phases(sleeping(clock, 0.2, 15), monkeypatch, 10, 45, seconds):
        assert (line["orbits"], line["seconds"]) == (orbits, pytest.approx(0.2 * orbits))


@pytest.mark.slow
def test_orbits_of_fig5_end_half_a_passage_behind_their_last_crossing() -> None:
    """Rounded to whole t'."""
    task = problems.precession_angle(None)
    times = route(task).time
    behind = task.times * problems.time_unit(task.body) - times[-1]
    np.testing.assert_allclose(behind, (times[-1] - times[-2]) / 2, rtol=0, atol=0.501)


def test_free_bodies_turn_both_ways_about_both_axes() -> None:
    M = problems.free_body(SimpleNamespace(orbits=4, turns=1)).states[:3]
    assert [np.sign(M[k % 2, k]) for k in range(4)] == [1, 1, -1, -1]


def test_a_wrong_symbol_that_a_method_does_not_vouch_for_is_wrong_and_not_trusted() -> None:
    codes, certain = np.array([[0, 1, 1]]), np.array([[True, True, False]])
    answer = Crossed(codes.astype(np.uint8), np.zeros((2, 3)), certain)
    expected = {"symbols": 3, "wrong_symbols": 2, "wrong_trusted": 1, "undecided": 1}
    assert judged(answer, np.zeros((1, 3))) == expected
    assert judged(answer._replace(certain=None), np.zeros((1, 3)))["wrong_trusted"] == 2


def test_orbits_and_bodies_drawn_by_lot_are_the_same_in_every_run() -> None:
    """The first bodies are those of the stored measurement."""
    one, more = problems.random_routes(SHORT, 5), problems.random_routes(SHORT, 9)
    np.testing.assert_array_equal(one.states, more.of(np.arange(5)).states)
    bodies = problems.drawn()
    assert set(bodies).isdisjoint(problems.drawn(problems.SEED + 1, 3))
    drawn = []
    for problem in bodies:
        A, r, mu = problem.body.floats()
        drawn.append([*A, *r[:2], mu, float(problem.h0), float(problem.J1_0)])
    names = ("A1", "A2", "A3", "r1", "r2", "mu", "h0", "J1_0")
    with h5py.File(REFERENCE.parent / "measured" / "bench.h5") as file:
        stored = np.array([file["data/bodies"][name][: len(drawn)] for name in names])
    np.testing.assert_array_equal(np.array(drawn).T, stored)
