"""Orbits that follow a route: the published one of Fig. 5, its plateaus, its samples."""

from typing import Any

import mpmath
import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.in_space import field
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes import herpolhode
from rigidpend.routes.codes import codes_of
from rigidpend.routes.herpolhode import RouteOrbit, follow, initial_state, samples
from tests.bodies import FIG5, THIN, problem
from tests.strategies import FINE, field_with_alpha, fine_angles

TOLERANCE = 3e-14
PROBLEM = problem(FIG5, 5, "10/9", "2.39205e-9")


def followed(theta2_0: float, times: Array) -> RouteOrbit:
    how: Any = {"step": 0.05, "tolerance": TOLERANCE, "engine": "taylor"}
    return follow(PROBLEM, theta2_0, times, **how)


@pytest.mark.parametrize(
    ("theta2_0", "published"),
    [("1.02", "2-2*-1*-1-4-4*-3*-3-4-4*-1*-1"), ("1.83", "2-2*-3*-3-4-4*-1*-1-2-2*-1*-1")],
)
def test_the_published_route_comes_out_and_is_followed(theta2_0: str, published: str) -> None:
    """The crossing error is how much later the samples cross."""
    route = codes_of(PROBLEM, [theta2_0], resolve(precisions=(113,)), 1, "integration")
    assert route.certain.all()
    assert herpolhode.vertices(route.separatrix[:, 0]) == published
    shift = np.array([1e-4, -2e-4, 1e-4, 0, -1e-4, 2e-4])
    orbit = followed(float(theta2_0), route.crossing_time[:, 0] - shift)
    np.testing.assert_array_equal(herpolhode.separatrices(orbit.states), route.separatrix[:, 0])
    np.testing.assert_allclose(orbit.crossing_error, shift, atol=1e-5)
    before, last = route.crossing_time[-2:, 0] - shift[-2:]
    assert 0 < last + (last - before) / 2 - orbit.t[-1] < 0.05 + 1e-9


def test_a_sample_on_the_section_is_one_crossing() -> None:
    """Up beside 2 over a sample with M3 = 0, and down beside 3."""
    Qp, Qm, M3 = [1, 1, 1, -1, -1], [-1, -1, 1, 1, 1], [-1, 0, 1, 1, -1]
    found = herpolhode.separatrices(np.array([Qp, Qm, M3, *[[0] * 5] * 3], dtype=float))
    np.testing.assert_array_equal(found, [2, 3])


def test_momenta_of_a_nearly_symmetric_body_are_physical_to_their_last_digits() -> None:
    """A1 - A2 is 2e-10, of which moments in doubles have six digits."""
    with mpmath.workdps(40):
        A1, A2, M3 = mpmath.mpf(1), mpmath.mpf("0.9999999998"), mpmath.mpf("1e-5")
        expected = float(M3 / mpmath.sqrt((A1 - A2) / (A1 * A2)))
    body = Body(A=(1, "0.9999999998", "0.9999999999"), r=(1, 2, 0), mu=0)
    M, _ = herpolhode.physical(np.array([0.0, 0.0, 1e-5, 0.0, 0.0, -1.0]), body)
    assert M[2] == pytest.approx(expected, rel=1e-15, abs=0)


def test_alpha_of_the_samples_is_the_quadrature_eqPV() -> None:
    """Through five passages, as far as an orbit stays the same when it is computed again."""
    p, orbit = PROBLEM, followed(1.83, np.array([170.0, 200.0]))
    made, state = samples(p.body, *orbit[:2]), initial_state(p, 1.83)
    begin = np.array([*state, *samples(p.body, orbit.t[:1], state[:, None]).alpha])
    again = states_at(field_with_alpha(p.body), begin, orbit.t, tolerance=TOLERANCE)
    apart = np.abs(again[:6] - orbit.states[:6]).max(axis=0)
    found = made.alpha
    assert np.ptp(found) > 0.05
    # By (th_al) within one computation, and between two by what they are apart.
    own = samples(p.body, orbit.t, again[:7]).alpha
    np.testing.assert_allclose(again[7], own, rtol=0, atol=1e-9)
    assert (np.abs(again[7] - found) < 1e-9 + 10 * np.maximum.accumulate(apart)).all()
    # No leap where the angle passes a multiple of pi.
    assert np.abs(np.diff(found)).max() < 0.1
    # By it the samples turn what omega has across the vertical, theta3 in its place not.
    M, gamma = herpolhode.physical(orbit.states[:6], p.body)
    omega, (xi, eta, zeta) = M / np.array(p.body.floats()[0])[:, None], made.omega.T
    np.testing.assert_allclose(np.unwrap(np.atan2(zeta, eta)), found, rtol=0, atol=1e-12)
    np.testing.assert_allclose(xi, (omega * gamma).sum(axis=0), rtol=0, atol=1e-13)
    np.testing.assert_allclose(eta**2 + zeta**2, (omega**2).sum(axis=0) - xi**2, rtol=1e-12)


def test_samples_of_a_thin_body_keep_their_digits() -> None:
    """Of M1, and so of J1/J2, omega and the rate of theta3, angles in doubles give eight digits."""
    p = fine_angles(THIN)
    state = [1e-9, 2e-9, -0.5, 0.6, 0.0, 0.8]
    cos, sin = FINE.cos(p.alpha0 / 2), FINE.sin(p.alpha0 / 2)
    Qp, Qm = map(FINE.mpf, state[:2])
    M1, M2 = (Qp + Qm) / (2 * cos), (Qp - Qm) / (2 * sin)
    J2 = FINE.sqrt(M1**2 + M2**2 + FINE.mpf("0.25"))
    found = samples(THIN, np.zeros(1), np.array([*state, 0.0])[:, None])
    J1 = (M1**2 + M2**2) / (2 * (J2 + FINE.mpf("0.5")))
    assert found.J1_over_J2[0] == pytest.approx(float(J1 / J2), rel=1e-15, abs=0)
    A1, A2, A3 = (x.at(FINE.prec) for x in THIN.A)
    s = FINE.sqrt((A1 - A2) / (A1 * A2))
    omega = FINE.sqrt((M1 / A1) ** 2 + (M2 / A2) ** 2 + (FINE.mpf("0.5") / A3) ** 2) / s
    assert np.linalg.norm(found.omega[0]) == pytest.approx(float(omega), rel=1e-15, abs=0)
    rate = p.mu * (M1 + M2) / FINE.sqrt(2) / J2**2
    assert field(THIN)([*state, 0.0])[6] == pytest.approx(float(rate), rel=1e-15, abs=0)
