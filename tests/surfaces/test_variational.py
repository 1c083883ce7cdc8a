"""The linearised equations against (eq1), their integral, and their quadratures."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from scipy.integrate import quad

from rigidpend import Body
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.free_body import (
    SEPARATRICES,
    SeparatrixMotion,
    direction,
    separatrix,
    theta1,
)
from rigidpend.orbits.integrate.states import states_at
from rigidpend.surfaces import melnikov
from rigidpend.surfaces.melnikov import (
    delta_theta1,
    linearised,
)
from tests.bodies import GENERIC
from tests.strategies import (
    DERIVATIVE,
    FINE,
    along,
    bodies,
    fine_angles,
    largest_difference,
    numbers,
    repeatable,
)

DELTA = (0.7, -0.4, 1.1, 0.3)


def beginning(number: int, J1_0: float = 1e-3) -> SeparatrixMotion:
    """A motion that begins near the periodic orbit from which the separatrix comes."""
    pair = (J1_0, 0.8) if direction(number) == 1 else (0.8, J1_0)
    return SeparatrixMotion(number, *pair, 0.7)


def fine(motion: SeparatrixMotion) -> SeparatrixMotion:
    return motion._replace(
        **{name: FINE.mpf(getattr(motion, name)) for name in ("J1_0", "J2mJ1_0", "theta2_0")}
    )


def flat(c: Any) -> list[Any]:
    return [c.theta1, c.J1, c.theta2, c.J2]


def beside(motion: SeparatrixMotion, t: Any, p: Any, s: Any) -> list[Any]:
    """The separatrix's state, displaced by s DELTA."""
    at = flat(separatrix(t, motion, p, FINE))
    return [x + s * y for x, y in zip(at, DELTA, strict=True)]


@pytest.mark.parametrize("number", SEPARATRICES)
@repeatable(5)
@given(bodies(), numbers(-4, 4))
def test_eq_eq2_is_the_slope_of_eq1_in_mu_and_the_distance(
    number: int, body: Body, t: float
) -> None:
    p, motion = fine_angles(body), fine(beginning(number, 0.1))

    def rates(s: Any) -> Any:
        return eq1(beside(motion, FINE.mpf(t), p, s[0]), p._replace(mu=s[0] * p.mu), FINE)

    expected = along(rates, [FINE.mpf(0)], [1])
    found = linearised(FINE.mpf(t), DELTA, motion, p, FINE)
    assert largest_difference(found, expected) < DERIVATIVE


@pytest.mark.parametrize("number", SEPARATRICES)
def test_eq_eq2_leaves_orbits_of_eq1_a_remainder_of_second_order(number: int) -> None:
    p, motion = GENERIC.angles(), beginning(number, 0.05)
    times, sizes = np.linspace(0, 5, 6), np.array([1e-3, 5e-4, 2.5e-4, 1.25e-4])
    centre = np.array(np.broadcast_arrays(*flat(separatrix(times, motion, p))))
    remainders = []
    for size in sizes:
        heavy, begin = p._replace(mu=size), size * np.array(DELTA)
        full = full_orbit(heavy, centre[:, 0] + begin, times)
        near = linear_orbit(motion, heavy, begin, times)
        remainders.append(np.abs(full - centre - near)[:, -1].max())
    slope = np.polyfit(np.log(sizes), np.log(remainders), 1)[0]
    assert slope == pytest.approx(2, abs=0.02)


def full_orbit(p: Any, begin: Any, times: Any) -> Any:
    return states_at(lambda x, m: eq1(x, p, m), begin, times)


def first_integral(t: Any, delta: Any, motion: SeparatrixMotion, p: Any, m: Any) -> Any:
    """The first integral J of (eq2): the excess of the energy over kappa J2_0^2/2."""
    by_theta1, _, _, by_J2 = delta
    at, J2 = separatrix(t, motion, p, m), motion.J2_0
    steep = direction(motion.number) * m.sin(p.alpha0)
    height = (at.J1 * m.sin(at.theta1 + at.theta2) + at.J2mJ1 * m.sin(at.theta2)) / J2
    return -at.J1 * at.J2mJ1 * steep * by_theta1 + p.kappa * J2 * by_J2 + p.mu * height


