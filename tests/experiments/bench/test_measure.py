"""How it is measured: search within its budget, meeting in turn, symbols counted, the worker."""

import itertools
import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import repeat
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
from rigidpend.experiments.bench.peers import Solver
from rigidpend.experiments.bench.problems import FIG4, Crossed, Task
from rigidpend.experiments.principal_axes import judged
from rigidpend.machine.workers import WorkerError
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.codes import codes_of
from tests.cli.calls import REFERENCE
from tests.remembered import remembered

SHORT = replace(FIG4, n_symbols=2)
PLAIN = Entrant()
"""What has no tolerance and no setting."""


def asking(**parts: Any) -> Any:
    made = {k: SimpleNamespace(**x) if isinstance(x, dict) else x for k, x in parts.items()}
    return SimpleNamespace(**made)


TASK = problems.fig4(3, 2)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The clock of all timings, which goes on only when it is told to: the machine may be busy."""
    now = [0.0]
    for module in (measure, principal_axes):
        monkeypatch.setattr(module, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    return now


@pytest.fixture
def napping(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> list[str]:
    """Methods whose solves take as long as their entry says, and which was solved."""
    solved = []

    def make(name: str, _: Task, entry: Entrant, threads: int = 1) -> Solver:
        naps = iter(entry.setting["naps"])

        def solve() -> None:
            solved.append(name)
            clock[0] += next(naps) + (entry.tolerance or 0.0)

        return Solver(solve)

    monkeypatch.setattr(measure, "ready", make)
    monkeypatch.setattr(problems, "errors", lambda *_: {"error": 0.0})
    return solved


@pytest.mark.usefixtures("napping")
def test_a_variant_is_tried_at_every_tolerance_until_it_takes_longer_than_a_meeting_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The median counts; what took too long is told too; the other variant begins anew."""
    # Behind a solve that warms up, solves of 1, 2 and 5 seconds by the clock.
    variants = {"naps": (7.0, 1.0, 2.0, 5.0)}, {"naps": (0.001,) * 4}
    monkeypatch.setitem(METHODS, "napping", Method("napping", "others", variants=variants))

    def lines(slowest: float) -> Any:
        asked: Any = SimpleNamespace(tolerances=[0.01, 0.005], slowest=slowest)
        rows = list(measure.search(TASK, {}, "napping", asked))
        return [(row["setting"], row["tolerance"], pytest.approx(row["seconds"])) for row in rows]

    second = [(1, 0.01, 0.011), (1, 0.005, 0.006)]
    assert lines(99.0) == [(0, 0.01, 2.01), (0, 0.005, 2.005), *second]
    assert lines(1.5) == [(0, 0.01, 1.01), (0, 0.005, 1.005), *second]
    assert lines(1.009) == [(0, 0.01, 1.01), *second]


@pytest.mark.parametrize(
    ("naps", "seconds", "rounds"),
    [
        # Who has spent his time misses the rounds that are left.
        (repeat(0.03), 0.05, [0.03, 0.03, np.nan, np.nan]),
        # What takes less than 10 ms counts when it has been made in its turn before.
        (
            (1.0, 0.0099, 0.001, 0.0099, 0.002, 0.0101, 0.0099, 0.003),
            9.0,
            [0.001, 0.002, 0.0101, 0.003],
        ),
    ],
)
def test_methods_meet_in_turn_for_some_rounds_within_a_budget(
    napping: list[str], naps: Any, seconds: float, rounds: list[float]
) -> None:
    """The first solve of all warms up; then the order turns."""
    each = {"single": naps, "other": repeat(0.011), "third": repeat(0.02)}
    entries = {name: Entrant(None, {"naps": x}) for name, x in each.items()}
    sizes, asked = {"columns": 2, "n_symbols": 2}, {"rounds": 4, "seconds": seconds}
    single, other, _ = measure.meeting(asking(problem=sizes, meeting=asked), entries, {})
    assert single["rounds"] == pytest.approx(rounds, nan_ok=True)
    assert other["rounds"] == pytest.approx([0.011] * 4)
    turns = [name for name, _ in itertools.groupby(napping)]
    assert turns[:6] == [*each, *each]
    assert turns[6:9] == ["other", "third", "single"]


