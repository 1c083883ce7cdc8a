"""Covering relations: each hypothesis barely true and barely false, for both checkers.

Where a limit lies is computed here, in doubles, from docs/full-shift.md.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import Mock

import h5py
import numpy as np
import pytest
from flint import arb

from rigidpend.experiments.full_shift import compute as full_shift
from rigidpend.experiments.full_shift.schema import Config
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.routes.certified import connections, coverings
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.families import Family
from rigidpend.routes.certified.growth import LogarithmicNorm
from rigidpend.routes.certified.pieces import (
    CLOCK,
    FamilyStep,
    Quad,
    StartLine,
    made,
    packed,
    unpacked,
    unpacked_line,
    unpacked_quads,
)
from scripts import check_full_shift as script
from scripts.check_certificate import Fails, Interval, Refused
from tests.attacks import lot
from tests.cli.calls import REFERENCE
from tests.config.samples import content as typed
from tests.experiments.trees import reference

GIVEN: Any = {"A": ("2", "1", "3/2"), "r": ("1", "1", "0"), "mu": "1/1000", "h": "1.3342"}
J1 = Fraction("1e-8")
CONFIG = Path(__file__).parents[3] / "configs" / "full_shift.yaml"
BODY = Body(A=GIVEN["A"], r=GIVEN["r"], mu=GIVEN["mu"])
BARELY = 0.005
ALONE, WIDEST = 2.0**-5, 2.0**-12
AT_ORBITS = Fraction(1), "C3", script.WIDEST
BITS = 60
CALM: dict[Any, int] = {(0, 0, 0): 0}
"""Terms of a component that is zero."""
SETS = [("upward", 0), ("upward", 1), ("downward", 0), ("downward", 1)]


@pytest.fixture(scope="module")
def data() -> Any:
    return reference("full_shift")["data"]


@pytest.fixture(scope="module")
def quads(data: Any) -> list[Quad]:
    return unpacked_quads(data["sets"])


@pytest.fixture(scope="module")
def orbits(data: Any) -> list[list[FamilyStep]]:
    return unpacked(data["proof"], 5)


@pytest.fixture(scope="module")
def numbers() -> coverings.Numbers:
    return coverings.Numbers.of(BODY, exact(GIVEN["h"]))


@pytest.fixture(autouse=True)
def digits() -> None:
    Interval.digits = script.DIGITS


def problem() -> script.Problem:
    return script.problem_of(GIVEN)


def series(terms: Mapping[Any, int], bits: int) -> script.Series:
    """Terms as the second checker reads them."""
    found = {at: w * (1 if at[0] == 0 else 2) for at, w in terms.items()}
    return script.Series.made(found, bits + 1)


def step(piece: FamilyStep) -> script.Step:
    states = [series(terms, piece.bits) for terms in piece.terms]
    return script.Step(series(piece.half, script.CLOCK), states)


def quad_of(quad: Quad) -> script.Quad:
    return script.Quad(*quad[:5], list(quad.p), [list(p) for p in quad.moves])


def line_of() -> script.Line:
    """A line that nobody asks for."""
    return script.Line(J1, *(Fraction(1),) * 4)


def constant(x: float) -> dict[Any, int]:
    return {(0, 0, 0): 2 * round(x * 2**BITS)}


def said(check: Callable[..., Any], *arguments: Any) -> str:
    """The reason for which something is not shown; empty where it is."""
    try:
        check(*arguments)
    except (Undecided, Fails) as doubt:
        return str(doubt)
    return ""


def moved(piece: FamilyStep, component: int, at: Any, by: float) -> FamilyStep:
    """A step of which a coefficient is off."""
    terms = [dict(each) for each in piece.terms]
    terms[component][at] = terms[component].get(at, 0) + round(by * 2**piece.bits)
    return piece._replace(terms=terms)


# ---- C1


def limit_of_beginning(quad: Quad, piece: FamilyStep) -> float:
    """How far the large Q may be off at u = v = 0: |C G| = (1 - theta)/32, in doubles."""
    y = [float(Family.of(t, piece.bits).at("z", -1).range.mid()) for t in piece.terms]
    (Q, d, _, g1, g2, g3), c = y, coverings.Numbers.of(BODY, exact(GIVEN["h"]))
    m1, m2, kappa = float(c.to_M1.mid()), float(c.to_M2.mid()), float(c.field.kappa.mid())
    r1, r2, h = float(c.field.mu_r1.mid()), float(c.field.mu_r2.mid()), float(c.h.mid())

    def at(Q: float) -> tuple[Any, Any]:
        M1, M2 = (Q + d) * m1, (Q - d) * m2
        G = [M1 * g1 + M2 * g2, g1**2 + g2**2 + g3**2 - 1]
        G.append(kappa / 2 * (M1**2 + M2**2) - Q * d / 2 + r1 * g1 + r2 * g2 - h)
        J = [[g1 * m1 + g2 * m2, M1, M2], [0, 2 * g1, 2 * g2]]
        return np.array(G), np.array([*J, [kappa * (M1 * m1 + M2 * m2) - d / 2, r1, r2]])

    # By how much each derivative changes within the box.
    wide = ALONE * np.array([[m1 + m2, m1, m2], [0, 2, 2], [kappa * (m1 * m1 + m2 * m2), 0, 0]])
    low, high = 0.0, ALONE
    for _ in range(50):
        off = (low + high) / 2
        G, J = at(Q + off)
        C = np.linalg.inv(J)
        theta = (np.abs(C) @ wide).sum(axis=1).max()
        low, high = (off, high) if np.abs(C @ G).max() < (1 - theta) * ALONE else (low, off)
    return low


@pytest.mark.parametrize(("factor", "reason"), [(1 - BARELY, ""), (1 + BARELY, "C1")])
def test_C1_points_of_the_section(
    quads: Any, orbits: Any, numbers: Any, factor: float, reason: str
) -> None:
    quad, piece = quads[0], orbits[0][0]
    limit = limit_of_beginning(quad, piece)
    assert 0 < limit < ALONE
    # Twice, for a coefficient of T_0 counts half.
    off = moved(piece, 0, (0, 0, 0), 2 * factor * limit)
    growth = LogarithmicNorm.of(numbers.field)
    mine = said(coverings.beginning, numbers, quad, off, growth)
    theirs = said(script.beginning, problem(), quad_of(quad), step(off))
    assert mine[:2] == theirs[:2] == reason


@pytest.fixture(scope="module")
def line(data: Any) -> StartLine:
    return unpacked_line(J1, data["line"])


@pytest.mark.parametrize(
    ("name", "by", "allowed"), [("J1", 1e-12, 1e-6), ("centre", 1e-9, 2e-9), ("half", 1e-9, 2e-9)]
)
def test_C1_a_line_is_as_far_as_it_is_moved(
    line: Any, orbits: Any, numbers: Any, name: str, by: float, allowed: float
) -> None:
    """J1 goes like the square of Qp = 2e-4: 1e-12 of it is 1e-8 of Qp; the others are gamma's."""
    growth, off = LogarithmicNorm.of(numbers.field), getattr(line, name) + Fraction(by)
    other = line._replace(**{name: off})
    for bound in (
        float(coverings.line_beginning(numbers, other, orbits[4][0], growth)[1][0].upper()),
        float(script.line_beginning(problem(), script.Line(*other), step(orbits[4][0]))[0]),
    ):
        assert by / 10 < bound < allowed
    far = line._replace(J1=line.J1 * 2)
    reasons = (
        said(coverings.line_beginning, numbers, far, orbits[4][0], growth),
        said(script.line_beginning, problem(), script.Line(*far), step(orbits[4][0])),
    )
    assert {reason[:2] for reason in reasons} == {"C1"}


