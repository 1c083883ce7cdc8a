"""Orbits in time against 60 digits; the inertia ellipsoid, which rolls without sliding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, aligned_from_body, scale
from rigidpend.mechanics.equations import energy
from rigidpend.mechanics.jacobi import modulus
from rigidpend.mechanics.poinsot import polhode as free
from rigidpend.mechanics.poinsot.orbit import (
    Orbit,
    encircling,
    shape,
    through,
)
from tests.bodies import FREE
from tests.mechanics.poinsot.reference import (
    EPS,
    NOWHERE,
    aligned_components,
    bodies_and_orbits,
    orbits,
    textbook,
)
from tests.strategies import FINE, ROUNDING, momenta, relative, repeatable

OTHER = Body(A=(2, "0.3", "1.8"), r=(1, 1, 0), mu=0)
A = [float(x) for x in FREE.A]
FAMILIES = [(axis, side) for axis in (1, 2) for side in (1, -1)]
SMALL = [0.9, 1e-2, 1e-6, 1e-10, 1e-16]
M0 = np.array([0.4, -0.3, 0.9])
PARTS = np.array([-1.3, -0.49, -0.2, 0.01, 0.11, 0.26, 0.38, 0.7])
"""Of a period."""


def error(found: Any, expected: list[Any], u: float) -> float:
    """The largest relative error of a component, in units of EPS (1 + |u|)."""
    errors = [abs(float(x / y - 1)) for x, y in zip(found, expected, strict=True)]
    return max(errors) / (EPS * (1 + abs(u)))


@pytest.mark.slow
@pytest.mark.parametrize("body", [FREE, OTHER])
@pytest.mark.parametrize(("axis", "side"), FAMILIES)
@pytest.mark.parametrize("small", SMALL)
@pytest.mark.parametrize("which", ["coheight", "height"])
def test_agrees_with_60_digits_relative_to_each_component(
    body: Body, axis: int, side: int, small: float, which: str
) -> None:
    """Beside the separatrix, and beside a permanent rotation."""
    orbit = encircling(body, axis, side, G=1.5, **{which: small})
    coheight = small if which == "coheight" else FINE.sqrt(1 - FINE.mpf(small) ** 2)
    for t in PARTS * orbit.period:
        expected = textbook(body, orbit, coheight, t)
        assert error(free.momentum(orbit, t), expected, orbit.rate * t) < 40


@given(orbit=orbits())
@repeatable(40)
def test_a_period_and_no_half_of_it_brings_the_orbit_back(orbit: Orbit) -> None:
    t = np.linspace(0, 1, 17) * orbit.period
    M = free.momentum(orbit, t)
    scale = orbit.G * 100 * EPS * (1 + orbit.modulus.K)
    np.testing.assert_allclose(free.momentum(orbit, t + orbit.period), M, atol=scale)
    half = free.momentum(orbit, t + orbit.period / 2)
    along = orbit.axis - 1
    np.testing.assert_allclose(half[along], M[along], atol=scale)
    np.testing.assert_allclose(half[[1 - along, 2]], -M[[1 - along, 2]], atol=scale)


@given(pair=bodies_and_orbits())
@repeatable(40)
def test_through_a_state_goes_its_orbit_at_its_time(pair: tuple[Body, Orbit]) -> None:
    body, orbit = pair
    for part in (-0.45, -0.2, 0.03, 0.3):
        t = part * orbit.period
        Qp, Qm, M3 = aligned_components(orbit, t)
        found, at = through(body, Aligned(Qp, Qm, M3, 0, 0, 0))
        assert (found.axis, found.side) == (orbit.axis, orbit.side)
        spread = ROUNDING * (1 + orbit.modulus.K)
        assert relative(found.coheight, orbit.coheight) < 10 * spread
        assert relative(found.G, orbit.G) < ROUNDING
        assert abs(at - t) * orbit.rate < 1e-12 / orbit.height


@pytest.mark.parametrize(
    "wrong",
    [
        {"axis": 3, "height": 0.5},
        {"axis": 1, "side": 0, "height": 0.5},
        {"axis": 1, "height": 0.5, "G": 0.0},
        {"axis": 1, "height": 1.0},
        {"axis": 1, "height": -0.1},
        {"axis": 1, "coheight": 0.0},
        {"axis": 1, "coheight": 1.5},
        {"axis": 1},
        {"axis": 1, "height": 0.6, "coheight": 0.8},
    ],
)
def test_what_is_no_orbit_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"orbit|axis|give"):
        encircling(FREE, **wrong)


def test_states_on_a_separatrix_and_at_rest_are_refused() -> None:
    for Q in ((0.0, 1.0), (1.0, 0.0), (0.0, 0.0)):
        with pytest.raises(ValueError, match="separatrix"):
            through(FREE, Aligned(*Q, 0.0, 0, 0, 0))


@pytest.mark.parametrize(("M", "axis", "side"), [((2, 0, 0), 1, 1), ((0, -2, 0), 2, -1)])
def test_through_a_permanent_rotation_goes_itself(M: Any, axis: int, side: int) -> None:
    a = aligned_from_body(M, (0, 0, 1), FREE.alpha0, float(scale(A)))
    found, t = through(FREE, a)
    assert (found.axis, found.side, t) == (axis, side, 0)
    np.testing.assert_allclose(free.momentum(found, 3.0), M, atol=ROUNDING)


@pytest.mark.parametrize(
    ("A2", "A3", "M1"),
    [("1.158", "1.885", 1.670237538722366), ("1.535", "1.692", 1.2356951015316677)],
)
def test_rounding_takes_no_permanent_rotation_beyond_its_end(A2: str, A3: str, M1: float) -> None:
    """Quotients of these numbers round to 1 + 2^-52."""
    number = shape(Body((2, A2, A3), (1, 1, 0), "0.001"))
    Q = M1 * number.cos
    found, _ = through(Body((2, A2, A3), (1, 1, 0), "0.001"), Aligned(Q, Q, 0.0, 0, 0, 0))
    assert (found.height, found.coheight) == (0, 1)
    assert found.modulus == modulus(1.0)


@pytest.mark.parametrize(("Q", "M3"), [(1.68, 0.0), (1.22, 0.5)])
def test_rounding_takes_no_orbit_beside_the_separatrix_beyond_its_height(
    Q: float, M3: float
) -> None:
    body = Body((2, "1.16", "1.86"), (1, 1, 0), "0.001")
    assert through(body, Aligned(Q, 1e-20, M3, 0, 0, 0))[0].height == 1


@given(M=momenta())
@repeatable(50)
def test_eq_el_of_omega_is_twice_the_energy(M: Any) -> None:
    twice = 2 * energy(M, NOWHERE, A, NOWHERE, 0)
    assert free.ellipsoid(M / np.array(A), A) == pytest.approx(twice, rel=ROUNDING)


def test_eq_el_is_1_at_the_ends_of_its_axes_and_at_the_pole() -> None:
    ends = np.diag(1 / np.sqrt(A))
    np.testing.assert_allclose(free.ellipsoid(ends, A), 1, rtol=ROUNDING)
    assert free.ellipsoid(free.pole(M0 / np.array(A), A), A) == pytest.approx(1, rel=ROUNDING)


def test_no_point_lies_beyond_the_plane_through_the_pole_across_M() -> None:
    normal = M0 / np.linalg.norm(M0)
    distance = normal @ free.pole(M0 / np.array(A), A)
    z = np.linspace(-1, 1, 81)[:, None]
    turn = np.linspace(-np.pi, np.pi, 161)
    across = np.sqrt(1 - z * z)
    sphere = [(across * np.cos(turn)).ravel(), (across * np.sin(turn)).ravel()]
    points = np.stack([*sphere, (z + 0 * turn).ravel()]) / np.sqrt(A)[:, None]
    assert (normal @ points <= distance * (1 + ROUNDING)).all()
    assert (normal @ points).max() > 0.999 * distance


@given(found=orbits())
@repeatable(20)
def test_invariant_the_plane_stays_across_M_at_its_distance(found: Orbit) -> None:
    A = np.array(found.shape.A)[:, None]
    omega = free.polhode(found, np.linspace(0, found.period, 41))
    rho, M = free.pole(omega, found.shape.A), omega * A
    # The plane touches where the gradient of the form, 2 A rho, has its direction.
    normal = A * rho / np.linalg.norm(A * rho, axis=0)
    np.testing.assert_allclose(normal, M / found.G, atol=2 * ROUNDING)
    assert relative((normal * rho).sum(axis=0), np.sqrt(2 * found.h0) / found.G) < ROUNDING
