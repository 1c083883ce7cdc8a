"""Chains of passages: their equations' derivatives, and orbits followed by the map itself."""

import contextlib
import copy
import math
import re
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.mechanics.body import Body
from rigidpend.numbers import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.chain import (
    MOVED,
    NoOrbit,
    System,
    check_split,
    displaced,
    on_surface,
    passages,
    signs_of,
)
from rigidpend.routes.symbolic.levels import ChainLevel, orbits_of
from rigidpend.routes.symbolic.shortest import (
    INSIDE,
    MORE_HALF_TURNS,
    alike,
    chain_through,
    check_possible,
    lessened,
    shortest,
    with_half_turns,
)
from tests.bodies import problem
from tests.routes.symbolic.fig4 import BODY, chain_of, level

SYMBOLS = np.array([0, 1, 1, 0, 0])
TURNS = (11, 10, 12, 11, 14)
CELLS = np.concatenate(([0], np.cumsum(TURNS)))


def system() -> System:
    """The equations of the orbits of the surface with these symbols."""
    return System(level(), on_surface, signs_of(SYMBOLS))


def test_the_splitting_is_the_largest_at_any_phase_and_less_at_downward_crossings() -> None:
    """As Melnikov's integrals along separatrices 3 and 2 are, to first order in mu = 0.001."""
    here, b, p = level(), np.linspace(0, 2 * np.pi, 5000), BODY.angles()
    on = here.arriving(np.zeros(b.size), b)
    U, V, *_ = here.map_level.charts[True].forward.look_up(on.d, on.chi, here.map_level.a)
    every = np.abs(U * V)
    assert np.isclose(here.splitting, every.max(), rtol=1e-3)
    assert every.min() < 0.1 * every.max()
    by_first_order = np.sin((p.alpha0 - p.beta0) / 2) / np.sin((p.alpha0 + p.beta0) / 2)
    assert here.downward_splitting / here.splitting == pytest.approx(by_first_order, rel=5e-3)


@pytest.mark.parametrize(
    ("code", "downward"), [([0, 0], True), ([1, 1], True), ([0, 1, 1, 0], False), ([1], False)]
)
def test_changes_of_sides_tell_what_splitting_counts(code: list[int], downward: bool) -> None:
    here = level()
    assert here.narrowest(signs_of(code)) == (
        here.downward_splitting if downward else here.splitting
    )


@pytest.mark.parametrize(
    ("by_upward", "body"), [(0.99, "at the Hess case or near it"), (1.01, "nearly symmetric")]
)
def test_a_body_that_is_symmetric_is_told_from_Hess(by_upward: float, body: str) -> None:
    here, times, angle = level(), 4, 3.0
    split = here.splitting / times
    moved = displaced(here, angle, split)
    with pytest.raises(NoOrbit, match=f"the body is {body}: "):
        check_split(here, split, angle, moved / (times * by_upward))
    check_split(here, split, angle, 1.01 * moved)
    with pytest.raises(NoOrbit):
        check_split(here, split, 1.1 * angle, 1.01 * moved)


@pytest.mark.parametrize(
    ("code", "given", "least"), [([1], False, 7), ([1, 1], False, 9), ([1, 1], True, 7)]
)
def test_passages_are_as_long_as_surfaces_ask(code: list[int], given: bool, least: int) -> None:
    """Downward by a sixth, which is 1.6 half rotations; what is given may end near a border."""
    far: Any = SimpleNamespace(off_middle=np.array([0.1, INSIDE + 0.04]))
    tried = Mock(return_value=far)
    refused = pytest.raises(NoOrbit, match=r"a crossing is 0\.40 half rotations from the middle")
    with contextlib.nullcontext() if given else refused:
        assert alike(level(), signs_of(code), tried, given) is far
    assert tried.call_args_list[0].args == (least,)


@pytest.mark.parametrize("upper", [True, False])
@pytest.mark.parametrize("rising", [True, False])
def test_slopes_of_crossings_are_their_differences(rising: bool, upper: bool) -> None:
    """Of a passage past the lower orbit the angle changes its sign on the way to the tables."""
    random, step = np.random.default_rng(1), 1e-5
    I, phase = random.uniform(-0.9, 0.9, (2, 50)) * [[level().widest_I], [9]]
    sides = np.full(50, rising), np.full(50, upper)
    at = level().crossings(*sides, I, phase)
    for k, (dI, dphase) in enumerate(((step * level().widest_I, 0.0), (0.0, step))):
        ahead, back = (level().crossings(*sides, I + s * dI, phase + s * dphase) for s in (1, -1))
        for by, x, y in ((at.chi_by[k], ahead.chi, back.chi), (at.d_by[k], ahead.d, back.d)):
            change = (x - y) / (2 * (dI + dphase))
            np.testing.assert_allclose(by, change, rtol=1e-6, atol=1e-8 * np.abs(by).max() + 1e-10)


