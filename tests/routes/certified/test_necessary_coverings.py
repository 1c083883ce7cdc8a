"""Hypotheses of covering relations: without any one of them a false statement is believed.

The orbit of a point is offered as that of a tiny set. It is another point's, another energy's or
ends at a wrong time, and integration in 113 bits shows that what is then said is false.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx

from rigidpend import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.certified import approximation, passages, pieces, sections
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.pieces import CLOCK, FamilyStep, Quad, made
from scripts import check_full_shift as script
from scripts.check_certificate import Fails
from tests.bodies import FIG4
from tests.routes.certified.offered import (
    BITS,
    WIDE,
    begun,
    constant,
    flow,
    moved,
    of_one,
    points,
    problem,
    quad_of,
    step,
)
from tests.routes.certified.test_coverings import radius_of_crossing
from tests.weakened import weakened

H = "1.3342"
Pieces = Sequence[FamilyStep]

HEAVY = Body((2, 1, "3/2"), (1, 1, 0), 1)
"""A passage takes a few units of t', so that three of them can be followed in 60 bits."""
SMALL = 2.0**-45
"""Of a set that is hardly more than a point."""


def orbit(d: float, g: float, until: float, longest: float, h: float = 2) -> tuple[Quad, Pieces]:
    """The orbit of a point of the section as a certificate of a tiny set."""
    quad = made(True, (SMALL, SMALL, g / 2, -0.5), (d,))
    begin = points(quad, [0], [0], h, HEAVY)
    with ctx.workprec(160):
        state = [arb(x.context.nstr(x, 40)) for x in begin[:, 0]]
        flow = approximation.Approximation(sections.Numbers.of(HEAVY, exact(2)).field, state)
    time, taken = 0.0, []
    while until - time > 1e-8:
        left = until - time
        flow.longest = left / math.ceil(left / longest)
        taken.append(flow.step(60))
        time += math.ldexp(taken[-1].half_length, 1 - pieces.ORBIT_CLOCK)
    return quad, of_one(taken)


def first_crossing(quad: Quad) -> tuple[float, float]:
    """Times between which M3 first changes its sign, in 113 bits; up to 3, or never."""
    begin, field = points(quad, [0], [0], 2, HEAVY), flow(HEAVY).aligned
    times = np.arange(1, 301) / 100
    for _ in range(2):
        M3 = states_at(field, begin, WIDE.array(list(times)), 113)[2, :, 0].astype(float)
        changed = np.flatnonzero(M3 * M3[0] < 0)
        if not changed.size:
            return math.inf, math.inf
        between = times[changed[0] - 1], times[changed[0]]
        times = np.linspace(*between, 101)
    return between


def own() -> tuple[Quad, Pieces]:
    """What is true: the set of the next ones, and its orbit up to behind the crossing."""
    return orbit(0.25, -0.375, 2.6730928881, 0.2)


def beside() -> tuple[Quad, Pieces]:
    """The orbit of a point a little farther from the separatrix, which crosses earlier."""
    return own()[0], orbit(0.26, -0.375, 2.6663737053, 0.2)[1]


def of_more_energy() -> tuple[Quad, Pieces]:
    return own()[0], orbit(0.25, -0.375, 2.6666278252, 0.2, h=2.02)[1]


def jumping() -> tuple[Quad, Pieces]:
    """The first step is of the true orbit, the others are of the one beside it."""
    quad, (first, *_) = own()
    return quad, [first, *beside()[1][1:]]


def bent() -> tuple[Quad, Pieces]:
    """The first step begins on the true orbit, and ends on the one beside it."""
    (quad, (true, *_)), (_, (first, *rest)) = own(), beside()
    for k, (there, here) in enumerate(zip(begun(true), begun(first), strict=True)):
        # (1 - x)/2 times what they are apart; a coefficient of T_0 counts half.
        off = float((there.range - here.range).mid()) / 2
        first = moved(moved(first, k, (0, 0, 0), 2 * off), k, (1, 0, 0), -off)
    return quad, [first, *rest]


