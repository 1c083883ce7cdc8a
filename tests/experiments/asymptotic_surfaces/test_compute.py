"""The experiment `asymptotic_surfaces`: Table 1 as published, and results told apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.asymptotic_surfaces import CURVES
from rigidpend.orbits.integrate.arithmetic import resolve
from tests.experiments.trees import asked, computed, differences, plain, with_change

TABLE_1 = {
    "alpha0": "2.91891 2.23654 1.23096 1.61146 1.97724 0.79020 0.56207",
    "gamma0": "2.46192 1.95519 0.92730 1.34948 1.77215 0.57351 0.40272",
}
SURFACES = ("S1_minus", "S2_plus")


@pytest.fixture(scope="module")
def content() -> Any:
    return asked("fig3")


@pytest.fixture(scope="module")
def data(content: Any) -> Any:
    return plain(computed(content))


@pytest.mark.parametrize("column", TABLE_1)
def test_table_1_is_the_published_one_to_the_printed_digit(data: Any, column: str) -> None:
    assert " ".join(f"{x:.5f}" for x in data["table"][column]) == TABLE_1[column]


def test_panels_are_ordered_by_nu(data: Any) -> None:
    assert list(data["bodies"]) == list("abcdefg")
    assert (np.diff(data["table"]["nu"]) > 0).all()
    np.testing.assert_allclose(data["table"]["nu"][[0, -1]], [1.756, 11.34], atol=5e-3)


def test_describe_prints_table_1(content: Any) -> None:
    rows = {row.name: row.value for row in experiments.describe("asymptotic_surfaces", content)}
    columns = zip(*(values.split() for values in TABLE_1.values()), strict=True)
    for name, (alpha0, gamma0) in zip("abcdefg", columns, strict=True):
        assert rows[f"body {name}"].startswith(f"alpha0 = {alpha0}, gamma0 = {gamma0}, nu = ")
    assert rows["beta0"] == "gamma0"


def test_windows_are_around_separatrix_2_in_units_of_the_swing(data: Any) -> None:
    """beta0 = gamma0, so the separatrix is at alpha0 + gamma0."""
    table = data["table"]
    for k, body in enumerate(data["bodies"].values()):
        assert body["centre"] == pytest.approx(table["alpha0"][k] + table["gamma0"][k])
        np.testing.assert_allclose(body["born"].mean(), body["centre"])
        np.testing.assert_allclose(np.ptp(body["born"]), 2 * body["Delta_1"])
        np.testing.assert_allclose(np.ptp(body["window"]), 5 * body["Delta_1"])
    swings = [body["Delta_1"] for body in data["bodies"].values()]
    np.testing.assert_allclose([min(swings), max(swings)], [0.0019, 0.0076], atol=5e-5)


def test_every_phase_has_its_curve_on_both_surfaces(content: Any, data: Any) -> None:
    for body in data["bodies"].values():
        for surface in SURFACES:
            curves = body[surface]
            assert curves["offsets"].size == curves["theta2_0"].size + 1 == 37
            assert curves["offsets"][-1] == curves["theta1"].size == curves["J1_over_J2"].size
        np.testing.assert_allclose(np.diff(body["S1_minus"]["theta2_0"]), np.pi / 18)


@pytest.mark.slow
def test_agrees_engines(content: Any) -> None:
    scipy, taylor = (
        plain(computed(content, arithmetic=resolve(engine))) for engine in ("scipy", "taylor")
    )
    assert differences("asymptotic_surfaces", scipy, taylor) == []


def test_samples_at_other_times_are_no_agreement(data: Any) -> None:
    """The points of both have no time in common, so that nothing else is compared."""
    later = with_change(data, lambda d: d["bodies"]["a"]["S1_minus"]["sample"].__iadd__(10000))
    [found] = differences("asymptotic_surfaces", data, later)
    assert "same times" in found


@pytest.mark.parametrize(("off", "told"), [(0.9e-11, 0), (1.1e-11, 1)])
def test_phases_at_the_cut_are_near_each_other(off: float, told: int) -> None:
    within: Any = CURVES["S1_minus"]["theta2_0"].within
    stored, fresh = ({"theta2_0": np.array([x])} for x in (0.0, 2 * np.pi - off))
    assert len(within.apart("theta2_0", stored, fresh)) == told


@pytest.mark.parametrize(("off", "told"), [(0.9e-12, 0), (1.1e-12, 1)])
def test_points_are_compared_where_both_results_have_one(off: float, told: int) -> None:
    """The fresh one lacks the second of four; at J1 = J2/2 an error has not grown."""
    within: Any = CURVES["S1_minus"]["theta1"].within
    stored = {"sample": np.arange(4), "theta1": np.arange(4.0), "offsets": np.array([0, 4])}
    fresh = {"sample": np.array([0, 2, 3]), "theta1": np.array([0.0, 2.0, 3.0 + off])}
    both = stored | {"J1_over_J2": np.full(4, 0.5)}, fresh | {"offsets": np.array([0, 3])}
    assert len(within.apart("theta1", *both)) == told
