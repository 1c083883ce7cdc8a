"""What theta3 gains: separatrices 1 to 4 integrated directly, orders in mu, the Hess case."""

import contextlib
import math
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.optimize import brentq

from rigidpend import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import aligned_coefficients, hamiltonian_J3_0
from rigidpend.mechanics.in_space import field
from rigidpend.mechanics.in_space import increments as first_order
from rigidpend.numbers.exact import context, exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.surfaces import heteroclinic
from rigidpend.surfaces.heteroclinic import increments
from rigidpend.surfaces.surface_orbits import launch, surface
from tests.bodies import THIN
from tests.orbits.integrate.problems import find, theta1_on

GENERIC = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.05")
HESS = Body(A=(2, 1, "1.5"), r=(1, "sqrt(2)", 0), mu="0.05")
ARITHMETIC = resolve(None, 3e-14)
H0 = exact(1)
LOW = math.exp(-44)


def beginning(separatrix: int, theta2: float) -> Any:
    """A state (6,) of energy 1 where the separatrix begins, at J1 or J2 - J1 = LOW J2."""
    p, theta = GENERIC.angles(), (theta1_on(separatrix, GENERIC), theta2)
    rising = separatrix in (2, 4)
    share = LOW if rising else 1 - LOW
    free, heavy = (hamiltonian_J3_0(share, 1, theta, p._replace(mu=mu), math) for mu in (0.0, p.mu))
    J2 = math.sqrt((1 - (heavy - free)) / free)
    small, large = LOW * J2, J2 - LOW * J2
    J1, J2mJ1 = (small, large) if rising else (large, small)
    c = Canonical(J1, J2mJ1, 0.0, *theta, 0.0, 1.0)
    state = aligned_from_canonical(c, p.alpha0, p.beta0)
    return np.array(state._replace(**{"Qm" if rising else "Qp": 0.0}))


def crossing(separatrix: int, theta2: float) -> tuple[float, float, Any]:
    """When the orbit crosses the section, gamma3 there, and where it began."""
    state = beginning(separatrix, theta2)
    found = find(state[:, None], ARITHMETIC.engine, body=GENERIC, n_crossings=1)
    assert found.separatrix[0, 0] == separatrix
    time = float(found.time[0, 0])
    numbers: Any = aligned_coefficients(GENERIC.angles(), math)
    end = states_at(numbers, state[:, None], [0.0, time])[:, -1, 0]
    return time, float(end[5]), state


def directly(separatrix: int) -> list[float]:
    """theta3 over the two orbits that cross the section where gamma3 = 0; checks the mirror."""
    grid = np.linspace(0, math.tau, 5)
    at = [crossing(separatrix, x)[1] for x in grid]
    gains = []
    for a, b, left, right in zip(grid, grid[1:], at, at[1:], strict=False):
        if left * right < 0:
            root = brentq(lambda x: crossing(separatrix, x)[1], a, b, xtol=1e-13)
            time, _, state = crossing(separatrix, root)
            times = np.array([0.0, time - 9, time - 4, time, time + 4, time + 9])
            orbit = states_at(field(GENERIC), [*state, 0.0], times)
            theta3 = orbit[6] - orbit[6, 3]
            assert abs(theta3[4]) > 0.2 * abs(theta3[0])
            np.testing.assert_allclose(-theta3[[2, 1]], theta3[[4, 5]], rtol=0, atol=1e-8)
            gains.append(float(-2 * theta3[0]))
    return sorted(gains)


@pytest.mark.slow
@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
def test_agrees_with_each_separatrix_integrated_directly(separatrix: int) -> None:
    found = np.sort(increments(GENERIC, H0, ARITHMETIC).gained[:, separatrix - 1])
    np.testing.assert_allclose(directly(separatrix), found, rtol=0, atol=2e-10)
    # Far more than that is between the orbits, and between them and the first order.
    first = first_order(GENERIC.angles(), 1.0)[separatrix - 1]
    assert found[1] - found[0] > 1e-4
    assert np.abs(found - first).min() > 1e-5


