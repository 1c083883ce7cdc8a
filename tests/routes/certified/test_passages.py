"""Passages: C1 to C5, and what C7 carries along, each up to where both checkers refuse."""

import itertools
import math
import random
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from flint import arb, arb_mat, ctx

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.exact import exact
from rigidpend.orbits.precision import precision
from rigidpend.routes.certified import coverings, passages, sections
from rigidpend.routes.certified.balls import ARB_BITS
from rigidpend.routes.certified.horseshoe import ShiftProblem
from rigidpend.routes.certified.models import INPUT_BITS, Family, on_parts
from rigidpend.routes.certified.proof_data import CLOCK, FamilyStep, Quad
from rigidpend.routes.certified.start_lines import LineStarts, line_pieces
from scripts import check_coverings, check_full_shift, check_passages, check_sections
from scripts.check_certificate import Fails, Interval
from tests.attacks import lot
from tests.routes.certified import offered
from tests.routes.certified.offered import BITS, CALM, Stored, constant, problem, same_limit, step

# ---- C1


def test_C1_points_of_the_section(stored: Stored) -> None:
    """How far the large Q may be off, less than where a point is alone."""
    piece = stored.orbits[0][0]
    same_limit(
        "C1",
        1e-4,
        2.0**-4,
        lambda off: stored.beginning(stored.quads[0], offered.moved(piece, 0, (0, 0, 0), off)),
    )


@pytest.mark.parametrize(("radius", "reason"), [(0.995, ""), (1.005, "C1: no points")])
def test_C1_newtons_iteration_contracts(radius: float, reason: str) -> None:
    """Of one unknown, whose slope is 1 up to a radius."""
    row, slope = constant(1e-6), arb(1, radius)
    offered.agree(
        reason,
        lambda: sections.solution([Family.of(row, BITS)], arb_mat([[slope]]), {}, 2.0**-5),
        lambda: check_sections.solution(
            [offered.series(row, BITS)], [[offered.interval(slope)]], {}, Fraction(1, 32)
        ),
    )


@pytest.mark.parametrize("k", [0, 2, 4, 5])
def test_C1_bounds_are_the_same_for_both(stored: Stored, k: int) -> None:
    """Each component moved, of sets and of lines: with a large J1 slopes are of Qp's size."""
    if k == 5:
        setting, ends = ShiftProblem(offered.BODY, exact(offered.GIVEN["h"]), 14), (1.5, 1.502)
        start: Any = LineStarts(setting, Fraction("0.01")).between(np.array(ends))[0]
        first, *_ = line_pieces(setting, start, ends)
    else:
        start, first = [*stored.quads, stored.line][k], stored.orbits[k][0]
    # Less than the box in which a start is alone.
    off = 1e-9 if k < 4 else 1e-13
    for component in range(6):
        mine, theirs = stored.beginning(start, offered.moved(first, component, (0, 1, 0), off))
        found, wanted = [float(x.upper()) for x in mine()], list(map(float, theirs()))
        assert found == pytest.approx(wanted, rel=1e-3, abs=1e-25)
        assert k < 5 or found[:2] == pytest.approx(wanted[:2], rel=1e-6, abs=0)


@pytest.mark.parametrize("large", [0, 1])
def test_C1_derivatives_are_those_of_the_integrals(stored: Stored, large: int) -> None:
    """Half of a difference over 2 is exact of what is quadratic; the weight has no part in it."""
    numbers, state = stored.numbers, [Fraction(k * k - 7, 8) for k in range(6)]
    weight = numbers.field.mu_r1, numbers.field.mu_r2
    balls = [arb(x.numerator) / x.denominator for x in state]
    with ctx.workprec(INPUT_BITS):
        rows = numbers.slopes(1, balls, weight, large)
        turned = numbers.slopes(1, balls[::-1], weight, large)
        apart = [x - y for x, y in zip(balls, balls[::-1], strict=True)]
        between = numbers.slopes(0, apart, weight, large)
        for column, moved in enumerate((large, 2, 3, 4, 5)):
            ahead, behind = (
                numbers.integrals(
                    [Family.of_fraction(x + side * (k == moved), 3) for k, x in enumerate(state)],
                    weight,
                )
                for side in (1, -1)
            )
            for row, (a, b) in enumerate(zip(ahead, behind, strict=True)):
                off = (a - b).range / 2 - rows[row][column]
                assert off.contains(0)
                assert off.rad() < 1e-40
                assert (rows[row][column] - turned[row][column] - between[row][column]).contains(0)


