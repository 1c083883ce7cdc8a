"""Both engines against the paper's closed solutions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ellipj, ellipk

from rigidpend import Body
from rigidpend.mechanics.coordinates import Aligned, canonical_from_aligned
from rigidpend.mechanics.equations import (
    aligned,
    aligned_coefficients,
    eq1,
    euler_poisson,
)
from rigidpend.orbits.integrate import Outcome
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import (
    ENGINES,
    FREE,
    WAYS,
    find,
    on_separatrix,
    theta1_on,
)
from tests.strategies import apart, floats_of

Array = NDArray[np.float64]

J2, THETA2, V = 1.3, 0.7, 12.0
"""|M|, initial phase and v of the separatrices below: J1 from 8e-6 J2 up, or down to it."""
TIMES = np.linspace(0, 2 * V / (J2 * math.sin(FREE.alpha0)), 40)

PENDULA = [
    # mu and h0: a small perturbation, and a pendulum that hardly gets over the top.
    pytest.param(Body((2, 1, "1.5"), (1, 1, 0), "0.001"), 1.3342, id="k=0.04"),
    pytest.param(Body((2, "1.2", "1.7"), (1, 3, 0), "0.9"), 1.0, id="k=0.97"),
]


def separatrix_J1(separatrix: int, times: Array) -> Array:
    """J1 on (sol_1)-(sol_22): rising on 2 and 4, sinking on 1 and 3."""
    falling = 1 if separatrix in (1, 3) else -1
    exponent = falling * (J2 * math.sin(FREE.alpha0) * times - V)
    return J2 / (np.exp(exponent) + 1)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
def test_agrees_aligned_field_with_the_unperturbed_separatrices(
    separatrix: int, engine: str
) -> None:
    expected = separatrix_J1(separatrix, TIMES)
    begin = on_separatrix(separatrix, FREE, expected[0], THETA2, J2)
    numbers = aligned_coefficients(FREE.angles(), math)
    orbit = states_at(lambda state, m: aligned(state, numbers), begin, TIMES, engine=engine)
    found = canonical_from_aligned(Aligned(*orbit), FREE.alpha0, FREE.beta0)
    np.testing.assert_allclose(found.J1, expected, rtol=2e-10)
    np.testing.assert_allclose(found.J2mJ1, J2 - expected, rtol=2e-10)
    assert apart(found.theta1, theta1_on(separatrix, FREE), 4 * math.pi) < 1e-10
    assert apart(found.theta2, FREE.kappa * J2 * TIMES + THETA2, 2 * math.pi) < 1e-10


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
def test_agrees_eq1_with_the_unperturbed_separatrices(separatrix: int, engine: str) -> None:
    expected = separatrix_J1(separatrix, TIMES)
    p = FREE.angles()
    begin = [theta1_on(separatrix, FREE), expected[0], THETA2, J2]
    theta1, J1, theta2, modulus = states_at(
        lambda state, m: eq1(state, p, m), begin, TIMES, engine=engine
    )
    # theta1 is steady on one half of the way only: its rounding grows on the other.
    np.testing.assert_allclose(theta1, begin[0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(J1, expected, rtol=1e-8)
    np.testing.assert_allclose(theta2, FREE.kappa * J2 * TIMES + THETA2, rtol=0, atol=1e-10)
    np.testing.assert_allclose(modulus, J2, rtol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
@pytest.mark.parametrize("separatrix", [2, 4])
def test_agrees_the_one_crossing_of_an_unperturbed_separatrix(
    separatrix: int, engine: str, bits: int
) -> None:
    J1 = float(separatrix_J1(separatrix, np.zeros(1))[0])
    begin = on_separatrix(separatrix, FREE, J1, THETA2, J2)
    found = find(begin[:, None], engine, bits, body=FREE, passage_limit=40)
    # J1 = J2/2 where u t = v; then the orbit stays on Q = 0 and never comes back.
    assert found.time[0, 0] == pytest.approx(V / (J2 * math.sin(FREE.alpha0)), abs=1e-10)
    assert np.isnan(found.time[1:]).all()
    assert found.separatrix[:, 0].tolist() == [separatrix, 0, 0, 0]
    assert found.outcome.tolist() == [Outcome.ASYMPTOTIC]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("body", "h0"), PENDULA)
def test_agrees_euler_poisson_with_the_physical_pendulum(
    body: Body, h0: float, sign: int, engine: str
) -> None:
    A, r, mu = floats_of(body)
    k2, rate = 2 * mu / (h0 + mu), math.sqrt((h0 + mu) / (2 * A[2]))
    times = np.linspace(0, 6 * ellipk(k2) / rate, 50)
    M3, gamma1, gamma2 = pendulum(A[2], r, mu, h0, sign, rate * times, k2)
    begin = [0, 0, M3[0], gamma1[0], gamma2[0], 0]
    orbit = states_at(
        lambda x, m: euler_poisson(x[:3], x[3:], A.tolist(), r.tolist(), mu),
        begin,
        times,
        engine=engine,
    )
    flat = np.zeros_like(times)
    expected = np.stack([flat, flat, M3, gamma1, gamma2, flat])
    np.testing.assert_allclose(orbit, expected, rtol=0, atol=1e-11)


def pendulum(
    A3: float, r: Any, mu: float, h0: float, sign: int, tau: Array, k2: float
) -> tuple[Any, Any, Any]:
    """M3, gamma1 and gamma2 of the paper's (5:3), the upper or the lower signs."""
    sn, cn, dn, _ = ellipj(tau, k2)
    along, across = 2 * sn**2 - 1, 2 * sign * sn * cn
    M3 = sign * math.sqrt(2 * A3 * (h0 + mu)) * dn
    return M3, r[0] * along - r[1] * across, r[1] * along + r[0] * across


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize(("body", "h0"), PENDULA)
def test_agrees_eq1_with_the_pendulum_in_canonical_variables(
    body: Body, h0: float, upper: bool, engine: str
) -> None:
    p = body.angles()
    k2, rate = 2 * p.mu / (h0 + p.mu), math.sqrt((h0 + p.mu) * p.kappa / 2)
    times = np.linspace(0, 4 * ellipk(k2) / rate, 40)
    sn, _, dn, _ = ellipj(rate * times, k2)
    expected = math.sqrt(2 * (h0 + p.mu) / p.kappa) * dn
    # (sol_3): J1 = 0 with theta2, or J1 = J2 with theta1 + theta2, from the lowest point.
    theta1 = 0.4
    begin = [theta1, upper * expected[0], -math.pi / 2 - upper * theta1, expected[0]]
    orbit = states_at(lambda state, m: eq1(state, p, m), begin, times, engine=engine)
    angle = orbit[2] + upper * orbit[0]
    np.testing.assert_allclose(orbit[3], expected, rtol=1e-9)
    np.testing.assert_allclose(orbit[1], upper * expected, atol=1e-9)
    np.testing.assert_allclose(np.sin(angle), 2 * sn**2 - 1, rtol=0, atol=1e-9)
