"""Orbits from their codes, each confirmed by integration; codes and addresses of given orbits."""

import itertools
import re
from contextlib import nullcontext
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body, address_of, find_orbit, route_codes
from rigidpend.mechanics import in_space
from rigidpend.mechanics.free_body import TURNS, symbols
from rigidpend.numbers.checked import ParameterError
from rigidpend.orbits.integrate import arithmetic
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import MapError
from rigidpend.orbits.return_map.passage import SectionPoint
from rigidpend.routes.codes import codes_of
from rigidpend.routes.herpolhode import initial_state, physical, separatrices
from rigidpend.routes.symbolic import Address, NoOrbit, find, follow, legs, shortest
from rigidpend.routes.symbolic.address import parsed
from rigidpend.routes.symbolic.chain import MOVED
from rigidpend.routes.symbolic.follow import RoundPhases, addressed, round_phases
from rigidpend.routes.symbolic.levels import onward, orbits_of
from rigidpend.routes.symbolic.refine import refined
from tests.bodies import FIG4, FIG5, FREE, problem
from tests.routes.symbolic.fig4 import level

START: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}


@pytest.mark.parametrize(
    ("code", "address", "text"),
    [
        # Symbols alone leave rotations free.
        ("0011", Address(None, (0, 0, 1, 1), None), "0011"),
        ([0, 1], Address(None, (0, 1), None), "01"),
        ("b 01", Address(1, (0, 1), None), "b 01"),
        ("a 0^9 1^9 1^9 0^99", Address(0, (0, 1, 1, 0), (9, 9, 9, 99)), "a 0^9 (1^9)*2 0^99"),
    ],
)
def test_addresses_are_read_and_told(code: Any, address: Address, text: str) -> None:
    assert parsed(code) == parsed(text) == parsed(address) == address
    assert str(address) == text


@pytest.mark.parametrize(
    ("word", "codes"),
    [
        ("one symbol", ["", "a"]),
        ("'2'", ["012"]),
        ("all passages", ["0^9 1"]),
        (r"\^", ["0^"]),
        ("as many", [Address(0, (0, 1), (9,)), Address(0, (0, 1), (9, 9, 9))]),
        ("first cell", [Address(2, (0, 1), None)]),
        ("0 and 1", [[0, 2]]),
    ],
)
def test_no_code_says_why(word: str, codes: list[Any]) -> None:
    for code in codes:
        with pytest.raises(ParameterError, match=word):
            parsed(code)


def times(theta2_0: Any, n: int, bits: int) -> Any:
    """Times t' of crossings by integration alone, certain throughout."""
    given: dict[str, Any] = {"n_symbols": n, "precisions": (bits,), "method": "integration"}
    routes = route_codes(FIG4, [theta2_0], **START, **given)
    assert routes.certain.all()
    return routes.crossing_time[:, 0]


# The last phase has the largest energy: those beside it lie below.
@pytest.mark.parametrize("theta2_0", ["1/10", "5.1", "1.570796"])
def test_the_address_of_an_orbit_leads_to_one_that_has_it(theta2_0: str) -> None:
    address = address_of(FIG4, theta2_0, **START, n_symbols=7)
    found = find_orbit(FIG4, address, **START, near=theta2_0, digits=12)
    assert found.address == address
    assert found.fixed == found.confirmed == found.passages == 7
    assert max(found.delay, found.passage_error) < 1e-10
    # An orbit that has all of the code is found itself; the map knows it to ten digits or more.
    assert float(found.theta2_0) == pytest.approx(float(Fraction(theta2_0)), rel=0, abs=1e-10)
    assert address_of(FIG4, found.theta2_0, **START, n_symbols=7, precisions=(113,)) == address


