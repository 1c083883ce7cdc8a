"""Closed orbits, closed again by integration in 113 bits, and the growth of deviations."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.mechanics.coordinates import Aligned, canonical_from_aligned
from rigidpend.mechanics.equations import eq1
from rigidpend.numbers import Array
from rigidpend.numbers.checked import ParameterError
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.symbolic import NoOrbit, closed_orbit
from rigidpend.routes.symbolic import closed as closed_module
from rigidpend.routes.symbolic.chain import crossing_states, passages, tangents
from rigidpend.routes.symbolic.closed import ClosedOrbit, actions, closed, closing, lyapunov, words
from rigidpend.routes.symbolic.levels import OrbitFamily, orbits_of
from rigidpend.routes.symbolic.stretching import integrated, most_stretched, stretched, stretching
from tests.bodies import problem
from tests.routes.symbolic.fig4 import BODY, H, chain_of, level

TURNS = 11


def test_words_are_one_for_each_orbit() -> None:
    """Moebius' formula counts 2, 1, 2, 3, 6, 9, ... necklaces; an even one is two orbits."""
    found = [len(word) for word in words(8)]
    assert [found.count(n) for n in range(1, 9)] == [2, 2, 2, 6, 6, 18, 18, 60]
    _, *lacking = (closed(level(), word, TURNS) for word in words(2))
    with pytest.raises(ValueError, match="3 points of period 2 instead of 4"):
        lyapunov(lacking, 2)


SLOW = pytest.mark.slow
STEEP = Body((2, "1.01", "1.48"), ("0.85", "0.53", 0), "0.0004"), 1
"""A passage stretches more than a thousand times."""
SHARP = Body((2, "1.32", "1.72"), ("0.62", "0.02", 0), "3.68e-3"), 1
"""Passages happen to meet sharply, and the gap is less than the expected one."""
SPARED = Body(("1.534", "1.296", "1.44"), ("0.983", "0.184", 0), "0.000179"), "1.0882"
DEEP = Body(("1.726", "1.389", "1.663"), ("0.727", "0.687", 0), "0.00142"), "1.5158"
BENT = Body(("1.05", "0.92", 1), (1, 10, 0), "1e-5"), "0.25"
"""Surfaces are split by 3e-14 and bend by more: straight lines would lead away."""
SLOWLY = (
    Body(("1.349201", "1.047724", "1.078825"), ("0.2698", "0.9629", 0), "0.00767316"),
    "19.5621",
)
"""They are split by 2e-9: corrections gain some six bits each."""


@pytest.mark.parametrize(
    ("of", "word", "turns", "bits", "most", "moved"),
    [
        pytest.param(STEEP, "0", 17, 113, 1e-26, (0, 1e-11), marks=SLOW),
        pytest.param(SHARP, "01", None, 113, 1e-30, (0, 1e-11), marks=SLOW),
        # As long as doubles tell: d tells |I| to a tenth there, and the derivative of its end.
        ((BODY, H), "0", 31, 113, 1e-12, (0, 1e-12)),
        # The first corrections gain a digit or two each, so that many bits take more than twelve.
        ((BODY, H), "0", 31, 300, 1e-68, (0, 1e-12)),
        # Errors along the surfaces, which are split by 3e-14, are not taken for such across them.
        (BENT, "1", None, 113, 1e-20, (1e-7, 1e-5)),
        (BENT, "011", None, 113, 1e-13, (1e-7, 1e-5)),
        (BENT, "011", None, 106, 1e-8, (1e-7, 1e-5)),
        # Without spare bits a passage rounds up to eleven times as much as its tolerance tells.
        (SPARED, "011", None, 106, 1e-13, (0, 1e-6)),
        # A period errs by no less than all its roundings come to, grown.
        (DEEP, "0", None, 106, 3e-20, (0, 1e-4)),
        # Where a passage ends, a state of size 1 rounds: roundings of d's own size are too small.
        (DEEP, "01", None, 106, 1e-20, (0, 1e-4)),
        pytest.param(SLOWLY, "0", None, 113, 1e-23, (1e-9, 1e-7), marks=SLOW),
        pytest.param(SLOWLY, "0", None, 160, 1e-37, (1e-9, 1e-7), marks=SLOW),
    ],
)
def test_integration_closes_to_what_is_expected(
    of: Any, word: str, turns: int | None, bits: int, most: float, moved: tuple[float, float]
) -> None:
    """An orbit of a body at an energy; corrections move it by so much."""
    orbit = closed_orbit(of[0], word, h=of[1], half_turns=turns)
    found = closing(orbit, bits)
    assert found.error < found.expected < most
    assert moved[0] <= found.moved < moved[1]
    at = orbit.chain.d[0], orbit.chain.chi[0]
    assert list(map(float, found.place)) == pytest.approx(at, rel=0, abs=max(1e-11, moved[1]))


