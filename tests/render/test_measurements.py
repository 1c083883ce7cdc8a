"""Benchmark and stress in the report: the stored numbers, and what is absent or beyond."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.bench import report as bench
from rigidpend.experiments.stress import draw as stress
from tests.experiments.bench.data import data
from tests.results.loaded import loaded


def test_losses_come_first_and_every_problem_has_its_tables() -> None:
    found = [table.caption for table in bench.tables(loaded(data()))]
    assert found == [
        "Where another method is faster than ours",
        "Bodies drawn by lot",
        "The slowest bodies: route_codes as it comes, every symbol certain",
        "free body, to an error of 1e-09",
        "route codes, every symbol right",
        "Cross-check against cross-check, codes of Fig. 4, one thread",
        "Random phases",
        "Time against the number of orbits, one thread",
    ]


def case(verdict: str, ratio: float, limit: str = "") -> dict[str, object]:
    return {"verdict": verdict, "ratio": np.float64(ratio), "limit": limit}


def test_trials_are_counted_by_kind_and_those_beyond_are_named() -> None:
    content = {
        "long_time": {"claims": {"a": case("passed", 0.25), "b": case("limit", 3.0, "known why")}},
        "honesty": {"claims": {"c": case("FAILED", 7.0)}},
    }
    counted, beyond = stress.tables(loaded(content))
    assert counted.rows == [("long time", "1", "1", "0", "0.25"), ("honesty", "0", "0", "1", "0")]
    assert beyond.rows == [("limit", "long time, b", "known why"), ("FAILED", "honesty, c", "")]


def test_without_any_beyond_there_is_one_table() -> None:
    content = {"honesty": {"claims": {"c": case("passed", 0.5)}}}
    assert len(stress.tables(loaded(content))) == 1
