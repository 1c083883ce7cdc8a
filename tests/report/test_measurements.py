"""Benchmark and stress in the report: the stored numbers, and what is absent or beyond."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.bench import report as bench
from rigidpend.experiments.stress import report as stress
from tests.measure.benchmark.data import data


def test_every_problem_has_a_table_with_every_method() -> None:
    free, codes, long_time = bench.tables({"data": data()})
    assert [table.caption.split(":")[0] for table in (free, codes, long_time)] == [
        "free body",
        "route codes",
        "integrals over long times",
    ]
    assert [len(table.rows) for table in (free, codes, long_time)] == [4, 3, 2]
    assert {len(row) for row in codes.rows} == {6}


def test_times_are_beside_their_ratio_to_the_default() -> None:
    free, codes, _ = bench.tables({"data": data()})
    rows = {row[0].split(",")[0]: row for row in free.rows}
    default, scipy = rows["aligned Taylor"], rows["SciPy DOP853"]
    # Errors of 1e-3 and 1e-6 are reached with the first and second knob, 1e-12 not by SciPy.
    assert default[0].endswith(" *")
    assert default[1] == "1 ms (1)"
    assert scipy[1:3] == ("200 ms (2e+02)", "200 ms (1e+02)")
    assert scipy[4] == "not reached"
    right = {row[0].split(",")[0]: row[5] for row in codes.rows}
    assert right["SciPy DOP853"] == "16 s (2.3e+03)"


def test_an_absent_method_reaches_nothing() -> None:
    free, *_ = bench.tables({"data": data()})
    [absent] = [row for row in free.rows if row[0].startswith("diffrax")]
    assert absent[1:] == ("not reached",) * 4


def case(verdict: str, ratio: float, limit: str = "") -> dict[str, object]:
    return {"verdict": verdict, "ratio": np.float64(ratio), "limit": limit}


def test_trials_are_counted_by_kind_and_those_beyond_are_named() -> None:
    content = {
        "long_time": {"claims": {"a": case("passed", 0.25), "b": case("limit", 3.0, "known why")}},
        "honesty": {"claims": {"c": case("FAILED", 7.0)}},
    }
    counted, beyond = stress.tables({"data": content})
    assert counted.rows == [("long time", "1", "1", "0", "0.25"), ("honesty", "0", "0", "1", "0")]
    assert beyond.rows == [("limit", "long time, b", "known why"), ("FAILED", "honesty, c", "")]


def test_without_any_beyond_there_is_one_table() -> None:
    content = {"honesty": {"claims": {"c": case("passed", 0.5)}}}
    assert len(stress.tables({"data": content})) == 1