@pytest.mark.parametrize("k", range(5))
def test_C1_bounds_are_the_same_for_both(
    quads: Any, line: Any, orbits: Any, numbers: Any, k: int
) -> None:
    """Of solutions and their derivatives, each component of the start moved in turn."""
    growth, p = LogarithmicNorm.of(numbers.field), problem()
    for component in (0, 4):
        off = moved(orbits[k][0], component, (0, 1, 0), 1e-9)
        if k == 4:
            mine = coverings.line_beginning(numbers, line, off, growth)[1]
            theirs = script.line_beginning(p, script.Line(*line), step(off))
        else:
            mine = coverings.beginning(numbers, quads[k], off, growth)[1]
            theirs = script.beginning(p, quad_of(quads[k]), step(off))[1]
        told = [float(x.upper()) for x in mine]
        assert told == pytest.approx([float(x) for x in theirs], rel=1e-3)


def test_the_line_of_starts_is_where_theorem_2_says(line: Any, orbits: Any) -> None:
    """Its ends lie within the box of C1 about those of theta2_0 = 1.5625 -+ 0.006 or less."""
    from rigidpend.orbits.return_map.precision import precision
    from rigidpend.routes.certified.horseshoe import LineStarts, ShiftProblem

    starts = LineStarts(ShiftProblem(BODY, exact(GIVEN["h"]), 14), J1)
    theta2 = 1.5625 + np.array([-0.006, 0.0, 0.006])
    gamma = starts.states(theta2, precision(53))[3:]
    along = (float(line.e1) * gamma[0] + float(line.e2) * gamma[1] - float(line.centre)) / float(
        line.half
    )
    # So |u| <= 1 is passed between these two, and gamma is that of the polynomials, not of
    # the other theta2_0 at the same place.
    assert along[0] < -1
    assert along[2] > 1
    begin = [Family.of(t, orbits[4][0].bits).at("z", -1) for t in orbits[4][0].terms[3:]]
    found = [_value(dict(_terms(each)), each.bits, along[1], 0.0) for each in begin]
    np.testing.assert_allclose(found, gamma[:, 1], atol=2.0**-20)


@pytest.mark.parametrize("at", [(0, 0, 0), (0, 1, 0), (0, 0, 3)])
def test_a_beginning_is_as_far_as_it_is_moved(
    quads: Any, orbits: Any, numbers: Any, at: Any
) -> None:
    """The distance, and those of the derivatives, by which that of v^3 is three times as large."""
    quad, piece, growth = quads[2], orbits[2][0], LogarithmicNorm.of(numbers.field)
    off = moved(piece, 4, at, 2e-6)
    far = 1e-6 / float(growth.weight.mid())
    mine = coverings.beginning(numbers, quad, off, growth)[1]
    theirs = script.beginning(problem(), quad_of(quad), step(off))[1]
    for bounds in ([float(x.upper()) for x in mine], [float(x) for x in theirs]):
        for bound, times in zip(bounds, (1, at[1], at[2], 0), strict=True):
            # What is off also turns the matrix by which derivatives follow.
            assert times * far <= bound < 4e-6 * max(times, 0.1)


@pytest.mark.parametrize("k", [0, 2])
def test_C1_is_not_rounded_to_doubles(quads: Any, orbits: Any, numbers: Any, k: int) -> None:
    """What is left are units of 2^-60, a few dozen: a constant of 53 bits alone would be 1e-16."""
    growth = LogarithmicNorm.of(numbers.field)
    assert coverings.beginning(numbers, quads[k], orbits[k][0], growth)[1][0] < 2.0**-54


def mirrored(quad: Quad, piece: FamilyStep) -> tuple[Quad, FamilyStep]:
    """The same points beside the opposite separatrix, all that changes its sign taken with it."""
    curve = tuple(x if k % 2 else -x for k, x in enumerate(quad.p))
    other = quad._replace(a=-quad.a, b=-quad.b, l0=-quad.l0, p=curve)
    terms = [
        {at: -w for at, w in each.items()} if k in (0, 1, 5) else each
        for k, each in enumerate(piece.terms)
    ]
    return other, piece._replace(terms=terms)


@pytest.mark.parametrize("k", [0, 2])
def test_C1_a_set_lies_beside_separatrix_2_or_3(
    quads: Any, orbits: Any, numbers: Any, k: int
) -> None:
    """Beside the opposite one its symbol would be the other one."""
    quad, piece = mirrored(quads[k], orbits[k][0])
    growth = LogarithmicNorm.of(numbers.field)
    for reason in (
        said(coverings.beginning, numbers, quad, piece, growth),
        said(script.beginning, problem(), quad_of(quad), step(piece)),
    ):
        assert reason.startswith("C1: the large Q")


# ---- C2


@pytest.mark.parametrize(("share", "reason"), [(1 - BARELY, "C3"), (1 + BARELY, "C2")])
def test_C2_a_step_goes_forward(
    quads: Any, orbits: Any, numbers: Any, share: float, reason: str
) -> None:
    piece = orbits[0][0]
    middle = piece.half[0, 0, 0]
    bent = piece._replace(half={**piece.half, (0, 1, 0): int(share * middle)})
    # What is allowed is that of another orbit, and so the tube fails next.
    assert said(coverings.arrival, numbers, quads[0], [bent])[:2] == reason
    assert said(script.arrival, problem(), quad_of(quads[0]), [step(bent)])[:2] == reason