def test_a_period_is_finer_than_the_map_s_sum_of_doubles() -> None:
    orbit = closed(level(), (0, 1), TURNS)
    found, finer = (closing(orbit, bits).period for bits in (113, 160))
    assert abs(found - finer) < 1e-26
    assert 1e-26 < abs(found - Fraction(orbit.period)) < 1e-10


@pytest.mark.parametrize("word", [(0,), (0, 1), (0, 1, 1, 1)])
def test_errors_grow_as_the_derivatives_of_passages_tell(word: tuple[int, ...]) -> None:
    """In d and chi, whose product loses nothing where surfaces are split by 4e-4."""
    orbit = closed(level(), word, TURNS)
    _, _, growth = closed_module.roundings(orbit)
    grown = np.eye(2)
    for slope, found in zip(tangents(orbit.chain)[::-1, :2], growth[-2::-1], strict=True):
        grown = grown @ slope
        np.testing.assert_allclose(found, grown, rtol=1e-6, atol=0)
    np.testing.assert_array_equal(growth[-1], np.eye(2))


def test_gaps_that_corrections_leave_count(monkeypatch: Any) -> None:
    """Corrections end where passages meet to 1e-19; roundings alone grow to 6e-33."""
    monkeypatch.setattr(closed_module, "LOST", 50)
    found = closing(closed(level(), (0, 1), TURNS))
    assert 1e-30 < found.error < found.expected < 100 * found.error


@pytest.mark.parametrize("bits", [106, 212])
def test_a_gap_is_expected_by_the_numbers_that_round(bits: int) -> None:
    """Sums of doubles have these bits and no others; a gap is some of its roundings, grown."""
    found = [
        closing(closed(level(), word, turns), bits)
        for word, turns in (((0,), 14), ((1,), 21), ((0, 1), 11), ((0, 1, 1), 14))
    ]
    assert all(gap.error < gap.expected for gap in found)
    assert np.median([gap.expected / gap.error for gap in found]) < 2000


def test_a_multiplier_beyond_doubles_is_refused_and_not_infinite() -> None:
    assert closed(level(), (0,), 200).exponent > 100
    # The square of the last one's trace is beyond them. Each turn adds as much to the exponent.
    long = [closed(level(), (0,), n) for n in (200, 250, 300)]
    one, two, three = (orbit.exponent for orbit in long)
    assert three - two == pytest.approx(two - one, rel=1e-12, abs=0)
    assert 1e-12 < long[2].exponent_error < 1e-9
    with pytest.raises(OverflowError, match="6 passages deviations grow by more than doubles hold"):
        closed_orbit(BODY, "001", h=H, half_turns=200)


def test_crossings_that_doubles_do_not_tell_are_refused_with_how_long_passages_may_be() -> None:
    """Their d is that of the surface to rounding, and an orbit begun there is another one."""
    with pytest.raises(NoOrbit, match=r"^passage 1 takes so long .* half rotations") as refused:
        closed_orbit(BODY, "01", h=H, half_turns=200)
    most = int(str(refused.value).rpartition("with ")[2].split()[0])
    right, error = passages(closed_orbit(BODY, "01", h=H, half_turns=most).chain)
    assert right.all()
    assert error.max() < 1e-3
    with pytest.raises(NoOrbit, match=r"^passage \d takes so long"):
        closed_orbit(BODY, "01", h=H, half_turns=most + 4)


