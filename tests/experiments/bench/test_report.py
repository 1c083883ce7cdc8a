"""What is read from a result, worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import report as reading
from rigidpend.machine.wording import Table, terminal
from scripts import readme_tables
from tests.experiments.bench.data import counted, data, with_bodies
from tests.results.loaded import loaded


def row(table: Table, label: str) -> tuple[str, ...]:
    [found] = [tuple(cells) for cells in table.rows if cells[0].startswith(label)]
    return found


def test_a_ratio_is_the_median_of_the_rounds_ratios_and_not_the_ratio_of_medians() -> None:
    found = {r.method: r for r in reading.met(data(), "free_body", 1)}
    # Rounds 1e-3/2e-3, 8e-3/4e-3, 9e-4/3e-3: the medians' ratio would be 1/3. Three are too few for
    # an interval, and all of their range is told.
    eq1, scipy = found["heyoka_eq1"], found["scipy_dop853"]
    assert (eq1.seconds, *eq1.ratio) == pytest.approx((1e-3, 0.5, 0.3, 2))
    # A round that one of both missed does not count.
    assert (scipy.seconds, scipy.ratio[0]) == pytest.approx((0.6, 200))


def test_the_fastest_comes_first_and_without_a_meeting_or_a_default_there_is_none() -> None:
    changed = data()
    fastest = ["heyoka_principal", "aligned_batch", "route_codes", "heyoka_two_forms"]
    assert [r.method for r in reading.met(changed, "codes", 1)] == fastest
    assert reading.met(changed, "free_body", 2) == []
    changed["free_body"]["default"] = "closed_form"
    assert reading.met(changed, "free_body", 1) == []


def test_losses_are_peers_that_are_faster_and_good_enough_and_are_told_first() -> None:
    """heyoka at the free body is faster but errs by more than the level; ours is no peer."""

    def lost(changed: Any) -> Any:
        return [(problem, n, r.method) for problem, n, r in reading.losses(changed)]

    changed = data()
    assert lost(changed) == [("codes", 1, "heyoka_principal")]
    first = reading.tables(loaded(changed))[0]
    assert row(first, "route codes")[1:4] == ("heyoka, Euler-Poisson, batches", "1", "8 ms")
    one = changed["meetings"]["threads_1"]
    one["codes"]["heyoka_principal"]["wrong_symbols"] = np.float64(1)
    del changed["bodies"]
    assert "Nowhere" in reading.losses_table(changed).note
    one["free_body"]["heyoka_eq1"]["error"] = np.float64(1e-10)
    assert lost(changed) == [("free_body", 1, "heyoka_eq1")]


def test_one_and_two_threads_stand_beside_each_other() -> None:
    table = reading.meeting_table(data(), "codes")
    assert tuple(table.header) == (
        "method", "1 thread", "times ours", "up to 2 threads", "times ours", "error"
    )  # fmt: skip
    assert row(table, "heyoka, Euler")[3:5] == ("12 ms", "2 (2 to 2)")
    assert row(table, "route_codes")[3:5] == ("-", "-")
    labels = [cells[0] for cells in reading.meeting_table(data(), "free_body").rows]
    assert "aligned Taylor, batches *" in labels, "the default"
    assert "heyoka, (eq1), batches +" in labels, "fell short"


def test_wrong_symbols_are_per_million() -> None:
    changed = data()
    more = {**counted(0), "symbols": 9000}
    changed["random_phases"]["J1_0_1e-10"] |= {"aligned_batch": more}
    table = reading.phases_table(changed)
    assert row(table, "heyoka, Euler")[1:] == ("2,000", "0", "200 us")
    assert row(table, "route_codes")[1] == "0"
    assert table.header[1] == "wrong, J1_0 = 1e-10"
    assert "fewer than 2,000, of 1,500 symbols" in table.note


def test_every_table_can_be_written() -> None:
    lines = [line for table in reading.tables(loaded(data())) for line in terminal(table)]
    assert any("every symbol right" in line for line in lines)
    assert "  diffrax, jitted and vmapped: absent: jax is not installed." in lines


def test_bodies_are_told_by_median_and_worst_with_a_peer_scaled_to_as_many_orbits() -> None:
    table, slowest = reading.bodies_tables(data())
    own, peer = table.rows
    assert tuple(own) == (
        *("route_codes as it comes, every symbol certain", "1.75 s", "6.2 s", "8 s", "1"),
        *("7.5 us", "31 us", "40 us", "1", "0", "0"),
    )
    # 0.5 s and 9,000 orbits more at 0.2 ms; with the third body at 0.02 ms.
    assert [peer[k] for k in (1, 3, 5, 9)] == ["2.3 s", "2.3 s", "200 us", "400"]
    assert "4 bodies" in table.note
    assert "10,000 orbits" in table.note
    assert slowest.rows[0] == ("(2, 1, 1.5)", "(0.6, 0.8, 0)", "0.003", "1e-08", "8 s", "40 us")


def test_a_body_with_which_a_peer_is_faster_is_a_loss() -> None:
    """0.5 s and 9,000 orbits of 20 us, beside 8 s; 20 us beside 40."""
    rows = reading.losses_table(data()).rows[1:]
    assert [(row[0].partition(" bodies")[0], *row[3:]) for row in rows] == [
        ("first call: 1 of 4", "680 ms", "0.085"), ("again, an orbit: 1 of 4", "20 us", "0.5")
    ]  # fmt: skip


def test_the_readme_has_bodies_beside_the_fastest_peer_that_vouches_for_symbols() -> None:
    """A peer that vouches for none is no peer here, however fast."""
    changed = data()
    changed["bodies"] |= {"heyoka_two_tolerances": with_bodies([3.0] * 4, [0.5] * 4, 10_000)}
    assert [row[2:] for row in readme_tables.shortest(changed).rows[-2:]] == [
        ("1.75 s", "heyoka, two tolerances compared", "3 s", "1.75"),
        ("7.5 us", "heyoka, two tolerances compared", "50 us", "7.5"),
    ]


@pytest.mark.parametrize(("n", "ends"), [(2, (0, 1)), (5, (0, 4)), (6, (0, 5)), (11, (1, 9))])
def test_an_interval_is_as_narrow_as_its_chance_allows(n: int, ends: tuple[int, int]) -> None:
    """Of 11 rounds the second and the tenth: the third would leave a chance of 93.5 % only."""
    assert reading.interval(np.arange(n)[::-1]) == ((n - 1) / 2, *ends)