@pytest.mark.parametrize("k", [-9, 9])
def test_nothing_hangs_on_units(stored: Stored, k: int) -> None:
    """With M 2^k times as large so are C1's bounds about points that are off, and C3's tube."""
    by, other = 2.0**k, Stored(k)
    for j, off in ((0, 1e-3), (2, 1e-3), (4, 1e-13)):
        found: list[list[float]] = []
        for of, size in ((stored, off), (other, by * off)):
            start, (first, *_) = of.every[j]
            piece = offered.moved(first, 1 if j == 2 else 0, (0, 0, 0), size)
            found.append([float(check()[0]) for check in of.beginning(start, piece)])
        assert found[1] == pytest.approx([by * x for x in found[0]], rel=1e-3)
    link, after = other.every[4], other.every[0]
    again = offered.for_script(*link), offered.for_script(*after)
    offered.agree(
        "",
        lambda: coverings.prove_link(other.numbers, link, after),
        lambda: check_coverings.prove_link(other.problem, *again),
    )


def test_the_weight_of_gamma_is_limited_in_any_units() -> None:
    """Of a body of next to no weight, and by both: nothing but the limit tells it."""
    for k in (-9, 0, 9):
        of = Fraction(4) ** k
        given = offered.GIVEN | {
            "mu": str(of / 10**12),
            "h": str(of * Fraction(offered.GIVEN["h"])),
        }
        body = Body(*(given[name] for name in ("A", "r", "mu")))
        mine = sections.Numbers.of(body, exact(given["h"])).growth.weight
        theirs = check_sections.problem_of(given).w
        assert [float(mine), float(theirs.above)] == [2.0 ** (16 - k)] * 2


def test_the_line_of_starts_is_where_theorem_2_says(stored: Stored) -> None:
    """The page has what both checkers prove."""
    line, first = stored.line, stored.orbits[4][0]
    ends = check_sections.phases(problem(), offered.line_of(line), step(first))
    low, high = (Fraction(x, 1 << Interval.digits) for x in (ends.low, ends.high))
    mine = sections.phases(stored.numbers, line, [first])
    assert low < mine[0] < 1.5625 < mine[1] < high
    page = (Path(check_full_shift.__file__).parents[1] / "docs" / "full-shift.md").read_text(
        encoding="utf-8"
    )
    told = f"between {math.floor(low * 10**5) / 1e5} and {math.ceil(high * 10**5) / 1e5} whose"
    assert told in page


@pytest.mark.parametrize("k", [0, 2])
def test_C1_a_set_lies_beside_separatrix_2_or_3(stored: Stored, k: int) -> None:
    """Its symbol would be the other one; of its own are left units of 2^-60, not of 53 bits."""
    own = stored.quads[k], stored.orbits[k][0]
    assert float(stored.beginning(*own)[0]()[0]) < 2.0**-54
    offered.agree("C1: the large Q", *stored.beginning(*mirrored(*own)))


@pytest.mark.parametrize(
    ("J1", "side", "reason"),
    [("0.01", 1, ""), ("0.01", -1, "Qp > 0 > M3"), ("1", 1, "Qp > 0 > M3")],
)
def test_C1_starts_have_Qp_above_and_M3_below_zero(
    stored: Stored, J1: str, side: int, reason: str
) -> None:
    """Not beside the opposite separatrix, nor with a J1 above half of J2; of a short line."""
    starts = LineStarts(ShiftProblem(offered.BODY, exact(offered.GIVEN["h"]), 14), Fraction(J1))
    ends = 1.5 + 1e-9 * np.array([-1.0, 1.0])
    state = np.mean(starts.states(ends, precision(53)), axis=1)
    assert state[0] > 0
    assert bool(state[2] < 0) is (J1 == "0.01")
    state[[0, 5]] *= side
    piece = FamilyStep(BITS, {(0, 0, 0): 1}, [constant(float(x)) for x in state])
    line = starts.between(ends)[0]._replace(half=Fraction(1, 2**50))
    offered.agree(reason, *stored.beginning(line, piece))


