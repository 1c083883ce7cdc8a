"""Orbits from their codes, each confirmed by integration; addresses as the inverse."""

from __future__ import annotations

import math
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from rigidpend import Body, address_of, find_orbit, route_codes
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import context, exact
from rigidpend.orbits.integrate import arithmetic
from rigidpend.orbits.integrate.arithmetic import LADDER
from rigidpend.orbits.integrate.states import first_crossings, states_at
from rigidpend.orbits.return_map import MapError, SectionPoint
from rigidpend.orbits.return_map.passage import Entered
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.start import Scales, start, states_exact
from rigidpend.routes.symbolic import Address, NoOrbit, find, refine, shortest
from rigidpend.routes.symbolic.address import parsed
from rigidpend.routes.symbolic.levels import surface
from tests.bodies import problem
from tests.orbits.integrate.problems import FIG4, FREE

START: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}
FIG5 = Body(A=(2, "3/2", "9/5"), r=(0, 1, 0), mu="0.01")
ROUTE: dict[str, Any] = {"h0": "10/9", "J1_0": "2.39205e-9"}


def codes_of(body: Body, theta2_0: Any, n: int, start: dict[str, Any]) -> str:
    """The code by integration alone, certain throughout."""
    given: dict[str, Any] = {"n_symbols": n, "precisions": (113,), "method": "integration"}
    routes = route_codes(body, [theta2_0], **start, **given)
    assert routes.certain.all()
    return "".join(map(str, routes.codes[:, 0]))


@pytest.mark.parametrize("theta2_0", ["1/10", "5.1"])
def test_the_address_of_an_orbit_leads_to_one_that_has_it(theta2_0: str) -> None:
    address = address_of(FIG4, theta2_0, **START, n_symbols=7)
    found = find_orbit(FIG4, address, **START, near=theta2_0, digits=12)
    assert found.address == address
    assert found.fixed == found.confirmed == found.passages == 7
    assert max(found.delay, found.passage_error) < 1e-10
    assert float(found.theta2_0) == pytest.approx(float(Fraction(theta2_0)), abs=1e-4)
    assert address_of(FIG4, found.theta2_0, **START, n_symbols=7, precisions=(113,)) == address


def test_where_one_cell_has_no_orbit_that_of_the_other_one_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Either is the first of an address that does not say which."""
    each = {find_orbit(FIG4, f"{first} 0^11 1^11", **START).theta2_0 for first in "ab"}
    solved, found = shortest.exactly, []
    for lacking in (0, 1):

        def exactly(system: Any, cell: int, *given: Any, lacking: int = lacking) -> Any:
            if cell % 2 == lacking:
                raise NoOrbit("none there")
            return solved(system, cell, *given)

        monkeypatch.setattr(find, "exactly", exactly)
        found.append(find_orbit(FIG4, "0^11 1^11", **START).theta2_0)
    assert len(each) == 2
    assert set(found) == each


def test_the_orbit_returns_on_its_own_way() -> None:
    """It ends at gamma3 = 0: behind that the signs of I come again in the opposite order."""
    found = find_orbit(FIG4, "a 0^11 1^12 1^11 0^13", **START)
    code = codes_of(FIG4, found.theta2_0, 8, START)
    signs = [int(s) == (k % 2 == 0) for k, s in enumerate(code)]
    assert signs == signs[::-1]


def test_crossings_are_told_as_much_further_than_the_phase_as_a_change_of_it_grows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By integration of two orbits beside the one that is found; four digits are to spare.

    Of the first crossing a change of the energy has a share of its own.
    """
    grown, growth = [], refine._growth

    def grow(*of: Any) -> Any:
        grown.append(growth(*of))
        return grown[-1]

    def legs(_: Any, chain: Any, __: Any, needed: Any, ___: int) -> Any:
        assert min(needed + grown[0]) == pytest.approx(12 + 4)
        phases = [chain.unknown + x for x in (-1e-7, 1e-7)]
        given: Any = {"n_symbols": 2, "method": "integration", "precisions": (53,)}
        times = route_codes(FIG4, phases, **START, **given).crossing_time
        moved = np.log10(np.abs(times[:, 1] - times[:, 0]) / 2e-7)
        assert grown[0][0] == pytest.approx(moved[0], abs=0.5)
        assert grown[0][1:] == pytest.approx(moved[1:], abs=1e-3)
        raise NoOrbit("seen")

    monkeypatch.setattr(refine, "_growth", grow)
    monkeypatch.setattr(refine, "_Legs", legs)
    with pytest.raises(NoOrbit, match="seen"):
        find_orbit(FIG4, "a 0^11 1^12", **START, digits=12)