def test_C2_defects_are_the_same_for_both(orbits: Any, numbers: Any) -> None:
    """The steps' own, and one of which a coefficient is off by a known amount."""
    growth, p = LogarithmicNorm.of(numbers.field), problem()
    for piece in (orbits[0][6], moved(orbits[0][6], 2, (3, 2, 0), 1e-9)):
        states = [Family.of(terms, piece.bits) for terms in piece.terms]
        half = Family.of(piece.half, CLOCK)
        mine = [float(x.upper()) for x in coverings.defects(numbers, states, half, growth)]
        other = step(piece)
        theirs = script.defects(p, other)
        assert mine == pytest.approx([float(x) for x in theirs], rel=1e-6)
    # M3 = 1e-9 u^2 T_3, and T_3' = 9 at the ends; it drives the others besides.
    least = 9e-9 * float(growth.upright.mid())
    assert mine[0] > least
    assert mine[1] > 2 * least
    assert mine[2] < least


# ---- C3


def rates_of(growth: LogarithmicNorm, M3: float, radius: float) -> float:
    """The lemma's rate at an orbit so near, in doubles."""
    saddle, upright, w, F, Omega = (float(x.mid()) for x in growth)
    steep = saddle * (M3 + radius / upright)
    coupling = w * F + (1 + w * radius) * Omega / w
    return (steep + math.hypot(steep, coupling)) / 2


@pytest.mark.parametrize(("factor", "reason"), [(1 - BARELY, ""), (1 + BARELY, "C3")])
def test_C3_the_widest_tube(numbers: Any, factor: float, reason: str) -> None:
    """At a constant M3 the bound grows by exp(rate times length)."""
    M3, half = 1.2, 1.5
    growth = LogarithmicNorm.of(numbers.field)
    limit = WIDEST * math.exp(-rates_of(growth, M3, WIDEST) * 2 * half)
    begin = factor * limit
    piece = FamilyStep(
        BITS,
        {(0, 0, 0): int(half * 2 ** (CLOCK + 1))},
        [CALM, CALM, constant(M3), CALM, CALM, CALM],
    )
    states = [Family.of(terms, BITS) for terms in piece.terms]
    length = Family.of(piece.half, CLOCK)
    mine = said(coverings.tube, states[2], length, arb(begin), growth, 1, ("C3", WIDEST))
    theirs = said(script.tube, problem(), step(piece), Fraction(begin), *AT_ORBITS)
    assert mine[:2] == theirs[:2] == reason