def mirrored(quad: Quad, piece: FamilyStep) -> tuple[Quad, FamilyStep]:
    """The same points beside the opposite separatrix, all that changes its sign taken with it."""
    curve = tuple(x if k % 2 else -x for k, x in enumerate(quad.p[0]))
    other = quad._replace(a=-quad.a, b=-quad.b, l0=-quad.l0, p=(curve,))
    terms = [
        {at: -w for at, w in each.items()} if k in (0, 1, 5) else each
        for k, each in enumerate(piece.terms)
    ]
    return other, piece._replace(terms=terms)


# ---- C2 and C3


def by_lot(size: float, *middle: float) -> FamilyStep:
    """A step about a constant state: all that depends on x, u, v and w is drawn, up to squares."""
    chance = random.Random(1)
    powers = [at for at in itertools.product(range(3), repeat=4) if 0 < sum(at) < 3]

    def drawn(constant: float, by: float, bits: int, powers: Any) -> dict[Any, int]:
        terms = {at: round(chance.uniform(-by, by) * 2**bits) for at in powers}
        return terms | {(0, 0, 0, 0): round(constant * 2 ** (bits + 1))}

    terms = [drawn(x, size, BITS, powers) for x in middle]
    half = drawn(0.25, 0.05, CLOCK, [at for at in powers if not at[0]])
    return FamilyStep(BITS, half, terms)


@pytest.mark.parametrize("k", [-9, 0, 9])
def test_C2_and_C3_bounds_are_the_same_for_both(k: int) -> None:
    """Of a large step, and of a small one along M3 = 1.2 + u/10 with what it adds, in all units."""
    small, of = offered.moved(by_lot(1e-6, 0, 0, 1.2, 0, 0, 0), 2, (0, 1, 0, 0), 0.1), Stored(k)
    large = by_lot(0.1, 0.3, 0.2, 1.2, 0.5, 0.4, 0.3)
    for piece in (pieces := offered.in_units(k, of.quads[0], [large, small])[1]):
        states = [Family.of(x, piece.bits) for x in piece.terms]
        mine = passages.defects(of.numbers, states, Family.of(piece.half_length, CLOCK))
        theirs = check_passages.defects(of.problem, step(piece))
        assert [float(x) for x in mine] == pytest.approx(list(map(float, theirs)), rel=1e-6)
    begin = [2.0**k * x for x in (1e-6, 2e-6, 3e-6, 4e-6)]
    [(*_, found)] = passages.followed(of.numbers, pieces[1:], list(map(arb, begin)))
    others = check_passages.carried(of.problem, step(piece), list(map(Fraction, begin)), theirs)
    assert [float(x) for x in found] == pytest.approx(list(map(float, others)), rel=1e-4)


@pytest.mark.parametrize("k", [0, 8])
def test_C2_rounding_makes_the_bounds_of_a_defect_no_smaller_and_hardly_larger(
    stored: Stored, monkeypatch: pytest.MonkeyPatch, k: int
) -> None:
    """Than those of its products without rounding, of the first stored step and of the last."""
    piece, numbers = stored.orbits[0][k], stored.numbers
    bounded = Mock(side_effect=numbers.norms)
    monkeypatch.setattr(sections.Numbers, "norms", lambda _, states: bounded(states))
    states = [Family.of(x, piece.bits) for x in piece.terms]
    half = Family.of(piece.half_length, CLOCK)
    with ctx.workprec(ARB_BITS):
        found = passages.defects(numbers, states, half)
        [rounded] = bounded.call_args[0]
        rates = aligned(states, AlignedCoefficients(*map(half.constant, numbers.field)))
        off = [P.derivative() - half * rate for P, rate in zip(states, rates, strict=True)]
        exactly = numbers.norms(off)
    for mine, without in zip(found[:3], exactly[:3], strict=True):
        assert without <= mine < (1 + 1e-7) * without
    terms, all_terms = (sum(len(x.doubled) for x in each) for each in (rounded, off))
    assert terms < 0.85 * all_terms
    assert all(x.bits == piece.bits + passages.DEFECT_BITS for x in rounded)