@pytest.mark.parametrize("body", [GENERIC, Body(HESS.A, (2, 1, 0), 0)])
def test_order_tri1_errs_in_the_second_order_and_the_mean_of_both_orbits_in_the_third(
    body: Body,
) -> None:
    gaps = []
    for mu in ("2e-3", "1e-3"):
        heavy = Body(body.A, body.r, mu)
        gaps.append(increments(heavy, H0, ARITHMETIC).gained - first_order(heavy.angles(), 1.0))
    np.testing.assert_allclose(gaps[0] / gaps[1], 4, rtol=0.05)
    np.testing.assert_allclose(gaps[0].mean(axis=0) / gaps[1].mean(axis=0), 8, rtol=0.01)


def test_what_a_thin_body_gains_keeps_its_digits() -> None:
    """With beta0 = pi it is small, mu nu cos(alpha0/2)/h0; angles in doubles give eight digits."""
    p = Body(THIN.A, (0, 1, 0), "1e-24").angles(113)
    first = float(p.mu * p.nu * context(113).cos(p.alpha0 / 2))
    gained = increments(Body(THIN.A, (0, 1, 0), "1e-24"), H0, ARITHMETIC).gained
    np.testing.assert_allclose(gained, np.full((2, 4), first) * (1, 1, -1, -1), rtol=1e-12)


