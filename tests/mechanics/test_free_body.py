"""The free body: its orbits on the sphere, and its separatrices in time, to the last digit."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics import free_body
from rigidpend.mechanics.coordinates import aligned_from_canonical, momentum, scale
from rigidpend.mechanics.equations import energy, euler_poisson, hamiltonian_J3_0
from rigidpend.mechanics.free_body import SEPARATRICES, SeparatrixMotion, separatrix, unperturbed
from tests.orbits.integrate.problems import FREE, GENERIC, theta1_on
from tests.strategies import (
    DERIVATIVE,
    FINE,
    ROUNDING,
    along,
    bodies,
    canonicals,
    examples,
    fine_angles,
    floats_of,
    largest_difference,
    relative,
)

PHI = np.linspace(-3, 3, 61)
HALF = np.linspace(-1.5, 1.5, 41)
FAMILIES = [free_body.around_M1, free_body.around_M2]
AXIS = {free_body.around_M1: 0, free_body.around_M2: 1}

Family = Callable[..., Any]


@pytest.mark.parametrize("number", free_body.SEPARATRICES)
def test_a_separatrix_on_the_sphere_is_the_one_of_that_number_in_the_plane(number: int) -> None:
    M = free_body.half_circle(FREE.alpha0, number, HALF)
    middle = FREE.beta0 - FREE.alpha0 - 0.1 + 2 * np.pi
    theta1, J1 = free_body.in_plane(M, FREE.beta0, middle)
    assert (np.diff(J1) * (1 if number in (2, 4) else -1) > 0).all()
    np.testing.assert_allclose(theta1, theta1_on(number, FREE), atol=1e-14)
    told = free_body.separatrix_theta1(FREE.alpha0, FREE.beta0)[number - 1]
    assert told == pytest.approx(theta1_on(number, FREE), rel=1e-15, abs=0)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("height", [0.3, 0.8, 0.99])
@pytest.mark.parametrize(("side", "middle"), [(1, -1.0), (-1, 6.0), (1, 9.0)])
def test_an_orbit_keeps_momentum_and_energy_on_the_sphere_and_in_the_plane(
    family: Family, height: float, side: int, middle: float
) -> None:
    M = family(FREE.alpha0, height, side, PHI)
    A, nowhere = floats_of(FREE)[0], (0, 0, 0)
    # In units of J2^2, dimensionless: |M|^2 s^2.
    free = energy(M, nowhere, A, nowhere, 0.0) / scale(A) ** 2
    np.testing.assert_allclose((M * M).sum(axis=0), 1, rtol=ROUNDING)
    np.testing.assert_allclose(free, free[0], rtol=ROUNDING)
    assert np.abs(M[2]).max() == pytest.approx(height, rel=1e-3)
    assert (side * M[AXIS[family]] > 0).all(), "the sign on the axis that it encircles"
    assert np.ptp(np.unwrap(np.atan2(M[2], M[1 - AXIS[family]]))) > 4
    theta1, J1 = free_body.in_plane(M, FREE.beta0, middle)
    assert (np.abs(theta1 - middle) <= 2 * np.pi).all()
    H = hamiltonian_J3_0(J1, 1.0, (theta1, 0.3), FREE.angles(), np)
    np.testing.assert_allclose(H, free, rtol=ROUNDING)


HALF_PLANES = {1: (0, -1), 2: (1, 0), 3: (0, 1), 4: (-1, 0)}
"""The signs of Qp and Qm on each separatrix (`equations.aligned`)."""


def assert_solves(number: int) -> None:
    """In its half plane, with the rates of the free body, whatever the weight."""
    p = fine_angles(GENERIC)
    for share, t in ((1e-9, 3.0), (0.3, -1.0), (1 - 1e-9, 0.5)):
        J1, J2 = FINE.mpf(share) * FINE.mpf("0.8"), FINE.mpf("0.8")
        motion = SeparatrixMotion(number, J1, J2 - J1, FINE.mpf("0.3"))

        def state(x: Any, motion: SeparatrixMotion = motion) -> list[Any]:
            c = separatrix(x[0], motion, p, FINE)
            return [c.theta1, c.J1, c.theta2, c.J2]

        at = [FINE.mpf(t)]
        rate = unperturbed(state(at), p, FINE)
        assert largest_difference(along(state, at, [1]), rate) < DERIVATIVE
        assert (rate[1] > 0) == (free_body.direction(number) == 1)
        aligned = aligned_from_canonical(
            separatrix(at[0], motion, p, FINE), p.alpha0, p.beta0, FINE
        )
        for Q, sign in zip(aligned[:2], HALF_PLANES[number], strict=True):
            assert Q * sign > 1e-6 if sign else abs(Q) < 1e-55


def test_eq_sol_1_falls_where_Qm_is_negative() -> None:
    assert_solves(1)


def test_eq_sol_2_rises_where_Qp_is_positive() -> None:
    assert_solves(2)


def test_eq_sol_12_falls_where_Qm_is_positive() -> None:
    assert_solves(3)


def test_eq_sol_22_rises_where_Qp_is_negative() -> None:
    assert_solves(4)


@examples(6, bodies(), canonicals())
def test_eq_eq1_0_is_euler_s_equation_of_the_free_body(body: Body, c: Any) -> None:
    p, A = fine_angles(body), [x.at(FINE.prec) for x in body.A]
    s = scale(A, FINE)

    def M(x: Any) -> list[Any]:
        theta1, J1, _, J2 = x
        l, across = (theta1 - p.beta0) / 2, 2 * FINE.sqrt(J1 * (J2 - J1)) / J2
        turned = momentum(J2, (2 * J1 - J2) / J2, across, FINE.sin(l), FINE.cos(l))
        return [component / s for component in turned]

    x = [FINE.mpf(float(y)) for y in (c.theta1, c.J1, c.theta2, c.J2)]
    rate = along(M, x, [s * y for y in unperturbed(x, p, FINE)])
    free = euler_poisson(M(x), (0, 0, 1), A, (1, 0, 0), 0)[:3]
    assert largest_difference(rate, free) < 1e-28


@pytest.mark.parametrize("number", SEPARATRICES)
@pytest.mark.parametrize("J1_0", [1e-200, 1e-8, 0.4])
@pytest.mark.parametrize("exchanged", [False, True])
def test_both_actions_keep_their_relative_precision(
    number: int, J1_0: float, exchanged: bool
) -> None:
    pair = (1.0, J1_0) if exchanged else (J1_0, 1.0)
    p, fine = GENERIC.angles(), fine_angles(GENERIC)
    low, high = map(FINE.mpf, pair)
    for t in (0.0, 2.0, -300.0, 500.0):
        found = separatrix(t, SeparatrixMotion(number, *pair, 0.3), p)
        expected = separatrix(FINE.mpf(t), SeparatrixMotion(number, low, high, 0), fine, FINE)
        # exp(u t) is known as well as u t, and nothing of what is below 1e-300.
        for one, true in ((found.J1, expected.J1), (found.J2mJ1, expected.J2mJ1)):
            assert true <= 1e-300 or relative(one, float(true)) < ROUNDING + 4e-16 * abs(t)
        assert relative(found.J2, 1.0 + J1_0) < ROUNDING


def test_there_are_four_separatrices() -> None:
    for number in (0, 5, -1):
        with pytest.raises(ValueError, match="numbered 1 to 4"):
            free_body.theta1(number, GENERIC.angles())
