"""The experiment `phase_portraits`: curves of the Euler case, in closed form and no other way."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.phase_portraits import compute as phase_portraits
from rigidpend.mechanics.equations import energy, eq1
from tests.experiments.trees import asked, computed, differences


@pytest.fixture(scope="module")
def content() -> Any:
    return asked("fig1")


@pytest.fixture(scope="module")
def data(content: Any) -> Any:
    return computed(content)


def curves(group: Any, field: str) -> list[Any]:
    return [group[field][..., a:b] for a, b in pairwise(group["offsets"])]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["orbits", "separatrices", "centres"])
def test_every_curve_has_its_energy_on_the_sphere_and_in_the_plane(
    content: Any, data: Any, name: str
) -> None:
    body, group = content.problem.body, data[name]
    A = [float(x) for x in body.A]
    for M, energy_, level in zip(
        curves(group, "points"), group["energy"], group["level"], strict=True
    ):
        # H in physical units at |M| = 1, then in units of J2'^2: J2'^2 = |M|^2 s^2.
        kinetic = energy(M, (0, 0, 0), A, (0, 0, 0), 0.0) / (1 / A[1] - 1 / A[0])
        np.testing.assert_allclose(kinetic, energy_, rtol=1e-14)
        np.testing.assert_allclose(kinetic - body.kappa / 2, level, atol=1e-14)


@pytest.mark.parametrize("name", ["orbits", "separatrices"])
def test_the_curves_in_the_plane_satisfy_the_unperturbed_equations(
    content: Any, data: Any, name: str
) -> None:
    p, group = content.problem.body.angles(), data[name]
    for x, y in zip(curves(group, "theta1"), curves(group, "J1"), strict=True):
        middle = ((x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2, 0.0, 1.0)
        theta1_rate, J1_rate, _, _ = eq1(middle, p, np)
        dx, dy = np.diff(x), np.diff(y)
        along = dx * theta1_rate + dy * J1_rate
        across = dx * J1_rate - dy * theta1_rate
        # In the flow's sense, and along it but for the curvature within a step.
        assert (along >= 0).all()
        length = np.hypot(dx, dy) * np.hypot(theta1_rate, J1_rate)
        assert np.abs(across).max() < 2e-3 * length.max()


def test_the_projection_is_a_rotation_with_M3_upright(content: Any, data: Any) -> None:
    axes = phase_portraits.view_axes(content.problem.view)
    for group in (data["orbits"], data["separatrices"], data["centres"]):
        np.testing.assert_allclose(group["projected"], axes @ group["points"], atol=1e-15)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[0, 2] == 0
    assert axes[1, 2] > 0
    azimuth, elevation = (float(getattr(content.problem.view, x)) for x in ("azimuth", "elevation"))
    assert np.atan2(axes[2, 1], axes[2, 0]) == pytest.approx(azimuth)
    assert np.arcsin(axes[2, 2]) == pytest.approx(elevation)


def test_the_window_is_a_whole_period_between_two_separatrices_1(content: Any, data: Any) -> None:
    body, plane = content.problem.body, data["plane"]
    assert np.ptp(plane["window"]) == pytest.approx(4 * np.pi, rel=1e-15)
    assert plane["window"][0] == pytest.approx(body.beta0 - body.alpha0, abs=1e-15)
    assert plane["separatrix"].tolist() == [1, 2, 3, 4, 1]
    for field in ("orbits", "centres"):
        x = data[field]["theta1"]
        assert ((x > plane["window"][0]) & (x < plane["window"][1])).all()
    # No orbit crosses a separatrix.
    for x in curves(data["orbits"], "theta1"):
        assert np.ptp(np.searchsorted(plane["separatrix_theta1"], x)) == 0
    # The centres are equilibria.
    p, centres = body.angles(), data["centres"]
    rates = eq1((centres["theta1"], centres["J1"], 0.0, 1.0), p, np)
    np.testing.assert_allclose([rates[0], rates[1]], 0, atol=1e-14)
    np.testing.assert_allclose(np.diff(np.sort(centres["theta1"])), np.pi)


def test_visibility_may_change_on_the_outline_only(data: Any) -> None:
    orbits = data["orbits"]
    depth = orbits["projected"].copy()
    depth[2, 7] = 5e-15
    stored = {**data, "orbits": {**orbits, "projected": depth}}
    for index, count in ((7, 0), (8, 1)):
        visible = orbits["visible"].copy()
        visible[index] ^= True
        fresh = {**stored, "orbits": {**stored["orbits"], "visible": visible}}
        changed = {**stored, "orbits": {**stored["orbits"], "visible": orbits["visible"]}}
        assert len(differences("phase_portraits", changed, fresh)) == count
