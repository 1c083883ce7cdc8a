"""Curves of the Euler case: on both integrals, on integrated orbits, in the flow's sense."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend.mechanics import free_body
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import andoyer_from_body, canonical_from_andoyer, scale
from rigidpend.mechanics.equations import energy, euler_poisson, hamiltonian_J3_0
from rigidpend.orbits.integrate.states import states_at
from tests.bodies import FREE
from tests.strategies import ROUNDING, bodies, floats_of, numbers, repeatable

PHI = np.linspace(-3, 3, 61)
HALF = np.linspace(-1.5, 1.5, 41)
UP = np.array([0.0, 0.0, 1.0])
FAMILIES = [free_body.around_M1, free_body.around_M2]
AXIS = {free_body.around_M1: 0, free_body.around_M2: 1}

Family = Callable[..., Any]


def kinetic(body: Body, M: Any) -> Any:
    """Twice the energy of the body without weight."""
    A, r, _ = floats_of(body)
    return 2 * energy(M, (0, 0, 0), A, r, 0.0)


def rate(body: Body, M: Any) -> Any:
    """dM/dt of the Euler-Poisson equations without weight."""
    A, r, _ = floats_of(body)
    return np.array(euler_poisson(M, UP, A, r, 0.0)[:3])


def orbit(body: Body, M: Any, times: Any) -> Any:
    A, r, _ = floats_of(body)
    state = [*M, *UP]
    return states_at(lambda s, _: euler_poisson(s[:3], s[3:], A, r, 0.0), state, times)[:3]


@pytest.mark.parametrize("family", FAMILIES)
@given(body=bodies(), height=numbers(0.01, 0.999))
@repeatable(20)
def test_invariant_points_of_an_orbit_satisfy_both_integrals(
    family: Family, body: Body, height: float
) -> None:
    for side in (1, -1):
        M = family(body.alpha0, height, side, PHI)
        np.testing.assert_allclose((M**2).sum(axis=0), 1, rtol=ROUNDING)
        twice = kinetic(body, M)
        assert np.ptp(twice) <= ROUNDING * twice.max()


@given(body=bodies())
@repeatable(20)
def test_invariant_a_separatrix_has_the_energy_of_the_middle_axis(body: Body) -> None:
    for number in free_body.SEPARATRICES:
        M = free_body.half_circle(body.alpha0, number, HALF)
        np.testing.assert_allclose((M**2).sum(axis=0), 1, rtol=ROUNDING)
        np.testing.assert_allclose(kinetic(body, M) * float(body.A[2]), 1, rtol=ROUNDING)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("height", [0.2, 0.9, 0.999])
def test_the_height_is_the_largest_M3(family: Family, height: float) -> None:
    axis = AXIS[family]
    for side in (1, -1):
        M = family(FREE.alpha0, height, side, np.linspace(0, 2 * np.pi, 401))
        assert [M[2].max(), -M[2].min()] == pytest.approx([height] * 2, rel=1e-15)
        assert (side * M[axis] > 0).all(), "the sign on the axis that the orbit encircles"
        assert np.ptp(np.sign(M[1 - axis])) == 2


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("height", [0.3, 0.8, 0.99])
@pytest.mark.parametrize("side", [1, -1])
def test_agrees_with_the_integrated_orbit(family: Family, height: float, side: int) -> None:
    times = np.linspace(0, 40, 161)
    found = orbit(FREE, family(FREE.alpha0, height, side, np.array([0.7]))[:, 0], times)
    # The angle is told from M3 and from one other component; the third is then a test.
    other = 1 - AXIS[family]
    reach = family(FREE.alpha0, height, side, np.array([0.0]))[other, 0]
    phi = np.atan2(side * found[2] / height, found[other] / reach)
    expected = family(FREE.alpha0, height, side, phi)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert np.ptp(phi) > 4


@pytest.mark.parametrize("number", free_body.SEPARATRICES)
def test_agrees_with_the_integrated_separatrix(number: int) -> None:
    M = free_body.half_circle(FREE.alpha0, number, np.array([-0.9]))[:, 0]
    found = orbit(FREE, M, np.linspace(0, 4, 41))
    phi = np.arcsin(found[2] * (1 if number in (2, 4) else -1))
    assert (np.diff(phi) > 0).all()
    np.testing.assert_allclose(found, free_body.half_circle(FREE.alpha0, number, phi), atol=1e-10)


@given(body=bodies())
@repeatable(20)
def test_the_separatrices_in_the_plane_are_where_the_paper_has_them(body: Body) -> None:
    alpha0, beta0, turn = body.alpha0, body.beta0, 2 * np.pi
    expected = [beta0 - alpha0, beta0 + alpha0, beta0 - alpha0 + turn, beta0 + alpha0 + turn]
    np.testing.assert_allclose(
        free_body.separatrix_theta1(alpha0, beta0), expected, atol=4 * np.pi * 1e-15
    )


@pytest.mark.parametrize("number", free_body.SEPARATRICES)
def test_a_separatrix_on_the_sphere_is_the_one_of_that_number_in_the_plane(number: int) -> None:
    M = free_body.half_circle(FREE.alpha0, number, HALF)
    start = FREE.beta0 - FREE.alpha0 - 0.1
    theta1, _ = free_body.in_plane(M, FREE.beta0, start)
    expected = free_body.separatrix_theta1(FREE.alpha0, FREE.beta0)[number - 1]
    np.testing.assert_allclose(theta1, expected, atol=1e-14)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("start", [-7.0, 0.0, 3.0])
def test_in_the_plane_an_orbit_is_a_level_curve_of_the_hamiltonian(
    family: Family, start: float
) -> None:
    M = family(FREE.alpha0, 0.9, 1, PHI)
    theta1, J1 = free_body.in_plane(M, FREE.beta0, start)
    assert ((theta1 >= start) & (theta1 < start + 4 * np.pi)).all()
    H = hamiltonian_J3_0(J1, 1.0, (theta1, 0.3), FREE.angles(), np)
    # In units of J2^2, dimensionless: |M|^2 s^2.
    A, _, _ = floats_of(FREE)
    np.testing.assert_allclose(H, kinetic(FREE, M) / (2 * scale(A) ** 2), rtol=ROUNDING)


def test_in_the_plane_theta1_does_not_depend_on_gamma() -> None:
    M = free_body.around_M2(FREE.alpha0, 0.9, -1, PHI)
    theta1, J1 = free_body.in_plane(M, FREE.beta0, 0.0)
    gamma = np.tile([[0.6], [0.0], [-0.8]], PHI.size)
    expected = canonical_from_andoyer(andoyer_from_body(M, gamma), FREE.beta0)
    np.testing.assert_array_equal(theta1, expected.theta1)
    np.testing.assert_array_equal(J1, expected.J1 / expected.J2)
