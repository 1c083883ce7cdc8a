"""The experiment `precession`: orders of the regimes, slopes, and results told apart."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.contract import Means
from rigidpend.experiments.precession import compute as precession
from rigidpend.experiments.precession.compute import in_order
from rigidpend.experiments.precession.schema import Config
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.engines import default_engine
from tests.config.samples import content as typed
from tests.config.samples import refused
from tests.experiments.trees import differences, from_file, plain

CONFIG = Path(__file__).parents[3] / "configs" / "precession.yaml"
SMALL = ["problem.mu=[1e-4, 1e-3, 1e-2, 0.1]"]
BODIES = ("i", "ii", "iii", "iv", "v")


def computed(settings: list[str]) -> Any:
    content = typed(Config, CONFIG, settings)
    return precession.compute(content, Means(resolve(default_engine())))


@pytest.fixture(scope="module")
def tree() -> Any:
    return computed(SMALL)


@pytest.fixture(scope="module")
def data(tree: Any) -> Any:
    return plain(tree)


@pytest.mark.slow
def test_the_bodies_are_one_of_each_regime_and_measured_in_its_order(data: Any) -> None:
    bodies = data["bodies"]
    assert list(bodies["name"]) == list(BODIES)
    assert list(bodies["regime"]) == [
        "1 = 2 > 0 > 3 = 4",
        "2 > 1 > 0 > 3 > 4",
        "2 > 0 = 1 = 3 > 4",
        "2 > 3 > 0 > 1 > 4",
        "2 = 3 > 0 > 1 = 4",
    ]
    assert bodies["ordered"].all()


def test_order_remainders_are_of_the_second_order_and_means_of_the_third(data: Any) -> None:
    bodies = data["bodies"]
    hess = np.zeros((5, 4), dtype=bool)
    hess[2, [0, 2]] = True
    np.testing.assert_array_equal(np.isnan(bodies["slope"]), hess)
    np.testing.assert_array_equal(np.isnan(bodies["mean_slope"]), hess)
    np.testing.assert_allclose(bodies["slope"][~hess], 2, atol=0.03)
    np.testing.assert_allclose(bodies["mean_slope"][~hess], 3, atol=0.002)


def test_remainders_are_those_of_the_increments(data: Any) -> None:
    bodies = data["bodies"]
    gap = bodies["gained"] - bodies["first_order"][:, :, None]
    np.testing.assert_array_equal(bodies["remainder"], np.abs(gap).max(axis=2))
    np.testing.assert_allclose(bodies["mean_remainder"], np.abs(gap.mean(axis=2)), atol=1e-15)
    assert (np.abs(bodies["first_order"]) <= bodies["unit"][..., None] * (1 + 1e-15)).all()


def test_in_the_Hess_case_the_remainder_is_rounding(data: Any) -> None:
    hess = data["bodies"]["remainder"][2][:, [0, 2]]
    assert (hess < 1e-15 * data["bodies"]["unit"][2][:, None]).all()


@pytest.mark.slow
def test_the_drawn_mu_is_the_one_of_the_config(data: Any) -> None:
    assert data["mu_over_h0"][data["drawn"]] == 0.1
    other = plain(computed([*SMALL, "problem.drawn=1/1000", "problem.mu=[1e-3, 1e-2]"]))
    assert other["drawn"] == 0


@pytest.mark.parametrize(
    ("gained", "holds"),
    [
        ([1, 2, -1, -2], True),
        ([2, 1, -2, -1], False),
        ([2, 2, -2, -2], False),
        ([1, 2, 1, -2], False),
        ([np.nan, 2, -1, -2], False),
    ],
)
def test_an_order_holds_or_does_not(gained: list[float], holds: bool) -> None:
    groups = ((2,), (1,), (0,), (3,), (4,))
    assert in_order(np.array(gained, dtype=float), groups, 0.1) is holds


def test_equal_increments_are_equal_within_their_errors() -> None:
    groups = ((1, 2), (0,), (3, 4))
    gained = np.array([1.0, 1.05, -1.0, -1.0])
    assert in_order(gained, groups, 0.03)
    assert not in_order(gained, groups, 0.02)


@pytest.mark.slow
def test_each_body_is_a_part_of_the_run() -> None:
    parts = []

    def part(name: str, function: Callable[[], Any]) -> Any:
        parts.append(name)
        return function()

    content = typed(Config, CONFIG, ["problem.mu=[1e-2, 0.1]"])
    precession.compute(content, Means(resolve(default_engine()), 1, lambda _: None, part))
    assert parts == list(BODIES)


def test_a_result_does_not_differ_from_itself_nor_from_its_file(tree: Any, tmp_path: Path) -> None:
    loaded = from_file(tmp_path, "precession", tree)["data"]
    assert differences("precession", loaded, copy.deepcopy(loaded)) == []
    assert list(loaded["bodies"]["name"]) == list(BODIES)


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ("problem.bodies.ii.A=[2, 3, 1]", "problem.bodies.ii.A: A1 > A3 > A2 is broken"),
        ("problem.mu=[1e-3, 1e-4]", "problem.mu: mu must ascend"),
        ("problem.mu=[1e-4, 0.1, 2]", "problem.h0: h0 > mu is broken: h0 = 1, mu = 2"),
        ("problem.drawn=0.2", "problem.drawn: no such mu: 0.2 (known: 1e-5, 3e-5"),
        ("numerics.precisions=[53, 64]", "numerics.precisions: "),
    ],
)
def test_refuses_what_has_no_meaning_where_it_is_written(setting: str, place: str) -> None:
    [found] = refused(CONFIG, [setting])
    assert place in str(found)


def test_a_stated_error_opens_no_tolerance_and_fails_if_it_is_more_than_declared(
    data: Any,
) -> None:
    other = copy.deepcopy(data)
    other["bodies"]["error"] += 1
    [found] = differences("precession", data, other)
    assert found.startswith("bodies/error[")
    assert "is declared" in found
    other["bodies"]["gained"] += 1e-6
    assert any("bodies/gained" in x for x in differences("precession", data, other))


@pytest.mark.parametrize(("part", "noticed"), [(0.9, False), (1.1, True)])
def test_an_error_of_a_million_millionth_of_the_largest_increment_is_the_most(
    data: Any, part: float, noticed: bool
) -> None:
    other = copy.deepcopy(data)
    other["bodies"]["error"] = part * 1e-12 * data["bodies"]["unit"]
    found = differences("precession", data, other)
    assert any("bodies/error" in x for x in found) is noticed
