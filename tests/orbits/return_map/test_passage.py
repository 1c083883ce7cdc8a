"""Passages: against integration, forward and backward, areas, derivatives, first order in mu."""

import math
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson

from rigidpend.numbers.checked import ParameterError
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError, ReturnMap, SectionPoint, return_map
from rigidpend.orbits.return_map.build import FIRST, WITH_THETA3
from rigidpend.orbits.return_map.charts import inverse_table
from rigidpend.orbits.return_map.passage import Passage
from rigidpend.orbits.return_map.poincare import section_point, section_state
from rigidpend.orbits.return_map.reduced import coefficients, theta3_rate
from tests.orbits.integrate.problems import GENERIC
from tests.strategies import apart

H = 1.3342
DOUBLES = precision(53)
N = 40


@pytest.fixture(scope="module", params=[WITH_THETA3, FIRST], ids=["whole", "for codes"])
def made(request: pytest.FixtureRequest) -> ReturnMap:
    """A map that tells theta3 and one that does not."""
    return return_map(GENERIC, h=H, design=request.param)


def told(made: ReturnMap, passed: Passage) -> list[Any]:
    """What a map tells of passages: d, angle and time, and what theta3 gains if it is for that."""
    assert (passed.theta3 is not None) is made.design.theta3
    found = [passed.point.d, passed.turned, passed.time, passed.theta3]
    return found if made.design.theta3 else found[:3]


def points(made: ReturnMap, rising: bool, share: float = 0.5) -> SectionPoint:
    random = np.random.default_rng(7 + rising)
    width = float(made.charts[rising].forward.width)
    d, chi = random.uniform(-share * width, share * width, N), random.uniform(0, 2 * math.pi, N)
    return SectionPoint(rising, d, chi)


