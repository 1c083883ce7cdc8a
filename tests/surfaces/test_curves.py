"""Curves on S1- and S2+ against Hamilton's equations, forward and really backward in time."""

import contextlib
import math
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import aligned_coefficients, eq1
from rigidpend.mechanics.pendulum import Delta_1
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.start import Scales, start, states_double
from rigidpend.surfaces import curves as surfaces
from rigidpend.surfaces.curves import (
    CHORD,
    S1_minus,
    S2_plus,
    SurfaceCurves,
    points,
    projected,
    surface_problem,
    times,
)
from tests.orbits.integrate.problems import on_separatrix

MOMENTS = {"a": (2, "0.2", "1.8"), "d": (2, "1.18", "1.5"), "g": (2, 1, "1.04")}
THETA2_0 = 2 * math.pi * (np.arange(12) + 0.5) / 12


def made(name: str = "d", **changes: Any) -> RouteProblem:
    given = {"beta0": None, "mu": "0.01", "M_0": 2, "J1_0": "1e-8", **changes}
    numbers = (None if x is None else exact(x) for x in given.values())
    return surface_problem(list(map(exact, MOMENTS[name])), *numbers)  # type: ignore[arg-type]


def delta(problem: RouteProblem) -> float:
    return float(Delta_1(problem.body.angles(), float(problem.h0), 1, math))


def lower(
    problem: RouteProblem, theta2_0: Any = THETA2_0, half_width: float = 2.5
) -> SurfaceCurves:
    return S1_minus(problem, theta2_0, half_width * delta(problem), "taylor")


def curve(curves: SurfaceCurves, k: int) -> tuple[Any, Any, Any]:
    part = slice(*curves.offsets[k : k + 2])
    return curves.theta1[part], curves.J1_over_J2[part], curves.sample[part]


@pytest.mark.parametrize("name", MOMENTS)
def test_agrees_with_hamilton_s_equations(name: str) -> None:
    """By (dtheta) errors grow as J2^2/(J1 (J2 - J1))."""
    problem = made(name)
    p, curves, t = problem.body.angles(), lower(problem), times(problem)
    theta1, ratio, at = curve(curves, 5)
    begin = [p.alpha0 + p.beta0, float(problem.J1_0), THETA2_0[5], problem.J2_0(53)]
    orbit = states_at(lambda x: eq1(x, p, np), begin, np.append(0, t[at]), engine="scipy")
    gap = np.abs(theta1 - orbit[0, 1:]) * 4 * ratio * (1 - ratio)
    assert gap.max() < 1e-10
    np.testing.assert_allclose(ratio, orbit[1, 1:] / orbit[3, 1:], rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "engine"), [("a", "taylor"), ("d", "scipy"), ("g", "taylor")])
