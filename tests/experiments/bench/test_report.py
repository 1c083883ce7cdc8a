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


def test_losses_are_peers_that_are_faster_and_good_enough() -> None:
    """Ratios are 1e-3/2e-3, 8e-3/4e-3, 9e-4/3e-3; that of medians would be 1/3.

    Three rounds are too few for an interval: all of their range is told, without those missed.
    """
    default, peer = {"rounds": [2e-3, 4e-3, 3e-3]}, {"rounds": [1e-3, 8e-3, 9e-4], "error": 1e-3}
    one: Any = {
        "aligned_batch": default,
        # Faster, but it errs by more than the level.
        "heyoka_eq1": peer,
        "route_codes": {"rounds": [2e-4, 4e-4, 3e-4]},
        "scipy_dop853": {"rounds": [0.4, 0.8, np.nan]},
        "cyrk": {"rounds": [np.nan] * 3},
    }
    one = {k: {"error": 1e-10, **x, "rounds": np.array(x["rounds"])} for k, x in one.items()}
    told = {"default": "aligned_batch", "title": "free body", "diffrax": ABSENT}
    meetings = {"threads_1": {"free_body": one}, "threads_2": {}}
    data = {"free_body": told, "meetings": meetings}
    assert reading.meeting_table(data, "free_body").rows == [
        ("route_codes, every symbol certain", "300 us", "0.1 (0.1 to 0.1)", "-", "-", "1.0e-10"),
        ("heyoka, (eq1), batches +", "1 ms", "0.5 (0.3 to 2)", "-", "-", "1.0e-03"),
        ("aligned Taylor, batches *", "3 ms", "1", "-", "-", "1.0e-10"),
        ("SciPy DOP853", "600 ms", "200 (200 to 200)", "-", "-", "1.0e-10"),
    ]
    absent = "diffrax, jitted and vmapped: absent: jax is not installed."
    assert reading.losses_table(data).note == f"Nowhere in this run. {absent}"
    one["heyoka_eq1"]["error"] = 1e-10
    table = reading.losses_table(data)
    assert table.rows == [("free body", "heyoka, (eq1), batches", "1", "1 ms", "0.5 (0.3 to 2)")]
    assert table.note == absent
    # Without a meeting, or a default, there are no losses.
    assert reading.met(data, "free_body", 2) == []
    told["default"] = "closed_form"
    assert reading.losses(data) == []


@pytest.mark.parametrize(("n", "ends"), [(2, (0, 1)), (5, (0, 4)), (6, (0, 5)), (11, (1, 9))])
def test_an_interval_is_as_narrow_as_its_chance_allows(n: int, ends: tuple[int, int]) -> None:
    """Of 11 rounds the second and the tenth: the third would leave a chance of 93.5 % only."""
    assert reading.interval(np.arange(n)[::-1]) == ((n - 1) / 2, *ends)
