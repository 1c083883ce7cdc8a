"""Motions in space: the increments of (tri1) and their order, (eqPV) and (th_al) integrated."""

import functools
import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from rigidpend import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import cross, energy, euler_poisson, theta3_rate
from rigidpend.mechanics.free_body import SeparatrixMotion, separatrix
from rigidpend.mechanics.in_space import (
    Regime,
    alpha_ahead,
    angular_velocity,
    ellipsoid,
    fixed_components,
    hodograph,
    increments,
    plateaus,
    regime,
)
from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate.states import states_at
from tests.bodies import FIG5, GENERIC, THIN
from tests.orbits.integrate.problems import ENGINES
from tests.strategies import (
    FINE,
    ROUNDING,
    aligned_from_body,
    examples,
    field_with_alpha,
    fine_angles,
    momenta,
)

BODIES = [
    FIG5,
    GENERIC,
    Body(A=(2, 1, "1.5"), r=(1, 0, 0), mu="0.01"),
]
J2_0 = 0.8


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_eq_tri1_is_the_integral_of_th3_along_the_unperturbed_separatrix(
    body: Body, number: int
) -> None:
    p, motion = body.angles(), SeparatrixMotion(number, J2_0 / 2, J2_0 / 2, 0.7)

    def rate(t: float) -> float:
        c = separatrix(t, motion, p, math)
        return float(theta3_rate(c.J1, J2_0, c.theta1, p.mu, math))

    # The other half is the same, for J1 and J2 - J1 change places. Its side with J1 small is
    # the one on which theta3_rate subtracts nothing.
    far = 70 / (J2_0 * math.sin(p.alpha0))
    begin, end = (-far, 0.0) if number % 2 == 0 else (0.0, far)
    half, _ = quad(rate, begin, end, epsabs=1e-15, epsrel=1e-12, limit=200)
    h0 = body.kappa * J2_0**2 / 2
    assert increments(p, h0)[number - 1] == pytest.approx(2 * half, abs=1e-12)


def test_increments_keep_their_digits_where_alpha0_is_near_pi() -> None:
    body, m = Body(A=(2, 1, "1.9999999999"), r=(3, 1, 0), mu="0.01"), context(113)
    p = body.angles(113)
    unit = p.mu * m.pi * p.kappa / m.sin(p.alpha0)
    expected = [float(unit * m.sin((p.beta0 + side * p.alpha0) / 2)) for side in (-1, 1)]
    np.testing.assert_allclose(increments(body.angles(), 1.0)[:2], expected, rtol=1e-15)


@pytest.mark.parametrize(
    "body",
    [
        Body(THIN.A, (0, 1, 0), "0.01"),
        Body.from_angles("1.2", "1.2 + 1e-9", "1", "0.01"),
    ],
    ids=["beta0=pi", "near Hess"],
)
def test_small_increments_keep_their_digits_where_the_angles_have_them(body: Body) -> None:
    p, q = body.angles(113), fine_angles(body)
    expected = [q.mu * q.nu * FINE.sin((q.beta0 + side * q.alpha0) / 2) for side in (-1, 1)]
    found, rounded = (
        [abs(float(x / y - 1)) for x, y in zip(increments(each, 1.0)[:2], expected, strict=True)]
        for each in (p, body.angles())
    )
    assert max(found) < 1e-15
    assert max(rounded) > 1e-9


@pytest.mark.parametrize(
    ("beta0", "found", "order"),
    [
        *((x, Regime.i, "1 = 2 > 0 > 3 = 4") for x in ("pi", "3.141592653589793")),
        *((x, Regime.ii, "2 > 1 > 0 > 3 > 4") for x in ("pi - 1e-13", "2.5", "2 + 1e-13")),
        ("2", Regime.iii, "2 > 0 = 1 = 3 > 4"),
        *((x, Regime.iv, "2 > 3 > 0 > 1 > 4") for x in ("2 - 1e-13", "1", "1e-13")),
        ("0", Regime.v, "2 = 3 > 0 > 1 = 4"),
    ],
)
def test_eq_trieq_has_five_regimes(beta0: str, found: Regime, order: str) -> None:
    body = Body.from_angles(2, beta0, "1.5", "0.01")
    assert regime(body) is found
    assert str(regime(body)) == order
    p = body.angles()
    value = [0.0, *increments(p, 1.0) / float(p.mu * p.nu)]
    groups = [[value[k] for k in group] for group in regime(body).value]
    assert max(map(np.ptp, groups)) <= 4e-15
    assert all(min(above) > max(below) for above, below in itertools.pairwise(groups))