def test_in_the_Hess_case_nothing_is_gained_along_1_and_3() -> None:
    found = increments(HESS, H0, ARITHMETIC).gained
    assert np.abs(found[:, [0, 2]]).max() < 1e-17
    assert np.abs(found[:, [1, 3]]).min() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "rounding"),
    [
        (GENERIC, 1e-15),
        # Overtones of the rotation fall on the steps, if these are few.
        (Body((2, "1.632", "1.646"), ("0.666", "0.746", 0), "0.00731"), 3e-14),
        # With half as many steps for each turn the error is 7e-13, and told to be so.
        (Body((1, "0.544", "0.556"), ("0.991", "0.134", 0), "0.28"), 3e-14),
    ],
)
def test_the_error_told_holds_against_more_steps(
    body: Body, rounding: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = increments(body, H0, ARITHMETIC)
    assert 0 <= found.error.min() <= found.error.max() < rounding
    monkeypatch.setattr(heteroclinic, "STEPS", 3 * heteroclinic.STEPS)
    finer = increments(body, H0, ARITHMETIC)
    assert np.abs(finer.gained - found.gained).max() < found.error.max() + rounding


@pytest.mark.slow
def test_the_error_told_holds_where_steps_are_few(monkeypatch: pytest.MonkeyPatch) -> None:
    right = increments(GENERIC, H0, ARITHMETIC).gained
    monkeypatch.setattr(heteroclinic, "STEPS", 8)
    monkeypatch.setattr(heteroclinic, "TURN", 0)
    found = increments(GENERIC, H0, ARITHMETIC)
    assert 1e-11 < np.abs(found.gained - right).max() < found.error.max()


def test_theta3_is_followed_by_the_engine_that_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    followed = Mock(wraps=states_at)
    monkeypatch.setattr(heteroclinic, "beginning", lambda *_: (76.0, 40.0, 0.0))
    monkeypatch.setattr(heteroclinic, "states_at", followed)
    increments(GENERIC, H0, resolve("scipy", 1e-9))
    for call in followed.call_args_list:
        assert call.kwargs == {"engine": "scipy", "tolerance": 1e-9}
    assert followed.called


@pytest.mark.parametrize(
    "body",
    [
        # J1 shrinks in a part of each turn: over phases of starts g goes to and fro.
        Body(A=(2, "1.1855703", "1.1862"), r=("0.4798", "0.8774", 0), mu="0.02"),
        # g leaps over more than half a turn of all depths in a few of them.
        Body(A=(2, "0.42349489", "1.9886207"), r=(1, 1, 0), mu="0.0985"),
    ],
)
def test_orbits_are_found_and_right_where_the_weight_acts_strongly(body: Body) -> None:
    gained, s = increments(body, H0, ARITHMETIC).gained[0, 1], surface(body, H0, 53)
    depth, time, off = heteroclinic.beginning(s, math.pi / 2, ARITHMETIC)
    assert abs(off) < 1e-7
    start = [*map(float, launch(s, heteroclinic.START, depth)), 0.0]
    end = states_at(field(body), start, [time])[:, -1]
    # On the section gamma is across the axis of rotation: the orbit is its own mirror image.
    assert end[[2, 5]] == pytest.approx([0, 0], abs=1e-9)
    assert 2 * end[6] == pytest.approx(gained, abs=1e-9)


def test_a_search_ends_where_roundings_of_many_turns_keep_g_from_its_goal() -> None:
    """A nearly symmetric body turns 2,400 times on its way: g is known to 1e-11 only."""
    body = Body(A=(16, 8, "15.9999"), r=(1, "0.7", 0), mu="1e-6")
    unit = float(body.mu) * body.nu
    np.testing.assert_allclose(
        increments(body, H0, ARITHMETIC).gained,
        np.tile(first_order(body.angles(), 1.0), (2, 1)),
        rtol=0,
        atol=2e-8 * unit,
    )


def test_increments_of_a_thin_body_keep_their_digits() -> None:
    """alpha0 is 1.4e-6 below pi. Truth: Euler-Poisson by Taylor series in 190 bits."""
    body = Body(A=(2, "2e-6", "1.999999"), r=(1, 3, 0), mu="1e-6")
    truth = [7.834496371050263e-7, 6.448587842628892e-7]
    found = increments(body, H0, ARITHMETIC).gained[:, 1]
    assert found == pytest.approx(truth, rel=0, abs=1e-13 * float(body.mu) * body.nu)


@pytest.mark.parametrize("found", [True, False])
def test_an_orbit_is_none_where_g_leaps_over_its_goal(
    found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    off = 0.99e-3 if found else 1.01e-3

    def leap(s: Any, starts: Any, depth: Any, arithmetic: Any) -> Any:
        return Mock(phase=[math.copysign(off, depth - heteroclinic.DEPTH - 1)], time=[40.0])

    monkeypatch.setattr(heteroclinic, "meet", leap)
    s = surface(GENERIC, H0, 53)
    with contextlib.nullcontext() if found else pytest.raises(ArithmeticError, match="no orbit"):
        assert abs(heteroclinic.beginning(s, 0.0, ARITHMETIC).off) == off


def test_what_g_is_off_by_counts_in_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a share of what the two orbits differ by: here they are cut off at unlike times."""
    monkeypatch.setattr(heteroclinic, "beginning", lambda s, g, _: (76.0, 40.0 + g, 0.5))
    found = increments(GENERIC, H0, resolve("scipy", 1e-9))
    apart = np.ptp(found.gained, axis=0)
    assert apart.min() > 0
    assert (found.error >= apart / 2).all()


def test_an_elliptic_periodic_orbit_is_said_to_have_no_surface() -> None:
    body = Body(A=(2, "1.304", "1.354"), r=("0.666", "0.746", 0), mu="0.6")
    with pytest.raises(ArithmeticError, match=r"not hyperbolic: .* sum 0\.976049"):
        increments(body, H0, ARITHMETIC)


def test_an_orbit_that_is_not_found_is_an_error() -> None:
    body = Body(A=(2, "1.7", "1.85"), r=(2, 1, 0), mu="0.95")
    with pytest.raises(ArithmeticError, match=r"meets the section at g = -?1\.57"):
        increments(body, H0, ARITHMETIC)
