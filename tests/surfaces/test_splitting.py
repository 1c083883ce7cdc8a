"""The splitting: against real backward integration, in several precisions; orbits of S1-."""

import math
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import AlignedCoefficients, energy
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.surfaces import splitting
from rigidpend.surfaces.heteroclinic import START, beginning
from rigidpend.surfaces.splitting import MOST_HARMONICS, derivative, distance, harmonics, measure
from rigidpend.surfaces.surface_orbits import (
    Points,
    coefficients,
    launch,
    meet,
    numbers,
    section_angles,
    surface,
)
from tests.bodies import FIG4

GENERIC = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.02")
LARGE_NU = Body(A=(2, "1.7", "1.85"), r=(2, 1, 0), mu="0.3")
TABLE_1A = Body(A=(2, "0.2", "1.8"), r=("sqrt(0.2)", "sqrt(1.6)", 0), mu="1e-6")
ARITHMETIC = resolve(None, 3e-14)
IN_DOUBLES = ARITHMETIC._replace(precisions=(53,))
H0 = exact(1)
ALLOWED, LIGHT = 1e-9, 4e-15
"""Errors up to which a splitting counts as resolved: at any weight, and where mu is 1e-6 h0."""
M = numbers(53)


@pytest.mark.parametrize("bits", [53, 97])
def test_harmonics_are_those_of_a_known_curve(bits: int) -> None:
    """Known Fourier coefficients, at phases that lie unevenly; they sum up to the distance."""

    def curve(x: Any) -> Any:
        return 3 + 5 * M.cos(x) + 7 * M.sin(x) + 2 * M.sin(2 * x) - 4 * M.cos(3 * x)

    n, lag = 32, M.mpf("0.7")
    start = [2 * M.pi * (k + M.mpf("0.3")) / n for k in range(n)]
    g = [s + lag + M.mpf("0.2") * M.sin(s) for s in start]
    a, advance = precision(bits), [x - y for x, y in zip(g, start, strict=True)]
    told = harmonics(Points(*map(a.array, (g, advance, list(map(curve, g)), g))), a)
    assert told is not None
    found = [float(x) for x in told[0]]
    assert len(found) == 15
    # F(g) - F(pi - g) doubles what is odd about pi/2 and drops the rest.
    assert found[:4] == pytest.approx([10, 4, -8, 0], abs=1e-9)
    assert distance(found[:4], 0.4) == pytest.approx(
        float(curve(0.4) - curve(M.pi - 0.4)), abs=1e-8
    )
    # Weights of either sign cancel, in more bits than the numbers have.
    assert max(map(abs, derivative(a.array([M.mpf(1)] * n), a))) < 1e-25


@pytest.mark.slow
def test_no_error_is_below_the_rounding_of_the_doubles_that_hold_the_harmonics() -> None:
    """In 106 bits two computations agree far better than that, which is added."""
    found = measure(GENERIC, H0, 1e-17, ARITHMETIC._replace(precisions=(106,)))
    rounding = float(np.abs(found.excess).max()) * 2.0**-53
    assert 1e-21 < rounding < found.error < 1.01 * rounding
    assert found.resolved


@pytest.mark.parametrize(("turning", "known"), [(0.95, True), (1.05, False)])
def test_a_curve_that_turns_back_somewhere_has_no_harmonics(turning: float, known: bool) -> None:
    start = 2 * np.pi * np.arange(32) / 32
    advance = turning * np.sin(start)
    points = Points(start + advance, advance, np.cos(start), start)
    assert (harmonics(points, precision(53)) is not None) is known


