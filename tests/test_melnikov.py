"""Melnikov's integral: its zeros against quadrature, against known digits, against orbits."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from rigidpend import Body, melnikov, route_codes
from rigidpend.equations import hamiltonian_J3_0
from rigidpend.exact import exact
from rigidpend.routes.problem import RouteProblem
from tests.strategies import FINE, apart, bodies, fine_angles, numbers, repeatable

FIG4 = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
MAX_NU = 9
"""The integral is about nu exp(-nu) of its integrand: beyond, quadrature in doubles is blind."""


def problem(body: Body = FIG4, h0: Any = "1.3342", J1_0: Any = "1e-8") -> RouteProblem:
    return RouteProblem(body, exact(h0), exact(J1_0), 1)


def bracket(p: RouteProblem, J1: Any, theta2: Any) -> Any:
    """{H0, H1/(kappa J2_0)} on separatrix 2, the definition above (Im), of arrays.

    The derivatives of the Hamiltonian are taken in the complex direction, which rounds nothing.
    """
    angles, J2, tiny = p.body.angles(), float(p.J2_0(53)), 1e-30
    theta1 = angles.alpha0 + angles.beta0

    def slope(mu: float, at: complex, along: complex) -> Any:
        H = hamiltonian_J3_0(J1 + at, J2, (theta1 + along, theta2), angles._replace(mu=mu), np)
        return H.imag / tiny

    H0_J1, H0_theta1 = slope(0, tiny * 1j, 0), slope(0, 0, tiny * 1j)
    H1_J1, H1_theta1 = slope(1, tiny * 1j, 0) - H0_J1, slope(1, 0, tiny * 1j) - H0_theta1
    return (H0_theta1 * H1_J1 - H0_J1 * H1_theta1) / (angles.kappa * J2)


def integral(p: RouteProblem) -> Callable[[float], float]:
    """I_M as a function of the phase, by the trapezoid rule along (sol_2), J1(0) = J1_0."""
    angles, J2, J1_0 = p.body.angles(), float(p.J2_0(53)), float(p.J1_0)
    u, v = J2 * math.sin(angles.alpha0), math.log((J2 - J1_0) / J1_0)
    # On the whole line the rule converges exponentially; exp(-40) is left beyond the ends.
    t, step = np.linspace(v / u - 40 / u, v / u + 40 / u, 4001, retstep=True)
    J1 = J2 / (np.exp(-u * t + v) + 1)
    theta2 = angles.kappa * J2 * t
    return lambda phase: float(bracket(p, J1, theta2 + phase).sum() * step)


def zeros_by_quadrature(p: RouteProblem) -> list[float]:
    """Where the integral changes its sign in a turn."""
    f = integral(p)
    grid = np.linspace(0, math.tau, 14)
    ends = [f(x) for x in grid]
    signs = [(a, b) for a, b in zip(range(13), range(1, 14), strict=True) if ends[a] * ends[b] < 0]
    return [float(brentq(f, grid[a], grid[b], xtol=1e-14)) for a, b in signs]


def assert_same_angles(found: Any, expected: Any, allowed: float) -> None:
    """Two pairs of angles, in any order, around the circle."""
    first, second = expected
    direct = max(apart(found[0], first, math.tau), apart(found[1], second, math.tau))
    crossed = max(apart(found[0], second, math.tau), apart(found[1], first, math.tau))
    assert min(direct, crossed) <= allowed


def test_agrees_the_zeros_of_fig4_to_six_digits() -> None:
    assert [f"{x:.6f}" for x in melnikov.zeros(problem())] == ["1.563050", "4.704643"]


@pytest.mark.parametrize(
    ("A", "r"),
    [
        ((2, 1, "1.5"), (1, 1, 0)),
        ((2, "0.2", "1.8"), (1, 0, 0)),
        ((2, "1.04", "1.7"), (0, 1, 0)),
        ((2, "1.18", "1.5"), (2, "0.3", 0)),
        ((2, "1.3", "1.72"), (1, 3, 0)),
    ],
)
@pytest.mark.parametrize("J1_0", ["1e-2", "1e-8", "1e-100"])
def test_eq_Im_vanishes_where_the_quadrature_of_its_definition_does(
    A: Any, r: Any, J1_0: str
) -> None:
    p = problem(Body(A, r, 0), "0.7", J1_0)
    by_quadrature = zeros_by_quadrature(p)
    assert len(by_quadrature) == 2
    assert_same_angles(melnikov.zeros(p), by_quadrature, 1e-10)


@repeatable(30)
@given(bodies(), numbers(1, 5), st.integers(3, 200))
def test_eq_Im_vanishes_at_the_zeros_of_any_body(body: Body, h0: float, digits: int) -> None:
    assume(body.nu < MAX_NU)
    p = problem(body, h0, f"1e-{digits}")
    f = integral(p)
    first, second = melnikov.zeros(p)
    largest = abs(f(first + math.pi / 2))
    assert largest > 0
    assert max(abs(f(first)), abs(f(second))) < 1e-7 * largest


@repeatable(100)
@given(bodies(), numbers(1, 5), st.integers(3, 400))
def test_the_zeros_ascend_in_a_turn_and_are_half_a_turn_apart(
    body: Body, h0: float, digits: int
) -> None:
    first, second = melnikov.zeros(problem(body, h0, f"1e-{digits}"))
    assert 0 <= first < second < math.tau
    assert second - first == pytest.approx(math.pi, abs=1e-15)


@repeatable(50)
@given(bodies(), st.integers(1, 3))
def test_the_same_orbit_passed_a_turn_later_has_the_same_zeros(body: Body, turns: int) -> None:
    p = fine_angles(body)
    # So small that J2_0 - J1_0 is J2_0 in double precision.
    J1_0 = FINE.mpf("1e-40")
    later = J1_0 * FINE.exp(-turns * 2 * FINE.pi * FINE.sin(p.alpha0) / p.kappa)
    assume(later > FINE.mpf("1e-400"))
    found, shifted = (melnikov.zeros(problem(body, 1, FINE.nstr(x, 50))) for x in (J1_0, later))
    assert_same_angles(shifted, found, 1e-14)


def test_the_zeros_move_with_J1_0_by_kappa_over_sin_alpha0() -> None:
    before, after = (melnikov.zeros(problem(J1_0=x)) for x in ("1e-50", "2e-50"))
    shift = FIG4.kappa / math.sin(FIG4.alpha0) * math.log(2)
    assert_same_angles(after, [x + shift for x in before], 1e-14)


def test_between_the_zeros_the_first_symbol_follows_the_cosine_s_sign() -> None:
    zeros = melnikov.zeros(problem())
    near = 1.1 * float(FIG4.mu)
    phases = np.array([x + side * near for x in zeros for side in (-1, 1)])
    routes = route_codes(FIG4, phases, h0="1.3342", J1_0="1e-8", n_symbols=1)
    assert routes.certain.all()
    # cos(delta + theta2_0) is sin(theta2_0 - z) for the zero z where it starts to be positive.
    rising = next(z for z in zeros if integral(problem())(z + 0.1) < 0)
    assert routes.codes[0].tolist() == [int(math.sin(x - rising) > 0) for x in phases]
