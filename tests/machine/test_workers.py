"""Work side by side: where it runs, in which order its results come, what goes wrong."""

import concurrent.futures
import gc
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing import current_process
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidpend.machine import workers
from rigidpend.machine.signals import Stopped
from rigidpend.machine.workers import (
    WorkerError,
    ahead,
    check_stop,
    cores,
    side_by_side,
    spread,
    worth_processes,
)
from tests.cli.calls import UNTRACED
from tests.machine.work import place, spoken
from tests.processes import python


@pytest.mark.parametrize(("parts", "jobs"), [([3, 1, 2], 1), ([5], 4), ([], 2), ([1, 2], 0)])
@pytest.mark.parametrize("holds_interpreter", [True, False])
def test_one_job_or_one_part_starts_nothing(
    parts: list[int], jobs: int, holds_interpreter: bool
) -> None:
    found = side_by_side(place, (0.0,), holds_interpreter, parts, jobs)
    assert found == [(part, os.getpid(), threading.get_ident()) for part in parts]


def test_threads_share_the_process_and_keep_the_order() -> None:
    found = side_by_side(place, (0.2,), False, [0, 1, 2, 3], 4)
    parts, processes, threads = zip(*found, strict=True)
    assert parts == (0, 1, 2, 3)
    assert set(processes) == {os.getpid()}
    assert len(set(threads)) > 1
    assert threading.get_ident() not in threads


def test_an_error_ends_a_longer_part_before_it_and_threads_that_it_has_begun() -> None:
    begun, ended = threading.Barrier(3), list[int]()

    def inner(part: int) -> None:
        begun.wait(30)
        try:
            for _ in range(3000):
                check_stop()
                time.sleep(0.01)
        except Stopped:
            ended.append(part)
            raise

    def outer(part: int) -> None:
        if not part:
            side_by_side(inner, (), False, [1, 2], 2)
        begun.wait(30)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        side_by_side(outer, (), False, [0, 1], 2)
    assert sorted(ended) == [1, 2]


class Noted(list[int]):
    """Parts that note which were begun."""

    def __init__(self, *parts: int) -> None:
        super().__init__(parts)
        self.begun: list[int] = []

    def __getitem__(self, some: Any) -> Any:
        for part in super().__getitem__(some):
            self.begun.append(part)
            yield part


@pytest.mark.slow
def test_work_goes_ahead_of_its_use_in_processes_but_for_the_first() -> None:
    given, begun = Noted(0, 1, 2, 60, 60), time.monotonic()
    coming = ahead(place, given, 2)
    assert next(coming)[:2] == (0, os.getpid())
    first = next(coming)
    # So many ahead, and no more: what is done waits in memory.
    assert given.begun == [0, 1, 2, 60]
    parts, processes, _ = zip(first, next(coming), strict=True)
    assert list(parts) == [1, 2]
    assert os.getpid() not in processes
    # What is ahead ends with its use.
    coming.close()
    assert time.monotonic() - begun < 30
    assert list(ahead(place, [], 2)) == []


class Pool(ThreadPoolExecutor):
    """Threads in the place of processes, which take long to begin."""

    beginning, most_beginning = 0, 0
    """How many parts are being given to pools at once, now and at most."""

    def __init__(self, count: int, *_: Any, **__: Any) -> None:
        super().__init__(count)

    def submit(self, work: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:
        Pool.beginning += 1
        Pool.most_beginning = max(Pool.most_beginning, Pool.beginning)
        time.sleep(0.001)
        Pool.beginning -= 1
        return super().submit(work, *given, **named)


@pytest.fixture
def pools(monkeypatch: pytest.MonkeyPatch) -> None:
    """No process is begun, and whoever waits looks about often."""
    monkeypatch.setattr(concurrent.futures, "ProcessPoolExecutor", Pool)
    monkeypatch.setattr(workers, "CHECK_PERIOD", 0.001)


def asleep(part: int) -> int:
    time.sleep(0.01)
    return part


@pytest.mark.usefixtures("pools")
def test_what_processes_find_comes_in_the_order_of_the_parts() -> None:
    """Some ahead or all at once."""
    parts = [3, 1, 2, 5, 4]
    assert side_by_side(asleep, (), True, parts, 2) == parts
    assert list(ahead(asleep, parts, 2)) == parts


@pytest.mark.usefixtures("pools")
def test_two_threads_never_begin_processes_at_once() -> None:
    """Each hides the user's program meanwhile, which there must be again afterwards."""

    def begin(_: int) -> list[int]:
        return side_by_side(asleep, (), True, [1, 2, 3], 2)

    Pool.most_beginning = 0
    side_by_side(begin, (), False, [0, 1], 2)
    assert Pool.most_beginning == 1


@pytest.mark.usefixtures("pools")
def test_to_wait_for_a_process_ends_by_a_stop_or_at_its_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(TimeoutError, match=r"ended at 0\.001 s"):
        workers.apart(asleep, (1,), limit=0.001)
    asked = threading.Event()

    def came() -> int:
        asked.set()
        return signal.SIGTERM

    monkeypatch.setattr(workers, "came", came)
    with pytest.raises(Stopped):
        workers.apart(asked.wait, (0.1,))


def test_after_a_stop_no_part_is_begun_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "came", lambda: signal.SIGTERM)
    with pytest.raises(Stopped):
        side_by_side(pytest.fail, (), False, ["begun"], 1)


@pytest.mark.parametrize(("parts", "jobs", "worth"), [(7, 2, False), (8, 2, True), (9, 1, False)])
def test_many_parts_are_worth_processes(parts: int, jobs: int, worth: bool) -> None:
    assert worth_processes(parts, jobs) == worth