@pytest.mark.parametrize(
    ("error", "failure", "ended"),
    [
        (None, None, ""),
        (TimeoutError("ended at 3 s"), None, "ended at 3 s"),
        (WorkerError("it was killed"), None, "failed: it was killed"),
        (None, ValueError("no number"), "failed: ValueError: no number"),
    ],
)
def test_a_worker_s_end_is_told_and_what_it_had_is_kept(
    monkeypatch: pytest.MonkeyPatch, error: Any, failure: Any, ended: str
) -> None:
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    before = dict(os.environ)

    def work(line: Any) -> Iterator[Any]:
        yield line
        if failure:
            raise failure

    def apart(told: Any, given: Any, hear: Any, limit: float) -> str:
        assert limit == compute.PATIENCE * 2.0 + compute.GRACE
        assert os.environ["OMP_NUM_THREADS"] == "1"
        assert not list(Path(os.environ["XDG_CACHE_HOME"]).iterdir())
        said: str = told(*given, hear)
        if error:
            raise error
        return said

    monkeypatch.setattr(compute, "apart", apart)
    assert compute.by_worker(work, ({"x": 1},), 2.0) == ([{"x": 1}], ended)
    assert dict(os.environ) == before
    # A slip of ours is no failure of a method.
    failure = TypeError("a slip")
    with pytest.raises(TypeError, match="a slip"):
        compute.by_worker(work, ({"x": 1},), 2.0)


ROUTES = remembered(codes_of)


def route(task: Task, turned: int = -1) -> Any:
    """What integration finds, with one symbol of the column `turned` turned over."""
    found = ROUTES(task.problem, task.theta2_0, resolve())
    codes = found.codes.copy()
    if turned in range(codes.shape[1]):
        codes[1, turned] ^= 1
    return found._replace(codes=codes)


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> Any:
    """Lines of methods with bodies, of which `wrong` errs in column 3; who was called with what.

    By the clock an orbit takes 2 ms, with a new body `first` seconds more, and a method `made`
    before it is ready; in principal axes `dear`, where 64 bits are told wrong if `rough`.
    """

    def run(names: str, *sizes: float, **more: Any) -> Any:
        seen, called = set(), []

        def made(name: str, task: Task, entry: Any, threads: int) -> Solver:
            clock[0] += more.get("made", 0.0)

            def solve() -> Any:
                n = task.states.shape[1]
                called.append((name, n, task.end))
                anew = (name, task.problem) not in seen
                clock[0] += 2e-3 * n + more.get("first", 0.0) * anew
                seen.add((name, task.problem))
                return route(task, 3 if name == more.get("wrong") else -1)

            return Solver(solve)

        def told(problem: Any, phases: Any, *, bits: int, jobs: int) -> Any:
            clock[0] += more.get("dear", 0.01)
            right = route(problems.from_phases(problem, phases)).codes
            return 1 - right if bits == 64 and more.get("rough") else right

        monkeypatch.setattr(measure, "ready", made)
        offered = more.get("bits", (64, 113))
        monkeypatch.setattr(principal_axes, "working_type", offered.__contains__)
        monkeypatch.setattr(principal_axes, "codes", told)
        bodies = more.get("bodies", [SHORT])
        monkeypatch.setattr(problems, "drawn", lambda _, n: bodies[:n])
        asked = dict(zip(("orbits", "seconds", "longest"), sizes, strict=True))
        config = asking(bodies={"kept": len(bodies), "drawn": 0, "seed": 0, **asked})
        return list(measure.bodies(config, dict.fromkeys(names.split(), PLAIN))), called

    return run


DIFFER: list[tuple[str, float, dict[str, Any], int]] = [
    # Sixteen orbits of a pilot take 32 ms: 61 ms are enough for thirty.
    ("peer", 0.061, {"rough": True, "dear": 8e-3}, 30),
    ("ours", 0.061, {"dear": 8e-3}, 30),
    # Column 3 is the first in doubt: what is behind it would be without its like.
    ("peer", -1.0, {}, 3),
    # Thirty times 41 ms, in 113 bits, are more than four times 0.3 s.
    ("peer", 0.3, {"rough": True, "dear": 0.041}, 3),
    # 113 bits may not be offered, nor 64.
    ("peer", 1.0, {"rough": True, "bits": (64,)}, 3),
    ("peer", 1.0, {"bits": ()}, 3),
]
"""Who errs, the time that there is, what else is so, and of how many orbits symbols count."""