@pytest.mark.slow
@pytest.mark.parametrize("code", ["0010", "b 11"])
def test_an_orbit_returns_on_the_way_on_which_it_came(code: str) -> None:
    """From its last crossing, at gamma3 = 0: the code goes on backward, 0 and 1 exchanged."""
    found = find_orbit(FIG4, code, **START, digits=40)
    n, back = len(found.word), found.word[:0:-1].translate(str.maketrans("01", "10"))
    given: dict[str, Any] = {"n_symbols": 2 * n - 1, "precisions": (113,)}
    routes = route_codes(FIG4, [found.theta2_0], **START, **given)
    assert routes.words == [found.word + back]
    # Errors of 40 digits have grown to some 1e-25: what is left is the rounding of times.
    passages = np.diff(routes.crossing_time[:, 0])[1:]
    np.testing.assert_allclose(passages, passages[::-1], rtol=1e-13)


def test_whole_turns_of_a_phase_do_not_count() -> None:
    near, far = (find_orbit(FIG4, "011", **START, near=x) for x in ("1/10", "1/10 + pi*10**20"))
    assert str(near.address) == "a 0^8 1^8 1^13"
    assert far.theta2_0 == near.theta2_0
    # Of an orbit with another first symbol the cell is taken, and no half rotations.
    assert str(find_orbit(FIG4, "1", **START, near="1/10", digits=12).address) == "a 1^9"


