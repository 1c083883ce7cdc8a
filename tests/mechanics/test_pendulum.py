"""Pendulum motions against the equations of motion, motions beside them against (eq1)."""

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics import coordinates, equations, pendulum
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.pendulum import (
    Delta_1,
    periodic_solution,
    riccati_coefficients,
    swing_coefficients,
)
from tests.strategies import (
    DERIVATIVE,
    FINE,
    ROUNDING,
    along,
    apart,
    bodies,
    examples,
    fine_angles,
    floats_of,
    in_units,
    largest_difference,
    numbers,
)

FAMILIES = [1, 2]
P = Body((2, 1, "1.5"), (1, 1, 0), "1/2").angles()
GAPS = [1.0, 1e-2, 1e-5, 1e-8, 1e-11, 1e-14]


@pytest.mark.parametrize("sign", [1, -1])
@examples(6, bodies(), numbers(1.001, 3), numbers(-4, 4))
def test_eq_5_3_solves_euler_poisson_at_energy_h0(
    sign: int, body: Body, surplus: float, t: float
) -> None:
    p, mu, A = fine_angles(body), body.mu.at(FINE.prec), [x.at(FINE.prec) for x in body.A]
    r, h0 = (FINE.cos(p.beta0 / 2), FINE.sin(p.beta0 / 2), FINE.mpf(0)), surplus * (mu + 1)

    def motion(x: Any) -> list[Any]:
        M, gamma = pendulum.body_motion(x[0], sign, A[2], r, h0, mu, FINE)
        return [*M, *gamma]

    state = motion([FINE.mpf(t)])
    rate = equations.euler_poisson(state[:3], state[3:], A, r, mu)
    assert largest_difference(along(motion, [FINE.mpf(t)], [1]), rate) < DERIVATIVE
    assert abs(equations.energy(state[:3], state[3:], A, r, mu) - h0) < 1e-50
    assert state[2] * sign > 0


@pytest.mark.parametrize("family", FAMILIES)
@examples(6, bodies(), numbers(1.001, 3))
def test_eq_sol_3_is_5_3_in_other_coordinates(family: int, body: Body, surplus: float) -> None:
    (A, r, mu), p = floats_of(body), body.angles()
    h0, t = surplus * (mu + 1), np.linspace(-5, 5, 41)
    motion = pendulum.body_motion(t, 2 * family - 3, A[2], r, h0, mu, np)
    M, gamma = np.array(motion[0]), np.array(motion[1])
    found = coordinates.canonical_from_andoyer(coordinates.andoyer_from_body(M, gamma), p.beta0)
    s = coordinates.scale(A)
    J1, J2, tau = pendulum.canonical_motion(t * s, p, h0, family, np)
    c = in_units(found, coordinates.scale(A))
    np.testing.assert_allclose(c.J2, J2, rtol=20 * ROUNDING)
    np.testing.assert_allclose(c.J1, J1, rtol=20 * ROUNDING)
    assert apart(c.theta2 + (c.theta1 if family == 2 else 0), tau, 2 * np.pi) < 20 * ROUNDING


@pytest.mark.parametrize("gap", GAPS)
def test_the_modulus_keeps_its_digits_and_the_period_is_the_time_of_a_turn(gap: float) -> None:
    h0 = P.mu + gap
    exact = FINE.sqrt((FINE.mpf(h0) - P.mu) / (FINE.mpf(h0) + P.mu))
    assert abs(pendulum.complement(h0, P.mu, math) / exact - 1) < ROUNDING
    t = np.linspace(0, pendulum.period(P, h0, math), 101)
    _, J2, tau = pendulum.canonical_motion(t, P, h0, 1, np)
    assert J2[-1] == pytest.approx(J2[0], rel=1e-12, abs=0)
    # It is fastest where it begins, at the lowest point.
    assert np.ptp(np.unwrap(tau)) == pytest.approx(2 * np.pi, abs=1e-12)


TURNS = r"h0 > mu is broken: h0 = .*, mu = 0\.5"


