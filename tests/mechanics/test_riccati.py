"""The Riccati equation against (eq1), by the chain rule and the energy, in 60 digits."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given

from rigidpend import Body
from rigidpend.mechanics import riccati
from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import eq1
from tests.strategies import DERIVATIVE, FINE, along, bodies, fine_angles, numbers, repeatable

FAMILIES = [1, 2]
BODY = Body((2, "1.2", "1.7"), (1, 3, 0), "0.3")


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


def residual(theta1: Any, tau: Any, p: Angles, h: Any, family: int, coefficients: Any) -> Any:
    """What y' + a0 y^2 + a1 y + a2 leaves, with y' from (eq1) by the chain rule."""
    rate, clock, _ = beside(theta1, tau, p, h, family)
    y = FINE.cot(theta1 / 2)
    slope = along(lambda x: [FINE.cot(x[0] / 2)], [theta1], [rate / clock])[0]
    a0, a1, a2 = coefficients
    return abs(slope + a0 * y * y + a1 * y + a2) / (1 + y * y)


@pytest.mark.parametrize("family", FAMILIES)
@repeatable(30)
@given(bodies(), numbers(1.001, 3), numbers(0.1, 6.1), numbers(0, 6.3))
def test_eq_eq_Ric1_is_eq1_beside_the_pendulum_motions(
    family: int, body: Body, surplus: float, theta1: float, tau: float
) -> None:
    p, (x, phase) = fine_angles(body), fine(theta1, tau)
    h = surplus * (p.mu + 1)
    found = riccati.coefficients(phase, p, h, family, FINE)
    assert residual(x, phase, p, h, family, found) < DERIVATIVE


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
@repeatable(30)
@given(bodies(), numbers(1.001, 3), numbers(-6.3, 12.6), numbers(0, 6.3))
def test_agrees_the_regular_form_with_eq1(
    family: int, body: Body, surplus: float, theta1: float, tau: float
) -> None:
    p, (x, phase) = fine_angles(body), fine(theta1, tau)
    h = surplus * (p.mu + 1)
    a = riccati.coefficients(phase, p, h, family, FINE)
    rate, clock, _ = beside(x, phase, p, h, family)
    assert abs(riccati.theta1_rate(x, a, FINE) - rate / clock) < 1e-50


@pytest.mark.parametrize("family", FAMILIES)
@repeatable(30)
@given(bodies(), numbers(-6.3, 12.6), numbers(0, 6.3))
def test_invariant_the_small_action_grows_as_theta1_contracts(
    family: int, body: Body, theta1: float, tau: float
) -> None:
    p, (x, phase) = fine_angles(body), fine(theta1, tau)
    h = p.mu + 1
    _, clock, growth = beside(x, phase, p, h, family, FINE.mpf("1e-30"))
    a = riccati.coefficients(phase, p, h, family, FINE)
    slope = along(lambda z: [riccati.theta1_rate(z[0], a, FINE)], [x], [1])[0]
    assert abs(growth / clock + slope) < 1e-28


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
def test_the_pull_keeps_its_precision_at_the_top(gap: float) -> None:
    p, h = BODY.angles(), 0.3 + gap
    tau = math.pi / 2 + math.sqrt(gap)
    exact = p._replace(**{name: FINE.mpf(value) for name, value in p._asdict().items()})
    found = riccati.coefficients(tau, p, h, 1, math)
    expected = riccati.coefficients(FINE.mpf(tau), exact, FINE.mpf(h), 1, FINE)
    # The phase is itself rounded, by 1e-16 of its distance sqrt(gap) from the top.
    assert found[2] == pytest.approx(float(expected[2]), rel=1e-15 / math.sqrt(gap) + 1e-14)


def test_other_families_are_refused() -> None:
    with pytest.raises(ValueError, match="a family is 1"):
        riccati.coefficients(0.0, BODY.angles(), 1.0, 0, math)