def test_the_map_and_integration_follow_every_passage() -> None:
    chain = with_half_turns(system(), 0, 0.0, TURNS)
    assert chain.residual < 1e-12
    for k, symbol in enumerate(SYMBOLS):
        point = SectionPoint(k % 2 == 0, chain.d[k : k + 1], chain.chi[k : k + 1])
        passed = level().map_level.passage(point)
        assert passed.symbol[0] == symbol
        seen = passed.turned[0], passed.time[0]
        assert seen == pytest.approx((np.diff(chain.chi)[k], chain.time[k]), abs=1e-9)
    right, error = passages(chain)
    assert right.all()
    assert error.max() < 1e-9
    assert not passages(chain._replace(I=-chain.I))[0].any()


def test_few_half_rotations_leave_room() -> None:
    made = shortest(system(), 0, 0.0)
    assert np.abs(made.chi / np.pi - made.cells).max() <= INSIDE
    # The splitting allows no shorter passage beside the surface.
    assert np.diff(made.cells)[0] >= level().half_turns(level().splitting) - 1


def test_passages_are_lessened_while_their_neighbourhood_stays_inside(monkeypatch: Any) -> None:
    """By one each, while eight passages on each side, as far as there are so many, stay inside."""
    asked = Mock(wraps=chain_through)
    monkeypatch.setattr("rigidpend.routes.symbolic.shortest.chain_through", asked)
    word = np.random.default_rng(1).integers(0, 2, 14)
    one, made = System(level(), on_surface, signs_of(word)), chain_of(word)
    for k, near in ((1, 10), (10, 12)):
        fewer = lessened(one, made, made.cells, k)
        assert (made.cells - fewer).tolist() == [0] * (k + 1) + [1] * (14 - k)
        assert len(asked.call_args.args[0].signs) == near