def test_other_orbits_begin_in_the_other_cell() -> None:
    """With 0 and 1 exchanged they are alike to first order in mu, and no further."""
    one, other = (closed_orbit(BODY, word, h=H, half_turns=TURNS) for word in ("01", "b 10"))
    assert one.chain.chi[0] == pytest.approx(0, abs=1e-12)
    assert other.chain.chi[0] == pytest.approx(math.pi, abs=1e-12)
    assert 1e-5 < abs(one.trace / other.trace - 1) < 1e-3


def exchanged(word: str) -> str:
    """The word with 0 and 1 exchanged."""
    return word.translate(str.maketrans("01", "10"))


def assert_alike(one: str, other: str, body: Body = BODY) -> None:
    """Orbits of both words have one period, trace and action."""
    found = [closed_orbit(body, word, h=H, half_turns=TURNS) for word in (one, other)]
    told = [(x.period, x.trace, float(actions([x.chain])[0])) for x in found]
    # The rounding of chi, some 1e-14, times what a passage stretches, a few hundred.
    assert told[1] == pytest.approx(told[0], rel=5e-12, abs=0)
    assert found[0].mirrored == found[1].mirrored


@pytest.mark.parametrize("word", ["001", "00101", "b 0010", "a 010011", "b 010001"])
def test_an_orbit_is_read_from_any_upward_crossing_and_backward(word: str) -> None:
    """Words of odd length are read twice, so that any symbol may be their first."""
    cell, symbols = word.split() if " " in word else ("a", word)
    step = 1 if len(symbols) % 2 else 2
    assert_alike(word, f"{cell} {symbols[step:]}{symbols[:step]}")
    assert_alike(word, f"{cell} {exchanged(symbols[::-1])}")


@pytest.mark.slow
@pytest.mark.parametrize(("r", "cells"), [((1, 0, 0), "ab"), ((0, 1, 0), "ba")])
@pytest.mark.parametrize("word", ["01", "0001", "010011"])
def test_a_turn_by_pi_about_the_axis_of_the_centre_takes_orbits_to_orbits(
    r: Any, cells: str, word: str
) -> None:
    """It exchanges both periodic orbits, left and right.

    The image begins where the orbit crosses downwards, an odd number of cells further. About axis
    1 phases grow by pi, which is another cell.
    """
    body = Body(BODY.A, r, BODY.mu)
    for cell, image in zip("ab", cells, strict=True):
        assert_alike(f"{cell} {word}", f"{image} {exchanged(word[1:] + word[:1])}", body)


def test_what_is_no_closed_orbit_is_refused() -> None:
    with pytest.raises(ParameterError, match="0 and 1"):
        closed_orbit(BODY, "012", h=H)
    with pytest.raises(ParameterError, match="without half rotations"):
        closed_orbit(BODY, "0^9", h=H)
    for turns in (0, 2.5, "11", 10**30):
        with pytest.raises(ParameterError, match=r"half_turns must .* from 1 to 999999, got"):
            closed_orbit(BODY, "0011", h=H, half_turns=turns)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="bits must be a whole number from 96 on, got 95"):
        closing(closed(level(), (0,), TURNS), 95)
    # A period that grows roundings leaves open 0.6 rad by one computation, and 21 by another.
    with pytest.raises(NoOrbit, match=r"113 bits to 1e\+03 rad, which verifies nothing"):
        closed_module.roundings(closed(level(), (0, 0, 0, 1), 28))
    with pytest.raises(NoOrbit):
        closed_orbit(BODY, "0011", h=H, half_turns=4)
    assert closed_orbit(BODY, "0011", h=H).half_turns < 12
    # Beyond the tables Newton's method converges too, to what the cut of |I| makes of an orbit.
    with pytest.raises(NoOrbit, match=r"^passage 1 would need \|I\| above 0\.00265, where the tab"):
        closed_orbit(BODY, "01", h=H, half_turns=6)
    assert closing(closed_orbit(BODY, "01", h=H, half_turns=7)).error < 1e-30


