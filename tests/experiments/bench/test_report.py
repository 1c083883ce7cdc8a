"""What is read from a result: tables of the stored one on their page, and what is worked out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import report as reading
from rigidpend.machine.wording import markdown
from rigidpend.results import store
from tests.cli.calls import REFERENCE


def guest(rounds: Any, error: float = 1e-10, **more: float) -> dict[str, Any]:
    """The record of a method at a meeting."""
    numbers = {name: np.float64(value) for name, value in {"error": error, **more}.items()}
    return {"rounds": np.array(rounds), **numbers}


def codes_guest(*rounds: float) -> dict[str, Any]:
    return guest(rounds, 1e-7, wrong_symbols=0.0)


def data() -> dict[str, Any]:
    """Two problems; with two threads methods meet at one of them."""
    absent = {"ended": "absent: jax is not installed"}
    free_body = {
        "aligned_batch": guest([2e-3, 4e-3, 3e-3]),
        "scipy_dop853": guest([0.4, 0.8, np.nan]),
        "cyrk": guest([np.nan] * 3),
        "heyoka_eq1": guest([1e-3, 8e-3, 9e-4], 1e-3),
    }
    one = {
        "route_codes": codes_guest(0.020, 0.018, 0.022),
        "aligned_batch": codes_guest(0.010, 0.008, 0.012),
        "heyoka_principal": codes_guest(0.008, 0.007, 0.009),
    }
    two = {"aligned_batch": codes_guest(0.006, 0.005), "heyoka_principal": codes_guest(0.012, 0.01)}
    return {
        "free_body": {"default": "aligned_batch", "title": "free body", "diffrax": absent},
        "codes": {"default": "aligned_batch", "title": "route codes"},
        "meetings": {
            "threads_1": {"free_body": free_body, "codes": one},
            "threads_2": {"codes": two},
        },
    }


@pytest.mark.slow
def test_the_page_has_the_tables_of_the_stored_measurement() -> None:
    root = REFERENCE.parents[1]
    page = (root / "docs" / "measured.md").read_text(encoding="utf-8")
    tables = reading.tables(store.load(root / "results" / "measured" / "bench.h5"))
    told = ["\n".join(markdown(table)) in page for table in tables]
    # Of the meetings that of route codes has its table there.
    assert told == [True, True, True, False, False, True, False, True]


def test_without_a_meeting_or_a_default_there_is_none() -> None:
    changed = data()
    assert reading.met(changed, "free_body", 2) == []
    changed["free_body"]["default"] = "closed_form"
    assert reading.met(changed, "free_body", 1) == []


def test_losses_are_peers_that_are_faster_and_good_enough() -> None:
    """heyoka at the free body is faster but errs by more than the level; ours is no peer."""
    changed = data()
    table, heyoka = reading.losses_table(changed), "heyoka, Euler-Poisson, batches"
    assert table.rows == [("route codes", heyoka, "1", "8 ms", "0.8 (0.75 to 0.875)")]
    assert table.note == "diffrax, jitted and vmapped: absent: jax is not installed."
    one = changed["meetings"]["threads_1"]
    one["codes"]["heyoka_principal"]["wrong_symbols"] = np.float64(1)
    assert "Nowhere" in reading.losses_table(changed).note
    one["free_body"]["heyoka_eq1"]["error"] = np.float64(1e-10)
    assert [(x, n, r.method) for x, n, r in reading.losses(changed)] == [
        ("free_body", 1, "heyoka_eq1")
    ]


def test_a_meeting_tells_medians_of_ratios_and_who_fell_short() -> None:
    """Ratios are 1e-3/2e-3, 8e-3/4e-3, 9e-4/3e-3; that of medians would be 1/3.

    Three rounds are too few for an interval: all of their range is told, without those missed.
    """
    assert reading.meeting_table(data(), "free_body").rows == [
        ("heyoka, (eq1), batches +", "1 ms", "0.5 (0.3 to 2)", "-", "-", "1.0e-03"),
        ("aligned Taylor, batches *", "3 ms", "1", "-", "-", "1.0e-10"),
        ("SciPy DOP853", "600 ms", "200 (200 to 200)", "-", "-", "1.0e-10"),
    ]


def test_of_several_counts_of_no_wrong_symbol_the_fewest_symbols_tell() -> None:
    told = {"orbits": 100, "seconds": 0.02, "wrong_trusted": 0.0, "undecided": 0.0}
    group = {"route_codes": {**told, "symbols": 1500}, "aligned_batch": {**told, "symbols": 9000}}
    table = reading.phases_table({"random_phases": {"J1_0_1e-10": group}})
    assert "fewer than 2,000, of 1,500 symbols" in table.note


@pytest.mark.parametrize(("n", "ends"), [(2, (0, 1)), (5, (0, 4)), (6, (0, 5)), (11, (1, 9))])
def test_an_interval_is_as_narrow_as_its_chance_allows(n: int, ends: tuple[int, int]) -> None:
    """Of 11 rounds the second and the tenth: the third would leave a chance of 93.5 % only."""
    assert reading.interval(np.arange(n)[::-1]) == ((n - 1) / 2, *ends)
