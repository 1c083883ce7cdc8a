"""The herpolhode: against integration in space, quadrature of (eqPV), and known theorems."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend.mechanics.equations import cross
from rigidpend.mechanics.hodograph import angular_velocity, hodograph
from rigidpend.mechanics.poinsot import herpolhode as space
from rigidpend.mechanics.poinsot import polhode as free
from rigidpend.mechanics.poinsot.orbit import Orbit, encircling
from tests.bodies import FREE
from tests.mechanics.poinsot.reference import (
    EPS,
    in_space,
    orbits,
    rate,
    textbook,
)
from tests.strategies import FINE, ROUNDING, relative, repeatable

A = [float(x) for x in FREE.A]
FAMILIES = [(axis, side) for axis in (1, 2) for side in (1, -1)]


def by_hodograph(M: Any, A: Any) -> tuple[Any, Any, Any]:
    """(eqPV) with the axis of M in the place of the vertical."""
    G = sum(x * x for x in M) ** 0.5
    omega, domega = angular_velocity(M, A), angular_velocity(rate(M, A), A)
    return hodograph(omega, [x / G for x in M], domega)


@pytest.mark.parametrize(("axis", "side"), FAMILIES)
@pytest.mark.parametrize("coheight", [0.9, 0.3, 1e-2, 1e-4])
def test_agrees_with_omega_integrated_in_space(axis: int, side: int, coheight: float) -> None:
    orbit = encircling(FREE, axis, side, G=1.5, coheight=coheight)
    times = np.linspace(0, 0.7, 141) * orbit.period
    _, expected = in_space(free.momentum(orbit, 0.0), A, times)
    found = space.herpolhode(orbit, times)
    np.testing.assert_allclose(found, expected, atol=2e-14 / coheight)


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "coheight"), [(1, 0.5), (2, 0.5), (1, 1e-3), (2, 1e-6)])
def test_agrees_with_the_quadrature_of_eqPV_in_60_digits(axis: int, coheight: float) -> None:
    orbit = encircling(FREE, axis, coheight=coheight)
    exact = [x.in_context(FINE) for x in FREE.A]
    t = 0.6 * orbit.period

    def turning(t: Any) -> Any:
        return by_hodograph(textbook(FREE, orbit, coheight, t), exact)[2]

    panels = FINE.linspace(0, FINE.mpf(t), int(6 + orbit.rate * t))
    # Degree 4 is 24 points a panel, which a unit of u is wide.
    expected = FINE.quad(turning, panels, method="gauss-legendre", maxdegree=4)
    assert abs(space.angle(orbit, t) - expected) < 2 * EPS * (1 + t / A[2])
    square = by_hodograph(textbook(FREE, orbit, coheight, t), exact)[1]
    found = FINE.mpf(float(space.radius(orbit, t)))
    assert abs(found / FINE.sqrt(square) - 1) < 10 * EPS * (1 + orbit.rate * t)


@given(orbit=orbits())
@repeatable(40)
def test_the_angle_of_a_period_is_gained_in_any(orbit: Orbit) -> None:
    t = np.linspace(-1.2, 1.2, 23) * orbit.period
    gained = space.angle(orbit, t + orbit.period / 2) - space.angle(orbit, t)
    expected = space.angle_per_period(orbit)
    # Beside the middle axis psi turns with the body: its time errs as u does.
    scale = 1 + orbit.G * orbit.period / orbit.shape.A[2] + orbit.modulus.K / orbit.p
    np.testing.assert_allclose(gained, expected, atol=40 * EPS * scale)


@given(orbit=orbits(-3))
@repeatable(40)
def test_radii_bound_the_annulus_and_are_reached(orbit: Orbit) -> None:
    least, largest = space.radii(orbit)
    t = np.linspace(0, 1, 401) * orbit.period
    rho = space.radius(orbit, t)
    assert (rho >= least * (1 - ROUNDING)).all()
    assert (rho <= largest * (1 + ROUNDING)).all()
    np.testing.assert_allclose(rho[::200], largest, rtol=ROUNDING)
    spread = 20 * EPS * (1 + orbit.modulus.K) ** 2
    np.testing.assert_allclose(rho[100::200], least, rtol=spread)
    # The permanent rotations and the middle axis have the radius |M x omega|/|M|.
    M = free.momentum(orbit, t)
    expected = np.linalg.norm(cross(M, free.polhode(orbit, t)), axis=0) / orbit.G
    np.testing.assert_allclose(rho, expected, rtol=1e-14 / orbit.height / orbit.coheight)


@pytest.mark.parametrize("axis", [1, 2])
def test_curvature_is_that_of_the_curve(axis: int) -> None:
    orbit = encircling(FREE, axis, G=1.5, coheight=0.4)
    t, step = np.linspace(0.1, 0.9, 9) * orbit.period, 1e-3
    behind, here, ahead = (space.herpolhode(orbit, t + d)[1:] for d in (-step, 0, step))
    first, second = (ahead - behind) / (2 * step), (ahead - 2 * here + behind) / step**2
    turn = first[0] * second[1] - first[1] * second[0]
    expected = turn / np.hypot(*first) ** 3
    np.testing.assert_allclose(space.curvature(free.momentum(orbit, t), A), expected, rtol=1e-5)


@pytest.mark.parametrize("axis", [1, 2])
def test_the_elementary_angle_carries_on_the_one_by_carlson(
    axis: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    orbit = encircling(FREE, axis, coheight=1e-20)
    t = np.linspace(-1.5, 1.5, 400) * orbit.period
    expected = space.angle(orbit, t)
    monkeypatch.setattr(space, "ELEMENTARY", 1.0)
    np.testing.assert_allclose(space.angle(orbit, t), expected, atol=4 * EPS * np.abs(t).max())


@pytest.mark.parametrize("axis", [1, 2])
def test_limit_of_the_passage_beside_the_middle_axis(axis: int) -> None:
    """M turns from separatrix to separatrix, by alpha0 or its supplement, and psi less pi."""
    orbit = encircling(FREE, axis, coheight=1e-140)
    beyond = space.angle_per_period(orbit) - orbit.period / 2 / A[2]
    turned = FREE.alpha0 if axis == 2 else np.pi - FREE.alpha0
    assert beyond == pytest.approx(orbit.sigma * (turned - np.pi), rel=1e-12)
    assert relative(space.radius(orbit, orbit.period / 4), space.radii(orbit)[0]) < 1e-12