@pytest.mark.parametrize("trace", [-3.0, -2.02, -1.98, 0.0, 1.98, 2.02, 3.0])
def test_a_multiplier_is_of_its_trace_and_not_inside_of_the_unit_circle(trace: float) -> None:
    """Its inverse is the other one, for the map preserves the area."""
    nothing: Any = None
    orbit = ClosedOrbit((0,), TURNS, False, 1.0, trace, nothing)
    m = orbit.multiplier
    assert m + 1 / m == pytest.approx(trace)
    assert abs(m) >= 1 - 1e-15
    assert orbit.stable == (abs(trace) < 2)


@pytest.mark.parametrize("word", [(0, 1), (0, 0, 1)])
def test_the_action_is_the_integral_in_canonical_variables(word: tuple[int, ...]) -> None:
    """J1 dtheta1 + J2 dtheta2 along the paper's equations, through each passage."""
    chain = closed(level(), word, TURNS).chain
    p = BODY.angles()
    states = crossing_states(chain)[1][:, :-1]
    at = canonical_from_aligned(Aligned(*states), p.alpha0, p.beta0)
    begin = np.array([at.theta1, at.J1, at.theta2, at.J1 + at.J2mJ1])

    def rates(state: Any) -> tuple[Any, ...]:
        found = eq1(state[:4], p, np)
        return (*found, state[1] * found[0] + state[3] * found[2])

    whole = np.vstack((begin, 0 * begin[:1]))
    grown = states_at(rates, whole, chain.time[None], engine="scipy")[4, 0]
    [found] = actions([chain])
    assert found == pytest.approx(grown.sum(), rel=1e-12, abs=0)


LITTLE = Body(A=("1.9", "0.957", 1), r=(11, 1, 0), mu="6e-5")
LESS = Body(A=("1.05", "0.85", 1), r=(1, 10, 0), mu="1e-5")


@pytest.mark.parametrize(
    ("body", "h", "word", "trace", "missed"),
    [
        (LITTLE, "0.148", "1", 270.059297040011669, 2e-11),
        (LITTLE, "0.148", "10", -2.33483724123581, 2e-11),
        (LESS, "0.25", "1", 903.3015583795, 1e-7),
    ],
)
def test_multipliers_of_thin_bodies(
    body: Body, h: str, word: str, trace: float, missed: float
) -> None:
    """Split by 4e-8 and 3e-11; by Euler-Poisson: variations in 113 bits, differences in 212."""
    found = closed_orbit(body, word, h=h)
    assert found.trace == pytest.approx(trace, rel=missed)
    exponent = math.acosh(abs(trace) / 2) / len(found.chain.b)
    assert found.exponent == pytest.approx(exponent, rel=0, abs=found.exponent_error)


@pytest.mark.parametrize("side", [1, -1])
def test_an_exponent_beside_zero_errs_by_a_root_of_what_its_trace_does(side: int) -> None:
    """So much is a trace of 2 off from one that is known as well as that of the orbit."""
    orbit = closed(level(), (0, 0, 1), TURNS)
    size, n = abs(orbit.trace), len(orbit.chain.b)
    off = n * orbit.exponent_error * math.sqrt(size * size - 4) / size
    beside = orbit._replace(trace=2.0 * side)
    assert beside.exponent == 0
    assert beside.exponent_error == pytest.approx(math.acosh(1 + off) / n, rel=1e-6)


