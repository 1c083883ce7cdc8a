"""Finite-time exponents: by the variational equations, by other algebra, by closed orbits."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend import route_codes
from rigidpend.numbers.doubles import Array
from rigidpend.routes.problem import RouteProblem
from rigidpend.symbolic.chain import on_surface, signs_of, tangents
from rigidpend.symbolic.closed import closed
from rigidpend.symbolic.exponents import Stretched, integrated, rounding, stretched
from rigidpend.symbolic.shortest import path
from rigidpend.symbolic.stretching import most_stretched
from rigidpend.symbolic.surface import Surface, surface
from tests.symbolic.fig4 import BODY, J1_0, H, level

PASSAGES = 5


@pytest.fixture(scope="module")
def orbits() -> Surface:
    return surface(RouteProblem(BODY, H, J1_0, PASSAGES))


def some(count: int) -> tuple[Array, Array]:
    """Random phases, and actions of four orders of magnitude."""
    random = np.random.default_rng(7)
    return random.uniform(0, 2 * np.pi, count), 10 ** random.uniform(-9, -5, count)


@pytest.fixture(scope="module")
def found(orbits: Surface) -> Stretched:
    return stretched(orbits, *some(200), PASSAGES)


def test_the_variational_equations_grow_as_much(found: Stretched) -> None:
    assert found.inside.all()
    off = np.abs(integrated(BODY, found) - found.growth[-1])
    assert (off < rounding(found.growth)).all()
    # All but the most stretched are held to the differences' error, of growths from 2 to 1e6.
    assert np.median(off) < 1e-9
    assert np.ptp(found.growth[-1]) > 8


def test_orbits_have_their_codes(found: Stretched) -> None:
    phases, actions = some(200)
    for k in (0, 77, 160):
        routes = route_codes(BODY, [phases[k]], h0=H, J1_0=actions[k], n_symbols=PASSAGES)
        np.testing.assert_array_equal(routes.codes[:, 0], found.symbols[:, k])
        taken = routes.crossing_time[-1, 0] - routes.crossing_time[0, 0]
        assert found.time[k] == pytest.approx(taken, rel=1e-10)


def test_growths_are_the_largest_singular_values() -> None:
    slopes = np.random.default_rng(2).normal(size=(4, 2, 2, 9))
    unit = np.diag([0.3, 1.0])
    grown, whole = most_stretched(slopes, 0.3), np.broadcast_to(np.eye(2), (9, 2, 2))
    for k, slope in enumerate(np.moveaxis(slopes, -1, 1)):
        whole = np.linalg.inv(unit) @ slope @ unit @ whole
        largest = np.linalg.svd(whole, compute_uv=False)[:, 0]
        np.testing.assert_allclose(np.exp(grown[k]), largest, rtol=1e-12)


def test_beside_a_closed_orbit_it_is_the_multiplier_that_grows() -> None:
    orbit = closed(level(), (0, 1), 11)
    many = path(level(), on_surface, signs_of(np.array([0, 1] * 10)), 11 * np.arange(21), 0.0)
    grown = most_stretched(tangents(level(), many.chain)[:, :2], level().unit)
    assert (grown[11] - grown[7]) / 4 == pytest.approx(orbit.exponent, abs=1e-5)


def test_orbits_that_begin_beyond_the_normal_form_are_left_out(orbits: Surface) -> None:
    seen = stretched(orbits, np.array([1.0, 1.0]), np.array([1e-8, 0.3]), 1)
    np.testing.assert_array_equal(seen.inside, [True, False])
