"""The separatrix: half an ellipse in the body, a spiral of the same length in space."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend.mechanics import free_body
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.poinsot import herpolhode as space
from rigidpend.mechanics.poinsot import polhode as free
from rigidpend.mechanics.poinsot import spiral
from rigidpend.mechanics.poinsot.orbit import encircling
from tests.bodies import FREE
from tests.mechanics.poinsot.reference import (
    EPS,
    in_space,
)
from tests.strategies import FINE, bodies, relative, repeatable

A = [float(x) for x in FREE.A]
NUMBERS = free_body.SEPARATRICES


def integrated_length(curve: Any, a: float, b: float, panels: int) -> float:
    """The length of a smooth curve (k, n): derivatives by Chebyshev's, quadrature by Gauss."""
    x, weight = np.polynomial.legendre.leggauss(24)
    slope = np.polynomial.legendre.legvander(x, 23)
    derive = np.stack(
        [np.polynomial.legendre.Legendre.basis(k).deriv()(x) for k in range(24)], axis=1
    ) @ np.linalg.inv(slope)
    half = (b - a) / (2 * panels)
    middles = a + half * (2 * np.arange(panels) + 1)
    points = curve(middles[:, None] + half * x)
    speed = np.linalg.norm(points @ derive.T, axis=0)
    return float((speed @ weight).sum())


@pytest.mark.parametrize("number", NUMBERS)
def test_agrees_with_integration_in_body_and_space(number: int) -> None:
    times = np.linspace(0, 25, 101)
    expected, omega = in_space(spiral.momentum(FREE, number, 0.0, G=1.5), A, times)
    # The middle axis is unstable: rounding grows as the distance falls, to 4e-16 e^u.
    bound = 1e-15 * np.exp(spiral.rate(FREE, 1.5) * times) + 1e-13
    found = spiral.momentum(FREE, number, times, G=1.5)
    assert (np.abs(found - expected) <= bound).all()
    assert (np.abs(spiral.herpolhode(FREE, times, G=1.5) - omega) <= bound).all()


@pytest.mark.parametrize(("axis", "side", "number"), [(2, 1, 2), (2, -1, 3), (1, 1, 2), (1, -1, 1)])
def test_is_the_limit_of_orbits_relative_to_each_component(
    axis: int, side: int, number: int
) -> None:
    orbit = encircling(FREE, axis, side, coheight=1e-100)
    t = np.linspace(-300, 300, 61)
    expected = free.momentum(orbit, t)
    found = spiral.momentum(FREE, number, t)
    still = np.abs(t) > 0
    assert relative(found[:, still], expected[:, still]) < 1e-13
    np.testing.assert_allclose(
        spiral.herpolhode(FREE, t), space.herpolhode(orbit, t), atol=1e-15 * 4
    )


def test_the_spiral_is_symmetric_and_winds_around_Q() -> None:
    t = np.linspace(0, 150, 2001)
    xi, eta, zeta = spiral.herpolhode(FREE, t)
    behind = spiral.herpolhode(FREE, -t)
    np.testing.assert_array_equal(behind, [xi, eta, -zeta])
    assert np.ptp(xi) == 0
    assert xi[0] == pytest.approx(1 / A[2])
    radius = np.hypot(eta, zeta)
    assert (np.diff(radius) < 0).all()
    assert np.unwrap(np.atan2(zeta, eta))[-1] == pytest.approx(150 / A[2], rel=1e-13)
    assert radius[0] == spiral.rate(FREE)


@given(body=bodies())
@repeatable(25)
def test_the_length_of_the_spiral_is_that_of_the_polhode(body: Body) -> None:
    u = 40 / spiral.rate(body)
    # Ten windings of the spiral may pass while the pole moves by its size.
    panels = int(60 + u / float(body.A[2]))
    space_curve = integrated_length(lambda t: spiral.herpolhode(body, t), -u, u, panels)
    ellipse = integrated_length(lambda t: spiral.polhode(body, 2, t), -u, u, panels)
    assert space_curve == pytest.approx(spiral.length(body), rel=1e-12)
    assert ellipse == pytest.approx(spiral.length(body), rel=1e-12)


@pytest.mark.parametrize("span", [(0.0, 1.0), (-3.0, 2.0), (5.0, 30.0)])
def test_equal_arcs_in_equal_times_on_the_separatrix(span: tuple[float, float]) -> None:
    before, after = spiral.arc(FREE, np.array(span), G=1.5)
    for curve in (
        lambda t: spiral.herpolhode(FREE, t, G=1.5),
        lambda t: spiral.polhode(FREE, 4, t, G=1.5),
    ):
        assert integrated_length(curve, *span, 40) == pytest.approx(after - before, rel=1e-12)


def test_sech_is_precise_where_it_is_small() -> None:
    for u in (0.0, -1e-9, 0.7, 30.0, -700.0):
        assert abs(float(spiral.sech(u) / FINE.sech(FINE.mpf(u)) - 1)) < 4 * EPS
    assert spiral.sech(1e4) == 0
