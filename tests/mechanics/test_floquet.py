"""Periodic orbits against integrated ones, linearised integration, T1 and T2, and limits."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics import coordinates, floquet, pendulum
from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import aligned, aligned_coefficients, eq1
from rigidpend.mechanics.floquet import NotHyperbolic, PeriodicOrbit, periodic_orbit
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from scripts.stated_orbits import multiplier
from tests.strategies import aligned_from_body, apart

PAIRS = [(family, epsilon) for family in (1, 2) for epsilon in (1, -1)]
FIG4 = Body((2, 1, "1.5"), (1, 1, 0), 0).angles()
FIG5 = Body((2, "1.5", "1.8"), (0, 1, 0), 0).angles()
HESS = Body.from_angles("1.2", "1.2", "1", 0).angles()
SPECIAL = [
    pytest.param(FIG4, id="Grioli"),
    pytest.param(HESS, id="Hess"),
    pytest.param(Body((2, 1, "1.5"), (1, 0, 0), 0).angles(), id="beta0=0"),
    pytest.param(FIG5, id="beta0=pi"),
    pytest.param(Body.from_angles("0.1", "0.05", "0.085", 0).angles(), id="alpha0 near 0"),
    pytest.param(Body.from_angles("3.13", "1", "3", 0).angles(), id="alpha0 near pi"),
]
SHARES = [0.01, 0.9, 0.999]


def loaded(p: Angles, share: float) -> Angles:
    """The body with mu = share, where h0 = 1."""
    return p._replace(mu=share)


def leaves(orbit: PeriodicOrbit) -> bool:
    return orbit.exponent > 0


class Turning(NamedTuple):
    """An angle, with its cosine and sine: whoever adds angles needs no functions of them."""

    angle: Any
    cos: Any
    sin: Any

    @classmethod
    def of(cls, x: Any) -> Turning:
        return x if isinstance(x, cls) else cls(x, math.cos(x), math.sin(x))

    def __add__(self, other: Any) -> Turning:
        x, c, s = Turning.of(other)
        cos, sin = self.cos * c - self.sin * s, self.sin * c + self.cos * s
        return Turning(self.angle + x, cos, sin)

    def __sub__(self, other: Any) -> Turning:
        x, c, s = Turning.of(other)
        return self + Turning(-x, c, -s)

    def rates(self, rate: Any) -> tuple[Any, Any, Any]:
        return rate, -self.sin * rate, self.cos * rate


FUNCTIONS = SimpleNamespace(cos=lambda x: Turning.of(x).cos, sin=lambda x: Turning.of(x).sin)


def integrated(orbit: PeriodicOrbit, p: Angles, h0: float) -> Any:
    """theta1 and tau by (eq1) from the first point, in the sense in which errors shrink."""
    n = orbit.tau.size
    times = np.arange(n + 1) * orbit.period / n
    if not leaves(orbit):
        times = times[::-1]
    _, J2, tau = pendulum.canonical_motion(times[0], p, h0, orbit.family, math)
    theta1 = orbit.theta1[0] + (0 if leaves(orbit) else 2 * math.pi * orbit.turns)

    def field(x: Any) -> Any:
        # Held on J1 = 0 or J1 = J2, which is invariant but unstable to rounding.
        theta1, tau, J2 = Turning(*x[:3]), Turning(*x[3:6]), x[6]
        upper = orbit.family == 2
        state = (theta1, J2, tau - theta1, J2) if upper else (theta1, 0.0, tau, J2)
        by_theta1, _, by_theta2, by_J2 = eq1(state, p, FUNCTIONS)
        by_tau = by_theta1 + by_theta2 if upper else by_theta2
        return *theta1.rates(by_theta1), *tau.rates(by_tau), by_J2

    begin = [*Turning.of(theta1), *Turning.of(tau), J2]
    found = states_at(field, begin, times - times[0])[[0, 3]]
    return found[:, :-1] if leaves(orbit) else found[:, ::-1][:, :-1]


@pytest.mark.parametrize(("family", "epsilon"), PAIRS)
@pytest.mark.parametrize("share", SHARES)
def test_agrees_with_an_orbit_of_eq1(share: float, family: int, epsilon: int) -> None:
    p = loaded(FIG4, share)
    orbit = periodic_orbit(p, 1.0, family, epsilon)
    found, tau = integrated(orbit, p, 1.0)
    # Near the top the integrated orbit is worth no more than it moves under one ulp of mu.
    beside = [p._replace(mu=math.nextafter(p.mu, end)) for end in (0.0, 1.0)]
    moved = max(np.abs(integrated(orbit, q, 1.0)[0] - found).max() for q in beside)
    assert np.abs(found - orbit.theta1).max() < 1e-13 + 4 * moved
    assert moved < 1e-11
    assert apart(tau, orbit.tau, 2 * math.pi) < 1e-11
    assert np.ptp(orbit.theta1) > 1e-3


def monodromy(p: Angles, h0: float, family: int) -> Any:
    """The linearised aligned field over a period, (6, 6), by DOP853."""
    c = aligned_coefficients(p, math)
    _, J2, tau = pendulum.canonical_motion(0.0, p, h0, family, math)
    small, theta2 = (0.0, J2), tau - (0.3 if family == 2 else 0.0)
    J1, J2mJ1 = small if family == 1 else small[::-1]
    state = coordinates.Canonical(J1, J2mJ1, 0.0, 0.3, theta2, 0.0, 1.0)
    M, gamma = coordinates.body_from_andoyer(coordinates.andoyer_from_canonical(state, p.beta0))
    begin = np.array(aligned_from_body(M, gamma, p.alpha0, 1.0))

    def field(flat: Any) -> Any:
        # The field is quadratic: central differences of any step are its derivative.
        x, v = flat[:6, None], flat[6:].reshape(6, 6)
        ahead, behind = (np.array(aligned(x + side * v, c)) for side in (1, -1))
        return np.concatenate((aligned(flat[:6], c), ((ahead - behind) / 2).ravel()))

    whole = [0.0, pendulum.period(p, h0, math)]
    start = np.concatenate((begin, np.eye(6).ravel()))
    flat = states_at(field, start, whole, engine="scipy")[:, -1]
    np.testing.assert_allclose(flat[:6], begin, atol=1e-11)
    return flat[6:].reshape(6, 6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("p", "share", "family", "turns"),
    [
        *(
            (p.values[0], 0.3, 1 + k % 2, turns)
            for k, (p, turns) in enumerate(zip(SPECIAL[1::2], (0, 0, 3), strict=True))
        ),
        (FIG4, 0.999, 2, 0),
        (FIG5, 0.95, 1, -1),
        (FIG5, 0.95, 2, 1),
    ],
)
def test_agrees_with_the_linearised_field(p: Angles, share: float, family: int, turns: int) -> None:
    q = loaded(p, share)
    # Four of the multipliers are 1: of energy, time, |gamma| and M . gamma.
    trace = np.trace(monodromy(q, 1.0, family)) - 4
    one, other = (periodic_orbit(q, 1.0, family, epsilon) for epsilon in (1, -1))
    assert one.multiplier + other.multiplier == pytest.approx(trace, rel=1e-10)
    assert one.multiplier * other.multiplier == pytest.approx(1, rel=1e-12)
    # Where the direction has turned oddly often when it comes back they are negative.
    assert (trace < -2) == bool(turns)
    for orbit, leaving in ((one, family == 1), (other, family == 2)):
        assert (orbit.turns, leaves(orbit)) == (turns, leaving)
        np.testing.assert_allclose(integrated(orbit, q, 1.0)[0], orbit.theta1, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("share", "family"), [(0.6, 1), (0.86, 2)])
def test_an_elliptic_motion_is_told_from_a_hyperbolic_one(share: float, family: int) -> None:
    p = loaded(FIG5, share)
    multipliers = np.linalg.eigvals(monodromy(p, 1.0, family))
    np.testing.assert_allclose(np.abs(multipliers), 1, atol=1e-4)
    # Apart from the four that are 1 to within 1e-6: one pair off the real axis.
    assert np.abs(multipliers - 1).max() > 0.1
    with pytest.raises(NotHyperbolic, match="not hyperbolic: its multipliers have the sum"):
        periodic_orbit(p, 1.0, family)


@pytest.mark.parametrize("p", SPECIAL)
@pytest.mark.parametrize(("family", "epsilon"), PAIRS)
def test_order_the_multipliers_without_weight(p: Angles, family: int, epsilon: int) -> None:
    J2_0, side = math.sqrt(2 / p.kappa), epsilon * (3 - 2 * family)
    u, T = J2_0 * math.sin(p.alpha0), 2 * math.pi / (p.kappa * J2_0)
    free = periodic_orbit(p, 1.0, family, epsilon)
    assert free.period == pytest.approx(T, rel=1e-14)
    assert free.exponent == pytest.approx(side * u / 2, rel=1e-13, abs=1e-14)
    assert free.multiplier == pytest.approx(math.exp(side * u * T / 2), rel=1e-12)
    np.testing.assert_allclose(free.theta1, p.beta0 + epsilon * p.alpha0, atol=1e-13)


@pytest.mark.slow
def test_order_of_rounding_beside_a_symmetric_body_at_a_small_energy() -> None:
    """Of which the moments differ by a part d of A1: there the bound of all others is broken."""
    d, body = 4e-6, Body((2, 1, "1.999992"), (3, 1, 0), "6e-9")
    found = periodic_orbit(body.angles(), 1e-8)
    truth, period = multiplier(body, exact("1e-8"), 1)
    rest = 1 - 0.6
    off = rest * 2.0**46 * float(abs(found.exponent_per_period - truth))
    assert 1 < off < 0.01 / d
    assert rest * float(abs(found.period / period - 1)) < 2.0**-48


def test_what_is_no_orbit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="epsilon is 1 or -1"):
        periodic_orbit(FIG4, 1.0, 1, 2)
    monkeypatch.setattr(floquet, "MOST", 32)
    with pytest.raises(ArithmeticError, match="32 steps don't settle the periodic orbit at h0 = "):
        periodic_orbit(FIG4, 1.0)
