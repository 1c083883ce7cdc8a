"""What is read from a result, worked out by hand."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from rigidpend.experiments.bench.measuring import reading
from rigidpend.machine.tables import Table, terminal
from tests.experiments.bench.measuring.data import data


def row(table: Table, label: str) -> tuple[str, ...]:
    [found] = [tuple(cells) for cells in table.rows if cells[0].startswith(label)]
    return found


def test_a_ratio_is_the_median_of_the_rounds_ratios_and_not_the_ratio_of_medians() -> None:
    found = {r.method: r for r in reading.met(data(), "free_body", 1)}
    # Rounds 1e-3/2e-3, 8e-3/4e-3, 9e-4/3e-3: the medians' ratio would be 1/3.
    assert found["heyoka_eq1"].ratio == pytest.approx(0.5)
    assert (found["heyoka_eq1"].low, found["heyoka_eq1"].high) == pytest.approx((0.4, 1.25))
    assert found["heyoka_eq1"].seconds == pytest.approx(1e-3)


def test_a_round_that_one_of_both_missed_does_not_count() -> None:
    found = {r.method: r for r in reading.met(data(), "free_body", 1)}
    assert found["scipy_dop853"].ratio == pytest.approx(200)
    assert found["scipy_dop853"].seconds == pytest.approx(0.6)


def test_the_fastest_comes_first() -> None:
    assert [r.method for r in reading.met(data(), "codes", 1)] == [
        "heyoka_principal", "aligned_batch", "route_codes", "heyoka_two_forms"
    ]  # fmt: skip


def test_a_problem_without_a_meeting_or_a_default_has_no_result() -> None:
    changed = data()
    assert reading.met(changed, "long_time", 1) == []
    changed["free_body"]["default"] = "closed_form"
    assert reading.met(changed, "free_body", 1) == []


def test_losses_are_peers_that_are_faster_and_good_enough() -> None:
    # heyoka at the free body is faster but errs by more than the level; ours is no peer.
    found = [(problem, n, r.method) for problem, n, r in reading.losses(data())]
    assert found == [("codes", 1, "heyoka_principal")]
    changed = data()
    changed["meetings"]["threads_1"]["free_body"]["heyoka_eq1"]["error"] = np.float64(1e-10)
    changed["meetings"]["threads_1"]["codes"]["heyoka_principal"]["wrong_symbols"] = np.float64(1)
    found = [(problem, n, r.method) for problem, n, r in reading.losses(changed)]
    assert found == [("free_body", 1, "heyoka_eq1")]


def test_losses_are_told_first_also_where_there_is_none() -> None:
    first = reading.tables(data())[0]
    assert first.caption == "Where another method is faster than ours"
    assert row(first, "route codes")[1:4] == ("heyoka, Euler-Poisson, batches", "1", "8 ms")
    changed = data()
    changed["meetings"]["threads_1"]["codes"]["heyoka_principal"]["rounds"] *= 2
    assert "Nowhere" in reading.tables(changed)[0].note


def test_the_time_to_reach_an_error_is_the_shortest_that_is_enough() -> None:
    group = data()["free_body"]
    assert reading.time_to_reach(group["aligned_batch"], 1e-3) == 1e-3
    assert reading.time_to_reach(group["aligned_batch"], 1e-9) == 4e-3
    assert reading.time_to_reach(group["scipy_dop853"], 1e-9) == 0.4
    assert reading.time_to_reach(group["heyoka_eq1"], 1e-9) == math.inf
    assert reading.time_to_reach(group["diffrax"], 1e-3) == math.inf


def test_over_long_times_only_what_went_all_the_way_counts() -> None:
    group = data()["long_time"]
    assert reading.time_to_reach(group["scipy_dop853"], 1e-3) == math.inf
    assert reading.time_to_reach(group["aligned_batch"], 1e-9) == 2.0
    assert reading.error_at_cost(group["scipy_dop853"], 10.0) == math.inf


def test_error_at_equal_cost_is_the_smallest_that_is_cheap_enough() -> None:
    group = data()["codes"]
    assert reading.error_at_cost(group["aligned_batch"], 0.0065) == 1e-2
    assert reading.error_at_cost(group["aligned_batch"], 0.1) == 1e-7
    assert reading.error_at_cost(group["scipy_dop853"], 3.0) == math.inf
    table = reading.cost_table(data())
    # The unit is the median of the default at the meeting: 10 ms.
    assert tuple(table.header) == ("method", "up to 10 ms", "up to 20 ms", "up to 100 ms")
    assert row(table, "heyoka, Euler")[1] == "1.0e-08"


def test_marks_say_who_is_the_default_who_fell_short_and_who_was_scaled() -> None:
    table = reading.meeting_table(data(), "free_body")
    labels = [cells[0] for cells in table.rows]
    assert "aligned Taylor, batches *" in labels
    assert "heyoka, (eq1), batches +" in labels
    assert "SciPy DOP853 ~" in labels


def test_one_and_two_threads_stand_beside_each_other() -> None:
    table = reading.meeting_table(data(), "codes")
    assert tuple(table.header) == (
        "method", "1 thread", "times ours", "up to 2 threads", "times ours", "error"
    )  # fmt: skip
    assert row(table, "heyoka, Euler")[3:5] == ("12 ms", "2 (2 to 2)")
    assert row(table, "route_codes")[3:5] == ("-", "-")


def test_cross_checks_are_compared_with_ours() -> None:
    table = reading.cross_checks_table(data())
    assert len(table.rows) == 2
    assert row(table, "heyoka, both forms")[1:] == ("25 ms", "1.25", "15", "0")


def test_wrong_symbols_are_per_million() -> None:
    table = reading.phases_table(data())
    assert row(table, "heyoka, Euler")[1:] == ("2,000", "0", "200 us")
    assert row(table, "route_codes")[1] == "0"
    assert table.header[1] == "wrong, J1_0 = 1e-10"
    assert "fewer than 2,000, for 1,500 symbols" in table.note


def test_what_is_absent_or_cut_is_said() -> None:
    table = reading.search_table(data(), "free_body")
    assert row(table, "diffrax")[1:] == ("-",) * 5 + ("absent: jax is not installed",)


def test_every_table_can_be_written_and_the_summary_is_json() -> None:
    lines = [line for table in reading.tables(data()) for line in terminal(table)]
    assert any("Cross-check against cross-check" in line for line in lines)
    found = json.loads(json.dumps(reading.summary(data()), allow_nan=False))
    assert found["losses"][0]["method"] == "heyoka_principal"
    assert found["free_body"]["methods"]["heyoka_eq1"]["error"][2] is None
    assert found["random_phases"]["J1_0_1e-10"]["heyoka_principal"]["wrong"] == 3