def test_C3_a_jump_between_steps_adds_to_the_distance_of_orbits(stored: Stored) -> None:
    """One of Qp, whose size is that in the norm, and none of its derivatives."""
    begin, jump = 2.0**-20, Fraction(3, 2**20)
    states = [Family.of_fraction(x, BITS) for x in (jump, 0, 0, 0, 0, 0)]
    end = [Family.of_fraction(0, BITS) for _ in states]
    found = passages.joined(stored.numbers, states, end, [arb(begin)] * 4)
    for bound, true in zip(found, [4 * begin, *[begin] * 3], strict=True):
        assert arb(true) <= bound < (1 + 1e-9) * arb(true)


@pytest.mark.parametrize(("share", "reason"), [(0.995, "C3"), (1.005, "C2")])
def test_C2_a_step_goes_forward(stored: Stored, share: float, reason: str) -> None:
    """What is allowed is that of another orbit, and so the tube fails next."""
    piece = stored.orbits[0][0]
    bent = piece._replace(
        half_length={**piece.half_length, (0, 1, 0): int(share * piece.half_length[0, 0, 0])}
    )
    offered.agree(reason, *stored.of(stored.quads[0], [bent]))


def tubes(stored: Stored, M3: float, begin: float, bits: int) -> list[Callable[[], Any]]:
    """The tube about a constant M3, by both."""
    steep: dict[Any, int] = {(0, 0, 0): round(M3 * 2 ** (bits + 1))}
    half: dict[Any, int] = {(0, 0, 0): 3 * 2 ** (CLOCK - stored.k)}
    piece = FamilyStep(bits, half, [CALM, CALM, steep, CALM, CALM, CALM])
    sizes = [abs(x).upper() for x in on_parts(Family.of(steep, bits), passages.PARTS)]
    of = sizes, Family.of(half, CLOCK).bound, arb(begin), stored.numbers
    theirs = stored.problem, step(piece), Fraction(begin), Fraction(1), "C3", check_passages.WIDEST
    return [lambda: passages.tube(*of), lambda: check_passages.tube(*theirs)]


@pytest.mark.parametrize("k", [-9, 0, 9])
def test_C3_the_widest_tube(k: int) -> None:
    """It is as wide in other units, where M3, distances and rates are 2^k times as large."""
    by, of = 2.0**k, Stored(k)
    limit = same_limit("C3", 1e-9, 1e-3, lambda begin: tubes(of, by * 1.2, by * begin, BITS))
    mine, theirs = (
        [float(x) for x in check()] for check in tubes(of, by * 1.2, by * limit / 2, BITS)
    )
    assert mine == pytest.approx(theirs, rel=1e-6)


@pytest.mark.parametrize("M3", [2.0**12, 2.0**60])
def test_C3_a_bound_without_end_is_refused_in_no_time(stored: Stored, M3: float) -> None:
    """exp(thousands) is no double, and exp(2^60) is no number of this world."""
    offered.agree("C3", *tubes(stored, M3, 1e-9, 1))


def test_C3_a_step_begins_where_the_one_before_ends(stored: Stored) -> None:
    """Not beside it, as where one is left out."""
    offered.agree("C3", *stored.of(stored.quads[0], stored.orbits[0][:4:2]))


# ---- C4


def test_C4_the_sign_of_M3_beside_its_bound(stored: Stored) -> None:
    """Nothing else tells a part: Qp is half of what it may be off, and M3 may rise or fall."""
    bound = 1e-4

    def both(M3: float) -> list[Callable[[], Any]]:
        terms = [constant(bound / 2), CALM, constant(M3), CALM, CALM, CALM]
        piece = FamilyStep(BITS, {(0, 0, 0): 2}, terms)
        states = [Family.of(each, BITS) for each in terms]
        return [
            lambda: list(passages.signs_on_parts(stored.numbers, states, arb(bound), "C4", [1])),
            lambda: list(check_passages.signs(problem(), step(piece), Fraction(bound), 1)),
        ]

    same_limit("C4", 10 * bound, bound / 10, both)