@pytest.mark.parametrize(
    ("function", "given", "said"),
    [
        *((pendulum.period, (P, h0), TURNS) for h0 in (0.5, 0.4999, 0.0, -1.0, math.nan)),
        (pendulum.complement, (0.5, P.mu), TURNS),
        (pendulum.canonical_motion, (0.0, P, 1.0, 3), "a family is 1"),
        (pendulum.body_motion, (0.0, 2, 1.5, (1, 0, 0), 1.0, 0.5), "a sign is 1 or -1"),
        (periodic_solution, (0.0, P, 1.2, 1, 0), "epsilon is 1 or -1"),
    ],
)
def test_what_is_no_motion_is_refused(function: Any, given: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        function(*given, math)


GENERIC = Body((2, "1.2", "1.7"), (1, 3, 0), "0.3")
H0 = 1.2
MUS = ("1e-3", "1e-5")
SIGNS = [(family, epsilon) for family in (1, 2) for epsilon in (1, -1)]
BODIES = [
    pytest.param(GENERIC, id="generic"),
    pytest.param(Body.from_angles("1.2", "1.2", "1", 0), id="Hess"),
    pytest.param(Body(GENERIC.A, (1, 0, 0), 0), id="beta0=0"),
    pytest.param(Body(GENERIC.A, (0, 1, 0), 0), id="beta0=pi"),
    pytest.param(Body.from_angles("0.01", "1", "0.0085", 0), id="alpha0 near 0"),
    pytest.param(Body.from_angles("3.13", "1", "3", 0), id="alpha0 near pi"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("family", "epsilon"), SIGNS)
@examples(8, bodies())
def test_eq_dt_is_the_amplitude_of_T1_and_of_T2(family: int, epsilon: int, body: Body) -> None:
    p = body.angles()
    amplitude = p.mu * math.hypot(*swing_coefficients(p, H0, family, epsilon, math))
    assert Delta_1(p, H0, epsilon, math) == pytest.approx(amplitude, rel=1e-12, abs=1e-15)


def residual(body: Body, family: int, epsilon: int, mu: str, solution: Any) -> float:
    """What the family leaves of (eq1), the largest over a turn."""
    p = fine_angles(body)._replace(mu=FINE.mpf(mu))
    h0 = FINE.mpf("1.2")
    rate = p.kappa * FINE.sqrt(2 * h0 / p.kappa)
    phases = [FINE.mpf(k) * 2 * FINE.pi / 3 for k in range(3)]

    def state(x: Any) -> Any:
        return solution(x[0], p, h0, family, epsilon, FINE)

    return max(
        largest_difference(along(state, [x], [rate]), eq1(state([x]), p, FINE)) for x in phases
    )


def slope(sizes: list[float]) -> float:
    """The fitted power of mu."""
    return float(np.polyfit(np.log([float(mu) for mu in MUS]), np.log(sizes), 1)[0])


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize(("family", "epsilon"), SIGNS)
def test_eq_tt_leaves_a_residual_of_second_order(body: Body, family: int, epsilon: int) -> None:
    left = [residual(body, family, epsilon, mu, periodic_solution) for mu in MUS]
    assert slope(left) == pytest.approx(2, abs=0.01)


def T2_as_printed(theta2: Any, p: Any, h0: Any, family: int, epsilon: int, m: Any) -> Any:
    theta1, J1, angle, J2 = periodic_solution(theta2, p, h0, family, epsilon, m)
    right, printed = m.cos(p.beta0 + epsilon * p.alpha0 + theta2), m.cos(theta2)
    return theta1, J1, angle + p.mu / (2 * h0) * (printed - right), J2


def test_eq_tt_as_printed_leaves_a_residual_of_first_order_at_J1_J2() -> None:
    left = [residual(GENERIC, 2, 1, mu, T2_as_printed) for mu in MUS]
    assert slope(left) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("family", FAMILIES)
@examples(6, bodies(), numbers(1.001, 3), numbers(0.1, 6.1), numbers(0, 6.3))
def test_eq_eq_Ric1_is_eq1_beside_the_pendulum_motions(
    family: int, body: Body, surplus: float, theta1: float, tau: float
) -> None:
    p, x, phase = fine_angles(body), FINE.mpf(theta1), FINE.mpf(tau)
    h = surplus * (p.mu + 1)
    a0, a1, a2 = riccati_coefficients(phase, p, h, family, FINE)
    J2 = FINE.sqrt(2 * (h - p.mu * FINE.sin(phase)) / p.kappa)
    state = (x, J2, phase - x, J2) if family == 2 else (x, 0, phase, J2)
    rate, _, clock, _ = eq1(state, p, FINE)
    # y' of y = cot(theta1/2) from (eq1), by the chain rule; the phase is that of the pendulum.
    y, clock = FINE.cot(x / 2), clock + (rate if family == 2 else 0)
    slope = along(lambda z: [FINE.cot(z[0] / 2)], [x], [rate / clock])[0]
    assert abs(slope + a0 * y * y + a1 * y + a2) < DERIVATIVE * (1 + y * y)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_the_pull_keeps_its_precision_at_the_top(gap: float) -> None:
    p, h = GENERIC.angles(), 0.3 + gap
    tau = math.pi / 2 + math.sqrt(gap)
    exact = p._replace(**{name: FINE.mpf(value) for name, value in p._asdict().items()})
    found = riccati_coefficients(tau, p, h, 1, math)
    expected = riccati_coefficients(FINE.mpf(tau), exact, FINE.mpf(h), 1, FINE)
    # The phase is itself rounded, by 1e-16 of its distance sqrt(gap) from the top.
    assert found[2] == pytest.approx(float(expected[2]), rel=1e-15 / math.sqrt(gap) + 1e-14)
