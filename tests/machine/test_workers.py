"""Work side by side: where it runs, in which order its results come, what goes wrong."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rigidpend.machine import workers
from rigidpend.machine.progress import PartDone
from rigidpend.machine.signals import Stopped
from rigidpend.machine.workers import WorkerError, ahead, cores, side_by_side, spread


def place(part: float, delay: float = 0.0) -> tuple[float, int, int]:
    """The part with the process and the thread that had it; the first parts take longest."""
    time.sleep(delay / (1 + part))
    return part, os.getpid(), threading.get_ident()


def reciprocal(part: int) -> float:
    return 1 / part


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


def test_work_goes_ahead_of_its_use_by_so_many_parts_the_first_of_which_is_alone() -> None:
    begun: list[int] = []

    def work(part: int) -> int:
        begun.append(part)
        return part

    coming = ahead(work, range(9), 2)
    assert next(coming) == 0
    assert begun == [0]
    assert next(coming) == 1
    time.sleep(0.1)
    assert sorted(begun) == [0, 1, 2, 3]
    assert list(coming) == list(range(2, 9))
    assert list(ahead(work, [], 2)) == []


def test_what_goes_ahead_ends_with_its_user_and_its_errors_come_through() -> None:
    ended = threading.Event()

    def endless(part: int) -> int:
        try:
            while part == 2:
                workers.check_stop()
        except Stopped:
            ended.set()
        return part

    coming = ahead(endless, range(4), 2)
    assert [next(coming), next(coming)] == [0, 1]
    coming.close()
    assert ended.is_set()
    with pytest.raises(ZeroDivisionError):
        list(ahead(reciprocal, [1, 2, 0, 3], 2))


@pytest.mark.slow
def test_processes_serve_work_that_holds_the_interpreter() -> None:
    found = side_by_side(place, (0.2,), True, [0, 1, 2, 3], 2)
    parts, processes, _ = zip(*found, strict=True)
    assert parts == (0, 1, 2, 3)
    assert os.getpid() not in processes


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("holds_interpreter", [True, False])
def test_errors_of_the_work_come_through(jobs: int, holds_interpreter: bool) -> None:
    with pytest.raises(ZeroDivisionError):
        side_by_side(reciprocal, (), holds_interpreter, [1, 0, 2], jobs)


def spoken(parts: int, say: Callable[[str], object]) -> int:
    """Say a line for each part, with the share that is done; return the process."""
    for part in range(parts):
        say(PartDone(f"part {part}", part + 1, parts))
    if parts == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getpid() // min(parts, 1)


@pytest.mark.slow
def test_work_apart_is_heard_here_and_its_end_comes_through() -> None:
    heard: list[Any] = []
    assert workers.apart(spoken, (3,), heard.append) != os.getpid()
    assert heard == ["part 0", "part 1", "part 2"]
    assert [line.share for line in heard] == [1 / 3, 2 / 3, 1.0]
    with pytest.raises(ZeroDivisionError):
        workers.apart(spoken, (0,), heard.append)
    with pytest.raises(WorkerError, match="was killed"):
        workers.apart(spoken, (2,), heard.append)


@pytest.mark.parametrize(("columns", "parts"), [(7, 3), (2, 5), (6, 6), (5, 1), (4, 0)])
def test_spread_cuts_into_even_pieces_that_join_again(columns: int, parts: int) -> None:
    array = np.arange(2 * columns).reshape(2, columns)
    pieces = spread(array, parts, axis=1)
    sizes = [piece.shape[1] for piece in pieces]
    assert len(pieces) == max(1, min(parts, columns))
    assert max(sizes) - min(sizes) <= 1
    assert min(sizes) > 0
    np.testing.assert_array_equal(np.concatenate(pieces, axis=1), array)


def test_cores_are_those_that_this_process_may_use() -> None:
    assert 1 <= cores() <= (os.cpu_count() or 1)


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
    workers.note(lambda: "nobody listens")
    assert said[0] == "in any case"
    assert 1 <= len(said[1:]) <= 3
    assert all(line.startswith("part ") for line in said[1:])
