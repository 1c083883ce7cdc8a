"""Precession of M: the increments of (tri1) and the smooth form of (th3)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from rigidpend import Body, integrate
from rigidpend.coordinates import aligned_from_canonical, body_from_aligned, canonical, scale
from rigidpend.equations import theta3_rate
from rigidpend.hodograph import field
from rigidpend.precession import increments, plateaus, turning_rate
from tests.integrate.problems import ENGINES, on_separatrix, theta1_on

FIG5 = Body(A=(2, "1.5", "1.8"), r=(0, 1, 0), mu="0.01")
BODIES = [
    FIG5,
    Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.004"),
    Body(A=(2, 1, "1.5"), r=(1, 0, 0), mu="0.01"),
]
J2_0 = 0.8


def h0_of(body: Body) -> float:
    return body.kappa * J2_0**2 / 2


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
def test_eq_tri1_is_the_integral_of_th3_along_the_unperturbed_separatrix(
    body: Body, separatrix: int
) -> None:
    theta1, u = theta1_on(separatrix, body), J2_0 * math.sin(body.alpha0)

    def rate(t: float) -> float:
        J1 = J2_0 / (math.exp(-u * t) + 1)
        return float(theta3_rate(J1, J2_0, theta1, float(body.mu), math))

    # The other half is the same, for J1 and J2 - J1 change places.
    half, _ = quad(rate, -70 / u, 0, epsabs=1e-15, epsrel=1e-12, limit=200)
    found = increments(body.angles(), h0_of(body))[separatrix - 1]
    assert found == pytest.approx(2 * half, abs=1e-12)


def test_eq_tri1_printed_initial_value_of_separatrix_1_fails() -> None:
    """At theta1 = alpha0 - beta0 (+ 2 pi) instead, the integrand has another value."""
    body = BODIES[1]
    found = increments(body.angles(), h0_of(body))[[0, 2]]
    printed = body.alpha0 - body.beta0
    for value, extra in zip(found, (0.0, 2 * math.pi), strict=True):
        rate = theta3_rate(J2_0 / 2, J2_0, printed + extra, float(body.mu), math)
        total = rate * math.pi / (J2_0 * math.sin(body.alpha0) / 2)
        assert abs(total - value) > 0.5 * abs(value)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
def test_order_eq_tri1_errs_in_the_second_order_along_perturbed_orbits(
    separatrix: int, engine: str
) -> None:
    """Over |t'| <= T from the middle, where the first order is a known part of the whole."""
    u = J2_0 * math.sin(FIG5.alpha0)
    T = 6 / u
    part = 4 / math.pi * math.atan(math.tanh(u * T / 4))
    errors = []
    for mu in ("0.0004", "0.0002"):
        body = Body(A=FIG5.A, r=(1, 3, 0), mu=mu)
        state = np.array([*on_separatrix(separatrix, body, J2_0 / 2, 0.7, J2_0), 0.0, 0.0])
        ahead, behind = (
            integrate.sample(field(body), state, [0.0, end], engine=engine)[6, -1]
            for end in (T, -T)
        )
        first = increments(body.angles(), h0_of(body))[separatrix - 1]
        errors.append((ahead - behind) - part * first)
    assert abs(errors[0]) < 50 * 0.0004**2
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


def test_agrees_with_the_published_increment_of_fig_5() -> None:
    found = increments(FIG5.angles(), 1.1111)
    np.testing.assert_allclose(found, np.array([1, 1, -1, -1]) * 0.057715, atol=5e-7)


@pytest.mark.parametrize(
    ("beta0", "order"),
    [
        ("straight", "2=1>0>3=4"),
        ("2.5", "2>1>0>3>4"),
        ("2", "2>1=0=3>4"),
        ("1", "2>3>0>1>4"),
        ("0", "2=3>0>1=4"),
    ],
)
def test_increments_are_ordered_as_trieq_says(beta0: str, order: str) -> None:
    made = Body.from_angles(2, 0 if beta0 == "straight" else beta0, "1.5", "0.01")
    # r = (0, 1, 0) is beta0 = pi exactly.
    body = Body(A=made.A, r=(0, 1, 0), mu="0.01") if beta0 == "straight" else made
    value = dict(enumerate([0.0, *increments(body.angles(), h0_of(body))]))
    for left, relation, right in zip(order[::2], order[1::2], order[2::2], strict=False):
        gap = value[int(left)] - value[int(right)]
        assert gap > 1e-4 if relation == ">" else abs(gap) < 1e-14


def test_plateaus_add_up_the_increments_of_a_route() -> None:
    found = plateaus([2, 1, 4, 3, 4, 1], FIG5.angles(), 10 / 9)
    published = [0, 0.0577, 0.1154, 0.0577, 0, -0.0577, 0]
    np.testing.assert_allclose(found, published, atol=5e-5)


def test_turning_rate_is_th3_in_other_variables() -> None:
    rng = np.random.default_rng(5)
    for body in BODIES:
        A: Any = [float(x) for x in body.A]
        J2 = rng.uniform(0.5, 2, 200)
        J1, theta1 = J2 * rng.uniform(0.01, 0.99, 200), rng.uniform(0, 4 * math.pi, 200)
        c = canonical(J1, J2, 0.0, theta1, rng.uniform(0, 6, 200))
        state = aligned_from_canonical(c, body.alpha0, body.beta0)
        M, _ = body_from_aligned(state, body.alpha0, scale(A))
        r, mu = [float(x) for x in body.r], float(body.mu)
        in_dimensionless_time = turning_rate(M, r, mu) / scale(A)
        np.testing.assert_allclose(
            in_dimensionless_time, theta3_rate(J1, J2, theta1, mu, np), rtol=1e-11, atol=1e-15
        )
