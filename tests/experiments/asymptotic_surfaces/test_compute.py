"""The experiment `asymptotic_surfaces`: Table 1 as published, and results told apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.asymptotic_surfaces import compute as asymptotic_surfaces
from rigidpend.experiments.contract import Means
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.engines import default_engine
from rigidpend.runs import loading
from tests.config.samples import refused
from tests.experiments.trees import differences, from_file, plain, with_change

CONFIG = Path(__file__).parents[3] / "configs" / "fig3.yaml"
TABLE_1 = {
    "alpha0": "2.91891 2.23654 1.23096 1.61146 1.97724 0.79020 0.56207",
    "gamma0": "2.46192 1.95519 0.92730 1.34948 1.77215 0.57351 0.40272",
}
SURFACES = ("S1_minus", "S2_plus")


@pytest.fixture(scope="module")
def content() -> Any:
    return loading.load(CONFIG, []).content


def computed(content: Any, engine: str) -> Any:
    tree = asymptotic_surfaces.compute(content, Means(resolve(engine)))
    return plain(tree)


@pytest.fixture(scope="module")
def data(content: Any) -> Any:
    return computed(content, default_engine())


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
    scipy, taylor = (computed(content, engine) for engine in ("scipy", "taylor"))
    assert differences("asymptotic_surfaces", scipy, taylor) == []


def test_samples_at_other_times_are_no_agreement(data: Any) -> None:
    """The points of both have no time in common, so that nothing else is compared."""
    later = with_change(data, lambda d: d["bodies"]["a"]["S1_minus"]["sample"].__iadd__(10000))
    [found] = differences("asymptotic_surfaces", data, later)
    assert "same times" in found


@pytest.mark.parametrize(
    ("setting", "place"),
    [
        ("problem.bodies.b=[2, 3, 1]", "problem.bodies.b: A1 > A3 > A2 is broken"),
        ("problem.beta0=4", "problem.beta0: 0 <= beta0 <= pi is broken"),
        ("problem.beta0=alpha", "problem.beta0: 'alpha' is not understood"),
        ("problem.mu=-1", "problem.mu: mu >= 0 is broken"),
        ("problem.M_0=0.01", "problem.M_0: h0 = M_0^2/(2 A3) > mu is broken"),
        ("problem.J1_0=0.9", "problem.J1_0: J1_0 < J2_0/2 is broken"),
        ("problem.half_width=1", "problem.half_width: half_width must be more than 1"),
        ("problem.theta2_0.count=20000", "problem.theta2_0: at most 10000 orbits"),
        ("numerics.precisions=[53, 64]", "numerics.precisions: unknown key"),
    ],
)
def test_refuses_what_has_no_meaning_where_it_is_written(setting: str, place: str) -> None:
    [found] = refused(CONFIG, [setting])
    assert place in str(found)


@pytest.mark.slow
def test_the_file_holds_what_was_computed(content: Any, data: Any, tmp_path: Path) -> None:
    tree = asymptotic_surfaces.compute(content, Means(resolve(default_engine())))
    loaded = from_file(tmp_path, "asymptotic_surfaces", tree)["data"]
    assert differences("asymptotic_surfaces", data, loaded) == []
    assert list(loaded["bodies"]) == list("abcdefg")
