"""The inertia ellipsoid: its pole, its tangent plane, and that it rolls without sliding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend.mechanics.equations import energy
from rigidpend.mechanics.poinsot.ellipsoid import ellipsoid, pole, tangent_plane
from rigidpend.mechanics.poinsot.orbit import Orbit
from rigidpend.mechanics.poinsot.polhode import polhode
from tests.mechanics.poinsot.reference import NOWHERE, orbits
from tests.strategies import ROUNDING, gradient, momenta, relative, repeatable

A = (2.0, 1.0, 1.5)
M0 = np.array([0.4, -0.3, 0.9])


@given(M=momenta())
@repeatable(50)
def test_eq_el_of_omega_is_twice_the_energy(M: Any) -> None:
    twice = 2 * energy(M, NOWHERE, A, NOWHERE, 0)
    assert ellipsoid(M / A, A) == pytest.approx(twice, rel=ROUNDING)


def test_eq_el_is_1_at_the_ends_of_its_axes_and_at_the_pole() -> None:
    ends = np.diag(1 / np.sqrt(A))
    np.testing.assert_allclose(ellipsoid(ends, A), 1, rtol=ROUNDING)
    assert ellipsoid(pole(M0 / A, A), A) == pytest.approx(1, rel=ROUNDING)


def test_the_normal_is_the_gradient_and_no_point_lies_beyond_the_plane() -> None:
    x = pole(M0 / A, A)
    normal, distance = tangent_plane(x, A)
    slope = np.array(gradient(lambda y: ellipsoid(y, A), list(x)), dtype=float)
    np.testing.assert_allclose(normal, slope / np.linalg.norm(slope), rtol=ROUNDING)
    assert normal @ x == pytest.approx(distance, rel=ROUNDING)
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
    A = found.shape.A
    omega = polhode(found, np.linspace(0, found.period, 41))
    normal, distance = tangent_plane(pole(omega, A), A)
    M = omega * np.array(A)[:, None]
    np.testing.assert_allclose(normal, M / found.G, atol=2 * ROUNDING)
    assert relative(distance, np.sqrt(2 * found.h0) / found.G) < ROUNDING
