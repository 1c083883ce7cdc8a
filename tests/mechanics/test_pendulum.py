"""The pendulum motions against the equations of motion, mpmath, quadrature and each other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from rigidpend import Body
from rigidpend.mechanics import coordinates, equations, pendulum
from tests.strategies import (
    DERIVATIVE,
    FINE,
    ROUNDING,
    along,
    apart,
    bodies,
    fine_angles,
    floats_of,
    in_units,
    largest_difference,
    numbers,
    repeatable,
)

FAMILIES = [1, 2]
GAPS = [1.0, 1e-2, 1e-5, 1e-8, 1e-11, 1e-14]


def sign_of(family: int) -> int:
    """Of M3 = 2 J1 - J2."""
    return 2 * family - 3


@pytest.mark.parametrize("sign", [1, -1])
@repeatable(15)
@given(bodies(), numbers(1.001, 3), numbers(-4, 4))
def test_eq_5_3_solves_euler_poisson_at_energy_h0(
    sign: int, body: Body, surplus: float, t: float
) -> None:
    p, mu, A = fine_angles(body), body.mu.in_context(FINE), [x.in_context(FINE) for x in body.A]
    r, h0 = (FINE.cos(p.beta0 / 2), FINE.sin(p.beta0 / 2), FINE.mpf(0)), surplus * (mu + 1)

    def motion(x: Any) -> list[Any]:
        M, gamma = pendulum.body_motion(x[0], sign, A[2], r, h0, mu, FINE)
        return [*M, *gamma]

    state = motion([FINE.mpf(t)])
    rate = equations.euler_poisson(state[:3], state[3:], A, r, mu)
    assert largest_difference(along(motion, [FINE.mpf(t)], [1]), rate) < DERIVATIVE
    assert abs(equations.energy(state[:3], state[3:], A, r, mu) - h0) < 1e-50
    assert state[2] * sign > 0


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
@repeatable(15)
@given(bodies(), numbers(1.001, 3), numbers(-4, 4), numbers(0, 12))
def test_eq_sol_3_solves_eq1_whatever_theta1_is(
    family: int, body: Body, surplus: float, t: float, theta1: float
) -> None:
    p = fine_angles(body)
    h0 = surplus * (p.mu + 1)

    def motion(x: Any) -> tuple[Any, ...]:
        return pendulum.canonical_motion(x[0], p, h0, family, FINE)

    J1, J2, tau = motion([FINE.mpf(t)])
    theta2 = tau if family == 1 else tau - theta1
    rate = equations.eq1((FINE.mpf(theta1), J1, theta2, J2), p, FINE)
    phase = rate[2] if family == 1 else rate[0] + rate[2]
    expected = along(motion, [FINE.mpf(t)], [1])
    assert largest_difference(expected, (rate[1], rate[3], phase)) < DERIVATIVE


@pytest.mark.parametrize("family", FAMILIES)
@repeatable(30)
@given(bodies(), numbers(1.001, 3))
def test_eq_sol_3_is_5_3_in_other_coordinates(family: int, body: Body, surplus: float) -> None:
    (A, r, mu), p = floats_of(body), body.angles()
    h0, t = surplus * (mu + 1), np.linspace(-5, 5, 41)
    motion = pendulum.body_motion(t, sign_of(family), A[2], r, h0, mu, np)
    M, gamma = np.array(motion[0]), np.array(motion[1])
    found = coordinates.canonical_from_andoyer(coordinates.andoyer_from_body(M, gamma), p.beta0)
    s = coordinates.scale(A)
    J1, J2, tau = pendulum.canonical_motion(t * s, p, h0, family, np)
    c = in_units(found, coordinates.scale(A))
    np.testing.assert_allclose(c.J2, J2, rtol=20 * ROUNDING)
    np.testing.assert_allclose(c.J1, J1, rtol=20 * ROUNDING)
    assert apart(c.theta2 + (c.theta1 if family == 2 else 0), tau, 2 * np.pi) < 20 * ROUNDING


@pytest.mark.parametrize("gap", GAPS)
def test_period_is_the_time_of_a_turn(gap: float) -> None:
    p, h0 = Body((2, 1, "1.5"), (1, 1, 0), "1/2").angles(), 0.5 + gap

    def slowness(x: float) -> float:
        # tau = pi/2 + 2 atan(q tan(x/2)) spreads the top, where J2 is least.
        q = math.sqrt((h0 - p.mu) / (h0 + p.mu)) ** 0.5
        s, c = q * math.sin(x / 2), math.cos(x / 2)
        kinetic = (h0 - p.mu) + 2 * p.mu * s * s / (s * s + c * c)
        return q / (s * s + c * c) / math.sqrt(2 * p.kappa * kinetic)

    whole = 2 * quad(slowness, 0, math.pi, epsabs=0, epsrel=1e-12, limit=500)[0]
    period = pendulum.period(p, h0, math)
    assert period == pytest.approx(whole, rel=1e-11)
    t = np.linspace(0, 0.9, 10)
    now, later = (pendulum.canonical_motion(x, p, h0, 1, np) for x in (t, t + period))
    np.testing.assert_allclose(later[1], now[1], rtol=1e-12)
    assert apart(later[2], now[2], 2 * np.pi) < 1e-12


@given(st.sampled_from([0.5, 0.4999, 0.0, -1.0, math.nan]))
def test_a_pendulum_that_does_not_turn_is_refused(h0: float) -> None:
    p = Body((2, 1, "1.5"), (1, 1, 0), "1/2").angles()
    message = r"h0 > mu is broken: h0 = .*, mu = 0\.5"
    with pytest.raises(ValueError, match=message):
        pendulum.period(p, h0, math)
    with pytest.raises(ValueError, match=message):
        pendulum.modulus(h0, p.mu, math)


def test_other_families_and_signs_are_refused() -> None:
    p = Body((2, 1, "1.5"), (1, 1, 0), "1/2").angles()
    with pytest.raises(ValueError, match="a family is 1"):
        pendulum.canonical_motion(0.0, p, 1.0, 3, math)
    with pytest.raises(ValueError, match="a sign is 1 or -1"):
        pendulum.body_motion(0.0, 2, 1.5, (1, 0, 0), 1.0, 0.5, math)
