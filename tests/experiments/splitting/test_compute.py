"""The experiment `splitting`: what its results say, and results told apart."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.contract import Means
from rigidpend.experiments.splitting import compute as splitting
from rigidpend.experiments.splitting.layout import admitted
from rigidpend.experiments.splitting.schema import Config
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.engines import default_engine
from rigidpend.runs import loading
from tests.config.samples import content as typed
from tests.config.samples import refused
from tests.experiments.trees import differences, from_file, plain

CONFIG = Path(__file__).parents[3] / "configs" / "splitting.yaml"
BODIES = "{a: {A: [2, 0.2, 1.8], r: [1, 2, 0]}, fig4: {A: [2, 1, 1.5], r: [1, 1, 0]}}"
SMALL = [f"problem.bodies={BODIES}", "problem.mu=[1e-3, 3e-3, 1e-2, 0.1]", "problem.phases=9"]


def computed(settings: list[str]) -> Any:
    content = typed(Config, CONFIG, settings)
    return splitting.compute(content, Means(resolve(**content.numerics_asked), 2, lambda _: None))


@pytest.fixture(scope="module")
def tree() -> Any:
    return computed(SMALL)


@pytest.fixture(scope="module")
def data(tree: Any) -> Any:
    return plain(tree)


def test_all_are_resolved_and_the_errors_are_small_beside_what_is_measured(data: Any) -> None:
    bodies = data["bodies"]
    assert bodies["resolved"].all()
    assert (bodies["error"] < 0.01 * np.abs(bodies["excess"][..., 0])).all()
    assert bodies["excess"].shape[:2] == (2, 4)


def test_order_the_slopes_are_one_for_the_curve_and_two_for_its_cosine(data: Any) -> None:
    np.testing.assert_allclose(data["bodies"]["slope_amplitude"], 2, atol=2e-3)
    np.testing.assert_allclose(data["bodies"]["slope_curve"], 1, atol=0.05)


def test_the_largest_distance_is_near_melnikov_s_amplitude(data: Any) -> None:
    bodies = data["bodies"]
    ratio = bodies["largest"] / bodies["amplitude"]
    np.testing.assert_allclose(ratio[:, 0], 1, atol=1e-5)
    assert (np.abs(ratio[:, 3] - 1) > 1e-3).all()
    per_mu = bodies["amplitude"] / data["mu_over_h0"]
    np.testing.assert_allclose(per_mu, per_mu[:, :1] * np.ones(4), rtol=1e-14)


def test_the_reduced_distance_follows_the_closed_form(data: Any) -> None:
    closed, nu = data["closed_form"], data["bodies"]["nu"]
    expected = np.exp(np.interp(nu, closed["nu"], np.log(closed["decay"])))
    np.testing.assert_allclose(data["bodies"]["reduced"][:, 0], expected, rtol=2e-2)
    assert closed["nu"][-1] > nu.max()
    assert closed["decay"][0] == pytest.approx(1, abs=0.05)


def test_the_curve_is_that_of_the_drawn_body(data: Any) -> None:
    curve, bodies = data["curve"], data["bodies"]
    assert curve["body"] == "fig4"
    np.testing.assert_allclose(curve["g"][[0, 4, 8]], [-np.pi, 0, np.pi], atol=1e-15)
    np.testing.assert_allclose(curve["melnikov"], np.cos(curve["g"]))
    # At g = 0 the odd harmonics add up, at the quarters all vanish.
    middle = 1 + bodies["excess"][1, :, ::2].sum(axis=-1)
    np.testing.assert_allclose(curve["measured"][:, 4], middle, rtol=1e-12)
    np.testing.assert_allclose(curve["measured"][:, [2, 6]], 0, atol=1e-14)


def test_what_is_not_resolved_is_marked_and_not_drawn() -> None:
    """S1- turns back in g where mu is 0.3 of h0 and nu is 11."""
    body = "problem.bodies={g: {A: [2, 1, 1.04], r: [1, 0.2, 0]}}"
    settings = [body, "problem.drawn=g", "problem.mu=[0.01, 0.3]", "numerics.precisions=[53]"]
    data = plain(computed(settings))
    assert data["bodies"]["resolved"].tolist() == [[True, False]]
    assert np.isfinite(data["curve"]["measured"][0]).all()
    assert np.isnan(data["curve"]["measured"][1]).all()
    assert differences("splitting", data, copy.deepcopy(data)) == []


def test_each_body_is_a_part_of_the_run() -> None:
    parts = []

    def part(name: str, function: Callable[[], Any]) -> Any:
        parts.append(name)
        return function()

    content = typed(Config, CONFIG, [*SMALL, "problem.mu=[1e-2, 2e-2]"])
    splitting.compute(content, Means(resolve(default_engine()), 1, lambda _: None, part))
    assert parts == ["a", "fig4"]


def test_progress_says_how_each_body_was_resolved() -> None:
    said: list[str] = []
    content = typed(Config, CONFIG, [*SMALL, "problem.mu=[1e-2, 2e-2]"])
    splitting.compute(content, Means(resolve(default_engine()), 1, said.append))
    assert [text.split(":")[0] for text in said] == ["a", "fig4"]
    assert said[1] == "fig4: nu = 4.44, 2 in 53 bits"


def test_a_result_does_not_differ_from_itself_nor_from_its_file(
    tree: Any, data: Any, tmp_path: Path
) -> None:
    loaded = from_file(tmp_path, "splitting", tree)["data"]
    assert differences("splitting", loaded, copy.deepcopy(loaded)) == []
    np.testing.assert_array_equal(loaded["bodies"]["excess"], data["bodies"]["excess"])
    assert list(loaded["bodies"]["name"]) == ["a", "fig4"]


@pytest.mark.slow
def test_agrees_a_computation_in_more_bits(data: Any) -> None:
    finer = plain(computed([*SMALL, "numerics.precisions=[106]"]))
    assert (finer["bodies"]["bits"] != data["bodies"]["bits"]).all()
    assert differences("splitting", data, finer) == []


def test_a_stated_error_opens_no_tolerance_and_fails_if_it_is_more_than_admitted(
    data: Any,
) -> None:
    other = copy.deepcopy(data)
    other["bodies"]["error"] += 1
    [found] = differences("splitting", data, other)
    assert found.startswith("bodies/error[")
    assert "at most 1e-09 is declared" in found
    other["bodies"]["excess"] += 1e-6
    assert any("bodies/excess" in x for x in differences("splitting", data, other))


@pytest.mark.parametrize(("part", "noticed"), [(0.9, False), (1.1, True)])
def test_two_results_may_differ_by_twice_what_is_admitted_of_each(
    data: Any, part: float, noticed: bool
) -> None:
    """At mu/h0 = 1e-3 that is 1e-9, and no more at any mu; at 1e-6 it is 4e-15."""
    for column in (0, 3):
        other = copy.deepcopy(data)
        other["bodies"]["excess"][0, column, 1] += part * 2e-9
        found = differences("splitting", data, other)
        assert any("bodies/excess" in x for x in found) is noticed
    assert admitted(1e-6) == pytest.approx(4e-15)


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ("problem.bodies.b.A=[2, 3, 1]", "problem.bodies.b.A: A1 > A3 > A2 is broken"),
        ("problem.bodies.b.r=[-1, 1, 0]", "problem.bodies.b.r: r1, r2 >= 0 is broken"),
        ("problem.mu=[1e-3, 1e-4]", "problem.mu: mu must ascend"),
        ("problem.mu=[0, 1e-4]", "problem.mu: mu must be more than 0"),
        ("problem.mu=[1e-4]", "problem.mu: expected at least 2"),
        ("problem.mu=[1e-4, 2]", "problem.h0: h0 > mu is broken: h0 = 1, mu = 2"),
        ("problem.mu=[1e-200, 1e-4]", "problem.mu: mu = 1e-200 is below 1e-100 h0"),
        ("problem.drawn=z", "problem.drawn: no such body: z (known: a, fig4, b"),
        ("problem.phases=3", "problem.phases: input should be greater than or equal to 9"),
    ],
)
def test_refuses_what_has_no_meaning_where_it_is_written(setting: str, place: str) -> None:
    [found] = refused(CONFIG, [setting])
    assert place in str(found)


def test_the_config_spans_what_it_is_to_show() -> None:
    problem: Any = loading.load(CONFIG, []).content.problem
    nu = [shape.heavy(problem.mu[0]).nu for shape in problem.bodies.values()]
    assert min(nu) == pytest.approx(1.756, abs=1e-3)
    assert max(nu) > 12
    assert sum(abs(x - 12) < 0.5 for x in nu) == 1
    assert (float(problem.mu[0]), float(problem.mu[-1])) == (1e-6, 0.3)
    grioli = [shape.heavy(problem.mu[0]).special_cases for shape in problem.bodies.values()]
    assert sum("Grioli" in cases for cases in grioli) == 8


def test_the_estimate_counts_what_takes_more_than_doubles_and_more_orbits() -> None:
    """A body of large nu is the dear one, and of its weights the heavy ones."""
    shipped = typed(Config, CONFIG)
    whole, measured = splitting.cost(shipped), 12
    light, dear = (
        splitting.cost(shipped.model_copy(update={"problem": one}))
        for one in (_with_body(shipped, "fig4"), _with_body(shipped, "i"))
    )
    assert light < dear / 3 < whole
    assert measured / 4 < whole < 4 * measured


def _with_body(config: Config, name: str) -> Any:
    bodies = {name: config.problem.bodies[name]}
    return config.problem.model_copy(update={"bodies": bodies, "drawn": name})
