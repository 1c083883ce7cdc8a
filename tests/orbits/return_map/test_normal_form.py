"""The reduced equations against the aligned field, and the normal form against Floquet theory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given

from rigidpend import Body
from rigidpend.mechanics import floquet
from rigidpend.mechanics.equations import aligned
from rigidpend.orbits.return_map import normal_form as module
from rigidpend.orbits.return_map.conjugacy import inverted, placed, torus_rates
from rigidpend.orbits.return_map.expansions import Interval
from rigidpend.orbits.return_map.normal_form import MapError, normal_form, powers
from rigidpend.orbits.return_map.poincare import rotation_phase
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients, reduced, theta3_rate
from tests.orbits.integrate.problems import FIG4, GENERIC
from tests.strategies import bodies, repeatable

DOUBLES = precision(53)


def coefficients_of(body: Body, bits: int = 53) -> Any:
    return coefficients(body.angles(bits + 32), "1", precision(bits))


def state_of(Q: Any, psi: float, J2: float, body: Body) -> Any:
    """The aligned components by the least rotation itself, a matrix."""
    Qp, Qm = Q
    M1 = (Qp + Qm) / (2 * math.cos(body.alpha0 / 2))
    M2 = (Qp - Qm) / (2 * math.sin(body.alpha0 / 2))
    M3 = math.sqrt(J2**2 - M1**2 - M2**2)
    m, e3 = np.array([M1, M2, M3]) / J2, np.array([0.0, 0.0, 1.0])
    axis = np.cross(e3, m)
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    R = np.eye(3) + K + K @ K / (1 + m[2])
    gamma = math.cos(psi) * R[:, 0] - math.sin(psi) * R[:, 1]
    return np.array([Qp, Qm, M3, *gamma])


@pytest.mark.parametrize("body", [FIG4, GENERIC])
def test_agrees_the_reduced_equations_with_the_aligned_field(body: Body) -> None:
    c, J2, psi = coefficients_of(body), 1.3, 0.7
    state = state_of((0.2, -0.1), psi, J2, body)
    rates = reduced(
        state[:2],
        (math.cos(psi), math.sin(psi)),
        (J2, state[2], 1 / J2, 1 / (J2 + state[2])),
        c,
    )
    field = np.array(aligned(state, c.aligned))
    np.testing.assert_allclose((rates.Qp, rates.Qm), field[:2], rtol=1e-14, atol=1e-17)
    assert rotation_phase(state, c, DOUBLES) == pytest.approx(psi, abs=1e-15)
    ahead, behind = (rotation_phase(state + s * 1e-5 * field, c, DOUBLES) for s in (1, -1))
    # The step in a straight line leaves J2 and the plane of gamma by its square only.
    assert rates.psi == pytest.approx((ahead - behind) / 2e-5, abs=1e-9)
    base = float(body.mu) * math.cos(psi + body.beta0 / 2)
    height = c.aligned.mu_r1 * state[3] + c.aligned.mu_r2 * state[4]
    assert rates.drop == pytest.approx(base - height, abs=1e-16)
    assert rates.theta3 == pytest.approx(theta3_rate(state[:3], c), rel=1e-14)


@given(bodies(mu="1/20"))
@repeatable(6)
def test_agrees_lambda_at_0_with_the_floquet_exponent(body: Body) -> None:
    assume(body.mu.fraction and body.alpha0 < 3)
    h = 1.3342
    orbit = floquet.periodic_orbit(body.angles(), h, 2, 1)
    nf = normal_form(coefficients_of(body), Interval(h, 0.0, 1), 7, 35, 0.1, DOUBLES)
    np.testing.assert_allclose(
        2 * math.pi * nf.exponent[0, 0], abs(orbit.exponent_per_period), rtol=1e-12
    )
    np.testing.assert_allclose(2 * math.pi * nf.rotation[0, 0], orbit.period, rtol=1e-13)
    assert nf.disagreement < 1e-13, "the two determinations of Lambda"


def test_a_wrong_equation_shows_in_the_two_determinations_of_lambda() -> None:
    c = coefficients_of(FIG4)
    wrong = c._replace(aligned=c.aligned._replace(force_p=c.aligned.force_p * 1.001))
    radius = 0.2
    right, spoilt = (
        normal_form(x, Interval(1.3342, 0.0, 1), 9, 15, radius, DOUBLES).disagreement
        for x in (c, wrong)
    )
    assert right < 1e-15
    assert spoilt > 1e-11


def test_order_the_normal_form_solves_the_equations_to_its_degree() -> None:
    """d/dpsi of the series along u' = Lambda u, v' = -Lambda v is the field of reduced."""
    body, h, degree = GENERIC, 1.3342, 7
    c = coefficients_of(body)
    nf = normal_form(c, Interval(h, 0.0, 1), degree, 21, 0.1, DOUBLES)
    ones, psi = np.ones((1, 1)), np.array([0.4])

    def point(u: float, v: float, at: Any) -> Any:
        """Qp and Qm that have u and v: the inverse of `inverted`, by its own series."""
        from rigidpend.orbits.return_map.conjugacy import TorusSeries

        return TorusSeries(nf, ones, at, DOUBLES).values(np.array([u]), np.array([v]))[:2, 0]

    errors = []
    for scale in (0.2, 0.1):
        u, v, step = 0.6 * scale, 0.8 * scale, 1e-4
        rate = torus_rates(nf.exponent, nf.rotation, np.array([u * v])).exponent[0]
        ahead, behind = (
            point(u * math.exp(s * rate * step), v * math.exp(-s * rate * step), psi + s * step)
            for s in (1, -1)
        )
        Q = point(u, v, psi)
        J2 = momentum_at(Q, psi[0], h, c, body)
        M3 = state_of(Q, psi[0], J2, body)[2]
        turn = (math.cos(psi[0]), math.sin(psi[0]))
        field = reduced(Q, turn, (J2, M3, 1 / J2, 1 / (J2 + M3)), c)
        expected = np.array([field.Qp, field.Qm]) / field.psi
        errors.append(np.abs((ahead - behind) / (2 * step) - expected).max())
    assert errors[0] < 1e-5
    assert errors[1] < max(errors[0] / 2 ** (degree + 1), 3e-9)


def momentum_at(Q: Any, psi: float, h: float, c: Any, body: Body) -> float:
    """J2 by bisection on the energy, from the rotation matrix."""
    low, high = 0.5, 3.0
    for _ in range(60):
        J2 = (low + high) / 2
        state = state_of(Q, psi, J2, body)
        k = c.aligned
        energy = k.kappa / 2 * J2**2 - Q[0] * Q[1] / 2 + k.mu_r1 * state[3] + k.mu_r2 * state[4]
        low, high = (J2, high) if energy < h else (low, J2)
    return low


def test_agrees_the_inverse_of_the_series_in_64_and_113_bits() -> None:
    found = []
    for bits in (53, 113):
        a = precision(bits)
        h = a.number(1.3342)
        nf = normal_form(coefficients_of(FIG4, bits), Interval(h, 0 * h, 1), 5, 11, 0.1, a)
        ones, at = a.array([[1.0]]), a.array([0.4])
        beside = inverted(nf, ones, at, a.array([0.02]), a.array([-0.01]), a)
        found.append(np.array([float(x[0]) for x in beside]))
        assert float(nf.disagreement) < 2.0 ** (10 - bits)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)


@pytest.mark.parametrize("least", [1e-4, 1e-7])
def test_the_normal_form_ends_with_the_first_terms_that_are_small_enough(least: float) -> None:
    radius = 0.3
    given: Any = (coefficients_of(FIG4), Interval(1.3342, 0.0, 1), 21, 21, radius, DOUBLES)
    whole, short = normal_form(*given), normal_form(*given, least=least)
    degrees = powers(21, 1).sum(axis=1)
    np.testing.assert_array_equal(short.odd, whole.odd[:, degrees <= short.degree])
    # Coefficients of waves are no larger than what they add up to at phases, nor far below.
    sizes = [np.abs(whole.odd[:, degrees == D, :2]).max() * radius**D for D in range(1, 22, 2)]
    last, before = (sizes[(short.degree - k) // 2] / sizes[0] for k in (1, 3))
    assert last < least < 8 * before


def test_order_points_are_put_into_the_normal_form_to_rounding_of_doubles() -> None:
    """Where slopes of half the degree do, the last correction leaves no more than that."""
    nf = normal_form(coefficients_of(GENERIC), Interval(1.3342, 0.0, 1), 21, 21, 0.1, DOUBLES)
    ones, random = np.ones((1, 1)), np.random.default_rng(4)
    for _ in range(60):
        psi, (Qp, Qm) = random.uniform(0, 6.28, 20), random.uniform(-0.4, 0.4, (2, 20))
        at = inverted(nf, ones, psi, Qp, Qm, DOUBLES)
        again = placed(nf, ones, psi, at.u, at.v, DOUBLES)[:2]
        off = np.abs(np.array(again) - (Qp, Qm)) / np.maximum(np.abs(Qp), np.abs(Qm))
        assert off.max() < 2e-15


@pytest.mark.parametrize(("bits", "degree"), [(70, 21), (96, 29)])
def test_terms_in_doubles_leave_less_than_an_eighth_of_a_rounding(
    bits: int, degree: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each leaves a 256th part, `GUARD`; a rounding is of the largest at |u|, |v| = radius."""
    a, radius = precision(bits), 1 / 16
    h = a.number(1.3342)
    given: Any = (coefficients_of(FIG4, bits), Interval(h, 0 * h, 1), degree, degree, radius, a)
    found = normal_form(*given)
    monkeypatch.setattr(module, "GUARD", 0.0)
    whole = normal_form(*given)
    for x, true, parity in ((found.odd, whole.odd, 1), (found.even, whole.even, 0)):
        of = radius ** powers(degree - 1 + parity, parity).sum(axis=1, dtype=float)
        off, all_ = (np.abs(a.floats(y)).reshape(*y.shape[:2], -1) for y in (x - true, true))
        share = (off * of[:, None]).max() / (all_ * of[:, None]).max(axis=(0, 1)).min()
        assert 0 < share < 2.0**-bits / 8


def test_an_elliptic_orbit_has_no_normal_form() -> None:
    body = Body((2, "1.5", "1.8"), (0, 1, 0), "0.7")
    with pytest.raises(MapError, match="not hyperbolic"):
        normal_form(coefficients_of(body), Interval(1.0, 0.0, 1), 3, 41, 0.1, DOUBLES)