def test_cores_are_those_that_this_process_may_use(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 1 <= cores() <= (os.cpu_count() or 1)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 5}, raising=False)
    assert cores() == 3


def test_parts_behind_an_error_are_not_begun() -> None:
    begun: list[int] = []

    def work(part: int) -> float:
        begun.append(part)
        time.sleep(0.05 * bool(part))
        return 1 / part

    with pytest.raises(ZeroDivisionError):
        side_by_side(work, (), False, range(40), 2)
    assert len(begun) < 40


@pytest.mark.slow
def test_processes_serve_work_that_holds_the_interpreter_and_are_heard(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """What they warn of is a sentence: where in the code it arises is no news for a user."""
    heard: list[Any] = []
    assert os.getpid() not in side_by_side(spoken, (), True, [3, 1], 2, heard.append)
    assert sorted(heard) == ["part 0", "part 0", "part 1", "part 2"]
    assert sorted(line.share for line in heard) == [1 / 3, 2 / 3, 1.0, 1.0]
    assert capfd.readouterr().err == "rigidpend: warning: three parts are many\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parts", "limit", "error", "said"),
    [
        (0, 60.0, ZeroDivisionError, "division"),
        (2, 60.0, WorkerError, "was killed.*; the same command computes what is missing"),
        (4, 0.1, TimeoutError, r"ended at 0\.1 s"),
    ],
)
def test_the_end_of_work_apart_comes_through(
    parts: int, limit: float, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        workers.apart(spoken, (parts,), lambda _: None, limit)


def rare(_: int) -> bool:
    return gc.get_threshold()[0] > 100_000


@pytest.mark.slow
def test_a_process_looks_for_garbage_seldom() -> None:
    """While it imports; and not at its end, by the same function."""
    assert workers.apart(rare, (1,))


def test_a_process_of_a_pool_begins_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(current_process()._config, "daemon", True)  # type: ignore[attr-defined]
    with pytest.raises(WorkerError, match="use jobs=1"):
        workers.apart(spoken, (1,), lambda _: None)


PROGRAM = """
import os
from rigidpend.machine import workers
from tests.machine.work import spoken
print("once")
before = __file__, __spec__
def hear(text):
    print(text)
assert os.getpid() not in workers.side_by_side(spoken, (), True, [1, 5], 2, hear)
assert (__file__, __spec__) == before
"""


@pytest.mark.slow
def test_a_program_is_not_run_by_the_processes_that_it_lets_begin(tmp_path: Path) -> None:
    """It needs no ``if __name__ == "__main__"``, and hears by its own functions."""
    (tmp_path / "program.py").write_text(PROGRAM)
    # By its name: then it has both a file and a specification.
    done = python(tmp_path, "-m", "program", env=UNTRACED)
    assert (done.returncode, done.stderr) == (0, "")
    parts = [f"part {k}" for k in (0, *range(5))]
    assert sorted(done.stdout.splitlines()) == ["once", *parts]


@pytest.mark.parametrize(("columns", "parts"), [(7, 3), (2, 5), (6, 6), (5, 1), (4, 0)])
def test_spread_cuts_into_even_pieces_that_join_again(columns: int, parts: int) -> None:
    array = np.arange(2 * columns).reshape(2, columns)
    pieces = spread(array, parts, axis=1)
    sizes = [piece.shape[1] for piece in pieces]
    assert len(pieces) == max(1, min(parts, columns))
    assert max(sizes) - min(sizes) <= 1
    assert min(sizes) > 0
    np.testing.assert_array_equal(np.concatenate(pieces, axis=1), array)
    upright = spread(array.T, parts, axis=0)
    assert [piece.shape[0] for piece in upright] == sizes


def test_long_work_says_how_far_it_is_after_a_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    """In threads of a pool as well, one line for all of them; quick work says nothing."""
    monkeypatch.setattr(workers, "SILENCE", 0.05)
    said: list[str] = []

    def work(part: int) -> None:
        for _ in range(4):
            workers.note(lambda: f"part {part}")
            time.sleep(0.03)

    with workers.listening(said.append) as tell:
        workers.note(lambda: "too early")
        tell("in any case")
        workers.side_by_side(work, (), False, [1, 2, 3], 3)
    time.sleep(0.06)
    workers.note(lambda: "nobody listens")
    assert said[0] == "in any case"
    assert 1 <= len(said[1:]) <= 3
    assert all(line.startswith("part ") for line in said[1:])


class Slow(float):
    """A time whose reader is overtaken by other threads before he knows how long ago it is."""

    def __sub__(self, before: float) -> float:
        ago = float(self) - before
        time.sleep(0.001)
        return ago


@pytest.mark.parametrize("last", ["in any case", None])
def test_any_line_begins_a_new_silence_which_one_thread_ends(
    monkeypatch: pytest.MonkeyPatch, last: str | None
) -> None:
    clock, said = SimpleNamespace(now=0.0), list[str]()
    monkeypatch.setattr(workers, "time", SimpleNamespace(monotonic=lambda: Slow(clock.now)))
    listener = workers.Listener(said.append)
    if last:
        clock.now = workers.SILENCE
        listener.hear(last)
    clock.now += 0.99 * workers.SILENCE
    listener.hear(lambda: "too early")
    clock.now += 0.02 * workers.SILENCE
    side_by_side(lambda _: listener.hear(lambda: "late"), (), False, [1, 2, 3], 3)
    assert said == [*([last] if last else []), "late"]


def test_no_processes_begin_in_a_folder_that_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(WorkerError, match=r"the current folder is gone.*or use jobs=1"):
        side_by_side(abs, (), True, [1, 2], 2)
    assert side_by_side(abs, (), True, [-1, 2], 1) == [1, 2]