NEAREST = "near = _nearest(residual, slopes(1, q, d.range, y1, y2), turned, ALONE)"
GAPS = "bounds = [upper(bound + gap) for bound, gap in zip(bounds, gaps, strict=True)]"
ORDER = "runs != list(order)", "False"
FALSE: dict[str, tuple[Any, list[tuple[str, str]], Callable[[], tuple[Quad, Pieces]]]] = {
    "C1 energy": (sections, [(NEAREST, "near = [arb(0)]")], of_more_energy),
    "C1 distance": (
        sections,
        [("gamma2)], normed(apart, numbers.growth)", "gamma2)], [arb(0)]")],
        beside,
    ),
    "C2 joint": (passages, [(GAPS, "pass")], jumping),
    "C2 defect": (passages, [("leaps = defects(numbers, states, half)", "leaps = [arb(0)]")], bent),
    # Through two crossings to the third one.
    "C4": (
        passages,
        [ORDER, ("not (rate > 0 or rate < 0)", "False")],
        lambda: orbit(0.25, -0.375, 8.2774672421731, 0.2),
    ),
    # M3 sinks from the start, which is itself taken for the crossing.
    "C4 begin": (passages, [ORDER], lambda: orbit(0.7265625, 0.0625, 1e-3, 0.2)),
    # Polynomials that end 0.01 t' before the crossing, in two steps.
    "C5 time": (
        passages,
        [("time = upper(M3 / slowest)", "time = arb(0)")],
        lambda: orbit(0.25, -0.375, 2.6629928881346, 1.4),
    ),
    # A turn of M3 at 4e-6, where the rate of the middle says that it crosses.
    "C5 rate": (
        passages,
        [("rates[2]).lower()", "rates[2]).mid()")],
        lambda: orbit(0.66597, 0.74813282, 0.6710732, 0.2),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FALSE)
def test_without_a_hypothesis_another_crossing_is_believed(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Steps may end where the prover would not end them.
    monkeypatch.setattr(approximation, "CLEAR", 0.0)
    home, changes, offered = FALSE[name]
    quad, pieces = offered()
    # A crossing asks for no derivatives.
    numbers = sections.Numbers.of(HEAVY, exact(2))._replace(along="")
    slip: Any = weakened(home, *changes)
    with monkeypatch.context() as patch:
        if home is sections:
            patch.setattr(passages, "beginning", slip.beginning)
        least, most = (
            (passages if home is sections else slip).arrival(numbers, quad, pieces).duration
        )
    after, before = first_crossing(quad)
    assert most < after or least > before
    if name == "C5 time":
        # What is true is proven: the crossing within a wider time.
        least, most = passages.arrival(numbers, quad, pieces).duration
        assert least < after < before < most
        return
    # The tube, where it would grow too wide, or the hypothesis itself.
    refused = "C3" if name < "C3" else "C[45]"
    with pytest.raises(Undecided, match=f"^{refused}"):
        passages.arrival(numbers, quad, pieces)
    with pytest.raises(Fails, match=refused):
        script.arrival(problem(mu="1", h="2"), quad_of(quad), [step(x) for x in pieces])


def test_without_the_sign_of_C5_a_side_is_believed_that_nobody_knows() -> None:
    """The large Q is half of what it may be off: some of the orbits so near leave elsewhere."""
    numbers, bound = sections.Numbers.of(FIG4, exact(H)), 1e-9
    Q = radius_of_crossing(numbers.growth, bound) / 2
    values = (0.0, Q, 0.0, -math.sqrt(0.5), math.sqrt(0.5), 0.0)
    end = [Family.of(constant(x), BITS) for x in values]
    asked: Any = numbers, end, [arb(bound)] * 4, 1, [], arb(0)
    slip = weakened(passages, ("not (box[large] > 0 or box[large] < 0)", "False"))
    assert slip._crossing(*asked).right
    with pytest.raises(Undecided, match="C5: the side"):
        passages._crossing(*asked)


@pytest.mark.parametrize(
    ("before", "after", "sense"),
    [
        # A negative length, and a distance that is carried on as it was.
        ("2 * half.bound / PARTS", "2 * half.range / PARTS", -1),
        ("return grown, factor", "return upper(begin), factor", 1),
    ],
    ids=["C2 length", "C3"],
)
def test_without_a_hypothesis_a_bound_is_less_than_orbits_part(
    before: str, after: str, sense: int
) -> None:
    """The free body's Qm grows by exp(sin(alpha0)/2 M3 t) along M3 > 0, Qp backwards: (Im)."""
    numbers, M3, half, begin = sections.Numbers.of(FIG4, exact(H)), 1.2, 0.5, 1e-9
    states = [Family.of(constant(M3 if k == 2 else 0.0), BITS) for k in range(6)]
    length = Family.of({(0, 0, 0): sense * int(half * 2 ** (CLOCK + 1))}, CLOCK)
    of = states[2], length, arb(begin), numbers.growth, "C"
    apart = begin * math.exp(math.sqrt(8) / 6 * M3 * 2 * half)
    assert float(weakened(passages, (before, after)).tube(*of)[0]) <= begin * 1.001 < apart
    assert float(passages.tube(*of)[0]) > apart