LEAVES, ON_A_LINE = [1, 0, -1], [0, -1]


@pytest.mark.parametrize(
    ("signs", "order", "good"),
    [
        ([1, 0, 0, -1], LEAVES, True),
        ([1, 1, 0, -1, -1], LEAVES, True),
        *((x, LEAVES, False) for x in ([0, 0, -1], [1, 0, 0], [1, -1], [1, 0, -1, 0, -1], [])),
        ([-1, 0, 1], LEAVES, False),
        ([0, 0, -1], ON_A_LINE, True),
        *((x, ON_A_LINE, False) for x in ([1, 0, -1], [-1], [0])),
    ],
)
def test_C4_M3_leaves_zero_and_returns_once(
    stored: Stored, monkeypatch: pytest.MonkeyPatch, signs: list[int], order: Any, good: bool
) -> None:
    """By both; the second checker asks it where it follows orbits."""
    assert (offered.said(passages.check_signs, signs, order) == "") is good
    others = {"line_beginning": [], "beginning": ([], []), "carried": [Fraction(0)], "defects": []}
    for name, found in {**others, "signs": signs}.items():
        monkeypatch.setattr(check_passages, name, Mock(return_value=found))
    monkeypatch.setattr(check_passages, "crossing", Mock(side_effect=Fails("C5")))
    of = offered.quad_of(stored.quads[0]) if order is LEAVES else offered.line_of(stored.line)
    said = offered.said(check_passages.arrival, problem(), of, [step(stored.orbits[0][0])])
    assert said[:2] == ("C5" if good else "C4")


# ---- C5


def crossing(
    stored: Stored, end: list[dict[Any, int]], bounds: list[float], side: int = 1
) -> list[Callable[[], Any]]:
    """C5 by both, of ends of steps as terms and bounds on their distance, in any units."""
    end = [
        {at: w if j > 2 else round(w * 2.0**stored.k) for at, w in each.items()}
        for j, each in enumerate(end)
    ]
    states, theirs = [Family.of(x, BITS) for x in end], [offered.series(x, BITS) for x in end]
    bounds = [2.0**stored.k * x for x in bounds]
    balls, exactly = list(map(arb, bounds)), list(map(Fraction, bounds))
    own: Any = stored.numbers, states, balls, side, [], arb(0)
    return [
        lambda: passages.crossing(*own),
        lambda: check_passages.crossing(stored.problem, theirs, exactly, side),
    ]


SINE = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("words", "good", "bad", "end"),
    [
        # The large Q beside the radius of its box; M3 is driven by the weight's torque alone.
        ("C5: the side", 1e-7, 1e-10, lambda Q: (0.0, Q, 0.0, -SINE, SINE, 0.0)),
        # The weight's torque, which gives M3 its rate, beside what it may be off.
        ("C5: M3", 1.0, 1e-9, lambda g: (0.0, 1e-8, 0.0, -g, g, 0.0)),
    ],
)
def test_C5_the_side_and_the_rate_are_told(
    stored: Stored, words: str, good: float, bad: float, end: Callable[[float], Any]
) -> None:
    same_limit(words, good, bad, lambda x: crossing(stored, [*map(constant, end(x))], [1e-9] * 4))


def across(found: Any) -> list[Any]:
    """Coordinates d and g of crossings and the derivatives of d and of g."""
    return [found.d, found.g, *(row[j] for j in (0, 1) for row in found.slopes)]