@pytest.mark.slow
@pytest.mark.parametrize("g", [0.0, 1.1, 2.9, -0.7])
def test_agrees_with_orbits_integrated_backward_from_the_upper_periodic_solution(g: float) -> None:
    """The independent truth: S2+ by real backward integration, both surfaces at one phase."""
    s = surface(GENERIC, H0, 53)
    on_S1 = meet(s, [M.mpf(START)], beginning(s, g, ARITHMETIC).depth, ARITHMETIC)
    assert on_S1 is not None
    depth, time, _ = beginning(s, math.pi - g, ARITHMETIC)
    state = np.array([float(x) for x in launch(s, M.mpf(START), depth)])
    start = state * [1, 1, -1, 1, 1, -1]
    numbers_of = AlignedCoefficients(*map(float, coefficients(s)))
    end = states_at(numbers_of, start[:, None], [0.0, -time])[:, -1, 0]
    assert abs(end[2]) < 1e-12
    phase, offset = section_angles(list(end), s.p.alpha0, M.sin(s.p.alpha0), M)
    assert math.remainder(float(phase) - g, math.tau) == pytest.approx(0, abs=1e-11)
    found = measure(GENERIC, H0, ALLOWED, IN_DOUBLES)
    expected = found.amplitude * (math.cos(g) + distance(found.excess, g))
    gap = float(on_S1.offset[0] - offset)
    assert gap == pytest.approx(expected, abs=1e-13)
    # What is compared is known to many digits: the curve differs from Melnikov's by far more.
    assert abs(found.amplitude * distance(found.excess, g)) > 1e-7


@pytest.mark.parametrize("body", [FIG4, GENERIC])
def test_order_the_curve_errs_in_the_second_order_and_its_cosine_in_the_third(body: Body) -> None:
    one, two = (
        measure(Body(body.A, body.r, mu), H0, ALLOWED, IN_DOUBLES) for mu in ("1e-3", "2e-3")
    )
    assert (one.resolved, two.resolved) == (True, True)
    # In other units it is the same.
    doubled = measure(Body(body.A, body.r, "4e-3"), exact(2), ALLOWED, IN_DOUBLES)
    np.testing.assert_allclose(doubled.excess, two.excess, rtol=0, atol=2 * two.error)
    assert two.excess[:3] / one.excess[:3] == pytest.approx([4, 2, 4], rel=2e-3)
    assert 1e-7 < abs(one.excess[0]) < 1e-4


@pytest.mark.slow
def test_agrees_precisions_with_113_bits_within_the_errors_they_tell() -> None:
    truth, *others = (
        measure(TABLE_1A, H0, LIGHT, ARITHMETIC._replace(precisions=(bits,)))
        for bits in (113, 53, 64)
    )
    assert truth.error < 1e-6 * abs(truth.excess[0]) < 1e-15
    for found in others:
        gap = np.abs(found.excess[:3] - truth.excess[:3]).max()
        # What is told of the curve is rounded to doubles.
        assert gap <= found.error + truth.error + 1e-15 * abs(truth.excess[1])
        assert found.error < 2000 * 2.0**-found.bits


def test_surfaces_of_much_weight_are_measured_where_they_are_ahead_by_half_a_turn() -> None:
    """At mu = 0.6 h0: against orbits along the periodic orbit's unstable direction in 113 bits."""
    found = measure(Body(A=(2, 1, "1.5"), r=(1, 0, 0), mu="0.6"), H0, ALLOWED, IN_DOUBLES)
    assert found.resolved
    assert found.excess[:2] == pytest.approx([-0.131082813484, 0.261195011725], abs=1e-11)


def test_the_error_holds_for_a_body_almost_without_moment_about_an_axis() -> None:
    """There alpha0 is so close to pi that its double knows its sine to a few digits less."""
    body = Body(A=(2, "1e-3", "1.9995"), r=(1, 2, 0), mu="1e-5")
    found, truth = (
        measure(body, H0, ALLOWED, ARITHMETIC._replace(precisions=(bits,))) for bits in (53, 106)
    )
    assert (found.resolved, truth.resolved) == (True, True)
    assert np.abs(found.excess[:3] - truth.excess[:3]).max() <= found.error + truth.error


