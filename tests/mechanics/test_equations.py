"""Fields against the gradients of their Hamiltonians, and descriptions against each other."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

from rigidpend import Body
from rigidpend.mechanics import coordinates as co
from rigidpend.mechanics import equations as eq
from rigidpend.mechanics.coordinates import Canonical
from tests.strategies import (
    DERIVATIVE,
    FINE,
    aligned_from_body,
    bodies,
    canonicals,
    examples,
    fine_angles,
    floats_of,
    gradient,
    in_units,
    largest_difference,
    momenta,
    rational_vectors,
    verticals,
)

MOMENTS = st.tuples(*[st.fractions("1/3", 5, max_denominator=9)] * 3)
WEIGHTS = st.fractions(0, 3, max_denominator=9)
SIX = st.tuples(*[st.fractions(-3, 3, max_denominator=9)] * 6)
SIZES = 2.0**-60, 2.0**60


@pytest.mark.slow
@examples(8, rational_vectors(), rational_vectors(), MOMENTS, rational_vectors(), WEIGHTS)
def test_eq_eq_is_the_bracket_with_the_energy(
    M: Any, gamma: Any, A: Any, r: Any, mu: Fraction
) -> None:
    # The energy is quadratic: differences on both sides are its slopes, exactly so in Fractions.
    units, x = np.eye(6, dtype=int).astype(object), np.array([*M, *gamma])
    ahead, behind = (
        [eq.energy((x + side * unit)[:3], (x + side * unit)[3:], A, r, mu) for unit in units]
        for side in (1, -1)
    )
    by_M, by_gamma = np.split((np.array(ahead) - behind) / 2, 2)
    expected = [*(np.cross(M, by_M) + np.cross(gamma, by_gamma)), *np.cross(gamma, by_M)]
    assert list(eq.euler_poisson(M, gamma, A, r, mu)) == expected


def flat(c: Canonical) -> list[Any]:
    """theta1, J1, theta2, J2 of a state in 60 digits, in the order of (eq1)."""
    return [FINE.mpf(float(x)) for x in (c.theta1, c.J1, c.theta2, c.J2)]


@examples(6, bodies(), canonicals())
def test_eq_eq1_is_the_gradient_of_the_hamiltonian_at_J3_0(body: Body, c: Canonical) -> None:
    p = fine_angles(body)
    by_theta1, by_J1, by_theta2, by_J2 = gradient(
        lambda x: eq.hamiltonian_J3_0(x[1], x[3], (x[0], x[2]), p, FINE), flat(c)
    )
    expected = (by_J1, -by_theta1, by_J2, -by_theta2)
    assert largest_difference(eq.eq1(flat(c), p, FINE), expected) < DERIVATIVE


@examples(6, bodies(), canonicals())
def test_eq_h0_new_is_h_new_at_J3_0(body: Body, c: Canonical) -> None:
    p, (theta1, J1, theta2, J2) = fine_angles(body), flat(c)
    full = eq.hamiltonian((J1, J2, 0), (theta1, theta2), p, FINE)
    assert abs(full - eq.hamiltonian_J3_0(J1, J2, (theta1, theta2), p, FINE)) < 1e-50


def andoyer_and_energy(body: Body, c: Canonical) -> tuple[co.Andoyer, Any]:
    """Physical Andoyer variables, and the energy of the body state that they describe."""
    A, r, mu = floats_of(body)
    a = co.andoyer_from_canonical(in_units(c, 1 / co.scale(A)), body.beta0)
    return a, eq.energy(*co.body_from_andoyer(a), A, r, mu)


@pytest.mark.slow
@examples(8, bodies(), canonicals())
def test_eq_h_d_is_the_energy_of_the_body(body: Body, c: Canonical) -> None:
    a, energy = andoyer_and_energy(body, c)
    found = eq.hamiltonian_andoyer(a, floats_of(body)[0], body.beta0, float(body.mu), np)
    assert found == pytest.approx(energy, rel=1e-13, abs=1e-13)


@pytest.mark.slow
@examples(8, bodies(), canonicals())
def test_eq_h_new_is_the_energy_of_the_body(body: Body, c: Canonical) -> None:
    _, energy = andoyer_and_energy(body, c)
    found = eq.hamiltonian((c.J1, c.J2, c.J3), (c.theta1, c.theta2), body.angles(), np)
    assert found == pytest.approx(energy, rel=1e-13, abs=1e-13)


@examples(6, bodies(), canonicals())
def test_eq_th3_is_the_derivative_of_h_new_by_J3(body: Body, c: Canonical) -> None:
    p, (theta1, J1, theta2, J2) = fine_angles(body), flat(c)
    (slope,) = gradient(
        lambda x: eq.hamiltonian((J1, J2, x[0]), (theta1, theta2), p, FINE), [FINE.mpf(0)]
    )
    assert abs(eq.theta3_rate(J1, J2, theta1, p.mu, FINE) - slope) < DERIVATIVE


@pytest.mark.slow
@examples(8, bodies(), momenta(), verticals())
def test_agrees_aligned_with_euler_poisson(body: Body, M: Any, gamma: Any) -> None:
    A, r, mu = floats_of(body)
    s, coefficients = float(co.scale(A)), eq.aligned_coefficients(body.angles(), np)
    rate = eq.euler_poisson(M, gamma, A, r, mu)
    # The map is linear: derivatives go through it as the state does.
    expected = aligned_from_body(rate[:3], np.array(rate[3:]) / s, body.alpha0, 1.0)
    found = eq.aligned(aligned_from_body(M, gamma, body.alpha0, s), coefficients)
    size = mu + np.sum(M * M) / A[1] + np.sum(np.abs(M)) / (A[1] * s)
    assert largest_difference(found, expected) <= 1e-13 * size


@examples(8, bodies(), SIX, SIX)
def test_the_derivative_of_the_aligned_field_is_exact_along_changes_of_any_size(
    body: Body, x: Any, along: Any
) -> None:
    c, y = eq.aligned_coefficients(body.angles(), np), np.array(along)
    exactly = eq.AlignedCoefficients(*map(Fraction, c))
    # The field is quadratic: its central difference in Fractions is the derivative.
    ahead, back = (np.array(eq.aligned(x + side * y, exactly)) for side in (1, -1))
    assert list(eq.aligned_along(x, y, exactly)) == list((ahead - back) / 2)
    small, large = (eq.aligned_along(map(float, x), size * y.astype(float), c) for size in SIZES)
    assert np.array(small) / SIZES[0] == pytest.approx(np.array(large) / SIZES[1], rel=0, abs=0)
