"""The fixed hodograph: (eqPV) and (th_al) against integration of the body's axes in space."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigidpend import Body
from rigidpend.mechanics.coordinates import (
    Aligned,
    aligned_from_body,
    body_from_aligned,
    scale,
)
from rigidpend.mechanics.equations import cross, euler_poisson
from rigidpend.mechanics.in_space import (
    alpha_ahead,
    angular_velocity,
    field,
    fixed_components,
    hodograph,
)
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import ENGINES

BODY = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.2")
A = [float(x) for x in BODY.A]
R = [float(x) for x in BODY.r]
S = float(scale(A))
M0, GAMMA0 = np.array([0.3, -0.5, 1.4]), np.array([0.5, 0.3, 0.0])
TIMES = np.linspace(0, 12, 301)
"""Physical."""


@pytest.fixture(scope="module")
def start() -> tuple[Any, Any]:
    """M and gamma with M . gamma = 0."""
    gamma = np.cross(M0, GAMMA0)
    return M0, gamma / np.linalg.norm(gamma)


@pytest.fixture(scope="module")
def in_space(start: tuple[Any, Any]) -> Any:
    """omega in the fixed basis, (3, n), and M there: three fixed vectors carried in body axes."""
    M, gamma = start
    eta = M / np.linalg.norm(M)
    zeta = np.cross(gamma, eta)

    def rates(_: float, y: Any) -> Any:
        dM_dgamma = euler_poisson(y[:3], y[3:6], A, R, 0.2)
        omega = y[:3] / A
        return np.array([*dM_dgamma, *cross(y[6:9], omega), *cross(y[9:], omega)])

    y0 = [*M, *gamma, *eta, *zeta]
    found: Any = solve_ivp(rates, (0, 12), y0, "LSODA", TIMES, rtol=1e-11, atol=1e-12)
    M, *axes = found.y.reshape(4, 3, -1)
    omega = M / np.array(A)[:, None]
    return tuple(np.array([(v * axis).sum(axis=0) for axis in axes]) for v in (omega, M))


def orbit(start: tuple[Any, Any], engine: str) -> Any:
    """The same with the module's field: theta3 and alpha by quadrature, M and gamma."""
    M, gamma = start
    ahead = alpha_ahead(M, M / A, gamma)
    state = [*aligned_from_body(M, gamma, BODY.alpha0, S), 0.0, ahead]
    found = states_at(field(BODY), state, TIMES * S, engine=engine)
    return found[6], found[7], *body_from_aligned(Aligned(*found[:6]), BODY.alpha0, S)


@pytest.mark.parametrize("engine", ENGINES)
def test_eq_eqPV_alpha_is_the_angle_of_omega_in_space(
    start: tuple[Any, Any], in_space: Any, engine: str
) -> None:
    """And theta3 that of M, and the fixed components are those of omega."""
    theta3, alpha, M, gamma = orbit(start, engine)
    for angle, (_, eta, zeta), moved in zip((alpha, theta3), in_space, (0.5, 0.1), strict=True):
        expected = np.unwrap(np.atan2(zeta, eta))
        assert np.ptp(expected) > moved
        np.testing.assert_allclose(angle, expected, atol=1e-7)
    assert np.abs(in_space[1][0]).max() < 1e-8, "M is horizontal"
    found = fixed_components(angular_velocity(M, A), gamma, alpha)
    np.testing.assert_allclose(found.T, in_space[0], atol=1e-7)


@pytest.mark.parametrize("engine", ENGINES)
def test_eq_th_al_holds_between_the_two_quadratures(start: tuple[Any, Any], engine: str) -> None:
    theta3, alpha, M, gamma = orbit(start, engine)
    ahead = alpha_ahead(M, angular_velocity(M, A), gamma)
    assert np.ptp(ahead) > 0.1
    np.testing.assert_allclose(alpha - theta3, ahead, rtol=0, atol=1e-9)


def test_eq_eqPV_of_a_circle_is_its_rate() -> None:
    """omega turns at the rate 3 about the vertical, with radius 2 at height 5."""
    t = np.linspace(0, 2, 7)
    omega = np.array([5 + 0 * t, 2 * np.cos(3 * t), 2 * np.sin(3 * t)])
    domega = np.array([0 * t, -6 * np.sin(3 * t), 6 * np.cos(3 * t)])
    xi, square, rate = hodograph(omega, (1.0, 0.0, 0.0), domega)
    for found, expected in ((xi, 5), (square, 4), (rate, 3)):
        np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_pendulum_keeps_omega_on_the_eta_axis() -> None:
    M, gamma = np.array([0, 0, 1.4]), np.array([math.cos(1), math.sin(1), 0])
    state = [*aligned_from_body(M, gamma, BODY.alpha0, S), 0.0, 0.0]
    found = states_at(field(BODY), state, TIMES)
    np.testing.assert_array_equal(found[6:], 0)
