"""Necessary hypotheses: without any one of them a checker believes a false certificate.

A certificate here is an orbit beside the true one, and says other crossings than integration in 113
bits finds. A checker that lacks one hypothesis believes it, and neither true checker does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from rigidpend import route_codes
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.exact import exact
from rigidpend.routes.certified import checker, intervals, passages
from rigidpend.routes.certified.balls import enclosed
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.pieces import ORBIT_CLOCK, Step
from scripts.check_certificate import Fails
from tests.routes.certified.offered import GIVEN, Start, by_package, by_script
from tests.weakened import weakened

BITS = 80
"""Of the polynomials: so many that their own defect counts for nothing."""


def truth(start: Start, until: float) -> list[int]:
    """The separatrices beside which the orbit crosses, by integration in 113 bits."""
    given: Any = {"h0": start.h0, "J1_0": start.J1_0, "n_symbols": 2, "precisions": (113,)}
    found = route_codes(start.problem.body, start.phase, **given)
    return found.separatrix[found.crossing_time[:, 0] < until, 0].tolist()


def along(start: Start, *lengths: float, **off: float) -> list[Step]:
    """Steps along an orbit from a state that is off, their lengths in those of the longest."""
    orbit = start.approximation(BITS, **off)
    steps, longest = [], orbit.longest
    for share in lengths:
        orbit.longest = share * longest
        steps.append(orbit.step(BITS))
    return steps


def other_side() -> tuple[Start, list[Step]]:
    """The orbit from Qp = -2e-4 in place of 2e-4, so that it first crosses beside 4 and not 2."""
    start = Start()
    return start, along(start, *[1] * 9, Qp=-2 * Qp_of(start))


def bent() -> tuple[Start, list[Step]]:
    """The same orbit, but the first step begins where the true one does: Qp (1 - x) is added."""
    start, (first, *steps) = other_side()
    added = round(Qp_of(start) * 2**BITS)
    (w0, w1, *rest), *others = first.series
    return start, [first._replace(series=[[w0 + 2 * added, w1 - added, *rest], *others]), *steps]


def Qp_of(start: Start) -> float:
    return float(enclosed(start.problem, exact(start.phase), BITS).state[0].mid())


def above() -> tuple[Start, list[Step]]:
    """M3 = 2e-8 at the start, where the true orbit crosses at once from M3 = -2e-8."""
    start = Start(h0="2/3", J1_0="0.49999999")
    return start, along(start, 0.001, *[1] * 8, M3=4e-8)


def once() -> tuple[Start, list[Step]]:
    """M3 passes a turn near zero with one sign, where that of the true orbit crosses three times.

    So the numbers are found: at one time M3 = 0 and M3' = -2e-4 or 2e-4, while M3'' is small.
    """
    start = Start(
        ("2", "1", "6/5"), ("3", "4", "0"), "1", "2", "0.7033276173680131", "8.171498451090635"
    )
    like = start._replace(J1_0="0.7035407937984435", phase="8.173451809314095")
    return start, along(like, 0.4, 0.4)


def late() -> tuple[Start, list[Step]]:
    """M3 = 2e-8 at the start, and rises: the crossing was before."""
    start = Start(h0="2/3", J1_0="0.50000001")
    return start, along(start, 0.001, *[1] * 3)


def beside() -> tuple[Start, list[Step]]:
    """Qp > 0 where M3 rises through zero, and Qp < 0 on the true orbit, a little later in phase."""
    start = Start(GIVEN["A"], ("1", "4", "0"), "1", "1.1", "0.002196736300645435", "6.08698")
    return start, along(start._replace(phase="6.08696"), *[0.5] * 4)


def other_beside() -> tuple[Start, list[Step]]:
    """The same with both orbits exchanged, for a side that nobody knows is taken for Qp < 0."""
    like, _ = beside()
    start = like._replace(phase="6.08696")
    return start, along(like, *[0.5] * 4)


def taken(module: Any, start: Start, steps: Sequence[Step]) -> tuple[list[int], float]:
    """The crossings that a checker believes, and the time t' up to which it believes them."""
    problem = enclosed(start.problem, exact(start.phase), BITS + 64)
    walk = module.OrbitChecker(problem)
    for step in steps:
        walk.take(step)
    return [x.separatrix for x in walk.crossings], float(walk.time / problem.unit)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("without", "before", "after", "made"),
    [
        ("H1", "self.bound + self.growth.norm(gap)", "self.bound", other_side),
        ("H2", "defect(models, duration, self.coefficients, self.growth)", "arb(0)", bent),
        ("H3", "grown = upper(factor * begin)", "grown = upper(begin)", other_side),
        ("H4", "away = _whole(radius / self.growth.upright)", "away = 0", above),
        ("H5", "least <= _whole(self._rate_apart(models, radius, duration))", "False", once),
        ("H5", "min(map(large.least, where)) <= _whole(radius)", "False", beside),
    ],
)
def test_without_a_hypothesis_a_false_certificate_is_believed(
    without: str, before: str, after: str, made: Callable[[], tuple[Start, list[Step]]]
) -> None:
    start, steps = made()
    claimed, until = taken(weakened(checker, (before, after)), start, steps)
    assert claimed != truth(start, until)
    # The hypothesis itself refuses it, or the tube, if that would grow too wide before.
    reasons = (without, "H3")
    assert by_package(start, steps).startswith(reasons)
    assert by_script(start, steps).partition(": ")[2].startswith(reasons)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("home", "before", "after", "made"),
    [
        (intervals, '[arb(0)], "H", before', '[arb(0)], "H"', other_side),
        (intervals, "len(runs) % 2 == 0 or not kinds or heads != order", "False", late),
        (passages, "numbers.field)[2]\n        if", "numbers.field)[2].mid()\n        if", once),
        (intervals, "if not (large > 0 or large < 0):", "if False:", other_beside),
    ],
    ids=["H1", "H4", "H5 rate", "H5 side"],
)
def test_without_a_hypothesis_other_crossings_of_an_interval_are_believed(
    home: Any,
    before: str,
    after: str,
    made: Callable[[], tuple[Start, list[Step]]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of the same orbits, as those of an interval; what sets ask for too is shown of these."""
    start, steps = made()
    until = sum(math.ldexp(x.half_length, 1 - ORBIT_CLOCK) for x in steps)
    with pytest.raises(Undecided, match=r"H[345]"):
        start.signs(steps)
    with pytest.raises(Fails, match=r"H[345]"):
        start.signs_by_script(steps)
    slip: Any = weakened(home, (before, after))
    if home is passages:
        monkeypatch.setattr(intervals, "told", slip.told)
    found = start.signs(steps, slip if home is intervals else intervals)
    runs = [x for k, x in enumerate(found) if k == 0 or found[k - 1] != x]
    claimed = [separatrix_beside(x[0], x[1], x[1]) for x in runs if isinstance(x, tuple)]
    assert claimed != truth(start, until)
