"""Time against the number of orbits: what is timed, what is scaled, where methods cross."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench.measuring import many, reading
from rigidpend.experiments.bench.measuring.tasks import Crossed, RouteTask, Solver
from tests.experiments.bench.measuring.data import data
from tests.experiments.bench.measuring.data import many as record


def slow(each: float, first: float) -> Any:
    """A method that takes so many seconds for an orbit, and more at first."""
    left = [first]

    def make(task: RouteTask) -> Solver:
        n = task.states.shape[1]

        def solve() -> int:
            time.sleep(n * each + left[0])
            left[0] = 0.0
            return n

        certain, none = np.arange(n) > 0, np.zeros((2, n), dtype=np.uint8)
        return Solver(solve, lambda n: Crossed(none[:, :n], np.zeros((3, n)), certain[None]))

    return make


def test_numbers_are_tried_until_the_next_would_go_beyond_the_budget() -> None:
    lines = list(many.counted(slow(1e-3, 0.2), (4, 20, 1000), 2, 3, 0.5))
    assert [line["orbits"] for line in lines] == [4, 20]
    assert [line["undecided"] for line in lines] == [1, 1]
    assert 0.15 < lines[0]["prepare"] < 0.4
    assert lines[1]["prepare"] < 0.1
    assert 0.02 <= lines[1]["seconds"] < 0.1
    assert lines[0]["repeats"] == 3


def test_a_first_solve_beyond_the_budget_is_all_there_is() -> None:
    [line] = many.counted(slow(0.02, 0.0), (5, 6), 2, 3, 0.05)
    assert line["orbits"] == 5
    assert line["repeats"] == 1


def test_times_are_scaled_from_the_most_that_was_timed() -> None:
    one = record([10, 100], [1.0, 8.0], [0.5, 0.25])
    assert many.at(one, 100) == (8.0, 0.75, 100)
    assert many.at(one, 1000) == (80.0, 0.75, 100)
    assert many.at(one, 10) == (1.0, 0.5, 10)
    assert many.at(one, 5).seconds == pytest.approx(0.5)


def test_methods_cross_where_their_times_are_equal() -> None:
    fast = record([10, 1000], [1e-4, 1e-2], [2.0, 0.0])
    # 2 + 1e-5 n = 1e-3 n at n = 2,020.
    assert many.crossing(fast, record([10], [1e-2], [0.0])) == pytest.approx(2020, rel=0.02)
    assert many.crossing(record([10], [1e-2], [0.0]), record([10], [1e-4], [0.0])) == np.inf
    assert many.crossing(record([10], [1e-4], [0.0]), record([10], [1e-2], [0.0])) == 1


def test_the_table_has_the_ratio_to_maps_and_marks_what_is_scaled() -> None:
    table = reading.many_table(data())
    rows = {row[0]: row[1:] for row in table.rows}
    own, maps, peer = rows.values()
    assert list(table.header[1:4]) == ["100", "1,000", "10,000"]
    assert maps[:3] == ("1 ms", "10 ms", "100 ms")
    assert own[4] == "50"
    assert own[6] == "2"
    assert peer[2].endswith("~")
    assert peer[4] == "20,000"
    assert peer[6] == "-"
    # 2 + 1e-5 n = 0.1 + 5e-4 n
    assert float(own[5].replace(",", "")) == pytest.approx(3878, rel=0.02)