def linear_orbit(motion: SeparatrixMotion, p: Any, begin: Any, times: Any) -> Any:
    """(eq2) integrated, its time being a fifth variable."""

    def field(x: Any, _: Any) -> tuple[Any, ...]:
        return (*linearised(x[4], x[:4], motion, p, np), 1.0)

    return states_at(field, [*begin, times[0]], times, engine="scipy")[:4]


@pytest.mark.parametrize("number", SEPARATRICES)
@repeatable(10)
@given(bodies(), numbers(-4, 4))
def test_invariant_the_first_integral_s_derivative_vanishes(
    number: int, body: Body, t: float
) -> None:
    p, motion = fine_angles(body), fine(beginning(number, 0.1))
    rate = linearised(FINE.mpf(t), DELTA, motion, p, FINE)
    (slope,) = along(
        lambda x: [first_integral(x[0], x[1:], motion, p, FINE)],
        [FINE.mpf(t), *map(FINE.mpf, DELTA)],
        [1, *rate],
    )
    assert abs(slope) < DERIVATIVE


@pytest.mark.parametrize("number", SEPARATRICES)
@pytest.mark.parametrize("way", [1, -1])
def test_eq_dtheta_is_the_integral_of_eq2(number: int, way: int) -> None:
    p, motion = GENERIC.angles(), beginning(number, 0.05)
    times = way * np.linspace(0, 12, 7)
    expected = linear_orbit(motion, p, [2e-3, 0, 0, 0], times)[0]
    found = [delta_theta1(t, 2e-3, motion, p) for t in times]
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize("number", SEPARATRICES)
@pytest.mark.parametrize("J1_0", [1e-200, 1e-30, 1e-8, 0.4])
@pytest.mark.parametrize("passed", [-20.0, 0.3, 1.9])
def test_eq_dtheta_the_two_printed_forms_are_equal(number: int, J1_0: float, passed: float) -> None:
    """At times up to where the other end is as near as the beginning was."""
    p, motion = GENERIC.angles(), beginning(number, J1_0)
    rate, half = 0.8 * math.sin(p.alpha0), float(theta1(number, p)) / 2
    t = (passed if passed < 0 else passed * abs(math.log(J1_0 / 0.8))) / rate

    def across(tau: float) -> float:
        at = separatrix(tau, motion, p, math)
        return float(at.J1 * at.J2mJ1)

    def pull(tau: float) -> float:
        return across(tau) / across(t) * math.cos(p.kappa * motion.J2_0 * tau + 0.7 + half)

    middle = direction(number) * math.log(motion.J2mJ1_0 / motion.J1_0) / (0.8 * math.sin(p.alpha0))
    ends = [0.0, *([middle] if min(0, t) < middle < max(0, t) else []), t]
    least = 1e-12 * max(map(across, ends)) / across(t)
    forced = sum(quad(pull, a, b, epsabs=least, limit=1000)[0] for a, b in pairwise(ends))
    expected = across(0) / across(t) * 2e-3 + 2 * p.mu * math.sin(half) / motion.J2_0 * forced
    found = delta_theta1(t, 2e-3, motion, p)
    assert found == pytest.approx(expected, rel=1e-9 + 1e-15 * abs(rate * t))


@pytest.mark.parametrize("number", SEPARATRICES)
def test_eq_dtheta_leaves_by_what_melnikov_s_integral_is(number: int) -> None:
    """From far before the middle to far behind it, the deviation times J1 (J2 - J1)."""
    p, motion = GENERIC.angles(), beginning(number, 1e-14)
    J2, rate = motion.J2_0, 0.8 * math.sin(p.alpha0)
    t = 2 * math.log(J2 / 1e-14) / rate
    at = separatrix(t, motion, p)
    grown = delta_theta1(t, 0.0, motion, p) * at.J1 * at.J2mJ1
    expected = -direction(number) * p.mu * p.kappa * J2 / math.sin(p.alpha0)
    assert grown == pytest.approx(expected * melnikov.integral(motion, p), rel=1e-9)