def test_where_a_cell_has_no_orbit_the_other_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Either is the first of an address that does not say which; of both it is the quicker one."""
    both = [find_orbit(FIG4, f"{first} 0^11 1^11", **START) for first in "ab"]
    quicker = min(both, key=lambda x: np.ptp(x.crossing_time)).theta2_0
    assert find_orbit(FIG4, "0^11 1^11", **START).theta2_0 == quicker
    solved = shortest.with_half_turns
    for lacking, other in enumerate(both[::-1]):

        def exactly(system: Any, cell: int, *given: Any, lacking: int = lacking) -> Any:
            if cell % 2 == lacking:
                raise NoOrbit("none there")
            return solved(system, cell, *given)

        monkeypatch.setattr(find, "with_half_turns", exactly)
        assert find_orbit(FIG4, "0^11 1^11", **START).theta2_0 == other.theta2_0


@pytest.mark.parametrize(
    ("address", "digits", "bits"),
    [
        ("b 0^11 1^12 0^13", 12, 113),
        ("a 0^11 1^12 1^11 0^13 (0^11)*2 (1^11)*3", 28, 113),
        ("b 0^11 1^12 1^11 0^13 (0^11)*4 (1^11)*4", 40, 160),
        ("b 0^11 1^12 (0^11)*2 1^13 (0^11)*3", 11, 113),
        ("a 0^11 1^12 (0^11)*2 1^13 (0^11)*3", 12, 113),
        # Beside its first crossing chi is pi, and has a whole turn less.
        ("a 0^20 1^12 (0^11)*5", 13, 113),
    ],
)
def test_no_other_digits_do_better_or_fix_more(address: str, digits: int, bits: int) -> None:
    """By integration of the orbit and of one whose last digit is another."""
    found = find_orbit(FIG4, address, **START, digits=digits)
    n, phase = len(found.word), Fraction(found.theta2_0)
    all_fixed = found.fixed == n
    of_phases = phase, phase + Fraction(1, 10**digits)
    each = [times(x, 2 * n if all_fixed else n, bits) for x in of_phases]
    moved = np.abs(np.subtract(*each))
    assert moved[: found.fixed + 1].max() <= 1e-3
    # Twelve bits may be lost on the way.
    assert 2.0 ** (12 - found.bits) <= 10.0**-digits
    assert all_fixed is (digits > 13 or n == 3)
    if not all_fixed:
        assert moved[found.fixed + 1] > 1e-3
        return
    assert found.confirmed == n
    # It ends at gamma3 = 0: behind that the times between crossings are those before it, and what
    # is left of that is less than the half of what the last digit changes.
    left, beside = (t[2 * n] + t[0] - 2 * t[n] for t in each)
    assert abs(left) < 0.501 * abs(beside - left)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Mock:
    """Integrations of legs from now on."""
    monkeypatch.setattr(legs, "states_at", noted := Mock(wraps=states_at))
    return noted


def test_corrections_gain_more_in_wider_numbers(asked: Mock) -> None:
    """Bits of each integration: in wide numbers one of them, and differences in smaller ones."""
    many, few = (find_orbit(FIG4, "a 0^11", **START, digits=n) for n in (80, 28))
    bits = [x.args[3] for x in asked.call_args_list if x.args[1].shape[1] == 2]
    assert bits.count(424) == 2
    assert set(bits) == {106, 212, 424}
    assert abs(Fraction(few.theta2_0) - Fraction(many.theta2_0)) <= Fraction(1, 2 * 10**28)


def test_a_rounding_of_the_digits_to_gain_changes_nothing(asked: Mock, monkeypatch: Any) -> None:
    """It once called for differences in numbers too small: orbits of thin layers were lost."""
    correct = legs.Legs.correct
    found, n = find_orbit(FIG4, "a 0^11", **START), asked.call_count
    monkeypatch.setattr(legs.Legs, "correct", lambda of, bits, x: correct(of, bits, x + 1e-12))
    assert find_orbit(FIG4, "a 0^11", **START).theta2_0 == found.theta2_0
    assert asked.call_count == 2 * n


def test_an_orbit_is_refined_as_fast_from_its_own_phase(asked: Mock) -> None:
    """At whose energy it is found at once, so that no others tell its derivatives in the energy."""
    found = find_orbit(FIG4, "a 0^11 1^11", **START)
    n, near = asked.call_count, found.theta2_0
    assert find_orbit(FIG4, "a 0^11 1^11", **START, near=near).theta2_0 == near
    assert asked.call_count == 2 * n


@pytest.mark.parametrize(
    ("address", "phase", "late"),
    [
        # Its end doubles hardly tell: by Taylor series of Euler-Poisson in 260 bits it is there.
        ("a 0^36", "1.5620001402547490809955031060", 1e-12),
        # 2^13 roundings of the time of a passage, 100 t' at most: from the map's place, before it
        # is corrected, one is late by a thousand times more.
        ("b 0^27 1^27 1^29", "4.70569685418972", 1e-10),
    ],
)
def test_long_passages_are_found_and_are_hardly_late(address: str, phase: str, late: float) -> None:
    found = find_orbit(FIG4, address, **START, digits=len(phase) - 2)
    assert str(found.theta2_0) == phase
    assert found.fixed == found.confirmed >= 1
    assert found.delay < late


ROUND: dict[str, Any] = {"h0": 1, "J1_0": "1e-8"}
LITTLE = Body(A=(2, "17/10", "37/20"), r=(2, 1, 0), mu="1/100")
"""Surfaces are split by 6e-9: deviations across the layer grow to 5e9 in a passage."""
THIN = Body(A=(2, "1.45", "1.48"), r=("0.9", "0.44", 0), mu="0.00056")
"""Split by 3e-11 and 9e-12: derivatives at the map's crossings gain few digits."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "address", "phase"),
    [
        (LITTLE, "b 0^77 (1^78)*2", "4.30271931474466041837"),
        (THIN, "b 0^105 1^105 1^106 0^105", "3.54950057447218089608"),
        (LITTLE, "a 1^97 1^99 0^97", "0.48489734196847815811"),
    ],
)
def test_orbits_of_thin_layers_are_found(body: Body, address: str, phase: str) -> None:
    """At whose last crossing gamma3 = 0, by Taylor series of Euler-Poisson in 113 and 230 bits."""
    found = find_orbit(body, address, **ROUND, digits=20)
    assert str(found.theta2_0) == phase
    assert found.confirmed == found.passages == len(found.word)


FAR: dict[str, Any] = {"h0": "0.8057", "J1_0": "2.09e-8", "digits": 20}
CLOSE = Body(A=("2.208", "1.902", "1.935"), r=("0.909", "0.417", 0), mu="0.00247")
ASIDE: dict[str, Any] = {"h0": "0.9587", "J1_0": "8.14e-10", "digits": 20}
FAR_ASIDE = Body(A=("1.855", "1.58", "1.834"), r=("0.914", "0.406", 0), mu="0.00231")
"""Surfaces are split by a 1e13th of d, and starts are 3e4 and 2e4 times as far from them.

They come to a surface at one phase, the second's beside the border of a cell."""


