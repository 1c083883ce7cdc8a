"""Motions beside a pendulum motion against (eq1), in 60 digits; their swing in both its forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from rigidpend import Body
from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.pendulum import (
    Delta_1,
    periodic_solution,
    riccati_coefficients,
    swing_coefficients,
    theta1_rate,
)
from tests.strategies import (
    DERIVATIVE,
    FINE,
    along,
    bodies,
    fine_angles,
    floats_of,
    largest_difference,
    numbers,
    repeatable,
)

BODIES = [
    pytest.param((2, 1, "1.5"), (1, 1), id="Grioli"),
    pytest.param((2, "1.2", "1.7"), (1, 3), id="generic"),
    pytest.param((2, "0.2", "1.8"), (3, 1), id="flat"),
]
GENERIC = Body((2, "1.2", "1.7"), (1, 3, 0), "0.3")
H0 = 1.2
MUS = ("1e-3", "1e-4", "1e-5")
SIGNS = [(family, epsilon) for family in (1, 2) for epsilon in (1, -1)]
ANGLES = [
    pytest.param(("1.9", "1.2", "1.5"), id="generic"),
    pytest.param(("1.2", "1.2", "1"), id="Hess"),
    pytest.param(("1.9", "0", "1.5"), id="beta0=0"),
    pytest.param(("1.9", "pi", "1.5"), id="beta0=pi"),
    pytest.param(("0.01", "1", "0.0085"), id="alpha0 near 0"),
    pytest.param(("3.13", "1", "3"), id="alpha0 near pi"),
]


def Delta_1_from_moments(A: Any, r: Any, mu: float, h0: float, epsilon: int) -> float:
    """The second of the printed forms of (dt), from the body's own numbers."""
    A1, A2, A3 = A
    lean = r[0] * A1 * math.sqrt(A2 * (A3 - A2)) + epsilon * r[1] * A2 * math.sqrt(A1 * (A1 - A3))
    square = 4 * A3 * (A1 + A2 - A3) - 3 * A1 * A2
    return mu * abs(lean) / (math.sqrt(A3 * (A1 - A2) * square) * h0)


