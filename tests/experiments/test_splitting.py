"""The experiment `splitting`: what its results say, and results told apart."""

import copy
import itertools
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.shared import SMALL as SMALL_RATIO
from rigidpend.experiments.shared import slope
from rigidpend.experiments.splitting import slope_change
from rigidpend.experiments.splitting.compute import cost, describe, largest
from rigidpend.experiments.splitting.draw import draw
from tests.experiments.trees import asked, computed, differences, unlike_stored

A = "a: {A: [2, 0.2, 1.8], r: [sqrt(0.2), sqrt(1.6), 0]}"
BODIES = f"{{{A}, fig4: {{A: [2, 1, 1.5], r: [1, 1, 0]}}}}"
SMALL = [f"problem.bodies={BODIES}", "problem.mu=[1e-4, 1e-3, 1e-2, 0.1]", "problem.phases=9"]

FLAT = (
    "problem.bodies={s: {A: [1.002, 1, 1.001], r: [1, 1, 0]}}",
    "problem.mu=[1e-3, 1e-2]",
    "problem.drawn=s",
)
"""A body whose nu is 1572."""


@pytest.fixture(scope="module")
def data() -> Any:
    said, parts = list[str](), list[str]()
    found = computed(asked("splitting", *SMALL), parts, jobs=2, report=said.append)
    assert parts == [text.split(":")[0] for text in said] == ["a", "fig4"]
    assert said[1].startswith("fig4: nu = 4.44, ")
    return found


def test_all_is_as_it_is_stored_of_these_bodies_and_weights(data: Any) -> None:
    """But a slope, which is fitted to fewer of them, and the range of the closed form."""
    kept = {"bodies": [0, 1], "mu": [2, 3, 4, 6], "phases": range(0, 73, 9)}
    expected = {"bodies/slope_curve", "closed_form/nu", "closed_form/decay"}
    assert unlike_stored("splitting", data, kept) == expected


def test_order_the_slope_of_the_curve_is_one(data: Any) -> None:
    np.testing.assert_allclose(data["bodies"]["slope_curve"], 1, atol=0.05)


def test_a_slope_is_of_what_is_small_enough_and_above_rounding() -> None:
    ratio = SMALL_RATIO * np.array([0.01, 0.75, 1.0, 1.25])
    assert slope(ratio, ratio**2 * [9, 1, 1, 9], 1e-7) == pytest.approx(2, rel=1e-9)


@pytest.mark.parametrize("ratio", [[9e-3, 1e-2], [1e-6, 1e-5, 1e-4, 1e-3, 1e-2], [1e-4, 1e-2, 1]])
def test_errors_of_values_change_a_slope_by_its_bound_and_no_more(ratio: list[float]) -> None:
    """All signs of the errors are tried: the worst reaches almost all of it."""
    at = np.array(ratio)
    values, error = at**2, 0.03 * at**2 * np.linspace(1, 0.2, len(at))
    bound, known = slope_change(at, values, error), slope(at, values)
    signs = np.array(list(itertools.product((-1, 1), repeat=len(at))))
    changes = [abs(slope(at, values + sign * error) - known) for sign in signs]
    assert 0.95 * bound < max(changes) <= bound


def test_a_slope_without_sound_values_has_no_bound() -> None:
    """What is not fitted, and may be NaN, does not count."""
    at, error = np.array([1e-4, 1e-3, 1.0]), np.array([1e-9, 1e-6, np.inf])
    assert slope_change(at, np.array([1e-8, 1e-6, np.nan]), error) == np.inf
    assert slope_change(at, np.array([1e-8, 1e-5, np.nan]), error) < 0.2


def test_the_largest_distance_is_that_of_all_phases_and_not_of_some() -> None:
    """Of cos g + e sin 2g it is where sin g = s with 4 e s^2 + s = 2 e."""
    e = np.array([1e-6, -1e-3, 0.11, 1.7])
    s = (np.sqrt(1 + 32 * e**2) - 1) / (8 * e)
    found = largest(np.stack((np.ones(4), e), axis=1))
    np.testing.assert_allclose(found, np.sqrt(1 - s * s) * (1 + 2 * e * s), rtol=1e-15)
    assert np.isnan(largest(np.full((1, 2), np.nan)))


def test_the_reduced_distance_follows_the_closed_form(data: Any) -> None:
    closed, nu = data["closed_form"], data["bodies"]["nu"]
    expected = np.exp(np.interp(nu, closed["nu"], np.log(closed["decay"])))
    np.testing.assert_allclose(data["bodies"]["reduced"][:, 0], expected, rtol=2e-2)
    assert closed["nu"][-1] > nu.max()
    assert closed["decay"][0] == pytest.approx(1, abs=0.05)


def test_what_is_not_resolved_is_marked_and_not_drawn() -> None:
    """Doubles do not know 1e-7 h0 so well, and S1- turns back at 0.02 h0, where A2 is so small."""
    body = "problem.bodies={g: {A: [2, 0.001, 1.9995], r: [1, 2, 0]}}"
    settings = [
        body,
        "problem.drawn=g",
        "problem.mu=[1e-7, 1e-5, 0.02]",
        "numerics.precisions=[53]",
    ]
    said = list[str]()
    data = computed(asked("splitting", *settings), report=said.append)
    assert said[0].endswith("1 in 53 bits, 2 not resolved")
    assert data["bodies"]["resolved"].tolist() == [[False, True, False]]
    assert np.isfinite(data["curve"]["measured"][1]).all()
    assert np.isnan(data["curve"]["measured"][[0, 2]]).all()
    assert differences("splitting", data, copy.deepcopy(data)) == []


def test_numbers_of_160_bits_are_estimated_to_take_longer_where_they_are_needed() -> None:
    """Two weights of a nearly symmetric body took 22 s, and one was told."""
    body = "problem.bodies={a: {A: [2, 1.9, 1.96], r: [1, 1, 0]}}", "problem.drawn=a"
    weights = "problem.mu=[1e-4, 1e-2]", "numerics.precisions=[53, 106, 160]"
    assert 7 < cost(asked("splitting", *body, *weights)) < 66


def test_a_splitting_below_all_doubles_is_described_computed_and_drawn_as_not_resolved() -> None:
    flat = asked("splitting", *FLAT, "numerics.precisions=[53]")
    [row] = describe(flat)
    assert "distance = 8.492e-677 mu cos g" in row.value
    with np.errstate(all="raise", under="ignore"):
        # What no precision resolves is tried in the first alone.
        assert cost(asked("splitting", *FLAT)) == pytest.approx(cost(flat))
        data = computed(flat)
    assert not data["bodies"]["resolved"].any()
    assert np.isnan(data["bodies"]["excess"]).all()
    loaded: Any = {"data": data}
    first, errors, *others = draw(loaded).axes
    assert len(others) == 2
    assert [text.get_text() for text in errors.texts] == ["no distance is resolved"]
    assert errors.get_legend() is None
    legend = first.get_legend()
    assert legend is not None
    assert legend.get_title().get_text() == "", "no curve has a mu/h0"