@pytest.mark.parametrize("rising", [True, False])
def test_agrees_a_passage_with_integration(made: ReturnMap, rising: bool) -> None:
    """Time, symbol, point and theta3 of one passage, by an orbit carried to its end."""
    here, level = points(made, rising), made.at(H)
    passed = level.passage(here, slopes=True)
    c = made.coefficients
    begin = section_state(rising, here.d, here.chi, H, c, DOUBLES)
    assert passed.inside.sum() > N / 2
    for k in np.flatnonzero(passed.inside)[:12]:
        times = np.linspace(0, passed.time[k], 2001)
        path = states_at(c.aligned, begin[:, [k]], times)[:, :, 0]
        end = path[:, -1]
        # Deviations grow along a passage by what its derivatives tell.
        grown = 1e-14 * (1 + np.abs(passed.slopes[:, :, k]).max() / 100)
        sign = -1 if passed.mirrored[k] else 1
        # To the right of the upper orbit one comes beside 3, of the lower one beside 4, an image.
        assert passed.symbol[k] == (passed.mirrored[k] ^ rising)
        assert abs(end[2]) < grown + 1e-13
        d, Q = (end[0], end[1]) if rising else (end[1], end[0])
        assert Q * sign > 0
        assert abs(d * sign - passed.point.d[k]) < grown
        expected = section_state(
            not rising, passed.point.d[[k]], passed.point.chi[[k]], H, c, DOUBLES
        )[:, 0]
        image = end * np.array([sign, sign, 1, 1, 1, sign])
        np.testing.assert_allclose(image, expected, rtol=0, atol=grown + 1e-13)
        assert (path[2, 5:-5] > 0).all() if rising else (path[2, 5:-5] < 0).all()
        if made.design.theta3:
            gained = simpson(theta3_rate(path[:3], c), x=times)
            assert passed.theta3[k] == pytest.approx(gained, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("rising", [True, False])
def test_invariant_forward_then_backward_is_the_identity(made: ReturnMap, rising: bool) -> None:
    here, level = points(made, rising), made.at(H)
    there = level.passage(here, slopes=True)
    back = level.passage(there.point, backward=True)
    ok = there.inside & back.inside
    assert ok.sum() > N / 2
    grown = 1e-14 * (1 + np.abs(there.slopes).max(axis=(0, 1)))
    assert (np.abs(back.point.d - here.d) < grown)[ok].all()
    # Far from the limits of the interval of angles.
    assert all(
        apart(x, y, 2 * math.pi) < g
        for x, y, g in zip(back.point.chi[ok], here.chi[ok], grown[ok], strict=True)
    )
    np.testing.assert_allclose((back.time + there.time)[ok], 0, atol=1e-11)
    assert (back.symbol == there.symbol)[ok].all()
    assert (back.mirrored == there.mirrored)[ok].all()
    if made.design.theta3:
        sign = np.where(there.mirrored, -1, 1)
        np.testing.assert_allclose((there.theta3 + sign * back.theta3)[ok], 0, atol=1e-12)


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("rising", [True, False])
def test_agrees_the_derivatives_with_differences(
    made: ReturnMap, rising: bool, backward: bool
) -> None:
    here, level = points(made, rising, 0.3), made.at(H)
    passed = level.passage(here, slopes=True, backward=backward)
    for which, step in (("d", 1e-7), ("chi", 1e-6)):
        near = [
            level.passage(
                here._replace(**{which: getattr(here, which) + s * step}), backward=backward
            )
            for s in (1, -1)
        ]
        same = passed.inside & near[0].inside & near[1].inside
        same &= near[0].symbol == near[1].symbol
        slopes = passed.slopes[:, ["d", "chi"].index(which)]
        # Beside an asymptotic orbit the derivatives themselves change too fast.
        same &= np.abs(slopes).max(axis=0) * step < 1e-3
        assert same.sum() > 5
        ahead, behind = (np.array(told(made, x)) for x in near)
        moved = (ahead - behind) / (2 * step)
        if which == "chi":
            moved[1] += 1
        scale = 1 + np.abs(slopes).max(axis=0)
        assert (np.abs(moved - slopes) < 1e-5 * scale)[:, same].all()


@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize("backward", [False, True])
def test_numbers_and_lists_pass_as_arrays_do(rising: bool, backward: bool) -> None:
    level = return_map(GENERIC, h=H, design=FIRST).at(H)
    expected, *others = (
        level.passage(SectionPoint(rising, d, chi), backward=backward, slopes=True)
        for d, chi in (
            (np.array([1e-4]), np.array([0.5])),
            ([1e-4], [0.5]),
            (1e-4, np.float64(0.5)),
            (np.array(1e-4), Fraction(1, 2)),
        )
    )
    assert expected.inside.all()
    for found in others:
        assert found.point.d.shape == (1,)
        np.testing.assert_array_equal(found.slopes, expected.slopes)
        np.testing.assert_array_equal(found.point.chi, expected.point.chi)


@pytest.mark.parametrize("h", [1.3343, -1.0, math.nan, [H, 1.34]])
def test_an_energy_that_a_map_is_not_of_is_refused(made: ReturnMap, h: Any) -> None:
    with pytest.raises(ParameterError, match=r"from 1\.3342 to 1\.3342, got h ="):
        made.at(h)


def test_the_ends_of_a_map_are_its_own() -> None:
    """Ends that no double holds, given as the doubles beside them."""
    wide = return_map(GENERIC, h=("1.3332", "1.3352"))
    assert wide.at([1.3332, 1.3352, math.nextafter(1.3352, 2)]).h.size == 3
    assert wide.at("1.3332").h == wide.at(Decimal("1.3332")).h == 1.3332
    with pytest.raises(ParameterError, match="h: 'one'"):
        wide.at("one")
    with pytest.raises(ParameterError):
        wide.at(1.3352 * (1 + 1e-12))


def test_starts_are_inside_as_far_as_the_table_of_invariants(made: ReturnMap) -> None:
    """On a periodic orbit or beyond it a start never crosses; its logarithm is no number."""
    level, phase = made.at(H), np.array([0.1])
    inside = [level.enter(Qp, phase).inside.item() for Qp in (1e-4, 0.0, -1e-4, 1.0)]
    assert inside == [True, False, False, False], "the last beyond the normal form"
    at, _ = level.started(1e-4, phase)
    for share, inside in ((0.99, [False]), (1.01, [True])):
        table = level.charts[True].inverse
        table = table._replace(width=share * float(np.abs(at.u * at.v)[0]))
        level.charts[True] = level.charts[True]._replace(inverse=table)
        assert level.enter(1e-4, phase).inside.tolist() == inside


def test_passages_are_inside_as_far_as_the_tables(made: ReturnMap) -> None:
    """That of invariants comes first; beyond the chart, and at no number, there are none."""
    level, chi = made.at(H), np.array([1.0])
    forward, inverse = level.charts[True].forward, level.charts[False].inverse
    inside, outside = np.zeros(1), np.array([float(forward.width)])
    for _ in range(40):
        d = (inside + outside) / 2
        if level.passage(SectionPoint(True, d, chi)).inside.item():
            inside = d
        else:
            outside = d
    U, V, *_ = forward.look_up(inside, chi, DOUBLES)
    assert np.abs(U * V) / inverse.width == pytest.approx(1, rel=1e-6)
    for beyond in (2 * forward.width, np.nan):
        assert not level.passage(SectionPoint(True, np.array([beyond]), chi)).inside.any()


def test_an_inverse_chart_of_more_than_the_chart_covers_is_refused(made: ReturnMap) -> None:
    """All points of the section with such invariants lie beyond the chart's width."""
    forward, chi = made.charts[True].forward, np.tile(np.linspace(0, 6, 50), 2)
    ends = np.repeat([-1.0, 1.0], 50) * float(forward.width)
    U, V, *_ = made.at(H).charts[True].forward.look_up(ends, chi, DOUBLES)
    beyond, n = 1.1 * float(np.abs(U * V).max()), made.orders.n_phase_inverse
    with pytest.raises(MapError, match="do not cover"):
        inverse_table(True, forward, beyond, n, made.normal_form, DOUBLES)


@pytest.mark.parametrize("rising", [True, False])
def test_orbits_that_never_leave_have_no_passage(made: ReturnMap, rising: bool) -> None:
    """A chart puts them where U = 0, or V = 0 backward."""
    charts = list(made.charts)
    forward = charts[rising].forward
    charts[rising] = charts[rising]._replace(forward=forward._replace(values=0 * forward.values))
    level = replace(made, charts=(charts[0], charts[1])).at(H)
    assert not level.passage(points(made, rising)).inside.any()


@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize("unit", ["1024", "1/1024"])
def test_points_of_the_section_are_those_of_any_unit(rising: bool, unit: str) -> None:
    """M in other units, and so mu and h: Newton's steps end where they end in the first."""
    d, chi, of = np.array([1e-3, -2e-4]), np.array([0.3, 2.0]), float(Fraction(unit))
    c, scaled = (coefficients(GENERIC.angles(), x, DOUBLES) for x in ("1", unit))
    told = section_state(rising, d * of, chi, H * of**2, scaled, DOUBLES)
    expected = section_state(rising, d, chi, H, c, DOUBLES)
    np.testing.assert_allclose(told[:2] / of, expected[:2], rtol=4e-16)


@pytest.mark.parametrize("bits", [53, 64])
def test_points_that_an_energy_does_not_allow_are_refused(bits: int) -> None:
    a = precision(bits)
    c, far = coefficients(GENERIC.angles(128), "1", a), a.array([3.0])
    with pytest.raises(MapError, match="the energy is too small for a crossing at such a distance"):
        section_state(True, far, a.array([0.3]), a.number(H), c, a)


@pytest.mark.parametrize("bits", [53, 90])
@pytest.mark.parametrize("rising", [True, False])
def test_section_points_are_those_of_the_states_whatever_their_image_and_vertical(
    bits: int, rising: bool
) -> None:
    random, a = np.random.default_rng(4), precision(bits)
    d, chi = (a.array(x) for x in (random.uniform(-0.1, 0.1, N), random.uniform(-3, 3, N)))
    side = np.where(np.arange(N) % 2, -1.0, 1.0)
    c = coefficients(GENERIC.angles(128), "1.37", a)
    Qp, Qm, M3, *gamma = section_state(rising, d, chi, a.number(1.4), c, a)
    image = side * Qp, side * Qm, M3, *(3.0 * x for x in (*gamma[:2], side * gamma[2]))
    found, phase, beside = section_point(rising, np.stack(image), c, a)
    np.testing.assert_array_equal(beside, side)
    np.testing.assert_array_equal(a.floats(found - d), 0)
    assert a.largest(phase - chi) < 8 * a.epsilon