def test_no_unknown_steps_by_more_than_half_a_radian(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluated = Mock(side_effect=System.evaluated)
    monkeypatch.setattr(System, "evaluated", lambda *x: evaluated(*x))
    one = system()._replace(last_chi=float(np.pi * CELLS[-1]))
    with contextlib.suppress(NoOrbit):
        one.solved(one.guess(np.pi * CELLS, 0.0) + 0.8)
    seen = [given.args[1] for given in evaluated.call_args_list]
    steps = np.abs(np.diff(seen, axis=0)).max(axis=1)
    assert steps.max() == pytest.approx(0.5)


def test_an_orbit_and_its_energy_change_with_its_phase() -> None:
    orbits = orbits_of(problem(n_symbols=1))
    rise = float(orbits.energy(1 + 1e-3) - orbits.energy(1 - 1e-3))
    assert orbits.energy_slope(1) == pytest.approx(rise / 2e-3, rel=1e-5, abs=0)
    arrival = orbits.begin(level())
    early, here, late = (arrival(1.2 + x) for x in (-1e-3, 0.0, 1e-3))
    assert here.I_slope == pytest.approx((late.I - early.I) / 2e-3, rel=1e-5, abs=0)
    assert here.b_slope == pytest.approx((late.b - early.b) / 2e-3, rel=1e-5)


def test_a_chain_is_guessed_from_where_its_crossings_are() -> None:
    made = chain_of([0, 1, 1, 0])
    one = System(level(), on_surface, np.sign(made.I), last_chi=float(made.chi[-1]))
    assert np.abs(one.guess(made.chi, made.parameter) - made.unknowns).max() < 1e-6


@pytest.mark.parametrize("cell", [34, 35])
@pytest.mark.parametrize(
    ("code", "half_turns"),
    [([0, 1, 1], (78, 78, 78)), ([0, 1, 1], (83, 83, 83)), ([1, 1, 1], (81, 82, 77))],
)
def test_chains_in_thin_layers_are_found_from_the_middles_of_cells(
    cell: int, code: list[int], half_turns: tuple[int, ...]
) -> None:
    """Surfaces are split by 6e-9, and Newton's method takes its time before it converges."""
    thin = Body((2, "1.7", "1.85"), (2, 1, 0), "0.01")
    orbits = orbits_of(problem(thin, 3, h0=1))
    level = ChainLevel(orbits.return_map, 1)
    begin = orbits.begin(level)
    cells = np.cumsum([cell, *half_turns])
    phase = math.pi * cell - float(level.arriving(*begin(0.0)[:2]).chi[0])
    chain_through(System(level, begin, signs_of(code)), cells, phase, patient=False)


def test_too_few_half_rotations_end_in_a_fold() -> None:
    cells = np.concatenate(([0], np.cumsum((11, 7, 12, 11, 14))))
    with pytest.raises(NoOrbit, match="The shortest is passage 2:") as refused:
        chain_through(system(), cells, 0.0)
    longer, needed, most = map(float, re.findall(r"\d+\.\d+", str(refused.value)))
    # In the fold |I| is what the passage before and the downward crossing behind it give at most.
    here, before = level(), level().invariant(11 + longer)
    in_fold = needed * here.invariant(longer) / here.invariant(0)
    assert in_fold == pytest.approx(here.downward_splitting + before, rel=0.05)
    assert most == pytest.approx(here.splitting, rel=2e-3)
    with pytest.raises(NoOrbit, match=r"none exists: passage 2 with 5 half rotations needs \|I\|"):
        with_half_turns(system(), 0, 0.0, (11, 5, 12, 11, 14))


def test_a_crossing_makes_passages_possible_by_five_quarters_of_the_splitting() -> None:
    """Beside |I| of the passage before, whose crossings may be a half rotation closer."""
    here: Any = copy.copy(level())
    added = here.invariant(7) - here.invariant(8)
    here.splitting = 1.01 * added / 1.25
    check_possible(here, (9, 6))
    here.splitting = 0.99 * added / 1.25
    with pytest.raises(NoOrbit, match="none exists: passage 2 with 6 half rotations"):
        check_possible(here, (9, 6))


def test_the_reason_that_is_told_is_that_of_the_middle_of_the_last_cell(monkeypatch: Any) -> None:
    def none(*_: Any, end: float) -> Any:
        raise NoOrbit(f"none at {end}")

    monkeypatch.setattr("rigidpend.routes.symbolic.shortest.chain_through", none)
    monkeypatch.setattr("rigidpend.routes.symbolic.shortest.STARTS", 0)
    with pytest.raises(NoOrbit, match=r"^none at 0\.0$"):
        with_half_turns(system(), 0, 0.0, TURNS)


def test_a_chain_that_is_not_found_at_any_length_is_said_not_to_be(monkeypatch: Any) -> None:
    monkeypatch.setattr(System, "solved", Mock(side_effect=NoOrbit("none")))
    with pytest.raises(NoOrbit, match="does not converge even for long passages"):
        chain_through(system(), CELLS, 0.0)


def test_no_length_is_tried_where_doubles_place_no_orbit_on_the_surfaces() -> None:
    """But orbits with a single passage change no side, and are found with a start that is off."""
    tried: list[int] = []

    def each(half_turns: int) -> Any:
        tried.append(half_turns)
        raise NoOrbit("too short")

    flat: Any = copy.copy(level())
    flat.splitting = flat.downward_splitting = 30 * math.ldexp(flat.widest_d, -53) / MOVED * 0.99
    with pytest.raises(NoOrbit, match="nearly symmetric"):
        alike(flat, signs_of([0, 1]), each)
    hess: Any = copy.copy(level())
    hess.downward_splitting = flat.splitting
    with pytest.raises(NoOrbit, match="at the Hess case"):
        alike(hess, signs_of([0, 0]), each)
    assert not tried
    with pytest.raises(NoOrbit, match="too short"):
        alike(flat, signs_of([0]), each)
    assert len(tried) == MORE_HALF_TURNS


def test_newtons_method_fails_for_the_crossings_where_surfaces_are_split_least() -> None:
    """Those between two passages that change sides, here downward ones."""
    hess: Any = copy.copy(level())
    hess.downward_splitting = math.ldexp(hess.widest_d, -53)
    for here, reason in ((level(), "does not converge"), (hess, "at the Hess case or near it")):
        for symbols, told in (([0, 0], reason), ([0, 1], "does not converge")):
            one = System(here, on_surface, signs_of(symbols), 2 * math.pi)
            with pytest.raises(NoOrbit, match=told):
                one.solved(one.guess(math.pi * np.arange(3.0), 0.0))


def test_a_passage_whose_invariant_is_below_all_doubles_is_refused_without_a_warning() -> None:
    """Fig. 4's body takes some 320 half rotations at most."""
    system = System(level(), on_surface, signs_of(np.array([0])))
    assert abs(chain_through(system, np.array([0, 300]), 0.0).I[0]) > 0
    with pytest.raises(NoOrbit, match=r"a passage with 900 half rotations is below all doubles"):
        chain_through(system, np.array([0, 900]), 0.0)


def test_invariants_settle_at_their_roundings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method squares what is left: three sums of the rates, and not all eight."""
    here, sums, rates = level(), [], ChainLevel.rates
    signs, growth = np.array([1, -1, 1]), np.pi * np.array([8.0, 11.0, 25.0])

    def counted(self: ChainLevel, I: Array) -> Any:
        sums.append(I)
        return rates(self, I)

    monkeypatch.setattr(ChainLevel, "rates", counted)
    I, slope = here.invariants(signs, growth)
    assert len(sums) <= 4
    np.testing.assert_array_equal(np.sign(I), signs)
    np.testing.assert_allclose(-np.log(np.abs(I)) / here.rates(I).exponent, growth, rtol=1e-14)
    low, high = (here.invariants(signs, growth + off)[0] for off in (-1e-5, 1e-5))
    np.testing.assert_allclose(slope, (high - low) / 2e-5, rtol=1e-9)