@pytest.mark.parametrize("k", [-9, 0, 9])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("Q", "off"), [(0.25, 1e-4), (-0.25, 1e-4), (0.25, 1e-8)])
def test_C5_and_C7_crossings_are_the_same_for_both(Q: float, off: float, side: int, k: int) -> None:
    """Of an end in which all counts; slopes are off by more than their size, or by far less."""
    small = 0.01
    large = (small, Q) if side > 0 else (Q, small)
    # M3 is so far from zero that derivatives change on the way.
    end = by_lot(1e-5, *large, side * 5e-5, -side * SINE, side * SINE, 0.1)
    ends = [{at: w for at, w in each.items() if not at[0]} for each in end.terms]
    bounds = [1e-7, off, 2 * off, 3 * off]
    mine, theirs = (check() for check in crossing(Stored(k), ends, bounds, side))
    assert mine.right == bool(theirs.symbol)
    assert mine.late == pytest.approx(float(theirs.time.above), rel=1e-3)
    # The crossing may come before the end of the last step, or after it.
    assert np.diff(mine.duration) == pytest.approx(2 * mine.late, rel=1e-6, abs=0)
    for one, other in zip(mine.box, theirs.box, strict=True):
        assert float(one.mid()) == pytest.approx((other.low + other.high) / 2 / 2**Interval.digits)
    for family, row in zip(across(mine), across(theirs), strict=True):
        assert family.error / 2**family.bits == pytest.approx(row.error / 2**row.digits, rel=1e-3)
        assert float(family.bound) == pytest.approx(float(row.most), rel=1e-3)
        assert offered.value(family, 0.3, 0.2, 0.1) * float(row.ball().low + row.ball().high) >= 0


# ---- C6 along a line of starts


def test_C6_energies_along_a_line_are_the_same_for_both() -> None:
    """w and its derivatives are off where gamma is, up to energies of which nothing is known."""

    def both(spread: float) -> list[Callable[[], Any]]:
        wide, piece = Fraction(spread), by_lot(0.01, 0, 0, 0, 0.5, 0.4, 0.3)
        numbers = sections.Numbers.of(offered.BODY, offered.H0, wide, offered.H0)
        given = {name: x for name, x in offered.GIVEN.items() if name != "h"} | {"h0": "1.3342"}
        p, held = check_sections.problem_of(given | {"spread": wide}), numbers.h0
        assert held is not None
        assert p.h0 is not None
        own, other = (held, piece), (p.h0, step(piece))
        bounds = [1e-3, 2e-3, 3e-3, 4e-3]
        return [
            lambda: passages.energies_along(numbers, *own, list(map(arb, bounds))),
            lambda: check_passages.energies_along(p, *other, list(map(Fraction, bounds))),
        ]

    limit = same_limit("C6", 1.0, 1e-6, both)
    (w, slopes), (other, others) = (check() for check in both(2 * limit))
    for mine, theirs in zip((w, *slopes), (other, *others), strict=True):
        assert float(mine.bound) == pytest.approx(float(theirs.most), rel=1e-9)


def test_orbits_in_106_bits_do_what_the_relations_say(stored: Stored) -> None:
    """From random points of each set: crossings and their derivatives are where bounds say."""
    of = zip(stored.quads, stored.orbits, stored.arrivals, strict=False)
    for k, (quad, pieces, arrival) in enumerate(of):
        with lot.drawn(f"orbits of a full shift, set {k}") as chance:
            u, v = chance.uniform(-1, 1), chance.uniform(-1, 1)
        # The point, and two beside it in each direction: it is cubic terms that differences lack.
        beside, step_by = np.array([0.0, 1.0, -1.0, 0.0, 0.0]), 2.0**-20
        begin = offered.points(quad, u + step_by * beside, v + step_by * np.roll(beside, 2))
        states, late = offered.crossings(begin, offered.duration(pieces, u, v))
        end = states[:, 0].astype(float)
        large, small = (1, 0) if quad.rising else (0, 1)
        sign = 1 if end[large] > 0 else -1
        assert ((sign > 0) is quad.rising) is arrival.right
        assert abs(late[0]) < arrival.late
        by_u, by_v, _ = arrival.slopes
        for j, family, *slopes in zip(
            (small, 5), (arrival.d, arrival.g), by_u[:2], by_v[:2], strict=True
        ):
            values = sign * states[j]
            assert (
                abs(float(values[0]) - offered.value(family, u, v)) < family.error / 2**family.bits
            )
            for found, slope in zip((values[1::2] - values[2::2])[:2], slopes, strict=True):
                off = float(found) / (2 * step_by) - offered.value(slope, u, v)
                assert abs(off) < slope.error / 2**slope.bits