@pytest.mark.parametrize(("wrong", "seconds", "more", "counted"), DIFFER)
def test_where_two_methods_differ_more_bits_tell_which_is_right_if_there_is_time(
    lines: Any, wrong: str, seconds: float, more: Any, counted: int
) -> None:
    [line], called = lines("ours peer", 40, seconds, 9.0, wrong=wrong, **more)
    assert line["ours"]["orbits"] == 40
    assert line["peer"]["orbits"] >= counted
    for name in ("ours", "peer"):
        assert line[name]["symbols"] == 2 * counted
        errs = name == wrong and counted > 3
        assert (line[name]["wrong_trusted"], line[name]["undecided"]) == (errs, 0)
    if counted > 3:
        assert (line["peer"]["first"], line["peer"]["again"]) == pytest.approx((0.06, 0.06))
    assert line["body"] == [2, 1, 1.5, *[0.5**0.5] * 2, 0.001, 1.3342, 1e-8]
    # Both are called with another body first: what any body needs is not told of this one.
    assert [x[:2] for x in called[:3]] == [("ours", 1), ("ours", 40), ("peer", 16)]
    last = route(problems.random_routes(SHORT, 40)).crossing_time.max()
    end = called[-1][2] * problems.time_unit(SHORT.body)
    assert last < end < 1.01 * last, "the horizon of a peer"


@pytest.mark.parametrize(("longest", "n"), [(0.04, 40), (0.039, 20), (1e-3, 10)])
def test_ours_follows_as_many_orbits_as_it_is_expected_to_in_its_time(
    lines: Any, monkeypatch: pytest.MonkeyPatch, longest: float, n: int
) -> None:
    """An orbit is expected to take 1 ms; few are followed in any case.

    A first call that takes longer than a peer may, for it builds maps, is followed by another.
    """
    monkeypatch.setattr(measure, "expected_seconds", lambda _, orbits: 1e-3 * orbits)
    other = replace(SHORT, body=Body((2, 1, "1.4"), (1, 1, 0), "0.001"))
    [line], _ = lines("ours", 40, 0.15, longest, first=5.0, made=0.25, bodies=[other])
    times = {"first": 5.25 + 2e-3 * n, "again": 2e-3 * n}
    counts = {"symbols": 0, "wrong_symbols": 0, "wrong_trusted": 0, "undecided": 0}
    assert line["ours"] == pytest.approx({"orbits": n, **times, **counts})


@pytest.mark.parametrize(("seconds", "orbits"), [(5.9, 30), (6.1, 40), (99, 45)])
def test_symbols_of_random_phases_are_held_against_113_bits_within_the_time_that_there_is(
    monkeypatch: pytest.MonkeyPatch, clock: list[float], seconds: float, orbits: int
) -> None:
    """An orbit takes 0.2 s, in chunks of ten, each of which has a symbol turned over.

    What is solved before the clock runs does not count.
    """

    def made(_: str, task: Task, __: Any) -> Solver:
        def solve() -> Any:
            clock[0] += 0.2 * task.states.shape[1]
            return route(task, 2)

        return Solver(solve)

    monkeypatch.setattr(measure, "ready", made)
    monkeypatch.setattr(measure, "CHUNK", 10)
    lines = list(measure.random_phases(asking(orbits=45, seconds=seconds), "x", PLAIN))
    assert [line.pop("J1_0") for line in lines] == ["1e-6", "1e-10"]
    wrong = -(-orbits // 10)
    counts = {"symbols": 15 * orbits, "wrong_symbols": wrong, "wrong_trusted": wrong}
    expected = {**counts, "undecided": 0, "orbits": orbits, "seconds": 0.2 * orbits}
    assert lines == [pytest.approx(expected)] * 2


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
