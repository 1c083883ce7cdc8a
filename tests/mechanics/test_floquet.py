"""Periodic orbits against integrated ones, linearised integration, T1 and T2, and limits."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics import floquet, pendulum
from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.floquet import PeriodicOrbit, periodic_orbit
from rigidpend.numbers.exact import exact
from scripts.stated_orbits import multiplier
from tests.bodies import THIN
from tests.strategies import apart

PAIRS = [(family, epsilon) for family in (1, 2) for epsilon in (1, -1)]
FIG4 = Body((2, 1, "1.5"), (1, 1, 0), 0)
FIG5 = Body((2, "1.5", "1.8"), (0, 1, 0), 0)
HESS = Body.from_angles("1.2", "1.2", "1", 0)
NEAR_PI = Body.from_angles("3.1", "1", "2.9", 0)
SPECIAL = {
    "Grioli": FIG4,
    "Hess": HESS,
    "beta0=0": Body(FIG4.A, (1, 0, 0), 0),
    "beta0=pi": FIG5,
    "alpha0 near 0": Body.from_angles("0.1", "0.05", "0.085", 0),
    "alpha0 near pi": NEAR_PI,
}


def leaves(orbit: PeriodicOrbit) -> bool:
    return orbit.exponent > 0


def assert_solves_eq1(orbit: PeriodicOrbit, p: Angles, points: int = 1 << 10) -> None:
    """theta1 is that of many more steps, whose slope by Fourier is its rate by (eq1)."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(floquet, "FEWEST_STEPS", points // 2)
        patch.setattr(floquet, "MOST_STEPS", points)
        finer = periodic_orbit(p, 1.0, orbit.family, orbit.epsilon)
    np.testing.assert_allclose(orbit.theta1, finer.theta1[:: points // orbit.tau.size], atol=3e-14)
    times = np.linspace(0, finer.period, points, endpoint=False)
    _, J2, tau = pendulum.canonical_motion(times, p, 1.0, finer.family, np)
    assert apart(tau, finer.tau, 2 * math.pi) < 1e-13
    # What is left without its turns is periodic.
    turn = 2 * math.pi / finer.period
    series = np.fft.rfft(finer.theta1 - finer.turns * turn * times)
    slope = np.fft.irfft(1j * turn * np.arange(series.size) * series, points) + finer.turns * turn
    upper = finer.family == 2
    state = finer.theta1, J2 if upper else 0 * J2, tau - (finer.theta1 if upper else 0), J2
    # The fastest harmonics round to a double each.
    assert np.abs(slope - eq1(state, p, np)[0]).max() < 1e-14 * turn * points


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "mu", "family", "turns"),
    [
        (HESS, "0.3", 1, 0),
        (FIG5, "0.3", 2, 0),
        (NEAR_PI, "0.6", 1, 2),
        (FIG4, "0.999", 2, 0),
        (FIG5, "0.95", 1, -1),
        (FIG5, "0.95", 2, 1),
    ],
)
def test_agrees_with_the_linearised_field(body: Body, mu: str, family: int, turns: int) -> None:
    """Over a period, in 212 bits."""
    heavy = Body(body.A, body.r, mu)
    truth = float(multiplier(heavy, exact(1), family)[0])
    for epsilon in (1, -1):
        orbit = periodic_orbit(heavy.angles(), 1.0, family, epsilon)
        leaving = (family == 1) == (epsilon == 1)
        assert (orbit.turns, leaves(orbit)) == (turns, leaving)
        # Where the direction has turned oddly often when it comes back they are negative.
        expected = (-1) ** turns * math.exp(truth if leaving else -truth)
        assert orbit.multiplier == pytest.approx(expected, rel=1e-10, abs=0)
        assert_solves_eq1(orbit, heavy.angles(), 1 << (12 if body is NEAR_PI else 10))


@pytest.mark.parametrize("body", SPECIAL.values(), ids=SPECIAL)
@pytest.mark.parametrize(("family", "epsilon"), PAIRS)
def test_order_the_multipliers_without_weight(body: Body, family: int, epsilon: int) -> None:
    p = body.angles()
    J2_0, side = math.sqrt(2 / p.kappa), epsilon * (3 - 2 * family)
    u, T = J2_0 * math.sin(p.alpha0), 2 * math.pi / (p.kappa * J2_0)
    free = periodic_orbit(p, 1.0, family, epsilon)
    assert free.period == pytest.approx(T, rel=1e-14, abs=0)
    assert free.exponent == pytest.approx(side * u / 2, rel=1e-13, abs=1e-14)
    assert free.multiplier == pytest.approx(math.exp(side * u * T / 2), rel=1e-12, abs=0)
    np.testing.assert_allclose(free.theta1, p.beta0 + epsilon * p.alpha0, atol=1e-13)


@pytest.mark.parametrize(("mu", "h0"), [("0.6", 1.0), ("6e-9", 1e-8)])
def test_order_of_rounding_beside_a_symmetric_body(mu: str, h0: float) -> None:
    """Of which the moments differ by a part d of A1: there the bound of all others is broken."""
    d, rest, shape = 4e-6, 1 - 0.6, ((2, 1, "1.999992"), (3, 1, 0))
    found = periodic_orbit(Body(*shape, mu).angles(), h0)
    truth, period = multiplier(Body(*shape, "0.6"), exact(1), 1)
    off = rest * 2.0**46 * float(abs(found.exponent_per_period - truth))
    assert 1 < off < 0.01 / d
    assert rest * float(abs(found.period * math.sqrt(h0) / period - 1)) < 2.0**-48


