"""What is read from a result, worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import report as reading
from scripts import readme_tables
from tests.experiments.bench.data import counted, data, with_bodies
from tests.results.loaded import loaded


def test_without_a_meeting_or_a_default_there_is_none() -> None:
    changed = data()
    assert reading.met(changed, "free_body", 2) == []
    changed["free_body"]["default"] = "closed_form"
    assert reading.met(changed, "free_body", 1) == []


def test_losses_are_peers_that_are_faster_and_good_enough_and_are_told_first() -> None:
    """heyoka at the free body is faster but errs by more than the level; ours is no peer."""

    def lost(changed: Any) -> Any:
        return [(problem, n, r.method) for problem, n, r in reading.losses(changed)]

    changed = data()
    assert lost(changed) == [("codes", 1, "heyoka_principal")]
    one = changed["meetings"]["threads_1"]
    one["codes"]["heyoka_principal"]["wrong_symbols"] = np.float64(1)
    del changed["bodies"]
    assert "Nowhere" in reading.losses_table(changed).note
    one["free_body"]["heyoka_eq1"]["error"] = np.float64(1e-10)
    assert lost(changed) == [("free_body", 1, "heyoka_eq1")]


def test_of_several_counts_of_no_wrong_symbol_the_fewest_symbols_tell() -> None:
    changed = data()
    changed["random_phases"]["J1_0_1e-10"] |= {"aligned_batch": {**counted(0), "symbols": 9000}}
    assert "fewer than 2,000, of 1,500 symbols" in reading.phases_table(changed).note


# Ratios are medians of the rounds' ratios: 1e-3/2e-3, 8e-3/4e-3, 9e-4/3e-3, where that of medians
# would be 1/3; three rounds are too few for an interval: all of their range is told, without one
# that either missed. A peer's times with a body are scaled to as many orbits: 0.5 s and 9,000
# orbits more at 0.2 ms, with the third body at 0.02 ms, beside 8 s and 40 us of ours.
# `*` is the default, `+` fell short of the level.
TABLES = """
Where another method is faster than ours
problem|method|threads|time|times ours
route codes|heyoka|1|8 ms|0.8 (0.75 to 0.875)
first call: 1 of 4 bodies drawn by lot, the worst|heyoka|2|680 ms|0.085
again, an orbit: 1 of 4 bodies drawn by lot, the worst|heyoka|2|20 us|0.5

Bodies drawn by lot
method|first call|90 %|worst|times ours|again, an orbit|90 %|worst|times ours|wrong|not decided
route_codes as it comes, every symbol certain|1.75 s|6.2 s|8 s|1|7.5 us|31 us|40 us|1|0|0
heyoka|2.3 s|2.3 s|2.3 s|1.34 (0.085 to 2.3)|200 us|200 us|200 us|30 (0.5 to 40)|400|0

The slowest bodies: route_codes as it comes, every symbol certain
A|r|mu/h0|J1_0|first call|again, an orbit
(2, 1, 1.5)|(0.6, 0.8, 0)|0.003|1e-08|8 s|40 us
(2, 1, 1.5)|(0.6, 0.8, 0)|0.002|1e-08|2 s|10 us
(2, 1, 1.5)|(0.6, 0.8, 0)|0.004|1e-08|1.5 s|5 us
(2, 1, 1.5)|(0.6, 0.8, 0)|0.001|1e-08|1 s|5 us

free body, to an error of 1e-09
method|1 thread|times ours|up to 2 threads|times ours|error
heyoka, (eq1), batches +|1 ms|0.5 (0.3 to 2)|-|-|1.0e-03
aligned Taylor, batches *|3 ms|1|-|-|1.0e-10
SciPy DOP853|600 ms|200 (200 to 200)|-|-|1.0e-10

route codes, every symbol right
method|1 thread|times ours|up to 2 threads|times ours|error
heyoka|8 ms|0.8 (0.75 to 0.875)|12 ms|2 (2 to 2)|1.0e-07
aligned Taylor, batches *|10 ms|1|6 ms|1|1.0e-07
route_codes, every symbol certain|20 ms|2 (1.83 to 2.25)|-|-|1.0e-07
heyoka, both forms compared|25 ms|2.5 (2.5 to 2.5)|-|-|1.0e-07

Random phases
method|wrong, J1_0 = 1e-10|not decided, J1_0 = 1e-10|time per orbit, J1_0 = 1e-10
route_codes, every symbol certain|0|0|200 us
heyoka|2,000|0|200 us
"""


def test_tables_tell_the_numbers_of_a_result() -> None:
    tables = reading.tables(loaded(data()))
    rows = [[x.caption, *("|".join(cells) for cells in (x.header, *x.rows))] for x in tables]
    text = "\n\n".join(map("\n".join, rows))
    assert text.replace("heyoka, Euler-Poisson, batches", "heyoka") == TABLES.strip()
    notes = [table.note for table in tables]
    assert notes[0] == "diffrax, jitted and vmapped: absent: jax is not installed."
    assert all(x in notes[1] for x in ("4 bodies", "10,000 orbits"))
    assert "true ratio with a chance of 95 % at least" in notes[3]
    assert "fewer than 2,000, of 1,500 symbols" in notes[-1]


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
