"""What is read from measurements: which setting goes to a meeting, and what tables tell."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.integrate import DOP853

from rigidpend.experiments.bench import methods as choice
from rigidpend.experiments.bench import report as reading
from rigidpend.experiments.bench.methods import METHODS, PROBLEMS, Entrant
from rigidpend.experiments.bench.schema import Workload
from tests.experiments.trees import asked

ABSENT = {"ended": "absent: jax is not installed"}


def record(error: Any, seconds: Any, **more: Any) -> dict[str, Any]:
    """The record of a search: errors and times at ever finer tolerances."""
    columns = {"tolerance": np.logspace(-2, -1 - len(error), len(error)), "setting": 0, **more}
    columns |= {"error": error, "seconds": seconds}
    return {name: np.zeros(len(error)) + x for name, x in columns.items()}


@pytest.mark.parametrize(
    ("problem", "error", "more", "row"),
    [
        ("free_body", [1e-3, 5e-10, 1e-12], {}, 2),
        # None is good enough: the most exact.
        ("free_body", [1e-3, 2e-9, 1e-8], {}, 1),
        ("codes", [1e-9, 1e-3, 1e-9], {"wrong_symbols": [1.0, 0.0, 1.0]}, 1),
    ],
)
def test_the_fastest_good_one_is_chosen_even_where_a_finer_is_faster(
    problem: str, error: Any, more: Any, row: int
) -> None:
    assert choice.chosen(problem, record(error, [1e-3, 4e-3, 3e-3], **more)) == row


def test_guests_bring_their_tolerance_and_variant() -> None:
    group = {
        "heyoka_eq1": record([1e-10], [1e-3], setting=[2.0]),
        "cyrk": record([1e-12], [1e-3], setting=[1.0]),
        "closed_form": record([1e-15], [1e-3], tolerance=[np.nan]),
        "scipy_dop853": record([1e-10], [9.0]),
        "diffrax": ABSENT,
    }
    # Who is too slow or absent stays away.
    assert choice.guests("free_body", group, asked("bench")) == {
        "closed_form": Entrant(None, {"way": "closed"}),
        "heyoka_eq1": Entrant(1e-2, {"eq1": True, "lanes": 16}),
        "cyrk": Entrant(1e-2, {"method": "Vern8"}),
    }


def test_the_full_config_asks_for_everything() -> None:
    """Defaults answer, and tolerances stop where a method takes no finer."""
    content = asked("bench")
    for key, method in METHODS.items():
        tried: Any = choice.tolerances(key, content.search)
        if method.finest is None:
            assert tried == [None]
        else:
            assert len(tried) >= 8, key
            assert min(tried) >= method.finest
    assert all(name in METHODS[x.default].answers for name, x in PROBLEMS.items())
    # What a config leaves out of the problems is what the full one says.
    assert content.problem == Workload()
    usual = choice.best("codes", "cyrk", {}, content.search)
    assert usual == Entrant(1e-13, {"method": "DOP853"})
    assert set(METHODS) - set(content.problem.methods) == {"route_codes_auto"}
    assert (content.bodies.kept, content.bodies.drawn, content.bodies.orbits) == (40, 20, 20_000)
    assert (content.meeting.rounds, content.phases.orbits) == (11, 2000)


def test_scipy_takes_the_finest_tolerance_that_it_is_asked_for_and_none_finer() -> None:
    ask = partial(DOP853, lambda _, y: y, 0.0, np.ones(1), 1.0, atol=1e-9)
    ask(rtol=choice.FINEST_SCIPY)
    with pytest.warns(UserWarning, match="rtol"):
        ask(rtol=0.95 * choice.FINEST_SCIPY)


def guest(rounds: Any, error: float = 1e-10, **more: float) -> dict[str, Any]:
    """The record of a method at a meeting."""
    numbers = {name: np.float64(value) for name, value in {"error": error, **more}.items()}
    return {"rounds": np.array(rounds), **numbers}


def codes_guest(*rounds: float) -> dict[str, Any]:
    return guest(rounds, 1e-7, wrong_symbols=0.0)


def data() -> dict[str, Any]:
    """Two problems; with two threads methods meet at one of them."""
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
        "free_body": {"default": "aligned_batch", "title": "free body", "diffrax": ABSENT},
        "codes": {"default": "aligned_batch", "title": "route codes"},
        "meetings": {
            "threads_1": {"free_body": free_body, "codes": one},
            "threads_2": {"codes": two},
        },
    }


def test_losses_are_peers_that_are_faster_and_good_enough() -> None:
    """heyoka at the free body is faster but errs by more than the level; ours is no peer.

    Without a meeting, or a default, there are none.
    """
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
    assert reading.met(changed, "free_body", 2) == []
    changed["free_body"]["default"] = "closed_form"
    assert reading.met(changed, "free_body", 1) == []


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