def test_plateaus_add_up_the_increments_of_a_route() -> None:
    found = plateaus([2, 1, 4, 3, 4, 1], FIG5.angles(), 10 / 9)
    published = [0, 0.0577, 0.1154, 0.0577, 0, -0.0577, 0]
    np.testing.assert_allclose(found, published, atol=5e-5)


BODY = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.2")
A = [float(x) for x in BODY.A]
R = [float(x) for x in BODY.r]
S = float(scale(A))
M0 = np.array([0.3, -0.5, 1.4])
ACROSS = np.cross(M0, (0.5, 0.3, 0.0))
GAMMA0 = ACROSS / np.linalg.norm(ACROSS)
TIMES = np.linspace(0, 12, 301)
"""Physical."""


@functools.cache
def in_space() -> Any:
    """omega in the fixed basis, (3, n), and M there: two more fixed vectors beside gamma."""
    eta = M0 / np.linalg.norm(M0)

    def rates(_: float, y: Any) -> Any:
        M, gamma, *more = y.reshape(4, 3)
        turned = [cross(axis, M / A) for axis in more]
        return np.concatenate((euler_poisson(M, gamma, A, R, 0.2), *turned))

    y0 = [*M0, *GAMMA0, *eta, *np.cross(GAMMA0, eta)]
    found: Any = solve_ivp(rates, (0, 12), y0, "LSODA", TIMES, rtol=1e-11, atol=1e-12)
    M, *axes = found.y.reshape(4, 3, -1)
    return tuple(np.einsum("kin,in->kn", axes, v) for v in (M / np.array(A)[:, None], M))


@functools.cache
def orbit(engine: str) -> Any:
    """The same with the module's field: theta3 and alpha by quadrature, M and gamma."""
    ahead = alpha_ahead(M0, M0 / A, GAMMA0)
    state = [*aligned_from_body(M0, GAMMA0, BODY.alpha0, S), 0.0, ahead]
    found = states_at(field_with_alpha(BODY), state, TIMES * S, engine=engine)
    return found[6], found[7], *body_from_aligned(Aligned(*found[:6]), BODY.alpha0, S)


@examples(8, M=momenta())
def test_eq_el_of_omega_is_twice_the_energy(M: Any) -> None:
    A, _, _ = FIG5.floats()
    nowhere = (0, 0, 0)
    twice = 2 * energy(M, nowhere, A, nowhere, 0)
    assert ellipsoid(angular_velocity(M, A), A) == pytest.approx(twice, rel=ROUNDING, abs=0)


@pytest.mark.parametrize("engine", ENGINES)
def test_eq_eqPV_alpha_is_the_angle_of_omega_in_space(engine: str) -> None:
    """And theta3 that of M, and the fixed components are those of omega."""
    theta3, alpha, M, gamma = orbit(engine)
    for angle, (_, eta, zeta), moved in zip((alpha, theta3), in_space(), (0.5, 0.1), strict=True):
        expected = np.unwrap(np.atan2(zeta, eta))
        assert np.ptp(expected) > moved
        np.testing.assert_allclose(angle, expected, atol=1e-7)
    assert np.abs(in_space()[1][0]).max() < 1e-8, "M is horizontal"
    found = fixed_components(angular_velocity(M, A), gamma, alpha)
    np.testing.assert_allclose(found.T, in_space()[0], atol=1e-7)


@pytest.mark.parametrize("engine", ENGINES)
def test_eq_th_al_holds_between_the_two_quadratures(engine: str) -> None:
    theta3, alpha, M, gamma = orbit(engine)
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


def test_the_horizontal_part_of_a_nearly_vertical_velocity_does_not_cancel() -> None:
    _, square, rate = hodograph((1.0, 1e-9, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 2e-9))
    assert square == pytest.approx(1e-18, rel=1e-13, abs=0)
    assert rate == pytest.approx(2, rel=1e-13, abs=0)
