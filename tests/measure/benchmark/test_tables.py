"""What the tables say of a result, worked out by hand."""

from __future__ import annotations

import json
import math

from rigidpend.measure.benchmark import tables
from tests.measure.benchmark.data import data


def test_the_time_to_reach_an_error_is_the_shortest_that_is_enough() -> None:
    group = data()["free_body"]
    assert tables.time_to_reach(group["aligned_batch"], 1e-3) == 1e-3
    assert tables.time_to_reach(group["aligned_batch"], 1e-9) == 4e-3
    assert tables.time_to_reach(group["scipy_dop853"], 1e-9) == 0.4
    assert tables.time_to_reach(group["heyoka_eq1"], 1e-9) == math.inf
    assert tables.time_to_reach(group["diffrax"], 1e-3) == math.inf


def test_over_long_times_only_what_arrived_counts() -> None:
    group = data()["long_time"]
    assert tables.time_to_reach(group["scipy_dop853"], 1e-3) == math.inf
    assert tables.time_to_reach(group["aligned_batch"], 1e-9) == 2.0


def test_every_symbol_right_at_the_loosest_tolerance_that_does() -> None:
    group = data()["codes"]
    assert tables.all_right(group["scipy_dop853"]) == (16.0, 1e-4, 5)
    assert tables.all_right(group["aligned_batch"]).seconds == 0.007
    assert tables.all_right(data()["free_body"]["diffrax"]).seconds == math.inf


def test_who_is_faster_than_the_default_is_named_where_it_is_most() -> None:
    assert tables.faster_than_default(data()) == [("free_body", "heyoka_eq1", 1e-2, 2.0)]
    # Ours may be, for what they lack; an error of the size of the answer is none.
    changed = data()
    changed["free_body"]["heyoka_eq1"]["error"][0] = 0.5
    assert tables.faster_than_default(changed) == []


def test_an_error_that_the_default_does_not_reach_is_told_apart() -> None:
    changed = data()
    changed["free_body"]["scipy_dop853"]["error"][2] = 1e-15
    assert ("free_body", "scipy_dop853", 1e-15, math.inf) in tables.faster_than_default(changed)
    assert any("1.0e-15, which it does not reach" in line for line in tables.text(changed))
    json.dumps(tables.summary(changed), allow_nan=False)


def test_a_default_that_is_not_there_is_no_yardstick() -> None:
    changed = data()
    changed["free_body"]["default"] = "closed_form"
    assert tables.faster_than_default(changed) == []
    first, _, _ = "\n".join(tables.text(changed)).partition("route codes")
    [row] = [line for line in first.splitlines() if "SciPy DOP853" in line]
    assert "200 ms" in row
    assert "x)" not in row


def test_the_text_has_a_row_for_each_method_and_says_what_is_absent() -> None:
    text = "\n".join(tables.text(data()))
    assert text.count("aligned Taylor, batch *") == 3
    assert "200 ms (100x)" in text
    assert "16 s (2286x)" in text
    # What certainty costs stands beside.
    [certain] = [
        line for line in text.splitlines() if line.startswith("  route_codes (certain)  ")
    ][:1]
    assert "20 ms (2.9x)" in certain
    assert "Without a certificate" in text
    assert "absent: jax is not installed" in text
    assert "heyoka, plain, (eq1), at an error of 1.0e-02, 2x as fast" in text


def test_the_summary_is_json_without_infinities() -> None:
    found = json.loads(json.dumps(tables.summary(data()), allow_nan=False))
    assert found["free_body"]["methods"]["scipy_dop853"]["time_to_reach"]["1e-12"] is None
    assert found["codes"]["methods"]["scipy_dop853"]["all_right"] == {"seconds": 16.0, "knob": 1e-4}
    assert found["free_body"]["methods"]["diffrax"]["ended"].startswith("absent")
    assert found["against_orbits"]["route_codes"]["seconds"] == [2e-3, 5e-3]
    assert found["faster_than_default"][0]["method"] == "heyoka_eq1"
