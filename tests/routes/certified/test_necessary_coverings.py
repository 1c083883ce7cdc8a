"""Hypotheses of covering relations: without any one of them a false relation is believed.

The stored proof is offered for sets that are moved, for another energy or for a wrong time, and
integration in 113 bits shows that what it then says is false.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx

from rigidpend import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.certified import (
    approximation,
    coverings,
    passages,
    pieces,
    sections,
)
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.pieces import (
    CLOCK,
    FamilyStep,
    Quad,
    made,
)
from scripts import check_full_shift as script
from scripts.check_certificate import Fails
from tests.bodies import FIG4
from tests.routes.certified.offered import (
    BITS,
    WIDE,
    Stored,
    constant,
    crossings,
    flow,
    of_one,
    places,
    points,
    problem,
    quad_of,
    step,
)
from tests.routes.certified.test_coverings import radius_of_crossing
from tests.weakened import weakened

H = "1.3342"
MOVED = 0.4
"""By how much of its half-width a set is moved: both edges' images are then beyond one end."""
Pieces = Sequence[FamilyStep]


@functools.cache
def is_covered(quad: Quad, target: Quad, h: str) -> bool:
    """Whether the edges go beyond opposite ends of a set, in truth."""
    Qp, Qm, *_, gamma3 = crossings(points(quad, [-1, 1], [0, 0], Fraction(h)), 23.97).states
    side = np.sign(Qm.astype(float))
    ends, _ = places(target, (side * Qp).astype(float), (side * gamma3).astype(float))
    return min(ends) < -1 and max(ends) > 1


def moved(quad: Quad) -> Quad:
    return quad._replace(p=(quad.p[0] + Fraction(MOVED) * quad.a, *quad.p[1:]))


def shifted(quad: Quad, piece: FamilyStep) -> list[dict[Any, int]]:
    """The polynomials of the moved set: as those of its points in the set's own u and v."""
    by = Fraction(MOVED), Fraction(MOVED) * quad.a / quad.b
    found: list[dict[Any, Fraction]] = [{} for _ in piece.terms]
    for terms, new in zip(piece.terms, found, strict=True):
        for (j, k, l), w in terms.items():
            for m, n in itertools.product(range(k + 1), range(l + 1)):
                of_u = math.comb(k, m) * by[0] ** (k - m)
                of_v = math.comb(l, n) * by[1] ** (l - n)
                new[j, m, n] = new.get((j, m, n), Fraction(0)) + w * of_u * of_v
    return [{at: round(w) for at, w in new.items()} for new in found]


def jumping(quad: Quad, pieces: Pieces) -> Pieces:
    """The first step is of the moved set, the others are not."""
    first, *rest = pieces
    return [first._replace(terms=shifted(quad, first)), *rest]


def bent(quad: Quad, pieces: Pieces) -> Pieces:
    """The first step begins at the moved set and ends where that of the other does."""
    first, *rest = pieces
    both = []
    for old, new in zip(first.terms, shifted(quad, first), strict=True):
        mixed = dict(old)
        for at in new:
            # (1 - x)/2 times the difference, and x T_j = (T_{j-1} + T_{j+1})/2.
            j, *uv = at
            off = new[at] - old.get(at, 0)
            # Those of T_0 are twice what they stand for.
            for degree, share in ((j, 0.5), (j + 1, -0.25), (j - 1, -0.5 if j == 1 else -0.25)):
                if degree >= 0:
                    mixed[degree, *uv] = mixed.get((degree, *uv), 0) + round(share * off)
        both.append(mixed)
    return [first._replace(terms=both), *rest]


@pytest.fixture(scope="module")
def again() -> Iterator[Callable[[FamilyStep], script.Step]]:
    """Steps for the second checker, which has the defects of each only once."""
    # What an identity is of is kept, lest it become that of another one.
    steps, defects, find = dict[int, Any](), dict[int, Any](), script.defects

    def once(p: script.Problem, of: script.Step) -> Any:
        # Whatever the energy is, they are the same.
        if id(of) not in defects:
            defects[id(of)] = of, find(p, of)
        return defects[id(of)][1]

    def stepped(piece: FamilyStep) -> script.Step:
        if id(piece) not in steps:
            steps[id(piece)] = piece, step(piece)
        found: script.Step = steps[id(piece)][1]
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "defects", once)
        yield stepped