def test_invariant_mirrored_orbits_are_those_integrated_backward(name: str, engine: str) -> None:
    problem = made(name)
    body, t = problem.body, times(problem)
    upper = S2_plus(lower(problem), body.alpha0, body.beta0)
    J2, J1_0 = float(problem.J2_0(53)), float(problem.J1_0)
    theta1, ratio, at = curve(upper, 7)
    begin = on_separatrix(2, body, J2 - J1_0, upper.theta2_0[7], J2)
    numbers: Any = aligned_coefficients(body.angles(), math)
    orbit = states_at(numbers, begin[:, None], np.append(0, -t[at]), engine=engine)[:, 1:, 0]
    theta1_back, ratio_back = projected(orbit, body.alpha0, body.beta0)
    # J2 - J1_0 is rounded here: a relative 1e-8 of the distance from the surface.
    gap = np.abs(theta1 - theta1_back) * 4 * ratio * (1 - ratio)
    assert gap.max() < 1e-8
    np.testing.assert_allclose(ratio, ratio_back, rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", MOMENTS)
def test_surfaces_are_born_as_wide_as_the_periodic_solutions_swing(name: str) -> None:
    problem = made(name)
    curves = lower(problem, 2 * math.pi * np.arange(48) / 48)
    firsts = curves.theta1[curves.offsets[:-1]] - problem.body.alpha0 - problem.body.beta0
    assert np.abs(firsts).max() / delta(problem) == pytest.approx(1, abs=0.03)
    assert curves.J1_over_J2[curves.offsets[:-1]].max() < 1e-4


def test_curves_end_with_their_first_point_outside_the_window() -> None:
    problem = made("a")
    curves = lower(problem)
    for k in range(THETA2_0.size):
        theta1, _, at = curve(curves, k)
        off = np.abs(theta1 - problem.body.alpha0 - problem.body.beta0) / delta(problem)
        assert (off[:-1] <= 2.5).all()
        assert off[-1] > 2.5
        assert (np.diff(at) > 0).all()


def test_orbits_may_start_at_an_action_below_all_doubles() -> None:
    curves = lower(made("d", J1_0="1e-400"), THETA2_0[:2])
    theta1, ratio, _ = curve(curves, 0)
    assert np.isfinite(theta1).all()
    assert ratio[-1] > 0.5
    # J1/J2 grows from J1_0 and by the same factor in equal times.
    spans = [times(made("d", J1_0=J1))[-1] for J1 in ("1e-400", "1e-200", "1e-100")]
    assert (spans[0] - spans[1]) / (spans[1] - spans[2]) == pytest.approx(2)


def test_few_points_where_straight_and_more_where_bent() -> None:
    line = np.linspace(0, 0.9, 500)
    assert points(line, 2 * line).tolist() == [0, 499]
    arc = np.linspace(0, math.pi, 2000)
    kept = points(0.5 * np.cos(arc), 0.5 * np.sin(arc))
    # sqrt(c/(8 CHORD)) per length, curvature c = 2, length pi/2.
    assert kept.size == pytest.approx(math.sqrt(2 / (8 * CHORD)) * math.pi / 2, abs=3)
    assert points(2 * arc, arc)[-1] == np.argmax(2 * arc > 1)


def test_the_start_has_the_given_momentum_and_the_body_is_grioli_s() -> None:
    problem = made("d", M_0="1.7")
    begin = start(problem, 53, Scales())
    states = states_double(begin, THETA2_0, 0.0)
    A = [float(x) for x in problem.body.A]
    M, _ = body_from_aligned(Aligned(*states), problem.body.alpha0, scale(A))
    np.testing.assert_allclose(np.linalg.norm(M, axis=0), 1.7, rtol=1e-14)
    assert problem.body.special_cases == ("Grioli",)
    assert made("d", beta0="1.25").body.beta0 == pytest.approx(1.25, rel=1e-15, abs=0)


def test_where_the_pendulum_motion_is_elliptic_there_is_no_surface() -> None:
    """The body of Fig. 5 at mu = 0.57 h0: orbits of less energy stay beside it."""
    *A, beta0, mu, M_0, J1_0 = map(exact, (2, "1.5", "1.8", "pi", "0.28", "4/3", "1e-8"))
    problem = surface_problem(A, beta0, mu, M_0, J1_0)
    assert S1_minus(problem, np.array([0.3]), 1.0, "taylor").offsets.size == 2
    said = r"A = \(2, 1\.5, 1\.8\) was found at the energy 0\.4098.* between -2 and 2; take less"
    with pytest.raises(ArithmeticError, match=said):
        S1_minus(problem, np.array([0.3, -0.3]), 1.0, "taylor")


def test_a_body_whose_pendulum_motion_does_not_settle_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As of A = (1, 0.00012, 0.9999) and mu = h0/10: there rounding decides."""
    monkeypatch.setattr(surfaces, "periodic_orbit", Mock(side_effect=ArithmeticError("no end")))
    with pytest.raises(ArithmeticError, match=r"A = \(2, 1\.18, 1\.5\) .*: no end; take less"):
        lower(made("d"))


@pytest.mark.parametrize(("A3", "refused"), [("1.99999999340", False), ("1.99999999344", True)])
def test_an_orbit_of_more_samples_than_memory_holds_is_refused(A3: str, refused: bool) -> None:
    """The number of samples grows with nu, by 0.3 % between the two bodies."""
    given = [exact(x) for x in ("2", "1", A3)], None, exact("0.001"), exact("2"), exact("1e-8")
    reason = pytest.raises(ParameterError, match="too nearly symmetric")
    with reason if refused else contextlib.nullcontext():
        assert surfaces.surface_problem(*given).body.nu > 27_000


def test_many_orbits_are_followed_some_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """All samples of 10,000 orbits of a nearly symmetric body would take 40 GB."""
    problem = made()
    whole, followed = lower(problem), Mock(wraps=states_at)
    monkeypatch.setattr(surfaces, "states_at", followed)
    monkeypatch.setattr(surfaces, "AT_ONCE", 5 * times(problem).size)
    parts = lower(problem)
    assert [call.args[1].shape[-1] for call in followed.call_args_list] == [5, 5, 2]
    for name in SurfaceCurves._fields:
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-13)
    monkeypatch.setattr(surfaces, "AT_ONCE", 1)
    np.testing.assert_array_equal(lower(problem).offsets, whole.offsets)


def test_a_curve_that_leaves_the_sheet_goes_on_without_a_jump() -> None:
    """Through three sheets of 4 pi, as in a wide window around a heavy body."""
    alpha0, beta0 = 1.9, 0.7
    theta1 = alpha0 + beta0 + np.linspace(0, 12 * math.pi, 200)
    Qp, Qm = (0.8 * np.sin((theta1 - beta0 + side) / 2) for side in (alpha0, -alpha0))
    orbit = np.stack((Qp, Qm, np.full(200, 0.6), np.zeros(200), np.zeros(200), np.ones(200)))
    found, ratio = projected(np.stack((orbit, orbit), axis=2), alpha0, beta0)
    np.testing.assert_allclose(found, np.stack((theta1, theta1), axis=1), atol=1e-13)
    np.testing.assert_allclose(ratio, 0.8, atol=1e-15)