def test_C3_derivatives_are_carried_as_the_page_says(numbers: Any) -> None:
    """By its formula in doubles: M3 is constant, Qm = u/8 and the length changes with v."""
    growth = LogarithmicNorm.of(numbers.field)
    M3, half, changed, begin = 1.2, 1.0, 0.25, [1e-6, 2e-6, 3e-6, 4e-6]
    terms = [CALM, {(0, 1, 0): 2**BITS // 4}, constant(M3), CALM, CALM, CALM]
    length: dict[Any, int] = {
        (0, 0, 0): int(half * 2 ** (CLOCK + 1)),
        (0, 0, 1): int(changed * 2 ** (CLOCK + 1)),
    }
    piece = FamilyStep(BITS, length, terms)
    states, family = [Family.of(each, BITS) for each in terms], Family.of(length, CLOCK)
    mine = coverings._carried(states, family, list(map(arb, begin)), [arb(0)] * 4, growth)
    theirs = script.carried(problem(), step(piece), list(map(Fraction, begin)), [Fraction(0)] * 4)
    _, upright, w, F, Omega = (float(x.mid()) for x in growth)
    size = math.hypot(0.125, upright * M3)
    factor = math.exp(rates_of(growth, M3, 4e-6) * 2 * (half + changed))
    beta = math.hypot(1, Omega)
    added = [
        0,
        2 * beta * (half + changed) * 0.125,
        2 * (beta * (size + WIDEST) + w * F) * changed,
        0,
    ]
    expected = [factor * (x + more * begin[0]) for x, more in zip(begin, added, strict=True)]
    # The tube's radius, which is assumed, is a few bounds.
    assert [float(x.upper()) for x in mine] == pytest.approx(expected, rel=1e-4)
    assert [float(x) for x in theirs] == pytest.approx(expected, rel=1e-4)


def test_C3_a_bound_without_end_is_refused_in_no_time(numbers: Any) -> None:
    """exp(thousands) is no double, and exp(2^60) is no number of this world."""
    growth = LogarithmicNorm.of(numbers.field)
    for M3 in (2.0**12, 2.0**60):
        steep: dict[Any, int] = {(0, 0, 0): round(M3 * 2)}
        piece = FamilyStep(1, {(0, 0, 0): 3 << CLOCK}, [CALM, CALM, steep, CALM, CALM, CALM])
        states = [Family.of(terms, 1) for terms in piece.terms]
        length = Family.of(piece.half, CLOCK)
        mine = said(coverings.tube, states[2], length, arb(1e-9), growth, 1, ("C3", WIDEST))
        theirs = said(script.tube, problem(), step(piece), Fraction(1e-9), *AT_ORBITS)
        assert mine[:2] == theirs[:2] == "C3"


# ---- C4


@pytest.mark.parametrize(("factor", "reason"), [(1 + BARELY, ""), (1 - BARELY, "C4")])
def test_C4_the_sign_of_M3_beside_its_bound(numbers: Any, factor: float, reason: str) -> None:
    """Nothing else tells a part, for all else is zero, and so is the rate of M3."""
    growth, bound = LogarithmicNorm.of(numbers.field), 1e-4
    M3 = constant(factor * bound / float(growth.upright.mid()))
    piece = FamilyStep(BITS, {(0, 0, 0): 2}, [CALM, CALM, M3, CALM, CALM, CALM])
    states = [Family.of(terms, BITS) for terms in piece.terms]
    mine = said(coverings._signs, numbers, states, arb(bound), growth, 1)
    theirs = said(lambda: list(script.signs(problem(), step(piece), Fraction(bound), 1)))
    assert mine[:2] == theirs[:2] == reason


@pytest.mark.parametrize(
    ("signs", "good"),
    [
        ([1, 0, 0, -1], True),
        ([1, 1, 0, -1, -1], True),
        ([0, 0, -1], False),
        ([1, 0, 0], False),
        ([1, -1], False),
        ([1, 0, -1, 0, -1], False),
        ([-1, 0, 1], False),
        ([], False),
    ],
)
def test_C4_M3_leaves_zero_and_returns_once(signs: list[int], good: bool) -> None:
    assert (said(coverings._check_signs, signs, [1, 0, -1]) == "") is good


@pytest.mark.parametrize(
    ("signs", "good"), [([0, 0, -1], True), ([1, 0, -1], False), ([-1], False), ([0], False)]
)
def test_C4_on_a_line_M3_only_returns(signs: list[int], good: bool) -> None:
    assert (said(coverings._check_signs, signs, [0, -1]) == "") is good


# ---- C5


@pytest.mark.parametrize(("factor", "reason"), [(1 + BARELY, ""), (1 - BARELY, "C5")])
def test_C5_the_side_on_which_an_orbit_leaves(numbers: Any, factor: float, reason: str) -> None:
    """The large Q beside the radius of its box; M3 is driven by the weight's torque alone."""
    growth, bound = LogarithmicNorm.of(numbers.field), 1e-9
    Q = factor * radius_of_crossing(growth, bound)
    values = [0.0, Q, 0.0, -math.sqrt(0.5), math.sqrt(0.5), 0.0]
    end = [Family.of(constant(x), BITS) for x in values]
    mine = said(coverings._crossing, numbers, end, [arb(bound)] * 4, growth, 1, [], arb(0))
    states = [series(constant(x), BITS) for x in values]
    theirs = said(_crossed_by_script, states, bound)
    assert mine[:2] == theirs[:2] == reason


def radius_of_crossing(growth: LogarithmicNorm, bound: float) -> float:
    """The radius of the box by its definition in doubles, where only the torque mu = 1e-3 counts.

    M3 is at most its bound m, and falls at the rate mu: so m/mu has to pass, in which a component
    changes by m, for all rates are less. That is the box that is first assumed, less than which
    none is: m and the bound on M3 itself, which are the same, beyond the bound on Q.
    """
    m = bound / float(growth.upright.mid())
    return bound + 2 * m


def _crossed_by_script(states: list[script.Series], bound: float) -> None:
    """C5 of the second checker alone."""
    script.crossing(problem(), states, [Fraction(bound)] * 4, 1, [])


# ---- C6


def image(ends: float, across: float, quad: Quad) -> tuple[dict[Any, int], dict[Any, int]]:
    """d and g of an image that lies across a set: U = ends u, V = across v, on a straight set."""
    a, b, l0, l1 = (float(x) for x in (quad.a, quad.b, quad.l0, quad.l1))
    g = {(0, 1, 0): 2 * a * ends / l1, (0, 0, 1): -2 * b * across / l1, (0, 0, 0): -2 * l0 / l1}
    d = {(0, 1, 0): 2 * a * ends}
    return tuple({at: round(x * 2**BITS) for at, x in each.items()} for each in (d, g))  # type: ignore[return-value]


def reached(d: Any, g: Any, box: Any, begin: Any) -> coverings.Reached:
    at, up = Family.of(d, BITS), Family.of(g, BITS)
    slopes = [[each.partial(name) for name in "uvw"] for each in (at, up)]
    return coverings.Reached(at, up, True, box, 0.0, 0.0, (1.0, 1.0), begin, slopes)


STRAIGHT = made(True, (0.25, 0.5, 0.125, -0.5), (0.0,))


@pytest.mark.parametrize(
    ("ends", "across", "sheet", "reason"),
    [
        (1 + BARELY, 1 - BARELY, 1 - BARELY, ""),
        (-1 - BARELY, 1 - BARELY, 1 - BARELY, ""),
        (1 - BARELY, 1 - BARELY, 1 - BARELY, "C6: an edge"),
        (1 + BARELY, 1 + BARELY, 1 - BARELY, "C6: the image"),
        (1 + BARELY, 1 - BARELY, 1 + BARELY, "C6: the crossings"),
    ],
)
def test_C6_an_image_lies_across_a_set(
    ends: float, across: float, sheet: float, reason: str
) -> None:
    d, g = image(ends, across, STRAIGHT)
    far = sheet * ALONE
    box, begin = (arb(1 + far), arb(0.5), arb(0.5)), [arb(1), arb(0.5), arb(0.5)]
    source = reached(d, g, box, begin)
    mine = said(coverings.relation, source, STRAIGHT, begin, 0)
    there = [Interval.of(Fraction(float(x.mid()))) for x in box]
    other = script.Arrival(series(d, BITS), series(g, BITS), 1, there, [], Interval.of(0), [])
    at = [Interval.of(Fraction(float(x.mid()))) for x in begin]
    theirs = said(script.check_relation, other, quad_of(STRAIGHT), at)
    assert mine.startswith(reason)
    assert theirs.startswith(reason)
    assert bool(mine) is bool(theirs) is bool(reason)
    if not reason:
        found = coverings.relation(source, STRAIGHT, begin, 0)
        assert found.orientation == math.copysign(1, ends)
        np.testing.assert_allclose((found.edge, found.across), (abs(ends), across), rtol=1e-12)


# ---- C7


@pytest.mark.parametrize(
    ("cone", "reason"),
    [
        ((1.01 + 0.5, 0.5, 0.5, 0.49), ""),
        ((-1.01 - 0.5, 0.5, -0.5, -0.49), ""),
        ((0.99 + 0.5, 0.5, 0.5, 0.49), "C7"),
        ((-0.99 - 0.5, 0.5, 0.5, 0.49), "C7"),
        ((1.01 + 0.5, -0.53, 0.5, 0.49), "C7"),
        ((1.01 + 0.5, 0.5, 0.5, 0.51), "C7"),
        ((1.01 + 0.5, 0.5, 0.5, -0.51), "C7"),
    ],
)
@pytest.mark.parametrize("curve", [(0.0,), (0.0, 0.25, -2.0)])
def test_C7_differences_grow_along_u_or_shrink_along_v(
    cone: tuple[float, ...], reason: str, curve: tuple[float, ...]
) -> None:
    """U = U_u u + U_v v and V alike at the middle of the set, and nearly so on all of it."""
    quad = made(True, (2.0**-10, 2.0**-9, 0.0, -0.5), curve)
    a, b, _, l1 = (float(x) for x in quad[1:5])
    by_u, by_v, along_u, along_v = cone
    g = {
        (0, 1, 0): 2 * (a * by_u - b * along_u) / l1,
        (0, 0, 1): 2 * (a * by_v - b * along_v) / l1,
    }
    # d = p(g) + a U, whole in u and v.
    bent = {(0, 1, 0): 2 * a * by_u, (0, 0, 1): 2 * a * by_v}
    unit = {name: Family.of(whole(each), BITS) for name, each in (("g", g), ("aU", bent))}
    d = coverings.curve(quad.p, unit["g"]) + unit["aU"]
    slopes = [[each.partial(name) for name in "uvw"] for each in (d, unit["g"])]
    box = (arb(1), arb(0.5), arb(0.5))
    source = coverings.Reached(d, unit["g"], True, box, 0.0, 0.0, (1.0, 1.0), list(box), slopes)
    stretch, squeeze = coverings._cone(source, quad)
    assert stretch == pytest.approx(abs(by_u) - abs(by_v), abs=1e-9)
    assert squeeze == pytest.approx(abs(along_u) + abs(along_v), abs=1e-9)
    one = coverings.Relation(0, 1, 2.0, 0.5, stretch, squeeze)
    assert said(coverings.prove_cones, [one])[:2] == reason
    other = script.Quad(*quad[:5], list(quad.p))
    at, up = series(whole(g), BITS), series(whole(bent), BITS)
    place = other.curve(at, script.ENERGY) + up
    along = [(place.along(i), at.along(i), script.Series.of(i == 3)) for i in (1, 2, 3)]
    arrival = script.Arrival(place, at, 1, [], [], Interval.of(0), along)
    assert said(script.check_cone, arrival, other)[:2] == reason


@pytest.mark.slow
def test_C7_alone_may_fail(quads: Any, orbits: Any, numbers: Any, arrivals: Any) -> None:
    """A term of v^40 in the last bits: what it does to derivatives is 40 times what it does."""
    off = moved(orbits[3][0], 1, (0, 0, 40), 900 * 2.0**-BITS)
    found = coverings.arrival(numbers, quads[3], [off, *orbits[3][1:]])
    covered = [coverings.relation(found, quads[k], arrivals[k].begin, k) for k in (0, 1)]
    assert all(one.across < 0.9 and one.stretch > 1 < one.squeeze for one in covered)
    assert said(coverings.prove_cones, covered)[:2] == "C7"
    steps = [step(x) for x in (off, *orbits[3][1:])]
    other = script.arrival(problem(), quad_of(quads[3]), steps)
    for k in (0, 1):
        begin = [_interval(x) for x in arrivals[k].begin]
        assert said(script.check_relation, other, quad_of(quads[k]), begin) == ""
        assert said(script.check_cone, other, quad_of(quads[k]))[:2] == "C7"


@pytest.mark.slow
def test_cones_of_all_relations_are_asked_for(data: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight of the sets and two of the line, by both: one that fails is enough."""
    config = typed(Config, CONFIG, [])
    groups = data["sets"], data["line"], data["proof"]
    monkeypatch.setattr(coverings, "arrival", _kept(coverings.arrival))
    # The first and the last of the sets, and those of the line.
    for bad in (0, 7, 8, 9):
        asked: list[int] = []

        def cone(*_: Any, bad: int = bad, asked: list[int] = asked) -> tuple[float, float]:
            asked.append(bad)
            return (1.0 if len(asked) == bad + 1 else 2.0), 0.5

        monkeypatch.setattr(coverings, "_cone", cone)
        assert full_shift.checked(config, *groups).doubts[0].startswith("C7")
        assert len(asked) == 10
    monkeypatch.undo()
    counted: list[Any] = []
    largest: list[float] = []
    monkeypatch.setattr(script, "check_cone", lambda *of: counted.append(of))
    # C9 asks C8 again, of the strip's image too.
    monkeypatch.setattr(script, "check_transversal", lambda *of: None)
    monkeypatch.setattr(connections, "prove_transversal", lambda *of: None)
    monkeypatch.setattr(script, "check_middle", lambda _, small: largest.append(float(small)))
    assert script.main([str(REFERENCE / "full_shift.h5")]) == 0
    assert len({(id(source), quad.rising, quad.a) for source, quad in counted}) == 10
    monkeypatch.setattr(connections, "check_middle", lambda _, x: largest.append(float(x.upper())))
    full_shift.checked(config, *groups)
    # C8 is asked of the largest |d| of all sets and images.
    drawn, sets = data["drawn"], coverings_sets(data)
    surface = [np.polynomial.polynomial.polyval(-np.sin(drawn["chi"][k]), sets[k]) for k in (0, 2)]
    # Both add their bounds on the distance and on the time of the crossing, 1e-7.
    assert largest[0] == pytest.approx(largest[1], abs=1e-7)
    assert max(abs(x).max() for x in surface) < largest[0] < 2e-3


def coverings_sets(data: Any) -> list[list[float]]:
    """The curves of the sets."""
    return [[float(x) for x in quad.p] for quad in unpacked_quads(data["sets"])]


def _kept(check: Any) -> Any:
    """The same, computed once for each set."""
    found: dict[Any, Any] = {}

    def kept(numbers: Any, start: Any, pieces: Any) -> Any:
        if start not in found:
            found[start] = check(numbers, start, pieces)
        return found[start]

    return kept


def whole(terms: Mapping[Any, float]) -> dict[Any, int]:
    return {at: round(x * 2**BITS) for at, x in terms.items()}


@pytest.mark.slow
def test_what_asks_for_no_derivatives_has_all_else_and_no_cones(
    quads: Any, orbits: Any, numbers: Any, arrivals: Any
) -> None:
    """As along a chain: every bound of C1 to C6 is the same number."""
    source = coverings.arrival(numbers._replace(along=""), quads[0], orbits[0])
    assert source.slopes == [[], []]
    assert source.d.error == arrivals[0].d.error
    for name in ("bound", "late", "duration", "right"):
        assert getattr(source, name) == getattr(arrivals[0], name)
    both = [
        coverings.relation(found, quads[2], arrivals[2].begin, 2) for found in (source, arrivals[0])
    ]
    assert both[0][:4] == both[1][:4]
    assert said(coverings.prove_cones, both[1:]) == ""
    assert said(coverings.prove_cones, both)[:2] == "C7"
    p, first = problem(), step(orbits[0][0])
    few = p._replace(along=())
    assert script.beginning(few, quad_of(quads[0]), first)[1] == [
        script.beginning(p, quad_of(quads[0]), first)[1][0]
    ]
    assert script.carried(few, first, [Fraction(1, 2**50)], [Fraction(0)]) == [
        script.carried(p, first, [Fraction(1, 2**50)] * 4, [Fraction(0)] * 4)[0]
    ]


def test_functions_of_which_only_values_are_bounded_have_no_derivative() -> None:
    """An error that is no polynomial's may have any slope; that of a number has none."""
    u = Family.of({(0, 1, 0): 2}, BITS)
    rough = Family.of_ball(arb(0, 2.0**-70), BITS)
    assert (u * u * rough).partial("u").error == 2 * (u * u * rough).error > 0
    with pytest.raises(ValueError, match="only values are bounded"):
        (u + u.widened(arb(2.0**-50)) * rough).partial("u")
    other = script.Series.made({(0, 1, 0): 1}, 0)
    thin = script.Series.of(Interval(0, 1))
    assert (other * other * thin).along(1).error == 2 * (other * other * thin).error > 0
    with pytest.raises(Fails, match="only values are bounded"):
        (other + other.wider(Fraction(1, 2)) * thin).along(1)


def test_sets_that_are_not_two_and_two_prove_nothing(quads: Any, orbits: Any, numbers: Any) -> None:
    for kept in ([0, 1, 2], [0, 2], [0, 1, 2, 0]):
        mine = said(coverings.prove, numbers, [quads[k] for k in kept], [orbits[k] for k in kept])
        theirs = said(script.prove, GIVEN, [quad_of(quads[k]) for k in kept], line_of(), [])
        assert mine == theirs == "there are other sets than two on each section"


# ---- The stored proof.


@pytest.fixture(scope="module")
def arrivals(quads: Any, orbits: Any, numbers: Any) -> list[coverings.Reached]:
    return [coverings.arrival(numbers, *of) for of in zip(quads, orbits, strict=False)]


@pytest.mark.slow
def test_the_stored_proof_holds_in_both_checkers(
    data: Any, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    quads, orbits = unpacked_quads(data["sets"]), unpacked(data["proof"], 5)
    numbers = coverings.Numbers.of(BODY, exact(GIVEN["h"]))
    arrivals, relations = coverings.prove(numbers, quads, orbits[:4])
    for name in ("target", "orientation", "edge", "across", "stretch", "squeeze"):
        found = [[getattr(one, name) for one in pair] for pair in relations]
        np.testing.assert_allclose(found, data["relations"][name], rtol=1e-6)
    line = unpacked_line(J1, data["line"])
    _, crossed = coverings.prove_line(numbers, line, orbits[4], quads, arrivals)
    assert [one.target for one in crossed] == [0, 1]
    np.testing.assert_allclose([one.across for one in crossed], data["line"]["across"], rtol=1e-6)
    # What docs/full-shift.md says of one passage and of two, from either section.
    up, down = ([one for pair in relations[k : k + 2] for one in pair] for k in (0, 2))
    assert min(one.stretch for one in up + down) > 156
    assert min(one.stretch for one in up) * min(one.stretch for one in down) > 10**5
    assert max(one.squeeze for one in up) * max(one.squeeze for one in down) < 1 / 4
    file = str(REFERENCE / "full_shift.h5")
    kept: list[script.Arrival] = []
    follow = script.arrival

    def followed(*of: Any) -> script.Arrival:
        kept.append(follow(*of))
        return kept[-1]

    monkeypatch.setattr(script, "arrival", followed)
    assert script.main([file, "--config", str(CONFIG)]) == 0
    said_by_script = capsys.readouterr().out
    assert all(theorem in said_by_script for theorem in script.FURTHER)
    assert "A = 2, 1, 3/2; r = 1, 1, 0; mu = 1/1000; h = 6671/5000:" in said_by_script
    # The times of docs/full-shift.md are proven by both, and are as wide as these are.
    assert "23.9501 to 23.9902 t'" in said_by_script
    durations = np.array([each.duration for each in arrivals])
    assert 23.9501 < durations.min() < durations.max() < 23.9902
    other = tmp_path / "other.yaml"
    other.write_text(
        CONFIG.read_text(encoding="utf-8").replace("1.3342", "1.3343"),
        encoding="utf-8",
    )
    assert script.main([file, "--config", str(other)]) == 1
    capsys.readouterr()
    # Theorems 1 and 2 need neither cones nor what orbits do in the middle.
    again = iter(kept)
    monkeypatch.setattr(script, "arrival", lambda *of: next(again))
    monkeypatch.setattr(script, "check_cone", Mock(side_effect=Fails("C7: not shown")))
    monkeypatch.setattr(script, "check_middle", Mock(side_effect=Fails("C8: not shown")))
    assert script.main([file, "--config", str(CONFIG)]) == 0
    said_by_script = capsys.readouterr().out
    doubts = "set 0: C7: not shown", "C8: not shown", "set 0: C7: not shown"
    assert said_by_script.endswith("".join(f"; undecided: {doubt}" for doubt in doubts) + "\n")


@pytest.mark.parametrize(
    "moved",
    [
        pytest.param(np.array([2**62] * 4), id="come round again: 2^64 more than there are"),
        pytest.param(np.array([-(10**6), 10**6]), id="negative"),
    ],
)
def test_steps_have_the_terms_that_are_stored(data: Any, moved: Any) -> None:
    proof = dict(data["proof"])
    terms = np.array(proof["terms"], dtype=np.int64)
    terms[: moved.size] += moved
    with pytest.raises(ValueError, match="other terms"):
        unpacked({**proof, "terms": terms}, 5)


def finer(piece: FamilyStep, by: int) -> FamilyStep:
    """The same step in units that many bits finer, and half a unit of old off in each term."""
    terms = [{at: (w << by) + (1 << by - 1) for at, w in each.items()} for each in piece.terms]
    return FamilyStep(piece.bits + by, piece.half, terms)


def test_numbers_of_more_bits_than_a_word_are_stored_whole(orbits: Any) -> None:
    """By both readers, negative ones among them."""
    steps = [[finer(piece, 30) for piece in orbits[k]] for k in range(5)]
    steps[1] = orbits[1]
    stored = packed(steps)
    assert set(stored["family"]) > {0, 1, 5}
    found = unpacked(stored, 5)
    assert [[each.bits for each in of] for of in found] == [[x.bits for x in of] for of in steps]
    theirs = script._steps(stored)
    for mine, others, wanted in zip(found, theirs, steps, strict=True):
        for one, other, piece in zip(mine, others, wanted, strict=True):
            assert one.half == {at: w for at, w in piece.half.items() if w}
            for k, terms in enumerate(piece.terms):
                assert one.terms[k] == terms
                expected = series(terms, piece.bits)
                assert (other.states[k] - expected).most == 0


@pytest.mark.parametrize("how", ["of no step", "a length", "not finer"])
def test_digits_that_are_added_to_nothing_are_refused(orbits: Any, how: str) -> None:
    stored = packed([[finer(orbits[0][0], 30)]])
    if how == "of no step":
        stored["family"] = stored["family"][::-1]
    elif how == "a length":
        stored["coefficients"][-1, 6] = 1
        stored["powers"][-1] = 0, 9, 9
    else:
        stored["bits"][1] = stored["bits"][0] - 1
    with pytest.raises(ValueError, match="what is added to a step is"):
        unpacked(stored, 1)
    if how != "not finer":
        # The other reader counts five sets, and takes units of any order.
        stored["family"] = stored["family"] * 5
        with pytest.raises(Refused, match="what is added to a step is"):
            script._steps(stored)


def test_a_length_that_depends_on_time_is_refused(data: Any) -> None:
    coefficients = np.array(data["proof"]["coefficients"])
    later = np.flatnonzero(data["proof"]["powers"][:, 0])[0]
    coefficients[later, 6] = 1
    with pytest.raises(ValueError, match="depends on time"):
        unpacked({**data["proof"], "coefficients": coefficients}, 5)


def test_a_set_without_a_curve_is_refused(data: Any) -> None:
    with pytest.raises(ValueError, match="no extent"):
        unpacked_quads({**data["sets"], "p": np.zeros((4, 0))})


def spoilt(file: Any, how: str) -> None:
    """Make something of a result that is no proof of this file, or more than it can be."""
    sets, proof = file["data/sets"], file["data/proof"]
    if how == "link":
        del file["data/line/half"]
        file["data/line/half"] = h5py.ExternalLink(
            str(REFERENCE / "full_shift.h5"), "data/line/half"
        )
    elif how == "too large":
        del sets["a"]
        sets.create_dataset("a", (1000,), "S1048576", chunks=(1,))
    elif how == "a curve has no coefficients":
        del sets["p"]
        sets["p"] = np.zeros((4, 21))
    elif how == "more terms":
        at = np.array(np.unravel_index(np.arange(10001), (40, 40, 40))).T
        for name, value in {"family": [0], "bits": [60], "terms": [len(at)], "powers": at}.items():
            del proof[name]
            proof[name] = np.array(value)
        del proof["coefficients"]
        proof["coefficients"] = np.ones((len(at), 7), dtype=np.int64)
    else:
        text = file["config"].asstr()[()].replace('"1/100000000"', '"-1"')
        if how == "lacks something":
            text = text.replace('"3/2"', '"3/2", "1"')
        del file["config"]
        file["config"] = text


@pytest.mark.parametrize(
    "how",
    [
        "link",
        "too large",
        "a curve has no coefficients",
        "more terms",
        "lacks something",
        "J1_0 > 0 is broken",
    ],
)
def test_a_file_that_is_no_proof_is_refused_at_once(how: str, tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "other.h5"
    path.write_bytes((REFERENCE / "full_shift.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        spoilt(file, how)
    assert script.main([str(path)]) == 1
    assert how in capsys.readouterr().err


def changed(quads: list[Quad], orbits: Any, how: str) -> tuple[list[Quad], list[Any]]:
    quads, orbits = list(quads), [list(each) for each in orbits]
    if how == "a set is moved":
        first = quads[0]
        quads[0] = first._replace(p=(first.p[0] + 2 * first.a, *first.p[1:]))
    elif how == "two sets are exchanged":
        quads[0], quads[1] = quads[1], quads[0]
    elif how == "an edge is exchanged":
        quads[0] = quads[0]._replace(a=-quads[0].a)
    elif how == "a set is wider":
        quads[0] = quads[0]._replace(b=quads[0].b * Fraction(11, 10))
    elif how == "a step is dropped":
        del orbits[0][5]
    elif how == "steps are exchanged":
        orbits[0][5], orbits[0][6] = orbits[0][6], orbits[0][5]
    elif how == "the last step is shorter":
        last = orbits[0][-1]
        half = {**last.half, (0, 0, 0): last.half[0, 0, 0] * 99 // 100}
        orbits[0][-1] = last._replace(half=half)
    elif how == "a coefficient is off":
        orbits[0][0] = moved(orbits[0][0], 3, (2, 0, 0), 1e-5)
    return quads, orbits


CHANGES = [
    "a set is moved",
    "two sets are exchanged",
    "an edge is exchanged",
    "a set is wider",
    "a step is dropped",
    "steps are exchanged",
    "the last step is shorter",
    "a coefficient is off",
]


@pytest.mark.slow
@pytest.mark.parametrize("how", CHANGES)
def test_what_is_changed_proves_nothing(
    quads: Any, orbits: Any, numbers: Any, arrivals: Any, how: str
) -> None:
    """By both checkers, of the one set that is changed."""
    other, steps = changed(quads, orbits, how)

    def by_package() -> None:
        found = coverings.arrival(numbers, other[0], steps[0])
        for k in (2, 3):
            coverings.relation(found, other[k], arrivals[k].begin, k)

    assert said(by_package)[:1] == "C"

    def by_script() -> None:
        found = script.arrival(problem(), quad_of(other[0]), [step(x) for x in steps[0]])
        for k in (2, 3):
            begin = [_interval(x) for x in arrivals[k].begin]
            script.check_relation(found, quad_of(other[k]), begin)

    assert said(by_script)[:1] == "C"


def _interval(x: arb) -> Interval:
    (m, e), radius = x.mid().man_exp(), Fraction(float(x.rad().upper()))
    middle = Fraction(int(m)) * Fraction(2) ** int(e)
    return Interval(Interval.of(middle - radius).low, Interval.of(middle + radius).high)


@pytest.mark.slow
def test_a_changed_bit_proves_nothing(quads: Any, orbits: Any, numbers: Any) -> None:
    """A bit that is worth more than the bound allows, in any coefficient of a set."""
    with lot.drawn("full shift") as chance:
        for _ in range(lot.trials(4, 0.01)):
            steps = list(orbits[1])
            k, component = chance.randrange(len(steps)), chance.randrange(6)
            terms = [dict(each) for each in steps[k].terms]
            at = chance.choice(sorted(terms[component]))
            # From 2^-10 on: more than the radius of a tube.
            terms[component][at] ^= 1 << chance.randrange(steps[k].bits - 10, steps[k].bits)
            steps[k] = steps[k]._replace(terms=terms)
            assert said(coverings.arrival, numbers, quads[1], steps)[:1] == "C"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mu", "h"), [("0", "1.3342"), ("1e-3 + 1e-8", "1.3342"), ("1e-3", "1.33420001")]
)
def test_a_proof_is_of_one_body_and_energy(
    quads: Any, orbits: Any, arrivals: Any, mu: str, h: str
) -> None:
    body = Body(A=GIVEN["A"], r=GIVEN["r"], mu=mu)
    numbers = coverings.Numbers.of(body, exact(h))

    def whole() -> None:
        found = coverings.arrival(numbers, quads[0], orbits[0])
        coverings.relation(found, quads[2], arrivals[2].begin, 2)

    assert said(whole)[:1] == "C"
    if "+" not in mu:
        given = {**GIVEN, "mu": mu, "h": h}
        steps = [step(x) for x in orbits[0]]
        assert said(script.arrival, script.problem_of(given), quad_of(quads[0]), steps)[:1] == "C"


def test_the_second_checker_imports_nothing_of_the_package() -> None:
    found = set()
    for node in ast.walk(ast.parse(Path(script.__file__).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
        assert not (isinstance(node, ast.Name) and node.id in ("__import__", "exec", "eval"))
    standard = {"__future__", "argparse", "collections.abc", "fractions", "json", "math"}
    standard |= {"pathlib", "sys"}
    assert found <= standard | {"typing", "h5py", "yaml", "scripts.check_certificate"}


def places(quad: Quad, d: Any, g: Any) -> tuple[Any, Any]:
    """U and V in doubles."""
    a, b, l0, l1 = (float(x) for x in (quad.a, quad.b, quad.l0, quad.l1))
    off = d - np.polynomial.polynomial.polyval(g, [float(x) for x in quad.p])
    return off / a, (off - l0 - l1 * g) / b


@pytest.mark.slow
def test_closed_orbits_of_all_words_lie_in_the_sets(data: Any, quads: Sequence[Quad]) -> None:
    """Found by the return map alone, for all words of up to six symbols.

    By C7 they stretch by more than their relations do, all together.
    """
    from rigidpend.orbits.return_map import return_map
    from rigidpend.routes.symbolic.closed import closed, words
    from rigidpend.routes.symbolic.tables import Level

    level = Level(return_map(BODY, h=GIVEN["h"]), float(GIVEN["h"]))
    of = {(quad.rising, symbol): quad for quad, (_, symbol) in zip(quads, SETS, strict=True)}
    stretch = {at: data["relations"]["stretch"][k].min() for k, at in enumerate(of)}
    for word in words(6):
        orbit = closed(level, word, 14)
        chain, least = orbit.chain, 1.0
        for k, symbol in enumerate(word * (1 + len(word) % 2)):
            at = k % 2 == 0, symbol
            U, V = places(of[at], chain.d[k], -np.sin(chain.chi[k]))
            assert abs(U) < 1, (word, k)
            assert abs(V) < 1, (word, k)
            least *= stretch[at]
        assert abs(orbit.multiplier) ** (1 + len(word) % 2) > least, word


@pytest.mark.slow
def test_orbits_in_113_bits_do_what_the_relations_say(
    quads: Any, orbits: Any, arrivals: Any
) -> None:
    """From random points of each set: crossings and their derivatives are where bounds say."""
    for k, (quad, pieces, arrival) in enumerate(zip(quads, orbits, arrivals, strict=False)):
        with lot.drawn(f"orbits of a full shift, set {k}") as chance:
            u, v = chance.uniform(-1, 1), chance.uniform(-1, 1)
        # The point, and two beside it in each direction: it is cubic terms that differences lack.
        beside, step_by = np.array([0.0, 1.0, -1.0, 0.0, 0.0]), 2.0**-20
        crossed = crossings(quad, pieces, u + step_by * beside, v + step_by * np.roll(beside, 2))
        end = crossed.states[:, 0].astype(float)
        large, small = (1, 0) if quad.rising else (0, 1)
        sign = 1 if end[large] > 0 else -1
        assert ((sign > 0) is quad.rising) is arrival.right
        assert abs(crossed.late[0]) < arrival.late
        for j, family, slopes in zip(
            (small, 5), (arrival.d, arrival.g), arrival.slopes, strict=True
        ):
            values = sign * crossed.states[j]
            off = float(values[0]) - _value(dict(_terms(family)), family.bits, u, v)
            assert abs(off) < family.error / 2**family.bits
            for found, slope in zip((values[1::2] - values[2::2])[:2], slopes[:2], strict=True):
                expected = _value(dict(_terms(slope)), slope.bits, u, v)
                assert abs(float(found) / (2 * step_by) - expected) < slope.error / 2**slope.bits
        for target in quads:
            if target.rising != quad.rising:
                assert abs(places(target, sign * end[small], sign * end[5])[1]) < 1


class Crossings(NamedTuple):
    """Next crossings of orbits from points of a set, in 113 bits."""

    states: Any
    late: Any
    """When, after the end of the polynomials."""


def crossings(
    quad: Quad,
    pieces: Sequence[FamilyStep],
    u: Any,
    v: Any,
    h: Any = Fraction("1.3342"),
    w: float = 0,
) -> Crossings:
    from rigidpend.mechanics.equations import aligned
    from rigidpend.orbits.integrate.states import states_at
    from rigidpend.orbits.return_map.poincare import state_of
    from rigidpend.orbits.return_map.precision import precision
    from rigidpend.orbits.return_map.reduced import coefficients

    a = precision(113)
    c = coefficients(BODY.angles(160), "1", a)
    by_u, by_v, l0, l1 = (a.number(x) for x in (quad.a, quad.b, quad.l0, quad.l1))
    u, v = a.array(list(map(a.number, u))), a.array(list(map(a.number, v)))
    g = (by_u * u - by_v * v - l0) / l1
    d = 0 * g
    for x in quad.p[::-1]:
        d = d * g + a.number(x)
    d = d + by_u * u
    begin = state_of(quad.rising, d, a.sqrt(1 - g * g), -g, a.number(h), c, a)
    time = a.number(
        sum(2 * _value(piece.half, CLOCK, float(u[0]), float(v[0]), w) for piece in pieces)
    )
    end = states_at(c.aligned, begin, a.array([time]), 113)[:, -1]
    late = 0 * g
    for _ in range(3):
        # A short arc by its tangent and its bend, of which M3 is the time.
        rates = np.array(aligned(end, c.aligned))
        passed = -end[2] / rates[2]
        middle = end + rates * passed / 2
        end, late = end + np.array(aligned(middle, c.aligned)) * passed, late + passed
    return Crossings(end, late)


def _terms(family: Family) -> Iterator[tuple[Any, int]]:
    for at, w in family.doubled.to_dict().items():
        yield tuple(map(int, at)), int(w)


def _value(terms: Mapping[Any, int], bits: int, u: float, v: float, w: float = 0) -> float:
    powers = (((*at, 0)[1:4], c) for at, c in terms.items())
    return float(sum(c * u**k * v**l * w**m for (k, l, m), c in powers)) / 2 ** (bits + 1)
