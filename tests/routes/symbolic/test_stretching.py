"""Growth of deviations: by variational equations, other algebra, closed and long orbits."""

from __future__ import annotations

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Array
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic.closed import closed
from rigidpend.routes.symbolic.levels import Surface, surface
from rigidpend.routes.symbolic.stretching import (
    Stretched,
    integrated,
    most_stretched,
    stretched,
    stretching,
)
from tests.routes.symbolic.fig4 import BODY, J1_0, H, chain_of, level


def test_a_closed_orbit_stretches_by_its_multiplier() -> None:
    orbit, grown = closed(level(), (0, 1), 11), stretching(chain_of([0, 1] * 20))
    # In the middle the surface's orbit is beside the closed one, whose word has two passages.
    assert abs(grown[18:20].mean() - orbit.exponent) < 1e-8


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
    off = np.abs(integrated(found) - found.growth[-1])
    assert (off < found.allowed + found.integrated).all()
    assert np.median(found.allowed) < 1e-7
    assert np.ptp(found.growth[-1]) > 8


THIN = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="1e-7")
SHRUNK = Body(A=(2, "1/5", "9/5"), r=(3, 8, 0), mu="1e-5")


def test_integration_rounds_more_of_a_thinner_layer() -> None:
    """Its numbers are of the order of 1, however thin the layer of the orbits is."""
    seen = stretched(surface(RouteProblem(THIN, H, J1_0, PASSAGES)), *some(40), PASSAGES)
    off, told = np.abs(integrated(seen) - seen.growth[-1]), seen.inside
    assert told.sum() > 10
    assert (off < seen.allowed + seen.integrated)[told].all()
    assert np.median((off / seen.integrated)[told]) > 1e-3


def test_what_shrinks_again_is_rounded_as_what_had_grown() -> None:
    """A deviation grows to exp(14) and shrinks to exp(4) and exp(5).

    By the variational equations of (M, gamma), a Taylor series of degree 34 in 113 bits.
    """
    orbits = surface(RouteProblem(SHRUNK, exact("1.2"), J1_0, 3))
    phases, actions = [4.754114033321756, 4.754114], [8.802725145750686e-08, 8.8027e-08]
    seen = stretched(orbits, np.array(phases), np.array(actions), 3)
    off = np.abs(seen.growth[-1] - [4.279500267843436, 4.959372696596074])
    assert (off < seen.allowed).all()
    assert (seen.allowed < 1e-7).all()


def test_orbits_have_their_codes(found: Stretched) -> None:
    phases, actions = some(200)
    for k in (0, 77, 160):
        routes = route_codes(BODY, [phases[k]], h0=H, J1_0=actions[k], n_symbols=PASSAGES)
        np.testing.assert_array_equal(routes.codes[:, 0], found.symbols[:, k])
        taken = routes.crossing_time[-1, 0] - routes.crossing_time[0, 0]
        assert found.time[k] == pytest.approx(taken, rel=1e-10)


def test_growths_are_the_largest_singular_values() -> None:
    slopes = np.random.default_rng(2).normal(size=(4, 2, 2, 9))
    frames = np.random.default_rng(3).normal(size=(5, 2, 2, 9))
    grown, whole = most_stretched(list(slopes), list(frames)), np.eye(2)
    for k, slope in enumerate(np.moveaxis(slopes, -1, 1)):
        whole = slope @ whole
        begun, ended = np.moveaxis(frames[0], -1, 0), np.moveaxis(frames[k + 1], -1, 0)
        largest = np.linalg.svd(ended @ whole @ np.linalg.inv(begun), compute_uv=False)[:, 0]
        np.testing.assert_allclose(np.exp(grown[k]), largest, rtol=1e-11)


def test_orbits_that_begin_beyond_the_normal_form_are_left_out(orbits: Surface) -> None:
    seen = stretched(orbits, np.array([1.0, 1.0]), np.array([1e-8, 0.3]), 1)
    np.testing.assert_array_equal(seen.inside, [True, False])