@pytest.mark.parametrize(
    ("apart", "beyond", "error"),
    [(0, (0, 0), 2.0**-51), (1e-3, (0, 0), 4e-3), (0, (2, 3), 3), (0, (3, 2), 3)],
)
def test_the_error_told_is_four_times_what_two_computations_differ_by_or_what_is_left_out(
    apart: float, beyond: tuple[float, float], error: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The numbers themselves are rounded to 53 bits."""
    unit = splitting.amplitude(surface(FIG4, H0, 53))
    both = [([unit, k * apart * unit], left * unit) for k, left in enumerate(beyond)]
    monkeypatch.setattr(splitting, "meet", Mock())
    monkeypatch.setattr(splitting, "harmonics", Mock(side_effect=both))
    found = measure(FIG4, H0, 9.0, IN_DOUBLES)
    assert found.error == pytest.approx(error, rel=1e-9, abs=0)


def test_where_S1_turns_back_nothing_is_resolved_and_nothing_told() -> None:
    found = measure(LARGE_NU, H0, ALLOWED, IN_DOUBLES)
    assert not found.resolved
    assert found.n == splitting.SURE, "more orbits are not tried"
    assert np.isnan(found.excess).all()
    assert found.excess.shape == (MOST_HARMONICS,)


def test_eight_orbits_err_by_more_than_they_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """So sixteen are the fewest. Their third harmonic is also that of 32 orbits."""
    body = Body(A=(2, 1, "1.08"), r=("sqrt(0.92)", "sqrt(0.08)", 0), mu="1e-3")
    found = {}
    for n in (8, 16, 32):
        monkeypatch.setattr(splitting, "FEWEST", n)
        found[n] = measure(body, H0, 1.0, IN_DOUBLES)
        assert found[n].n == n
    few, enough, many = found.values()
    assert abs(few.excess[2] - many.excess[2]) > 2 * few.error
    assert np.abs(enough.excess - many.excess).max() <= enough.error + many.error


@pytest.mark.parametrize(
    ("body", "orbits"),
    [
        (FIG4, 16),
        (GENERIC, 32),
        (Body(GENERIC.A, GENERIC.r, "0.1"), 64),
        # Where twice as many orbits gain less than half, rounding is all that is left.
        (TABLE_1A, 32),
    ],
)
def test_orbits_are_doubled_until_the_error_is_that_of_integration(body: Body, orbits: int) -> None:
    """Which is far above rounding here, so that no processor decides."""
    assert measure(body, H0, 0.0, resolve(None, 1e-10, (53,))).n == orbits


# ---- Orbits of S1- up to the section: energy, angles, and that they are on S1-.


@pytest.mark.parametrize("mu", ["1e-6", "0.02", "0.6"])
@pytest.mark.parametrize("theta2_0", [0.3, 2.0, 4.5])
def test_invariant_orbits_start_with_the_energy_asked_for_and_J3_zero(
    mu: str, theta2_0: float
) -> None:
    body = Body(GENERIC.A, GENERIC.r, mu)
    state = launch(surface(body, exact("0.8"), 53), M.mpf(theta2_0), M.mpf(8))
    A, r, mu_ = body.floats()
    moments, gamma = body_from_aligned(Aligned(*map(float, state)), body.alpha0, scale(A, math))
    assert energy(moments, gamma, A, r, mu_) == pytest.approx(0.8, rel=1e-15, abs=0)
    assert abs(moments @ gamma) < 1e-15
    assert gamma @ gamma == pytest.approx(1, rel=1e-15, abs=0)


def test_a_small_offset_keeps_its_relative_precision() -> None:
    tiny = M.mpf("1e-20")
    state = (M.sin(tiny / 2 + 2), M.sin(tiny / 2), 0, 1, 0, 0)
    _, offset = section_angles(state, M.mpf(2), M.sin(2), M)
    assert abs(offset / tiny - 1) < 1e-20


def test_precisions_are_tried_in_turn_but_for_those_whose_rounding_is_far_too_large() -> None:
    """Of nu = 185 not even 160 bits resolve anything, and take a quarter of a minute."""
    body, both = Body(A=(2, "1.9625", "1.98948"), r=(1, 0, 0), mu="5.8e-5"), (53, 106)
    found = measure(body, H0, ALLOWED, resolve(precisions=(*both, 160)))
    assert (found.resolved, found.bits) == (False, 53)
    # Others are, of which doubles tell nothing either, until the splitting is resolved.
    body, one = Body(A=(2, "1.88", "1.95"), r=(1, 1, 0), mu="1e-5"), resolve(precisions=both)
    found = measure(body, H0, 1e-4, one)
    assert (found.resolved, found.bits) == (True, 106)
    assert measure(FIG4, H0, ALLOWED, one).bits == 53
    # Those whose rounding is a thousand times too large at most are.
    s = surface(body, H0, 106)
    noise = one.tolerance * 2.0**-53 * float(s.p.mu / s.h0 / splitting.amplitude(s))
    for times, bits in ((990, 106), (1010, 53)):
        assert measure(body, H0, noise / times, one).bits == bits
