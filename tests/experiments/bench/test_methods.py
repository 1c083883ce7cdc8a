"""Which setting of a method goes to a meeting: the fastest that is good enough."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench import methods as choice
from rigidpend.experiments.bench.methods import METHODS, PROBLEMS, Entrant
from rigidpend.experiments.bench.schema import Workload
from tests.experiments.trees import asked


def record(error: Any, seconds: Any, **more: Any) -> dict[str, Any]:
    """The record of a search: errors and times at ever finer tolerances."""
    columns = {"tolerance": np.logspace(-2, -1 - len(error), len(error)), "setting": 0, **more}
    columns |= {"error": error, "seconds": seconds}
    return {name: np.zeros(len(error)) + x for name, x in columns.items()}


@pytest.fixture(scope="module")
def content() -> Any:
    return asked("bench")


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


def test_guests_bring_their_tolerance_and_variant(content: Any) -> None:
    group = {
        "heyoka_eq1": record([1e-10], [1e-3], setting=[2.0]),
        "cyrk": record([1e-12], [1e-3], setting=[1.0]),
        "closed_form": record([1e-15], [1e-3], tolerance=[np.nan]),
        "scipy_dop853": record([1e-10], [9.0]),
        "diffrax": {"ended": "absent: jax is not installed"},
    }
    found = choice.guests("free_body", group, content)
    assert set(found) == {"heyoka_eq1", "cyrk", "closed_form"}, "too slow, or absent"
    settings = {"heyoka_eq1": {"eq1": True, "lanes": 16}, "cyrk": {"method": "Vern8"}}
    assert {name: found[name].setting for name in settings} == settings
    assert found["closed_form"].tolerance is None


def test_defaults_answer_and_tolerances_stop_where_a_method_takes_no_finer(content: Any) -> None:
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


def test_scipy_takes_the_finest_tolerance_that_it_is_asked_for_and_none_finer() -> None:
    from scipy.integrate import DOP853

    def ask(tolerance: float) -> None:
        DOP853(lambda _, y: y, 0.0, np.ones(1), 1.0, rtol=tolerance, atol=1e-9)

    ask(choice.FINEST_SCIPY)
    with pytest.warns(UserWarning, match="rtol"):
        ask(0.95 * choice.FINEST_SCIPY)