@pytest.mark.slow
@pytest.mark.parametrize("epsilon", [1, -1])
@repeatable(50)
@given(bodies())
def test_eq_dt_the_two_printed_forms_are_equal(epsilon: int, body: Body) -> None:
    A, r, mu = floats_of(body)
    printed = Delta_1_from_moments(A, r, mu, H0, epsilon)
    # Where beta0 is near alpha0 what is left is their rounding.
    assert Delta_1(body.angles(), H0, epsilon, math) == pytest.approx(printed, rel=1e-12, abs=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(("family", "epsilon"), SIGNS)
@repeatable(50)
@given(bodies())
def test_eq_dt_is_the_amplitude_of_T1_and_of_T2(family: int, epsilon: int, body: Body) -> None:
    p = body.angles()
    amplitude = p.mu * math.hypot(*swing_coefficients(p, H0, family, epsilon, math))
    assert Delta_1(p, H0, epsilon, math) == pytest.approx(amplitude, rel=1e-12, abs=1e-15)


def residual(angles: Any, family: int, epsilon: int, mu: str, solution: Any) -> float:
    """What the family leaves of (eq1), the largest over a turn."""
    p = fine_angles(Body.from_angles(angles[0], angles[1], angles[2], mu))
    h0 = FINE.mpf("1.2")
    rate = p.kappa * FINE.sqrt(2 * h0 / p.kappa)
    phases = [FINE.mpf(k) * 2 * FINE.pi / 12 for k in range(12)]

    def state(x: Any) -> Any:
        return solution(x[0], p, h0, family, epsilon, FINE)

    return max(
        largest_difference(along(state, [x], [rate]), eq1(state([x]), p, FINE)) for x in phases
    )


def slope(sizes: list[float]) -> float:
    """The fitted power of mu."""
    return float(np.polyfit(np.log([float(mu) for mu in MUS]), np.log(sizes), 1)[0])


@pytest.mark.slow
@pytest.mark.parametrize("angles", ANGLES)
@pytest.mark.parametrize(("family", "epsilon"), SIGNS)
def test_eq_tt_leaves_a_residual_of_second_order(angles: Any, family: int, epsilon: int) -> None:
    left = [residual(angles, family, epsilon, mu, periodic_solution) for mu in MUS]
    assert slope(left) == pytest.approx(2, abs=0.01)


def T2_as_printed(theta2: Any, p: Any, h0: Any, family: int, epsilon: int, m: Any) -> Any:
    theta1, J1, angle, J2 = periodic_solution(theta2, p, h0, family, epsilon, m)
    right, printed = m.cos(p.beta0 + epsilon * p.alpha0 + theta2), m.cos(theta2)
    return theta1, J1, angle + p.mu / (2 * h0) * (printed - right), J2


@pytest.mark.slow
@pytest.mark.parametrize("angles", ANGLES)
def test_eq_tt_as_printed_leaves_a_residual_of_first_order_at_J1_J2(angles: Any) -> None:
    left = [residual(angles, 2, 1, mu, T2_as_printed) for mu in MUS]
    assert slope(left) == pytest.approx(1, abs=0.01)


def beside(
    theta1: Any, tau: Any, p: Angles, h: Any, family: int, share: Any = 0
) -> tuple[Any, Any, Any]:
    """From (eq1) at the energy h: rates of theta1, tau and ln(small action) in t'."""
    J2 = FINE.sqrt(2 * (h - p.mu * FINE.sin(tau)) / p.kappa)
    small = share * J2
    if family == 1:
        rates = eq1((theta1, small, tau, J2), p, FINE)
        return rates[0], rates[2], rates[1] / (small or 1)
    rates = eq1((theta1, J2 - small, tau - theta1, J2), p, FINE)
    return rates[0], rates[0] + rates[2], (rates[3] - rates[1]) / (small or 1)


def fine(*x: float) -> list[Any]:
    return [FINE.mpf(y) for y in x]


def ric_residual(theta1: Any, tau: Any, p: Angles, h: Any, family: int, coefficients: Any) -> Any:
    """What y' + a0 y^2 + a1 y + a2 leaves, with y' from (eq1) by the chain rule."""
    rate, clock, _ = beside(theta1, tau, p, h, family)
    y = FINE.cot(theta1 / 2)
    slope = along(lambda x: [FINE.cot(x[0] / 2)], [theta1], [rate / clock])[0]
    a0, a1, a2 = coefficients
    return abs(slope + a0 * y * y + a1 * y + a2) / (1 + y * y)


@pytest.mark.parametrize("family", [1, 2])
@repeatable(30)
@given(bodies(), numbers(1.001, 3), numbers(0.1, 6.1), numbers(0, 6.3))
def test_eq_eq_Ric1_is_eq1_beside_the_pendulum_motions(
    family: int, body: Body, surplus: float, theta1: float, tau: float
) -> None:
    p, (x, phase) = fine_angles(body), fine(theta1, tau)
    h = surplus * (p.mu + 1)
    found = riccati_coefficients(phase, p, h, family, FINE)
    assert ric_residual(x, phase, p, h, family, found) < DERIVATIVE
    # And the same without poles.
    rate, clock, _ = beside(x, phase, p, h, family)
    assert abs(theta1_rate(x, found, FINE) - rate / clock) < 1e-50


@pytest.mark.parametrize("family", [1, 2])
@repeatable(30)
@given(bodies(), numbers(-6.3, 12.6), numbers(0, 6.3))
def test_invariant_the_small_action_grows_as_theta1_contracts(
    family: int, body: Body, theta1: float, tau: float
) -> None:
    p, (x, phase) = fine_angles(body), fine(theta1, tau)
    h = p.mu + 1
    _, clock, growth = beside(x, phase, p, h, family, FINE.mpf("1e-30"))
    a = riccati_coefficients(phase, p, h, family, FINE)
    slope = along(lambda z: [theta1_rate(z[0], a, FINE)], [x], [1])[0]
    assert abs(growth / clock + slope) < 1e-28


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_the_pull_keeps_its_precision_at_the_top(gap: float) -> None:
    p, h = GENERIC.angles(), 0.3 + gap
    tau = math.pi / 2 + math.sqrt(gap)
    exact = p._replace(**{name: FINE.mpf(value) for name, value in p._asdict().items()})
    found = riccati_coefficients(tau, p, h, 1, math)
    expected = riccati_coefficients(FINE.mpf(tau), exact, FINE.mpf(h), 1, FINE)
    # The phase is itself rounded, by 1e-16 of its distance sqrt(gap) from the top.
    assert found[2] == pytest.approx(float(expected[2]), rel=1e-15 / math.sqrt(gap) + 1e-14)


def test_other_families_and_epsilons_are_refused() -> None:
    p = Body((2, 1, "1.5"), (1, 1, 0), "0.01").angles()
    with pytest.raises(ValueError, match="a family is 1"):
        periodic_solution(0.0, p, H0, 3, 1, math)
    with pytest.raises(ValueError, match="epsilon is 1 or -1"):
        periodic_solution(0.0, p, H0, 1, 0, math)
    with pytest.raises(ValueError, match="a family is 1"):
        riccati_coefficients(0.0, p, 1.0, 0, math)