@pytest.mark.slow
@pytest.mark.parametrize(
    ("home", "before", "after", "change", "h"),
    [
        (
            sections,
            "near = _nearest(residual, slopes(1, q, d.range, y1, y2), turned, ALONE)",
            "near = [arb(0)]",
            None,
            "1.3343",
        ),
        (sections, "gamma2)], normed(apart, numbers.growth)", "gamma2)], [arb(0)]", None, H),
        (
            passages,
            "bounds = [upper(bound + gap) for bound, gap in zip(bounds, gaps, strict=True)]",
            "pass",
            jumping,
            H,
        ),
        (
            passages,
            "leaps = defects(numbers, states, half)",
            "leaps = [arb(0)]",
            bent,
            H,
        ),
        (passages, "return grown, factor", "return upper(begin), factor", None, H),
    ],
    ids=["C1 energy", "C1 distance", "C2 joint", "C2 defect", "C3"],
)
def test_without_a_hypothesis_a_relation_of_the_stored_proof_is_believed(
    stored: Stored,
    home: Any,
    before: str,
    after: str,
    change: Any,
    h: str,
    again: Callable[[FamilyStep], script.Step],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quads, orbits = stored.quads, stored.orbits
    target, quad = quads[2], quads[0] if h != H else moved(quads[0])
    steps = change(quads[0], orbits[0]) if change else orbits[0]
    numbers = sections.Numbers.of(FIG4, exact(H))
    begin, _ = sections.beginning(numbers, target, orbits[2][0])

    def believed(by: Any) -> bool:
        try:
            # A relation asks for no derivatives.
            others = sections.Numbers.of(FIG4, exact(h))._replace(along="")
            found = by.arrival(others, quad, steps)
            coverings.relation(found, target, begin, 2)
        except Undecided:
            return False
        return True

    assert not is_covered(quad, target, h)
    assert not believed(passages)
    slip: Any = weakened(home, (before, after))
    if home is sections:
        monkeypatch.setattr(passages, "beginning", slip.beginning)
    assert believed(passages if home is sections else slip)
    few = problem(h=h)._replace(along=())
    with pytest.raises(Fails, match="C3"):
        script.arrival(few, quad_of(quad), [again(x) for x in steps])


HEAVY = Body((2, 1, "3/2"), (1, 1, 0), 1)
"""A passage takes a few units of t', so that three of them can be followed in 60 bits."""
SMALL = 2.0**-45
"""Of a set that is hardly more than a point."""


def orbit(d: float, g: float, until: float, longest: float) -> tuple[Quad, Pieces]:
    """The orbit of a point of the section as a certificate of a tiny set."""
    quad = made(True, (SMALL, SMALL, g / 2, -0.5), (d,))
    begin = points(quad, [0], [0], 2, HEAVY)
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "d", "g", "until", "longest"),
    [
        # Through two crossings to the third one.
        (
            [("runs != list(order)", "False"), ("not (rate > 0 or rate < 0)", "False")],
            *(0.25, -0.375, 8.2774672421731, 0.2),
        ),
        # M3 sinks from the start, which is itself taken for the crossing.
        ([("runs != list(order)", "False")], 0.7265625, 0.0625, 1e-3, 0.2),
        # Polynomials that end 0.01 t' before the crossing, in two steps.
        ([("time = upper(M3 / slowest)", "time = arb(0)")], 0.25, -0.375, 2.6629928881346, 1.4),
        # A turn of M3 at 4e-6, where the rate of the middle says that it crosses.
        ([("rates[2]).lower()", "rates[2]).mid()")], 0.66597, 0.74813282, 0.6710732, 0.2),
    ],
    ids=["C4", "C4 begin", "C5 time", "C5 rate"],
)
def test_without_a_hypothesis_another_crossing_is_believed(
    changes: list[tuple[str, str]],
    d: float,
    g: float,
    until: float,
    longest: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Steps may end where the prover would not end them.
    monkeypatch.setattr(approximation, "CLEAR", 0.0)
    quad, pieces = orbit(d, g, until, longest)
    slip, numbers = weakened(passages, *changes), sections.Numbers.of(HEAVY, exact(2))
    least, most = slip.arrival(numbers, quad, pieces).duration
    after, before = first_crossing(quad)
    assert most < after or least > before
    if "time" in changes[0][0]:
        # What is true is proven: the crossing within a wider time.
        least, most = passages.arrival(numbers, quad, pieces).duration
        assert least < after < before < most
        return
    with pytest.raises(Undecided, match=r"^C[45]"):
        passages.arrival(numbers, quad, pieces)
    with pytest.raises(Fails, match=r"C[45]"):
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


def test_without_a_positive_length_of_C2_a_bound_shrinks_where_orbits_part() -> None:
    """Backwards along M3 > 0 the free body's Qp grows by exp(sin(alpha0)/2 M3 t), as in (Im)."""
    numbers, M3, half, begin = sections.Numbers.of(FIG4, exact(H)), 1.2, 0.5, 1e-9
    states = [Family.of(constant(M3 if k == 2 else 0.0), BITS) for k in range(6)]
    back = Family.of({(0, 0, 0): -int(half * 2 ** (CLOCK + 1))}, CLOCK)
    slip = weakened(passages, ("2 * half.bound / PARTS", "2 * half.range / PARTS"))
    stated = float(slip.tube(states[2], back, arb(begin), numbers.growth, "C")[0])
    apart = begin * math.exp(math.sqrt(8) / 6 * M3 * 2 * half)
    assert stated < begin < apart
    quad, (first, *rest) = orbit(0.25, -0.375, 0.1, 0.1)
    backward = first._replace(half={(0, 0, 0): -first.half[0, 0, 0]})
    with pytest.raises(Undecided, match="C2: the length"):
        passages.arrival(sections.Numbers.of(HEAVY, exact(2)), quad, [backward, *rest])
