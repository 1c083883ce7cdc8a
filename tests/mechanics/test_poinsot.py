"""Poinsot's free body against 60 digits, integration in space, and quadrature of (eqPV)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidpend.mechanics import poinsot
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, scale
from rigidpend.mechanics.equations import cross, energy, euler_poisson
from rigidpend.mechanics.in_space import angular_velocity, hodograph
from rigidpend.mechanics.jacobi import modulus
from rigidpend.mechanics.poinsot import Orbit, angle, ellipsoid, momentum, shape, through
from rigidpend.orbits.integrate.states import states_at
from tests.bodies import FREE
from tests.strategies import (
    FINE,
    ROUNDING,
    aligned_from_body,
    bodies,
    momenta,
    numbers,
    relative,
    repeatable,
)

EPS = float(np.finfo(float).eps)
OTHER = Body(A=(2, "0.3", "1.8"), r=(1, 1, 0), mu=0)
NOWHERE = (0, 0, 0)
A = [float(x) for x in FREE.A]
FAMILIES = [(axis, side) for axis in (1, 2) for side in (1, -1)]
PARTS = np.array([-1.3, -0.49, -0.2, 0.01, 0.26, 0.7])
"""Of a period."""


def aligned_components(body: Body, axis: int, M: Any, product: float) -> Aligned:
    """Qp, Qm and M3, dimensionless, of M; the small one of Qp and Qm comes from their product."""
    s2, sin, cos = shape(body)
    M1, M2, M3 = math.sqrt(s2) * M
    x, y = cos * M1, sin * M2
    # The sum of two numbers of one sign is the larger of Qp and Qm, and has no cancellation.
    plus = x * y >= 0
    large = x + y if plus else x - y
    small = (1 if axis == 1 else -1) * product / large
    return Aligned(*((large, small) if plus else (small, large)), M3, 0, 0, 0)


def encircling(
    body: Body, axis: int, side: int = 1, G: float = 1.0, height: float = 0.0, coheight: float = 0.0
) -> Orbit:
    """The orbit of a height or coheight around an axis, from its state at t = 0."""
    if height:
        coheight = math.sqrt((1 - height) * (1 + height))
    height = height or math.sqrt((1 - coheight) * (1 + coheight))
    s2, sin, cos = shape(body)
    p, q = (cos, sin) if axis == 1 else (sin, cos)
    along, across = G * side * math.hypot(q, p * coheight), G * p * height
    M = np.array((along, across, 0.0) if axis == 1 else (across, along, 0.0))
    product = s2 * (G * p * coheight) ** 2
    found, _ = through(body, aligned_components(body, axis, M, product))
    return found


@st.composite
def bodies_and_orbits(draw: st.DrawFn) -> tuple[Body, Orbit]:
    """Orbits of all families, coheight or height down to 1e-12, with their bodies."""
    small = {draw(st.sampled_from(["height", "coheight"])): 10 ** draw(numbers(-12, -0.01))}
    axis, side = draw(st.sampled_from(FAMILIES))
    body = draw(bodies())
    return body, encircling(body, axis, side, draw(numbers(0.5, 3)), **small)


def textbook(body: Body, found: Orbit, coheight: Any, t: Any) -> list[Any]:
    """M in 60 digits from |M|, the energy and the moments, after Landau and Lifshitz, 37."""
    A = [x.in_context(FINE) for x in body.A]
    G, t, coheight = (FINE.mpf(x) for x in (found.G, t, coheight))
    first, middle, last = (1, 2, 0) if found.axis == 1 else (0, 2, 1)
    a, b, c = A[first], A[middle], A[last]
    # Where the orbit is highest, M_first = 0.
    twice = G**2 * ((1 - coheight**2) / b + coheight**2 / c)
    below, above = G**2 - a * twice, c * twice - G**2
    tau = t * FINE.sqrt((c - b) * below / (a * b * c))
    k2 = (b - a) * above / ((c - b) * below)
    M = [FINE.mpf(0)] * 3
    M[first] = FINE.sqrt(a * above / (c - a)) * FINE.ellipfun("cn", tau, m=k2)
    M[middle] = found.side * FINE.sqrt(b * above / (c - b)) * FINE.ellipfun("sn", tau, m=k2)
    M[last] = found.side * FINE.sqrt(c * below / (c - a)) * FINE.ellipfun("dn", tau, m=k2)
    return M


def angle_in_space(M: Any, times: Any) -> Any:
    """psi of M (3,) at the first of the times, integrated without weight in the fixed space."""
    axis, omega = M / np.linalg.norm(M), M / np.asarray(A)
    radius = omega - axis * (axis @ omega)
    radius /= np.linalg.norm(radius)

    def rates(state: Any, _: Any) -> tuple[Any, ...]:
        omega = [state[i] / A[i] for i in range(3)]
        found = euler_poisson(state[:3], state[3:6], A, NOWHERE, 0.0)
        return (*found, *cross(state[6:], omega))

    found = states_at(rates, [*M, *radius, *np.cross(axis, radius)], times)
    M, *fixed = found.reshape(3, 3, -1)
    x, y = ((M / np.asarray(A)[:, None] * v).sum(axis=0) for v in fixed)
    return np.unwrap(np.atan2(y, x))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "small", "body"),
    [
        ("coheight", 0.9, FREE),
        ("coheight", 1e-2, OTHER),
        ("coheight", 1e-16, FREE),
        ("height", 1e-2, FREE),
        ("height", 1e-16, OTHER),
    ],
)
def test_agrees_with_60_digits_relative_to_each_component(
    which: str, small: float, body: Body
) -> None:
    """Beside the separatrix, and beside a permanent rotation."""
    for axis, side in ((1, -1), (2, 1)):
        orbit = encircling(body, axis, side, G=1.5, **{which: small})
        coheight = small if which == "coheight" else FINE.sqrt(1 - FINE.mpf(orbit.height) ** 2)
        for t in PARTS * orbit.period:
            pairs = zip(momentum(orbit, t), textbook(body, orbit, coheight, t), strict=True)
            error = max(abs(float(x / y - 1)) for x, y in pairs)
            assert error < 40 * EPS * (1 + abs(orbit.rate * t))


@given(pair=bodies_and_orbits())
@repeatable(8)
def test_a_period_and_no_half_of_it_brings_the_orbit_back(pair: tuple[Body, Orbit]) -> None:
    _, orbit = pair
    t = np.linspace(0, 1, 17) * orbit.period
    M = momentum(orbit, t)
    scale = orbit.G * 100 * EPS * (1 + orbit.modulus.K)
    np.testing.assert_allclose(momentum(orbit, t + orbit.period), M, atol=scale)
    half = momentum(orbit, t + orbit.period / 2)
    along = orbit.axis - 1
    np.testing.assert_allclose(half[along], M[along], atol=scale)
    np.testing.assert_allclose(half[[1 - along, 2]], -M[[1 - along, 2]], atol=scale)


@given(pair=bodies_and_orbits())
@repeatable(8)
def test_through_a_state_goes_its_orbit_at_its_time(pair: tuple[Body, Orbit]) -> None:
    body, orbit = pair
    product = shape(body)[0] * (orbit.G * orbit.p * orbit.coheight) ** 2
    for part in (-0.45, -0.2, 0.03, 0.3):
        t = part * orbit.period
        found, at = through(body, aligned_components(body, orbit.axis, momentum(orbit, t), product))
        assert (found.axis, found.side) == (orbit.axis, orbit.side)
        spread = ROUNDING * (1 + orbit.modulus.K)
        assert relative(found.coheight, orbit.coheight) < 10 * spread
        assert relative(found.G, orbit.G) < ROUNDING
        assert abs(at - t) * orbit.rate < 1e-12 / orbit.height


def test_states_on_a_separatrix_and_at_rest_are_refused() -> None:
    for Q in ((0.0, 1.0), (1.0, 0.0), (0.0, 0.0)):
        with pytest.raises(ValueError, match="separatrix"):
            through(FREE, Aligned(*Q, 0.0, 0, 0, 0))


@pytest.mark.parametrize(("M", "axis", "side"), [((2, 0, 0), 1, 1), ((0, -2, 0), 2, -1)])
def test_through_a_permanent_rotation_goes_itself(M: Any, axis: int, side: int) -> None:
    a = aligned_from_body(M, (0, 0, 1), FREE.alpha0, float(scale(A)))
    found, t = through(FREE, a)
    assert (found.axis, found.side, t) == (axis, side, 0)
    np.testing.assert_allclose(momentum(found, 3.0), M, atol=ROUNDING)


@pytest.mark.parametrize(
    ("A2", "A3", "M1"),
    [("1.158", "1.885", 1.670237538722366), ("1.535", "1.692", 1.2356951015316677)],
)
def test_rounding_takes_no_permanent_rotation_beyond_its_end(A2: str, A3: str, M1: float) -> None:
    """Quotients of these numbers round to 1 + 2^-52."""
    body = Body((2, A2, A3), (1, 1, 0), "0.001")
    Q = M1 * shape(body)[2]
    found, _ = through(body, Aligned(Q, Q, 0.0, 0, 0, 0))
    assert (found.height, found.coheight) == (0, 1)
    assert found.modulus == modulus(1.0)


@pytest.mark.parametrize(("Q", "M3"), [(1.68, 0.0), (1.22, 0.5)])
def test_rounding_takes_no_orbit_beside_the_separatrix_beyond_its_height(
    Q: float, M3: float
) -> None:
    body = Body((2, "1.16", "1.86"), (1, 1, 0), "0.001")
    assert through(body, Aligned(Q, 1e-20, M3, 0, 0, 0))[0].height == 1


@given(M=momenta())
@repeatable(8)
def test_eq_el_of_omega_is_twice_the_energy(M: Any) -> None:
    twice = 2 * energy(M, NOWHERE, A, NOWHERE, 0)
    assert ellipsoid(M / np.array(A), A) == pytest.approx(twice, rel=ROUNDING)


@pytest.mark.parametrize(("axis", "side"), FAMILIES)
@pytest.mark.parametrize("coheight", [0.9, 1e-2])
def test_the_angle_is_that_of_omega_integrated_in_space(
    axis: int, side: int, coheight: float
) -> None:
    orbit = encircling(FREE, axis, side, G=1.5, coheight=coheight)
    times = np.linspace(0, 0.7, 141) * orbit.period
    expected = angle_in_space(momentum(orbit, 0.0), times)
    np.testing.assert_allclose(angle(orbit, times), expected, atol=1e-13 / coheight)


@pytest.mark.slow
def test_the_angle_is_the_quadrature_of_eqPV_in_60_digits() -> None:
    """Over more than half a period, which is added as a whole; both axes are in the test above."""
    orbit = encircling(FREE, 2, coheight=0.1)
    exact = [x.in_context(FINE) for x in FREE.A]
    t = 0.6 * orbit.period

    def turning(t: Any) -> Any:
        """(eqPV) with the axis of M in the place of the vertical."""
        M = textbook(FREE, orbit, orbit.coheight, t)
        G, dM = sum(x * x for x in M) ** 0.5, euler_poisson(M, NOWHERE, exact, NOWHERE, 0)[:3]
        omega, domega = angular_velocity(M, exact), angular_velocity(dM, exact)
        return hodograph(omega, [x / G for x in M], domega)[2]

    panels = FINE.linspace(0, FINE.mpf(t), int(6 + orbit.rate * t))
    # Degree 3 is 12 points a panel, which less than a unit of u is wide.
    expected = FINE.quad(turning, panels, method="gauss-legendre", maxdegree=3)
    assert abs(angle(orbit, t) - expected) < 4 * EPS * (1 + t / A[2])


@pytest.mark.parametrize("axis", [1, 2])
def test_the_elementary_angle_carries_on_the_one_by_carlson(
    axis: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    orbit = encircling(FREE, axis, coheight=1e-20)
    t = np.linspace(-1.5, 1.5, 400) * orbit.period
    expected = angle(orbit, t)
    monkeypatch.setattr(poinsot, "ELEMENTARY", 1.0)
    np.testing.assert_allclose(angle(orbit, t), expected, atol=4 * EPS * np.abs(t).max())
