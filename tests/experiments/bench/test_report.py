"""What is read from measurements: which setting goes to a meeting, and what tables tell."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.integrate import DOP853

from rigidpend.experiments.bench import methods as choice
from rigidpend.experiments.bench import report as reading
from rigidpend.experiments.bench.methods import METHODS, Entrant
from rigidpend.experiments.bench.schema import Workload
from tests.experiments.trees import asked

ABSENT = {"ended": "absent: CyRK is not installed"}


def record(error: Any, seconds: Any, **more: Any) -> dict[str, Any]:
    """The record of a search: errors and times at ever finer tolerances."""
    columns: dict[str, Any] = {
        "tolerance": np.logspace(-2, -1 - len(error), len(error)),
        "setting": 0,
    }
    columns |= {"error": error, "wrong_symbols": 0, "seconds": seconds, **more}
    return {name: np.zeros(len(error)) + x for name, x in columns.items()}


@pytest.mark.parametrize(
    ("wrong", "row"),
    [
        ([1.0, 0.0, 0.0], 2),
        # None has every symbol right: the most exact.
        ([1.0, 2.0, 1.0], 1),
    ],
)
def test_the_fastest_right_one_is_chosen_even_where_a_finer_is_faster(wrong: Any, row: int) -> None:
    found = record([1e-8, 1e-9, np.nan], [1e-3, 4e-3, 3e-3], wrong_symbols=wrong)
    assert choice.chosen(found) == row


def test_guests_bring_their_tolerance_and_variant() -> None:
    records = {
        "heyoka_principal": record([1e-10], [1e-3], setting=[2.0]),
        "route_codes": record([1e-15], [1e-3], tolerance=[np.nan]),
        "scipy_dop853": record([1e-10], [9.0]),
        "cyrk": ABSENT,
    }
    # Who is too slow or absent stays away.
    assert choice.guests(records, asked("bench")) == {
        "route_codes": Entrant(None, {"way": "integration"}),
        "heyoka_principal": Entrant(1e-2, {"lanes": 16}),
    }


def test_the_full_config_asks_for_everything() -> None:
    """Tolerances stop where a method takes no finer."""
    content = asked("bench")
    for key, method in METHODS.items():
        tried: Any = choice.tolerances(key, content.search)
        if method.finest is None:
            assert tried == [None]
        else:
            assert len(tried) >= 8, key
            assert min(tried) >= method.finest
    # What a config leaves out of the problem is what the full one says.
    assert content.problem == Workload()
    usual = choice.best("cyrk", {}, content.search)
    assert usual == Entrant(1e-13, {"method": "DOP853"})
    assert (content.bodies.kept, content.bodies.drawn, content.bodies.orbits) == (40, 20, 20_000)
    assert (content.meeting.rounds, content.phases.orbits) == (11, 2000)


def test_scipy_takes_the_finest_tolerance_that_it_is_asked_for_and_none_finer() -> None:
    ask = partial(DOP853, lambda _, y: y, 0.0, np.ones(1), 1.0, atol=1e-9)
    ask(rtol=choice.FINEST_SCIPY)
    with pytest.warns(UserWarning, match="rtol"):
        ask(rtol=0.95 * choice.FINEST_SCIPY)


def test_losses_are_peers_that_are_faster_and_right() -> None:
    """Ratios are 1e-3/2e-3, 8e-3/4e-3, 9e-4/3e-3; that of medians would be 1/3.

    Three rounds are too few for an interval: all of their range is told, without those missed.
    """
    default, peer = {"rounds": [2e-3, 4e-3, 3e-3]}, {"rounds": [1e-3, 8e-3, 9e-4]}
    one: Any = {
        choice.DEFAULT: default,
        # Faster, but not every symbol is right.
        "heyoka_principal": {**peer, "wrong_symbols": 2.0},
        "route_codes": {"rounds": [2e-4, 4e-4, 3e-4]},
        "scipy_dop853": {"rounds": [0.4, 0.8, np.nan]},
        "cyrk_two_methods": {"rounds": [np.nan] * 3},
    }
    right = {"error": 1e-10, "wrong_symbols": 0.0}
    one = {k: {**right, **x, "rounds": np.array(x["rounds"])} for k, x in one.items()}
    data: Any = {"fig4": {"cyrk": ABSENT}, "meeting": one}
    assert reading.meeting_table(data).rows == [
        ("route_codes, every symbol certain", "300 us", "0.1 (0.1 to 0.1)", "1.0e-10"),
        ("heyoka, Euler-Poisson, batches +", "1 ms", "0.5 (0.3 to 2)", "2 symbols wrong"),
        ("aligned Taylor, batches *", "3 ms", "1", "1.0e-10"),
        ("SciPy DOP853", "600 ms", "200 (200 to 200)", "1.0e-10"),
    ]
    absent = "CyRK, compiled by numba: absent: CyRK is not installed."
    assert reading.losses_table(data).note == f"Nowhere in this run. {absent}"
    one["heyoka_principal"]["wrong_symbols"] = 0.0
    table, lost = reading.losses_table(data), "heyoka, Euler-Poisson, batches"
    assert table.rows == [(reading.FIG4_TITLE, lost, "1 ms", "0.5 (0.3 to 2)")]
    assert table.note == absent
    # Without the default there is nothing to compare with.
    del one[choice.DEFAULT]
    assert reading.met(data) == []


@pytest.mark.parametrize(("n", "ends"), [(2, (0, 1)), (5, (0, 4)), (6, (0, 5)), (11, (1, 9))])
def test_an_interval_is_as_narrow_as_its_chance_allows(n: int, ends: tuple[int, int]) -> None:
    """Of 11 rounds the second and the tenth: the third would leave a chance of 93.5 % only."""
    assert reading.interval(np.arange(n)[::-1]) == ((n - 1) / 2, *ends)