@pytest.mark.parametrize(
    ("body", "given", "code", "address", "phase"),
    [
        (CLOSE, FAR, "01", "b 0^225 1^225", "5.42091922632277482572"),
        (FAR_ASIDE, ASIDE, "01", "b 0^262 1^260", "1.30721736482326390221"),
    ],
)
def test_orbits_between_surfaces_that_doubles_do_not_tell_apart_are_found(
    body: Body, given: dict[str, Any], code: str, address: str, phase: str
) -> None:
    """At whose last crossing gamma3 = 0, by Taylor series of Euler-Poisson in 160 bits."""
    found = find_orbit(body, code, **given)
    assert (str(found.address), str(found.theta2_0)) == (address, phase)
    assert found.confirmed == found.passages == len(code)
    assert found.passage_error < MOVED
    # Tables that count d from 0 have the same first crossing, as far as its phase is known.
    orbits = orbits_of(problem(body, 1, given["h0"], given["J1_0"]))
    start = np.array([float(found.theta2_0)])
    begin = orbits.enter(orbits.return_map.at(orbits.energy(start)), start).point
    assert abs(begin.d[0] - found.d[0]) < found.delay * np.abs(found.d).max()


@pytest.mark.slow
def test_all_digits_are_right_where_the_map_of_the_whole_layer_is_coarse() -> None:
    """By both maps 45 digits begin with these; by that map the last of 28 came out as 1."""
    body = Body(A=("2.054", "1.637", "2.013"), r=("0.679", "0.735", 0), mu="0.000165")
    found = find_orbit(body, "0011010", h0="0.9299", J1_0="2.09e-8", digits=28)
    assert str(found.theta2_0) == "0.5880271106584498512739129793"


TOO_CLOSE = Body(A=("2.419", "2.222", "2.347"), r=("0.887", "0.462", 0), mu="0.000199")
TOO_HEAVY = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.3")
HESS = Body(A=(2, 1, "3/2"), r=(1, "sqrt(2)", 0), mu="0.001")


