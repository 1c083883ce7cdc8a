"""The inertia ellipsoid: its pole, its tangent plane, and that it rolls without sliding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend.mechanics.equations import energy
from rigidpend.mechanics.poinsot.orbit import Orbit
from rigidpend.mechanics.poinsot.polhode import ellipsoid, pole, polhode
from tests.mechanics.poinsot.reference import NOWHERE, orbits
from tests.strategies import ROUNDING, momenta, relative, repeatable

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


def test_no_point_lies_beyond_the_plane_through_the_pole_across_M() -> None:
    normal = M0 / np.linalg.norm(M0)
    distance = normal @ pole(M0 / A, A)
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
    omega = polhode(found, np.linspace(0, found.period, 41))
    rho, M = pole(omega, found.shape.A), omega * A
    # The plane touches where the gradient of the form, 2 A rho, has its direction.
    normal = A * rho / np.linalg.norm(A * rho, axis=0)
    np.testing.assert_allclose(normal, M / found.G, atol=2 * ROUNDING)
    assert relative((normal * rho).sum(axis=0), np.sqrt(2 * found.h0) / found.G) < ROUNDING