def test_order_of_rounding_beside_alpha0_of_pi() -> None:
    """With a small moment about axis 2 errors grow as 1/sin(alpha0)."""
    r, mu = ("0.737517", "0.675323", 0), "0.50657085"
    body = Body((1, "0.1025361364", "0.9498314523"), r, mu)
    truth, _ = multiplier(body, exact(1), 1)
    off = abs(float(abs(periodic_orbit(body.angles(), 1.0).exponent_per_period) - truth))
    assert 1 < off * 2.0**45 * (1 - float(body.mu)) < 1 / math.sin(body.alpha0)


def nearly_spherical(d: str, mu: str, r: Any = (1, 1, 0)) -> Body:
    """A body whose moments differ by a part d of A1, or less."""
    return Body((1, 1 - Fraction(d), 1 - Fraction(d) * 2 / 5), r, mu)


@pytest.mark.parametrize(("d", "mu"), [("1e-8", "1e-4"), ("1e-8", "0.3"), ("1e-12", "0")])
def test_an_exponent_near_0_keeps_digits_of_its_own(d: str, mu: str) -> None:
    """The sum of the multipliers is nearer to 2 than doubles can tell from 2."""
    body = nearly_spherical(d, mu)
    p = body.angles(113)
    found = periodic_orbit(p, 1.0).exponent_per_period
    truth = multiplier(body, exact(1), 1)[0] if p.mu else math.pi**2 / p.nu
    assert found == pytest.approx(float(truth), rel=1e-9 if p.mu > 0.1 else 1e-11, abs=0)
    assert found == -periodic_orbit(p, 1.0, 1, -1).exponent_per_period


def test_an_elliptic_motion_is_told_from_one_of_which_rounding_decides() -> None:
    """The sum of the multipliers is 2 - 0.59 d where the centre of gravity is on axis 2."""
    on_axis = nearly_spherical("1e-14", "0.3", (0, 1, 0)).angles(113)
    with pytest.raises(floquet.NotHyperbolic, match=r"sum 2 - 5\.9e-15, between"):
        periodic_orbit(on_axis, 1.0)
    for r in ((0, 1, 0), (3, 1, 0)):
        p = nearly_spherical("1e-17", "0.3", r).angles(113)
        with pytest.raises(ArithmeticError, match="rounding decides whether it is more") as raised:
            periodic_orbit(p, 1.0)
        assert not isinstance(raised.value, floquet.NotHyperbolic)


@pytest.mark.filterwarnings("error")
def test_a_growth_beyond_doubles_is_not_called_elliptic() -> None:
    """Thin bodies, where a period multiplies deviations by more than 1e308.

    With 32 steps the sum of the multipliers of the second would be -0.69, and steps of the third
    are singular in doubles.
    """
    for A, r, mu in (
        ((1, "1e-6", "0.9999995"), (1, "0.3", 0), "0.3"),
        ((1, "1e-11", 1 - Fraction(1, 3 * 10**11)), (1, 1, 0), Fraction(1, 9)),
        ((1, "1e-7", "0.99999999"), (1, 1, 0), "0.33"),
    ):
        p = Body(A, r, mu).angles(113)
        for epsilon in (1, -1):
            with pytest.raises(ArithmeticError, match="512 steps don't settle") as raised:
                periodic_orbit(p, 1.0, 1, epsilon)
            assert not isinstance(raised.value, floquet.NotHyperbolic)


def test_steps_settle_until_rounding_decides() -> None:
    """Beside alpha0 = pi: at 0.99 h0 halved steps change theta1 by 5e-13, at 0.9999 by 3e-11."""
    p = NEAR_PI.angles()
    assert leaves(periodic_orbit(p._replace(mu=0.99), 1.0))
    with pytest.raises(ArithmeticError, match=r"512 steps don't settle .*: rounding decides"):
        periodic_orbit(p._replace(mu=0.9999), 1.0)


def test_what_is_no_orbit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="epsilon is 1 or -1"):
        periodic_orbit(FIG4.angles(), 1.0, 1, 2)
    monkeypatch.setattr(floquet, "MOST_STEPS", 32)
    with pytest.raises(ArithmeticError, match="32 steps don't settle the periodic orbit at h0 = "):
        periodic_orbit(FIG4.angles(), 1.0)


def test_a_thin_body_s_multiplier_keeps_its_digits_where_its_angles_have_them() -> None:
    """Without weight its logarithm is pi^2/nu; the bound for angles in doubles is 2^-45/sin."""
    p = Body(THIN.A, THIN.r, 0).angles(113)
    truth = math.pi**2 / float(p.nu)
    off, rounded = (
        abs(periodic_orbit(each, 1.0).exponent_per_period / truth - 1)
        for each in (p, THIN.angles()._replace(mu=0.0))
    )
    assert off < 2.0**-45 / truth
    assert 1e-9 < rounded < 2.0**-45 / math.sin(p.alpha0)