@pytest.mark.parametrize("chi", [0.0, math.pi])
def test_a_change_of_the_first_crossing_has_no_whole_turn(
    chi: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where chi = pi lies between the orbits beside: the next time moves by 100 times chi."""

    def enter(_: Any, theta2: Any) -> Entered:
        turned = np.angle(np.exp(1j * (chi + 3 * (theta2 - 1))))
        return Entered(SectionPoint(True, 0 * theta2, turned), theta2 / 10, None, True)

    monkeypatch.setattr(refine, "tangents", lambda _: np.array([[[0, 0], [0, 1], [0, 100.0]]]))
    chain = SimpleNamespace(unknown=1.0, level=SimpleNamespace(map_level=None))
    orbits = SimpleNamespace(enter=enter, energy_slope=lambda _: 0.0)
    found: Any = refine._growth(cast("Any", orbits), cast("Any", chain), 0.0)
    assert 10**found == pytest.approx([0.1, 0.1 + 3 * 100], rel=1e-6)


@pytest.mark.parametrize(("off", "told"), [(1e-14, 20), (1e-12, 12), (1e-7, 7)])
def test_a_crossing_counts_as_known_two_digits_short_of_what_it_needs(
    off: float, told: int
) -> None:
    """Of two crossings that need 20 and 15 digits the second was so far off."""
    legs: Any = object.__new__(refine._Legs)
    m = legs.m = context(200)
    legs.needed, legs.most, legs.theta, legs.least = [20.0, 15.0], 20.0, m.mpf(1), m.mpf(0)
    legs.states, legs.times = np.full((6, 2), m.mpf(0)), np.full(2, m.mpf(0))
    legs._start = lambda _: legs.states[:, 0]
    ends = legs.states.copy()
    ends[4:, 1] += [off, 2.0**-150]
    legs._ends = lambda *_: (ends, np.array([m.mpf(0.25), m.mpf(0.5)]))
    slopes = [np.array([[m.mpf(1)]] * 6), np.eye(6, dtype=object) * m.mpf(1)]
    assert legs._corrected(slopes, 20, 1) == pytest.approx(told)
    # theta2_0 is changed so that gamma3 of the last one stays.
    assert (legs.theta - 1, legs.states[5, 1]) == (-(2.0**-150), 0)
    assert legs.times.tolist() == [0.25, 0.5]


def test_a_crossing_is_told_from_beside_it_to_the_third_power_of_the_time() -> None:
    """Before it and behind it: half the time divides the error by eight."""
    legs: Any = object.__new__(refine._Legs)
    m, begin = context(212), start(problem(n_symbols=1), 212, Scales())
    states = states_exact(begin, [exact("0.4")], 212)
    limit = 100.0
    given: Any = {"engine": "taylor", "bits": 212, "tolerance": 2.0**-52, "jobs": 1}
    crossed = first_crossings(begin.coefficients, states, limit, **given)
    assert crossed is not None
    _, section = crossed
    legs.c = AlignedCoefficients(*(m.mpf(x.numerator) / x.denominator for x in begin.coefficients))
    off = []
    for time in (Fraction(1, 2**k) * side for side in (1, -1) for k in (16, 17)):
        moved = states_at(begin.coefficients, section, np.array([[time]]), 212)[:, 0, 0]
        number = np.array([m.mpf(x.numerator) / x.denominator for x in moved])
        end, late = legs._on_section(number)
        assert end[2] == 0
        exact_end = [m.mpf(x.numerator) / x.denominator for x in section[:, 0]]
        off.append(
            (max(abs(end - exact_end)), abs(late + m.mpf(time.numerator) / time.denominator))
        )
    for coarse, fine in (off[:2], off[2:]):
        assert [float(x / y) for x, y in zip(coarse, fine, strict=True)] == pytest.approx(
            [8, 8], rel=1e-2
        )


@pytest.mark.parametrize(("digits", "fixed"), [(22, 1), (23, 2), (26, 2), (27, 3)])
def test_symbols_are_fixed_where_a_rounded_phase_moves_no_crossing_by_a_thousandth(
    digits: int, fixed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Changes of theta2_0 grow by these powers of ten; twelve bits may be lost on the way."""
    growth: Any = np.array([12.0, 16.0, 20.0, 24.0, 28.0])
    monkeypatch.setattr(refine, "_growth", lambda *_: growth)
    monkeypatch.setattr(refine, "_begun", lambda *_: np.ones((3, 1)))
    monkeypatch.setattr(refine._Legs, "__init__", lambda *_: None)
    monkeypatch.setattr(refine._Legs, "run", lambda _: (Fraction(1, 3), 0.0))
    found = refine.refined(None, SimpleNamespace(time=np.ones(4)), 0.0, digits, 1)  # type: ignore[arg-type]
    assert found.fixed == fixed
    assert 10.0 ** (growth[fixed] - digits) <= 1e-3 < 10.0 ** (growth[fixed + 1] - digits)
    assert 2.0 ** (12 - found.bits) <= 10.0**-digits


@pytest.mark.parametrize(
    ("digits", "kinds", "bent"),
    [
        (30, [106], 0.0),
        (36, [106], 2.0),
        (60, [106, 212], 0.0),
        (80, [106, 212], 0.0),
        (130, [106, 212, 424], 0.0),
        (200, [106, 212, 424], 0.0),
    ],
)
def test_no_more_digits_are_said_to_be_known_than_slopes_can_have_told(
    digits: int, kinds: list[int], bent: float
) -> None:
    """Legs that are no legs: a correction gains as many as its slopes have, or doubles them.

    Slopes have half of the digits of their numbers, less what the thin layer takes; at the first
    crossings the map errs by half a digit less than it may. Where legs are bent more than was
    expected each correction gains so many digits less.
    """
    legs: Any = object.__new__(refine._Legs)
    legs.needed, legs.most, legs.kinds = np.array([float(digits)]), float(digits), LADDER[1:]
    legs.m = context(4 * digits)
    legs.theta, legs.times, asked = legs.m.mpf(1), np.array([legs.m.mpf(0)]), []
    right = 9.5

    def differences(bits: int, _: int) -> list[float]:
        asked.append(bits)
        return [min(right, bits / 2 / math.log2(10) - refine.THIN)]

    def corrected(slopes: list[float], aim: float, _: int) -> float:
        nonlocal right
        before = right
        right = min(aim, before + slopes[0] - bent, 2 * before - refine.CURVED - bent)
        return min(legs.most, before)

    legs._differences, legs._corrected = differences, corrected
    legs.run()
    assert right >= digits
    assert asked == kinds


@pytest.mark.slow
def test_orbits_are_found_where_surfaces_are_split_little() -> None:
    """By 6e-9: across the layer deviations grow to 5e9 in a passage, along it to 1e3.

    The phase is that at whose last crossing gamma3 = 0, by a Taylor series of degree 34 in 113
    bits; there it is known to 1e-26.
    """
    body = Body(A=(2, "17/10", "37/20"), r=(2, 1, 0), mu="1/100")
    found = find_orbit(body, "011", h0=1, J1_0="1e-8", digits=20)
    assert str(found.theta2_0) == "4.10620635667083801521"
    assert (found.confirmed, found.passages) == (3, 3)


@pytest.mark.slow
def test_near_the_hess_case_a_change_of_sides_at_a_downward_crossing_takes_longer() -> None:
    """Surfaces are split by 1.1e-10 at upward crossings and by 1.5e-12 at downward ones.

    The phase is that at whose last crossing gamma3 = 0, by a Taylor series of degree 30 in 113
    bits; there it is known to 1e-25. Doubles place orbits within 1e-5 rad.
    """
    body = Body(A=(2, "7/4", "1.87"), r=(1, 1, 0), mu="1/100")
    orbits = surface(RouteProblem(body, START["h0"], START["J1_0"], 2))
    chain, _ = find._solved(orbits, parsed("11"), None)
    assert np.diff(chain.cells).tolist() == [135, 135]
    assert chain.unknown % (2 * math.pi) == pytest.approx(4.3624593828235308, abs=1e-5)


@pytest.mark.slow
def test_in_the_hess_case_no_orbit_changes_sides_at_a_downward_crossing() -> None:
    body = Body(A=(2, 1, "3/2"), r=(1, "sqrt(2)", 0), mu="0.001")
    with pytest.raises(NoOrbit, match=r"Hess case or near it: .* at most at downward crossings"):
        find_orbit(body, "11", **START)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("address", "fewer", "more"),
    [("b (0^11)*2 (1^11)*2 (0^11)*2 (1^11)*2", 13, 32), ("a 0^11", 50, 60)],
)
def test_more_digits_agree_with_fewer(
    address: str, fewer: int, more: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A crossing that drops out before it is known well enough spoils the last ones.

    Where the kernel's numbers have no more than 212 bits they tell 53 digits, integers the rest.
    """
    if more > 53:
        for module in (arithmetic, refine):
            monkeypatch.setattr(module, "LADDER", arithmetic.LADDER[:3])
        # In so many bits to establish the symbols takes as long as to find the phase.
        monkeypatch.setattr(find, "_confirmed", lambda problem, *_: problem.n_symbols)
    few, many = (find_orbit(FIG4, address, **START, digits=n) for n in (fewer, more))
    assert abs(Fraction(few.theta2_0) - Fraction(many.theta2_0)) <= Fraction(1, 2 * 10**fewer)
    assert few.fixed == many.fixed == many.confirmed == len(many.word)
    assert many.bits > 113


@pytest.mark.slow
def test_few_digits_fix_the_first_symbols_of_many() -> None:
    """With more than a hundred their half rotations stay alike."""
    code = np.random.default_rng(3).integers(0, 2, 120)
    found = find_orbit(FIG4, code, **START, digits=12)
    assert found.passages == 120
    assert found.passage_error < 1e-8
    assert found.confirmed == found.fixed > 4
    assert found.residual < 1e-11
    np.testing.assert_array_equal(found.symbols, code)
    assert len(set(found.address.half_turns or ())) == 1
    assert f"; theta2_0 = {found.theta2_0}; " in repr(found)
    assert len(repr(found)) < 500


def test_longer_passages_lie_between_shorter_ones() -> None:
    """Beside every change of a symbol further rotations accumulate, at the Floquet rate."""
    addresses = [f"a 0^{n}" for n in range(15, 23, 2)]
    found = [find_orbit(FIG4, each, **START, digits=12) for each in (*addresses, "b 0^11")]
    assert [str(one.address) for one in found] == [*addresses, "b 0^11"]
    phases = [float(one.theta2_0) for one in found[:-1]]
    ratios = np.diff(phases)[:-1] / np.diff(phases)[1:]
    # One rotation is a factor exp(2 pi Lambda_0) = 9.22.
    np.testing.assert_allclose(ratios, 9.22, rtol=2e-2)


def test_none_with_so_few_rotations_says_which_passage() -> None:
    with pytest.raises(NoOrbit, match=r"none exists: passage 2 with 4 half rotations needs \|I\|"):
        find_orbit(FIG4, "0^11 0^4 1^11", **START)
    # A random scan meets no orbit with fewer half rotations than the bound allows.
    phases = np.random.default_rng(0).uniform(0, 6.28, 30)
    fewest = min(min(address_of(FIG4, x, **START, n_symbols=3).half_turns or ()) for x in phases)
    assert fewest > 4


@pytest.mark.slow
def test_where_legs_do_not_meet_a_body_that_is_nearly_symmetric_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nor is any correction tried from which the next is expected to have no more digits."""
    aims, corrected = [], refine._Legs._corrected

    def counted(legs: Any, slopes: Any, aim: float, last: int) -> float:
        aims.append(aim)
        return corrected(legs, slopes, aim, last)

    monkeypatch.setattr(refine._Legs, "_corrected", counted)
    flat = Body(A=(2, "1.46", "1.48"), r=("0.90", "0.44", 0), mu="0.00056")
    with pytest.raises(NoOrbit, match=r"nearly symmetric: .* by 3e-13 only, .* within 0\.0007 rad"):
        find_orbit(flat, "011", h0=1, J1_0="1e-8", digits=10)
    assert min(aims) > refine.CURVED


def test_wrong_values_are_named() -> None:
    with pytest.raises(MapError, match="normal form"):
        find_orbit(FIG4, "01", h0="1.3342", J1_0="0.2")
    with pytest.raises(MapError, match=r"too large|does not reach"):
        find_orbit(Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.3"), "01", **START)
    with pytest.raises(MapError, match="no certain symbol"):
        address_of(FREE, 1, **START, n_symbols=3)


def test_addresses_end_before_what_is_not_certain() -> None:
    found = address_of(FIG4, "3/10", **START, n_symbols=40, precisions=(53,))
    assert isinstance(found, Address)
    assert 5 < len(found.symbols) < 40


def test_slopes_that_gain_little_are_told_anew() -> None:
    """Legs that are no legs: slopes have seven digits less than the crossings where they are told.

    The map's crossings are 6e-6 off: slopes told there gain a digit in each correction.
    """
    legs: Any = object.__new__(refine._Legs)
    legs.needed, legs.most, legs.kinds = np.array([36.0]), 36.0, [212, 424]
    legs.m = context(200)
    legs.theta, legs.times, asked = legs.m.mpf(1), np.array([legs.m.mpf(0)]), []
    right = 5.2

    def corrected(slopes: list[float], aim: float, _: int) -> float:
        nonlocal right
        before, right = right, min(aim, right + slopes[0], 2 * right - refine.CURVED)
        return min(legs.most, before)

    def differences(bits: int, _: int) -> list[float]:
        asked.append(bits)
        return [max(1.0, right - 7)]

    legs._differences, legs._corrected = differences, corrected
    legs.run()
    # Four digits are beyond those of the phase.
    assert right >= 36 - refine.FURTHER / 2
    assert asked == [212] * len(asked)
    assert 2 <= len(asked) <= 6


@pytest.mark.slow
def test_orbits_are_found_where_doubles_hardly_place_them() -> None:
    """Surfaces are split by 2.8e-13, and roundings displace crossings of the map by 6e-6.

    The phase is that at whose last crossing gamma3 = 0, by a Taylor series of Euler-Poisson in
    body axes in 270 bits.
    """
    body = Body(A=(2, "1.46", "1.48"), r=("0.90", "0.44", 0), mu="0.00056")
    found = find_orbit(body, "01", h0=1, J1_0="1e-8")
    assert str(found.theta2_0) == "5.7873060242382477000796518056"
    assert found.confirmed == 2
