"""Melnikov's integral against derivatives, sums and orbits, and orbits beside a separatrix."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from rigidpend import Body
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.free_body import SEPARATRICES, SeparatrixMotion, direction, separatrix
from rigidpend.orbits.integrate.states import states_at
from rigidpend.surfaces import melnikov
from rigidpend.surfaces.melnikov import delta_theta1, linearised
from tests.bodies import FIG4, GENERIC, problem
from tests.strategies import (
    DERIVATIVE,
    FINE,
    along,
    bodies,
    examples,
    fine_angles,
    largest_difference,
    numbers,
)
from tests.surfaces.bracket import bracket_on


def nearly_round(nu: float) -> Body:
    """A body of about the given nu; the nearer to a sphere, the larger it is."""
    spread = 2 * math.pi / nu
    return Body(A=(2, 2 - spread, 2 - spread / 2), r=(1, 3, 0), mu=0)


@pytest.mark.parametrize("number", SEPARATRICES)
@pytest.mark.parametrize("phase", [0.0, 1.0, 4.0])
def test_eq_Im_is_adaptive_quadrature_of_the_bracket(number: int, phase: float) -> None:
    p, motion = FIG4.angles(), SeparatrixMotion(number, 0.3, 0.7, phase)
    found = quad(lambda t: bracket_on(motion, t, p, math), -40, 40, epsabs=1e-14, limit=500)[0]
    assert melnikov.integral(motion, p) == pytest.approx(found, abs=1e-12)


def test_eq_Im_is_its_middle_form_with_legendre_s_integral() -> None:
    """The printed factor of sigma_0/u cos(delta + phase), the paper's minus sign apart."""
    m, p = FINE, fine_angles(nearly_round(5))

    def legendre(x: Any) -> Any:
        return m.sin(2 * p.nu * x) / (m.exp(2 * m.pi * x) + 1)

    ends = [k * m.pi / p.nu for k in range(math.ceil(11 * 5 / math.pi))]
    middle = 1 - 4 * p.nu * m.quad(legendre, ends, method="gauss-legendre")
    J2 = m.mpf("0.7")
    # sigma_0/u
    unit = 2 * m.sin((p.alpha0 + p.beta0) / 2) / (p.kappa * J2)
    assert abs(-melnikov.amplitude(2, J2, p, m) / unit - middle) < 1e-26


@pytest.mark.parametrize("nu", [1e-3, 4.0, 300.0, 745.0, 2000.0])
def test_the_amplitude_neither_overflows_nor_loses_digits(nu: float) -> None:
    p = GENERIC.angles()._replace(nu=nu)
    fine = fine_angles(GENERIC)._replace(nu=FINE.mpf(nu))
    lean = FINE.sin((fine.alpha0 + fine.beta0) / 2)
    expected = float(-2 * fine.nu * lean / (fine.kappa * FINE.sinh(fine.nu)))
    for m in (np, math):
        assert melnikov.amplitude(2, 1.0, p, m) == pytest.approx(expected, rel=1e-14, abs=1e-320)


def test_zeros_are_where_the_integral_vanishes() -> None:
    p, q = problem(GENERIC, 1, J1_0="1e-50"), fine_angles(GENERIC)
    J1, J2 = FINE.mpf("1e-50"), p.J2_0(200)
    found = melnikov.zeros(p)
    assert len(found) == 2
    for phase in found:
        at, beside = (
            melnikov.integral(SeparatrixMotion(2, J1, J2 - J1, phase + more), q, FINE)
            for more in (0, FINE.pi / 2)
        )
        assert abs(at) < 1e-14 * abs(beside)


def test_a_zero_that_rounds_to_a_whole_turn_is_the_first_of_them() -> None:
    """The start is made so that the second zero is 1e-20 below 2 pi."""
    J1_0 = "0.000679961682572420835835927651830210283088078993"
    assert melnikov.zeros(problem(GENERIC, 1, J1_0=J1_0)) == (0, math.pi)


DELTA = (0.7, -0.4, 1.1, 0.3)


def beginning(number: int, J1_0: Any, m: Any = math) -> SeparatrixMotion:
    """A motion that begins near the periodic orbit from which the separatrix comes."""
    pair = (J1_0, 0.8) if direction(number) == 1 else (0.8, J1_0)
    return SeparatrixMotion(number, *((0 * m.pi + x) for x in (*pair, 0.7)))


@pytest.mark.parametrize("number", SEPARATRICES)
@examples(4, bodies(), numbers(-4, 4))
def test_eq_eq2_is_the_slope_of_eq1_in_mu_and_the_distance(
    number: int, body: Body, t: float
) -> None:
    p, motion = fine_angles(body), beginning(number, 0.1, FINE)
    c = separatrix(FINE.mpf(t), motion, p, FINE)

    def rates(s: Any) -> Any:
        """On the separatrix displaced by s DELTA, of s times the weight."""
        state = zip((c.theta1, c.J1, c.theta2, c.J2), DELTA, strict=True)
        return eq1([x + s[0] * y for x, y in state], p._replace(mu=s[0] * p.mu), FINE)

    expected = along(rates, [FINE.mpf(0)], [1])
    found = linearised(FINE.mpf(t), DELTA, motion, p, FINE)
    assert largest_difference(found, expected) < DERIVATIVE


@pytest.mark.parametrize("number", SEPARATRICES)
@pytest.mark.parametrize("way", [1, -1])
def test_eq_dtheta_is_the_integral_of_eq2(number: int, way: int) -> None:
    p, motion = GENERIC.angles(), beginning(number, 0.05)
    times = way * np.linspace(0, 12, 7)

    def field(x: Any) -> tuple[Any, ...]:
        """Its time is a fifth variable."""
        return (*linearised(x[4], x[:4], motion, p, np), 1.0)

    expected = states_at(field, [2e-3, 0, 0, 0, 0], times, engine="scipy")[0]
    found = [delta_theta1(t, 2e-3, motion, p) for t in times]
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)


def test_what_is_missed_is_the_part_of_the_integral_before_the_start() -> None:
    """As large as it is at any phase; J1_0 is a ten thousandth of J2_0."""
    start, p = problem(FIG4, 1, J1_0="1e-4"), FIG4.angles()
    J2 = float(start.J2_0(53))
    motion, phases = SeparatrixMotion(2, 1e-4, J2 - 1e-4, 0.0), (0, math.pi / 2)
    both = [quad(lambda t, x=x: bracket_on(motion, t, p, math, x), -40, 0)[0] for x in phases]
    share = math.hypot(*both) / abs(melnikov.amplitude(2, J2, p))
    assert melnikov.missed(start) == pytest.approx(share, rel=1e-3)