def test_an_orbit_that_does_not_come_to_close_is_not_verified(monkeypatch: Any) -> None:
    """Corrections that gain too little, or are more than roundings explain, prove nothing."""
    orbit = closed(level(), (0,), TURNS)
    for name, limit, said in (
        ("GAINED", 100, r"the orbit of 0 does not come to close, by \d"),
        ("MOVED", 1e-17, r"come to close: a correction is .*are split by 0\.0004"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(closed_module, name, limit)
            with pytest.raises(NoOrbit, match=said):
                closing(orbit)


def test_a_closed_orbit_stretches_by_its_multiplier() -> None:
    orbit, grown = closed(level(), (0, 1), 11), stretching(chain_of([0, 1] * 20))
    # In the middle the surface's orbit is beside the closed one, whose word has two passages.
    assert abs(grown[18:20].mean() - orbit.exponent) < 1e-8


PASSAGES = 5


@pytest.fixture(scope="module")
def orbits() -> OrbitFamily:
    return orbits_of(problem(n_symbols=PASSAGES))


def some(count: int) -> tuple[Array, Array]:
    """Random phases, and actions of four orders of magnitude."""
    random = np.random.default_rng(7)
    return random.uniform(0, 2 * np.pi, count), 10 ** random.uniform(-9, -5, count)


@pytest.fixture(scope="module")
def found(orbits: OrbitFamily) -> Any:
    return stretched(orbits, *some(200), PASSAGES)


def test_the_variational_equations_grow_as_much(found: Any) -> None:
    assert found.inside.all()
    off = np.abs(integrated(found) - found.growth[-1])
    assert (off < found.allowed + found.allowed_integrated).all()
    assert np.median(found.allowed) < 1e-7
    assert np.ptp(found.growth[-1]) > 8


SHRUNK = Body(A=(2, "1/5", "9/5"), r=(3, 8, 0), mu="1e-5")
THIN = Body((1, "0.548", "0.556"), ("0.355", "0.935", 0), "0.0106")
LESS_THIN = Body((1, "0.647", "0.679"), ("0.491", "0.871", 0), "8.2e-5")
"""Surfaces of both are split by a 2e-6th and a 4e-4th of the layer."""


@pytest.mark.parametrize(
    ("body", "h0", "start", "n", "grown", "most"),
    [
        # It grows to exp(14), then shrinks and is rounded as what had grown.
        (SHRUNK, "1.2", (4.754114033321756, 8.802725145750686e-08), 3, 4.279500267843436, 1e-7),
        (SHRUNK, "1.2", (4.754114, 8.8027e-08), 3, 4.959372696596074, 1e-7),
        # The largest roundings are those of the derivatives, and those of the angles of passages.
        (THIN, 1, (5.201631831312892, 2.392218609764373e-09), 4, 20.157101117394234, 0.1),
        (LESS_THIN, 1, (4.82, 1e-8), 2, 16.754351688647613, 1e-8),
    ],
)
def test_a_growth_is_off_by_its_bound_at_most(
    body: Body, h0: Any, start: tuple[float, float], n: int, grown: float, most: float
) -> None:
    """By variational equations of (M, gamma), Taylor series in 113 bits, or `scripts/stated.py`."""
    theta2, J1 = map(np.atleast_1d, start)
    seen = stretched(orbits_of(problem(body, n, h0)), theta2, J1, n)
    assert abs(seen.growth[-1, 0] - grown) < seen.allowed[0] < most


def test_orbits_have_their_codes(found: Any) -> None:
    phases, actions = some(200)
    for k in (0, 77, 160):
        routes = route_codes(BODY, [phases[k]], h0=H, J1_0=actions[k], n_symbols=PASSAGES)
        np.testing.assert_array_equal(routes.codes[:, 0], found.symbols[:, k])
        taken = routes.crossing_time[-1, 0] - routes.crossing_time[0, 0]
        assert found.time[k] == pytest.approx(taken, rel=1e-10, abs=0)


def test_growths_are_the_largest_singular_values() -> None:
    slopes = np.random.default_rng(2).normal(size=(4, 2, 2, 9))
    frames = np.random.default_rng(3).normal(size=(5, 2, 2, 9))
    grown, whole = most_stretched(list(slopes), list(frames)), np.eye(2)
    for k, slope in enumerate(np.moveaxis(slopes, -1, 1)):
        whole = slope @ whole
        begun, ended = np.moveaxis(frames[0], -1, 0), np.moveaxis(frames[k + 1], -1, 0)
        largest = np.linalg.svd(ended @ whole @ np.linalg.inv(begun), compute_uv=False)[:, 0]
        np.testing.assert_allclose(np.exp(grown[k]), largest, rtol=1e-11)


def test_orbits_that_begin_beyond_the_normal_form_are_left_out(orbits: OrbitFamily) -> None:
    seen = stretched(orbits, np.array([1.0, 1.0]), np.array([1e-8, 0.3]), 1)
    np.testing.assert_array_equal(seen.inside, [True, False])