@pytest.mark.parametrize(
    ("body", "code", "given", "error", "said"),
    [
        (FIG4, "01", {"J1_0": "0.2"}, MapError, "J1_0 = 0.2 lies outside of the normal"),
        (FIG4, "01", {"J1_0": "1e-400"}, MapError, "J1_0 = 1e-400 is too small for the do"),
        (FIG4, "01", {"near": "1e400"}, ParameterError, "near must be a finite double"),
        (FIG4, "01", {"jobs": 0}, ParameterError, "jobs must be a whole number from 1"),
        (TOO_HEAVY, "01", {}, MapError, "too large|does not reach"),
        # Too long for the map, though ten digits do not determine its symbol.
        (
            FIG4,
            "a 0^60",
            {"digits": 10},
            NoOrbit,
            "passage 1 .* long .* 31 half rotations or fewer they surely do$",
        ),
        # No orbit changes sides at a downward crossing.
        (HESS, "11", {}, NoOrbit, "Hess case or near it: .* at downward crossings"),
        # A start too far from the surfaces for a thin layer.
        (
            CLOSE,
            "01",
            FAR | {"J1_0": "1e-4"},
            NoOrbit,
            "nearly symmetric: .*; a smaller J1_0 may help$",
        ),
        # Legs do not meet.
        (
            TOO_CLOSE,
            "11",
            {"h0": "0.9704", "J1_0": "2.52e-9", "digits": 20},
            NoOrbit,
            r"nearly symmetric: .* at most 1e-18.*; a smaller J1_0 may help$",
        ),
    ],
)
def test_where_no_orbit_is_found_the_reason_is_told(
    body: Body, code: str, given: dict[str, Any], error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        find_orbit(body, code, **{**START, **given})


@pytest.mark.slow
def test_more_digits_by_integers_agree_with_fewer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the kernel's numbers have no more than 212 bits they tell 53 digits, these the rest."""
    few = find_orbit(FIG4, "a 0^11", **START, digits=50)
    for module in (arithmetic, legs):
        monkeypatch.setattr(module, "LADDER", arithmetic.LADDER[:3])
    many = find_orbit(FIG4, "a 0^11", **START, digits=56)
    assert abs(Fraction(few.theta2_0) - Fraction(many.theta2_0)) <= Fraction(1, 2 * 10**50)


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
    assert len(repr(found)) < 500


def test_an_orbit_with_other_symbols_by_integration_is_refused(monkeypatch: Any) -> None:
    def otherwise(*given: Any) -> Any:
        return (found := codes_of(*given))._replace(codes=1 - found.codes)

    monkeypatch.setattr(find, "codes_of", otherwise)
    with pytest.raises(NoOrbit, match="integration of the full equations finds other symbols"):
        find_orbit(FIG4, "a 0^11", **START, digits=12)


def test_digits_that_are_not_gained_are_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigidpend.routes.symbolic.refine.ROUNDS", 1)
    with pytest.raises(NoOrbit, match=r"integration follows the map to 1\d digits only"):
        find_orbit(FIG4, "a 0^11", **START, digits=28)


ELSEWHERE = "integration does not find the crossings where the map"
SIX = "a 0^11 1^11 0^11 1^11 0^11 1^11"
BUT_LAST = np.array([1, -1, 0, 0, 0, 0, 0])
"""The last crossing stays in the middle of its cell."""


@pytest.mark.parametrize(
    ("code", "digits", "off", "found"),
    [
        # As roundings put those of nearly symmetric bodies, from four digits on: the first
        # correction shows that more legs count than was expected.
        (SIX, 10, {"chi": 5e-5 * BUT_LAST}, True),
        (SIX, 10, {"chi": 5e-4 * BUT_LAST}, False),
        # One that digits do not determine. A passage takes 14 at once: from 1e-9 it leads nowhere.
        ("a 0^30", 11, {"chi": np.array([1e-11, 0])}, True),
        ("a 0^30", 11, {"chi": np.array([1e-9, 0])}, False),
        # Delays of passages behind the map add up, to a thousandth at most.
        *(("a 0^11 1^11", 12, {"time": -early}, True) for early in (1e-7, 4e-4)),
        ("a 0^11 1^11", 12, {"time": -6e-4}, False),
    ],
)
def test_crossings_that_the_map_puts_badly_are_found_or_refused(
    code: str, digits: int, off: dict[str, Any], found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def moved(orbits: Any, chain: Any, *given: Any) -> Any:
        other = {name: getattr(chain, name) + by for name, by in off.items()}
        return refined(orbits, chain._replace(**other), *given)

    right = find_orbit(FIG4, code, **START, digits=digits)
    monkeypatch.setattr(find, "refined", moved)
    with nullcontext() if found else pytest.raises(NoOrbit, match=ELSEWHERE):
        orbit = find_orbit(FIG4, code, **START, digits=digits)
        assert orbit.theta2_0 == right.theta2_0
        assert "chi" in off or orbit.delay == pytest.approx(-2 * off["time"], rel=1e-3, abs=0)


def test_a_crossing_that_digits_do_not_determine_is_looked_for_too() -> None:
    right, found = (find_orbit(FIG4, "a 0^30", **START, digits=n) for n in (28, 11))
    assert found.fixed == 0
    assert abs(Fraction(found.theta2_0) - Fraction(right.theta2_0)) <= Fraction(1, 2 * 10**11)


@pytest.mark.parametrize(("digits", "found"), [(0.5, True), (-0.5, False)])
def test_a_last_crossing_off_by_more_than_a_radian_is_no_orbits(
    digits: float, found: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Long passages of a thin body once led to an orbit of another address, 5,325 t' late."""
    correct, first = legs.Legs.correct, [digits]

    def told(self: Any, *given: Any) -> list[float]:
        *others, last = correct(self, *given)
        return [*others, first.pop() if first else last]

    monkeypatch.setattr(legs.Legs, "correct", told)
    with nullcontext() if found else pytest.raises(NoOrbit, match=ELSEWHERE):
        assert find_orbit(FIG4, "a 0^11 1^11", **START, digits=10).passages == 2


def test_half_rotations_are_told_however_little_surfaces_are_split() -> None:
    body = Body(A=("2.322", "1.988", "2.042"), r=("0.975", "0.223", 0), mu="0.00307")
    given: dict[str, Any] = {"h0": "1.0414", "J1_0": "1.32e-8", "n_symbols": 7}
    # The address by which find_orbit has found the phase.
    found = address_of(body, "2.3247807303684225198563665815", **given)
    assert str(found) == "a 0^166 0^165 1^165 1^166 0^159 1^157 0^153"


def test_addresses_end_before_what_is_not_certain() -> None:
    found = address_of(FIG4, "3/10", **START, n_symbols=40, precisions=(53,))
    assert 5 < len(found.symbols) < 40
    with pytest.raises(MapError, match="no certain symbol"):
        address_of(FREE, 1, **START, n_symbols=3)


DOCS = Path(__file__).parents[3] / "docs" / "addresses.md"
ROUTE: dict[str, Any] = {"h0": "10/9", "J1_0": "2.39205e-9"}
J1_0, PASSAGES, WAIT = "1e-6", 5, 36.0
"""`WAIT` is the longest mean time t' of a passage, and of the way to the first crossing."""
GIVEN = [
    (FIG4, "1.3342", [4.95, 5.97]),
    (Body((3, 2, "2.5"), (1, 2, 0), "0.003"), 1, [2.66, 3.45, 5.97]),
]
"""Bodies, h0 and phases: for each body all passages occur."""


@pytest.mark.parametrize(("body", "h0", "phases"), GIVEN)
def test_an_address_is_what_a_reader_counts(body: Body, h0: Any, phases: list[float]) -> None:
    """Along an orbit in M and gamma, passage by passage, by the function that the page prints."""
    [block] = re.findall(r"```python\n(def cells.*?)```", DOCS.read_text(), re.DOTALL)
    names, met = dict[str, Any](np=np), set()
    exec(block, names)
    orbits = problem(body, PASSAGES, h0, J1_0)
    for phase in phases:
        times = np.linspace(0, WAIT * (PASSAGES + 1), 10_000)
        states = states_at(in_space.field(body), initial_state(orbits, phase), times)
        crossings = np.flatnonzero(np.diff(np.sign(states[2])))[: PASSAGES + 1]
        M, gamma = physical(states, body)
        counted = [
            names["cells"](M[:, i : j + 1], gamma[:, i : j + 1])
            for i, j in itertools.pairwise(crossings)
        ]
        beside = separatrices(states)[: PASSAGES + 1]
        wanted = address_of(body, phase, h0=h0, J1_0=J1_0, n_symbols=PASSAGES)
        assert wanted.first == counted[0][0] % 2
        assert wanted.symbols == tuple(symbols(beside))
        assert wanted.half_turns == tuple(int(behind - j) for j, behind in counted)
        met |= set(itertools.pairwise(beside.tolist()))
    assert len(met) == len(TURNS)


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_a_passage_that_the_map_takes_for_another_is_told_by_its_number(wrong: int) -> None:
    begin = SectionPoint(True, np.array([1e-4]), np.array([0.3]))
    passed = list(onward(level().map_level, begin, 3))
    _, *at = zip(begin, *(each.point for each in passed), strict=True)
    points = SectionPoint(True, *map(np.concatenate, at))
    codes = np.concatenate([each.symbol for each in passed])
    assert addressed(level(), points, codes).symbols == tuple(codes)
    codes[wrong] ^= 1
    with pytest.raises(MapError, match=f"passage {wrong + 1} of the orbit lies outside"):
        addressed(level(), points, codes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "published", "address", "count"),
    [
        ("00011", "1.02", "a 0^29 (0^31)*2 1^32 1^28", 4),
        ("11110", "1.83", "a 1^38 1^29 1^31 1^29 0^30", 11),
    ],
)
def test_published_phases_come_out(code: str, published: str, address: str, count: int) -> None:
    """The paper prints two decimals; of its codes alone these are the least such phases."""
    orbit = find_orbit(FIG5, address, **ROUTE, digits=12)
    assert f"{orbit.theta2_0:.2f}" == published
    assert route_codes(FIG5, [orbit.theta2_0], **ROUTE, n_symbols=5).words == [code]
    assert str(find_orbit(FIG5, code, **ROUTE, near=published, digits=12).address) == address
    found = round_phases(FIG5, code, **ROUTE, decimals=2)
    assert (found.tried, found.uncertain) == (629, 0)
    assert len(found.theta2_0) == count
    assert found.theta2_0[0] == Decimal(published)
    assert str(found.addresses[0]) == address


def round_(code: Any) -> RoundPhases:
    return round_phases(FIG4, code, **START, decimals=1)


def test_all_phases_of_a_code_are_found_and_of_an_address_those_that_have_it() -> None:
    every, phases = round_("011"), [Decimal(k) / 10 for k in range(63)]
    routes = route_codes(FIG4, phases, **START, n_symbols=3, method="integration")
    of = zip(phases, routes.words, strict=True)
    assert list(every.theta2_0) == [phase for phase, own in of if own == "011"]
    first = every.addresses[0]
    assert first == address_of(FIG4, every.theta2_0[0], **START, n_symbols=3)
    kept = round_(first)
    assert set(kept.addresses) == {first}
    assert kept.theta2_0[0] == every.theta2_0[0]
    assert len(kept.theta2_0) == every.addresses.count(first) < len(every.theta2_0)
    cells = [round_(f"{cell} 011").theta2_0 for cell in "ab"]
    assert sorted(cells[0] + cells[1]) == list(every.theta2_0)
    assert all(cells)


def test_where_the_tables_end_the_address_is_integrated(monkeypatch: pytest.MonkeyPatch) -> None:
    right = round_("011")
    monkeypatch.setattr(follow, "followed", lambda *_: (Address(0, (), ()), np.zeros(1)))
    assert round_("011") == right


@pytest.mark.slow
def test_where_doubles_do_not_follow_the_address_is_integrated() -> None:
    code = route_codes(FIG4, ["3.3"], **START, n_symbols=24).codes[:, 0]
    found = round_(code)
    assert found.theta2_0 == (Decimal("3.3"),)
    assert found.addresses == (address_of(FIG4, "3.3", **START, n_symbols=24),)


def test_what_is_not_certain_is_counted_and_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *others = round_("011").theta2_0

    def doubted(*given: Any, **named: Any) -> Any:
        found = route_codes(*given, **named)
        found.certain[1, int(10 * first)] = False
        return found

    monkeypatch.setattr("rigidpend.routes.symbolic.follow.route_codes", doubted)
    found = round_("011")
    assert (found.theta2_0, found.uncertain) == (tuple(others), 1)


def test_orbits_that_start_outside_of_the_normal_form_have_addresses() -> None:
    given: Any = {**START, "J1_0": "1e-3"}
    with pytest.raises(MapError, match="J1_0 = 1e-3 lies outside of the normal form: take a small"):
        find_orbit(FIG4, "010", **given)
    found = round_phases(FIG4, "a 010", **given, decimals=1)
    assert found.theta2_0
    for phase, address in zip(found.theta2_0, found.addresses, strict=True):
        assert address == address_of(FIG4, phase, **given, n_symbols=3)
        assert address.first == 0


def test_orbits_outside_of_the_map_have_no_address() -> None:
    found = round_phases(TOO_HEAVY, "0", **START, decimals=0)
    assert found.theta2_0
    assert set(found.addresses) == {None}
    assert round_phases(TOO_HEAVY, "a 0", **START, decimals=0).theta2_0 == ()
