"""Connections: what orbits do beside the sets, and how surfaces cross, by both checkers.

Where a limit lies is computed here, in doubles, from docs/full-shift.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pytest
from flint import arb

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.poincare import state_of
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.certified import connections, sections
from rigidpend.routes.certified.pieces import FamilyStep
from scripts import check_full_shift as script
from scripts.check_certificate import Interval
from tests.attacks import lot
from tests.routes.certified.offered import (
    BODY,
    GIVEN,
    WIDE,
    Stored,
    agree,
    arrived,
    begun,
    crossings,
    duration,
    flow,
    problem,
    quad_of,
    said,
    step,
    value,
    whole,
)

# ---- C8


def middle(A: tuple[str, ...], r: tuple[str, ...], mu: float, d0: float) -> dict[str, float]:
    """Each inequality of C8 as a number that is to be positive, in doubles, from its page."""
    A1, A2, A3 = (float(Fraction(x)) for x in A)
    rho = np.array([float(r[0]), float(r[1])]) / math.hypot(float(r[0]), float(r[1]))
    c = math.sqrt(A2 * (A1 - A3) / (A3 * (A1 - A2)))
    s = math.sqrt(A1 * (A3 - A2) / (A3 * (A1 - A2)))
    kappa, lam, h = A1 * A2 / (A3 * (A1 - A2)), s * c, 1.3342
    omega = (kappa - c * c) / (2 * c), (kappa + s * s) / (2 * s)
    a, b = mu * (s * rho[0] - c * rho[1]), mu * (s * rho[0] + c * rho[1])
    F = max(math.hypot(a, b), math.sqrt(2) * lam * mu)
    K1, K2 = omega[0] / (2 * c), omega[1] / (2 * s)
    J, K = math.sqrt(2 * h / kappa), max(K1, K2)
    m0, m1, q1, N = J / 3, 2 * J / 3, math.sqrt(h / K) / 5, math.sqrt((h + mu) / min(K1, K2))
    e = (h - mu - kappa * m1**2 / 2) / K
    v = (e - 2 * q1**2) / (4 * lam) - mu
    rate = lam * m0 - F / (math.sqrt(2) * min(c, s) * m0)
    D = 2 * math.sqrt(2 * lam * max(rate, 0) * max(e, 0) * (m1 - m0)) - 4 * lam * mu
    fall = D / (8 * lam) - mu
    return {
        "rise": v,
        "follow": q1 - math.exp(min(lam * m1**2 / v, 50)) * (d0 + F * m1 / v) if v > 0 else -1.0,
        "saddle": rate,
        "fall": min(fall, D - 4 * F * N * m0 / fall) if fall > 0 else -1.0,
    }


def limit_of(positive: Callable[[float], bool]) -> float:
    """The number up to which something holds."""
    low, high = 0.0, 1.0
    for _ in range(60):
        half = (low + high) / 2
        low, high = (half, high) if positive(half) else (low, half)
    return low


BODIES = [(("2", "1", "3/2"), ("1", "1", "0")), (("57/50", "1", "128/125"), ("1", "3", "0"))]
WORDS = {"rise": "rise", "follow": "follow", "saddle": "saddle", "fall": "fall to zero"}


@pytest.mark.parametrize(("name", "body"), [("rise", 0), ("follow", 1), ("saddle", 0), ("fall", 0)])
def test_C8_each_inequality_fails_beyond_its_own_weight(name: str, body: int) -> None:
    A, r = BODIES[body]
    limit = limit_of(lambda mu: middle(A, r, mu, 1e-3)[name] > 0)
    for factor in (0.99, 1.01):
        numbers, p = of_body(A, r, factor * limit)
        reasons = (
            said(connections.check_middle, numbers, arb(1e-3)),
            said(script.check_middle, p, Fraction(1, 1000)),
        )
        assert [WORDS[name] in reason for reason in reasons] == [factor > 1] * 2


def of_body(A: Any, r: Any, weight: float) -> tuple[sections.Numbers, script.Problem]:
    """The numbers of a body for both."""
    mu = Fraction(weight).limit_denominator(10**9)
    given = {"A": A, "r": r, "mu": f"{mu.numerator}/{mu.denominator}", "h": GIVEN["h"]}
    body = Body(A=A, r=r, mu=given["mu"])
    return sections.Numbers.of(body, exact(GIVEN["h"])), script.problem_of(given)


@pytest.mark.parametrize(("factor", "reason"), [(0.99, ""), (1.01, "C8: orbits beside")])
def test_C8_how_far_from_the_separatrix_sets_may_lie(
    stored: Stored, factor: float, reason: str
) -> None:
    d = factor * limit_of(lambda d: min(middle(GIVEN["A"], GIVEN["r"], 1e-3, d).values()) > 0)
    agree(
        reason,
        lambda: connections.check_middle(stored.numbers, arb(d)),
        lambda: script.check_middle(problem(), Fraction(d)),
    )


@pytest.mark.slow
def test_orbits_beside_the_separatrix_return_as_the_lemma_on_the_middle_says() -> None:
    """Random ones on both sides: M3 passes m1, and sinks through zero where D > 8 lambda mu."""

    a = precision(53)
    c = coefficients(BODY.angles(160), "1", a)
    n = 40
    with lot.drawn("orbits beside a separatrix") as chance:
        d = np.array([chance.uniform(0.001, 0.15) * chance.choice((-1, 1)) for _ in range(n)])
        chi = np.array([chance.uniform(-math.pi, math.pi) for _ in range(n)])
    begin = state_of(True, d, np.cos(chi), np.sin(chi), a.number(Fraction("1.3342")), c, a)
    states = np.asarray(states_at(c.aligned, begin, np.linspace(0.01, 40, 4000), 53))
    J = math.sqrt(2 * 1.3342 / float(c.aligned.kappa))
    lam = float(c.aligned.half_sigma)
    least = 8 * lam * 1e-3
    for p, q, M3 in states[:3].transpose(2, 0, 1):
        back = int(np.flatnonzero(M3 <= 0)[0])
        assert M3[:back].max() > 2 * J / 3
        assert q[back] ** 2 - p[back] ** 2 > least
        assert M3[back] < M3[back - 1]
        # Once D is positive q keeps its sign.
        out = np.flatnonzero((q**2 > p**2)[:back])
        assert len(set(np.sign(q[out]))) == 1


# ---- C9

FIELDS = connections.Middle._fields[1:]
"""Numbers of C8, in the order of both checkers."""


def middles(numbers: sections.Numbers, **changed: float) -> tuple[Any, Any, dict[str, float]]:
    """Those of Fig. 4's body, some of them changed, for both and in doubles."""
    mine = connections.check_middle(numbers, arb(1e-3))
    other = {name: float(getattr(mine, name)) for name in FIELDS} | changed
    balls: Any = {name: arb(x) for name, x in changed.items()}
    theirs = script.check_middle(problem(), Fraction(1, 1000))
    kept = dict(zip(FIELDS, theirs._fields, strict=True))
    exactly: Any = {kept[name]: Interval.of(Fraction(x)) for name, x in changed.items()}
    return mine._replace(**balls), theirs._replace(**exactly), other


@pytest.mark.parametrize(("A", "r"), BODIES)
def test_both_have_the_same_numbers_of_C8(A: Any, r: Any) -> None:
    """Of Fig. 4's body k and K are the same, of the other one they are not."""
    numbers, p = of_body(A, r, 5e-4)
    mine = connections.check_middle(numbers, arb(1e-3))
    theirs = script.check_middle(p, Fraction(1, 1000))
    for name, x in zip(FIELDS, theirs, strict=True):
        found = float(Interval.of(x).above)
        assert found == pytest.approx(float(getattr(mine, name)), rel=1e-12), name
    assert float(mine.share) == pytest.approx(float(theirs.ratio(p).above), rel=1e-12)


class Norm(NamedTuple):
    """Constants of the norm in doubles."""

    saddle: float
    upright: float
    weight: float
    torque: float
    turning: float


def slope(m: dict[str, float], norm: Norm, upright: float, aside: float) -> tuple[float, float]:
    """zeta and c of the page."""
    l = max(norm.weight * norm.torque, norm.turning / norm.weight)
    c = l + aside / math.sqrt(2)
    return 2 * c / (norm.saddle * upright - l), c


def ratio(m: dict[str, float], norm: Norm) -> float:
    return norm.torque * m["lean"] / (norm.saddle * m["m0"] ** 2)


def graph(m: dict[str, float], norm: Norm) -> float:
    """What is to be less than 1 for a graph over gamma3, and infinite where it cannot be told."""
    zeta, c = slope(m, norm, m["m0"], max(m["follow"], ratio(m, norm) * m["widest"]))
    T = m["lean"] / (m["thin"] * math.sqrt(2 * m["level"] / m["most"]))
    square = m["level"] / m["most"] - m["small"] ** 2
    pushed = m["mu"] / (2 * m["least"] * math.sqrt(square)) if square > 0 else math.inf
    if not (0 < zeta < 1 and T * pushed < 1):
        return math.inf
    lean = 1 + 2 * T * (pushed + 1 / norm.weight) / (1 - T * pushed)
    return math.exp(min(2 * c * m["time"], 700)) * (zeta + c * m["time"]) * lean


def norm_of(mine: connections.Middle) -> Norm:
    return Norm(*(float(x) for x in mine.growth))


Good: TypeAlias = Callable[[dict[str, float], Norm], bool]


def is_graph(m: dict[str, float], norm: Norm) -> bool:
    return graph(m, norm) < 1


def sides(numbers: sections.Numbers, name: str, good: Good, **held: float) -> Iterator[Any]:
    """The numbers for both just before and just beyond where a number of them ends what is good."""
    mine, _, m = middles(numbers, **held)
    norm = norm_of(mine)
    assert good(m, norm)
    end = next(x for x in (1e8, 1e-8) if not good(m | {name: m[name] * x}, norm))
    low, high = 0.0, math.log(end)
    for _ in range(60):
        half = (low + high) / 2
        there = m | {name: m[name] * math.exp(half)}
        low, high = (half, high) if good(there, norm) else (low, half)
    for by in (-0.002, 0.002):
        value = m[name] * math.exp(low + math.copysign(by, high * by))
        yield middles(numbers, **held | {name: value})[:2]


@pytest.mark.parametrize(
    "name",
    ["small", "level", "mu", "least", "most", "lean", "thin", "m0", "time", "widest", "follow"],
)
def test_C9_a_graph_over_gamma3(stored: Stored, name: str) -> None:
    """Each number in turn up to where it is none, for both."""
    # How far sets lie from the separatrix counts where the weight does.
    held = {"mu": 0.9 * heaviest(stored.numbers)} if name == "small" else {}
    within, beyond = sides(stored.numbers, name, is_graph, **held)
    for (mine, theirs), words in ((within, ""), (beyond, "C9: the")):
        agree(words, mine.check_graph, partial(script.check_graph, problem(), theirs))


def heaviest(numbers: sections.Numbers) -> float:
    """The weight up to which there is a graph."""
    return float(next(sides(numbers, "mu", is_graph))[0].mu)


@pytest.mark.parametrize(("share", "reason"), [(0.995, ""), (1.005, "C9: the weight")])
def test_C9_a_weight_that_turns_gamma_further_than_it_is_turned(
    stored: Stored, share: float, reason: str
) -> None:
    """Where T mu' is 1; before it all else is made small enough."""
    mine, theirs, m = middles(stored.numbers, time=1e-30, follow=0.0, lean=1e-9)
    T = m["lean"] / (m["thin"] * math.sqrt(2 * m["level"] / m["most"]))
    pushed = share / T
    mu = pushed * 2 * m["least"] * math.sqrt(m["level"] / m["most"] - m["small"] ** 2)
    for found in (
        said(mine._replace(mu=arb(mu)).check_graph),
        said(script.check_graph, problem(), theirs._replace(mu=Interval.of(Fraction(mu)))),
    ):
        # Short of it the graph is none either, for a pole is near.
        assert found.startswith(
            reason or "C9: the unstable surface is not shown to be a graph over"
        )


@pytest.mark.parametrize(
    ("upright", "aside", "good"),
    [
        (1.01, 0.0, True),
        (0.99, 0.0, False),
        (1.01, 0.3, True),
        (0.99, 0.3, False),
        (0.1, 0.0, False),
    ],
)
def test_C9_slopes_are_bounded_where_M3_is_large_enough(
    stored: Stored, upright: float, aside: float, good: bool
) -> None:
    """lambda m = l + 2 c is the limit; at a tenth of it the rate is negative, and so is zeta."""
    mine, _, _ = middles(stored.numbers)
    norm = norm_of(mine)
    l = max(norm.weight * norm.torque, norm.turning / norm.weight)
    m = upright * (l + 2 * (l + aside / math.sqrt(2))) / norm.saddle
    exactly = Interval.of(Fraction(m)), Interval.of(Fraction(aside))
    reasons = said(mine.slant, arb(m), arb(aside)), said(script.slant, problem(), *exactly)
    assert [reason[:2] for reason in reasons] == ["" if good else "C9"] * 2
    if good:
        zeta = slope({}, norm, m, aside)[0]
        assert float(mine.slant(arb(m), arb(aside))) == pytest.approx(zeta, rel=1e-9)
        assert float(script.slant(problem(), *exactly)[0].above) == pytest.approx(zeta, rel=1e-9)


class Strip(NamedTuple):
    """The stored strip, and what its first polynomials say of it in doubles."""

    line: Any
    piece: Any
    momentum: float
    upright: float
    """The least |M3|."""
    slopes: float
    """A_u + A_v."""


@pytest.fixture(scope="module")
def strip(stored: Stored) -> Strip:
    line, piece = stored.line, stored.orbits[4][0]
    norm = norm_of(middles(stored.numbers)[0])
    weights = [1, 0, norm.upright, *[1 / norm.weight] * 3]
    begin = begun(piece)
    slopes = sum(
        math.hypot(*(x * float(y.partial(name).bound) for x, y in zip(weights, begin, strict=True)))
        for name in "uv"
    )
    least = -float(begin[2].range.upper())
    return Strip(line, piece, float(begin[0].bound), least, slopes)


def surface(m: dict[str, float], norm: Norm, strip: Strip) -> dict[str, float]:
    """Each inequality of the strip as a number that is to be positive."""
    r0, wide = ratio(m, norm), float(strip.line.wide)
    n1 = strip.momentum * math.sqrt((1 + r0**2) / (1 - r0**2)) if r0 < 1 else math.inf
    left = m["level"] - m["most"] * n1**2
    zeta = slope(m, norm, math.sqrt(2 * left / m["kappa"]), r0 * n1)[0] if left > 0 else math.inf
    return {
        "begins": strip.upright - m["m1"],
        "sides": wide - r0 * strip.momentum,
        "left": left,
        "zeta": 1 - zeta if zeta > 0 else -1.0,
        "along": wide - zeta * strip.slopes if zeta > 0 else -1.0,
    }


def of_strip(
    stored: Stored, both: Sequence[Any], line: Any, piece: FamilyStep
) -> list[Callable[[], Any]]:
    """What both check of a strip, from their numbers of C8."""
    return [
        lambda: connections.check_strip(stored.numbers, both[0], line, piece),
        lambda: script.check_strip(problem(), both[1], script.Line(*line), step(piece)),
    ]


WORDS_OF_STRIP = {
    "m1": "to be beside",
    "lean": "pass between",
    "m0": "pass between",
    "level": "lie along",
    "kappa": "lie along",
    "most": "lie along",
}


@pytest.mark.parametrize("name", WORDS_OF_STRIP)
def test_C9_the_surface_is_a_curve_in_the_strip(stored: Stored, strip: Strip, name: str) -> None:
    """Each number in turn up to where nothing is told any more, for both."""
    both = sides(stored.numbers, name, lambda m, norm: min(surface(m, norm, strip).values()) > 0)
    for numbers, words in zip(both, ("", WORDS_OF_STRIP[name]), strict=True):
        agree(words, *of_strip(stored, numbers, strip.line, strip.piece))


@pytest.mark.parametrize(("factor", "words"), [(1.01, "be a graph"), (0.99, "to be beside")])
def test_C9_an_energy_that_the_strip_has_itself(
    stored: Stored, strip: Strip, factor: float, words: str
) -> None:
    """As h - mu sinks to K n1^2 nothing is left for M3."""
    mine, _, m = middles(stored.numbers)
    r0 = ratio(m, norm_of(mine))
    level = factor * m["most"] * strip.momentum**2 * (1 + r0**2) / (1 - r0**2)
    both = middles(stored.numbers, level=level)
    agree(words, *of_strip(stored, both, strip.line, strip.piece))


@pytest.mark.parametrize("words", ["to be beside", "pass between", "u lie along", "v lie along"])
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_C9_how_far_the_strip_may_be_from_its_polynomials(
    stored: Stored, strip: Strip, words: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its points and their derivatives are off by what C1 says, up to where nothing is told."""
    # The surface may be between the sides where M3 is allowed to be off, or M3 anything.
    other = {"to be beside": {"lean": 1e-9}, "pass between": {"m1": -9.0}}
    mine, theirs, m = middles(stored.numbers, **other.get(words, {}))
    norm, wide = norm_of(mine), float(strip.line.wide)
    r0, bounds = ratio(m, norm), [0.0] * 4
    n1 = strip.momentum * math.sqrt((1 + r0**2) / (1 - r0**2))
    upright = math.sqrt(2 * (m["level"] - m["most"] * n1**2) / m["kappa"])
    left = wide / slope(m, norm, upright, r0 * n1)[0] - strip.slopes
    most = {
        "to be beside": norm.upright * (strip.upright - m["m1"]),
        "pass between": wide / r0 - strip.momentum,
    }
    bounds[{"u": 1, "v": 2}.get(words[0], 0)] = factor * most.get(words, left)
    balls, exactly = list(map(arb, bounds)), list(map(Fraction, bounds))
    monkeypatch.setattr(connections, "line_beginning", lambda *_: ([], balls))
    monkeypatch.setattr(script, "line_beginning", lambda *_: exactly)
    for check in of_strip(stored, (mine, theirs), strip.line, strip.piece):
        assert (words.removeprefix("u ").removeprefix("v ") in said(check)) is (factor > 1)


def test_C9_a_line_alone_is_no_strip(stored: Stored, strip: Strip) -> None:
    """Neither is one that is turned over, both with the polynomials that are theirs."""
    for side in (0, -1):
        line = strip.line._replace(wide=side * strip.line.wide)
        terms = [
            {at: w * side ** at[2] for at, w in each.items() if side ** at[2]}
            for each in strip.piece.terms
        ]
        piece = strip.piece._replace(terms=terms)
        agree("pass between", *of_strip(stored, middles(stored.numbers), line, piece))


class Across(NamedTuple):
    """Images as linear functions: derivatives of d and of g in u and v."""

    strip: tuple[float, float, float, float] = (2e-4, 1e-5, 0.5, 0.02)
    image: tuple[float, float, float, float] = (3e-4, 2e-5, 0.25, 0.01)
    sheets: tuple[float, ...] = (0.5, 0.4)
    reach: float = 0.4

    def checks(self) -> list[Callable[[], Any]]:
        """C9 of them by both."""
        box = [arb(1), arb(0), arb(0.5)]
        of = [
            arrived([whole({(0, 1, 0): 2 * x, (0, 0, 1): 2 * y}) for x, y in (by[:2], by[2:])], box)
            for by in (self.strip, self.image)
        ]
        mine, theirs = zip(*of, strict=True)
        sheets = [Interval.of(Fraction(x)) for x in self.sheets]
        own = mine[0], arb(self.reach), [arb(x) for x in self.sheets], mine[1:]
        other = theirs[0], Fraction(self.reach), sheets, theirs[1:]
        return [
            lambda: connections.check_crossings(*own),
            lambda: script.check_crossings(*other),
        ]


# The strip's slope is within (2e-4 -+ 1e-5)/(0.5 -+ 0.02).
STEEP, FLAT = 2.1e-4 / 0.48, 1.9e-4 / 0.52
# The strip's image goes as far as 0.5 less 0.02.
CROSSINGS = {
    "all of it": (Across(), ""),
    "turned": (Across(strip=(-2e-4, 1e-5, -0.5, 0.02)), ""),
    "downward": (Across(strip=(-2e-4, 1e-5, 0.5, 0.02), image=(-3e-4, 2e-5, 0.25, 0.01)), ""),
    "one sheet": (Across(sheets=(-0.5, -0.4)), ""),
    "two sheets": (Across(sheets=(0.5, -0.4)), "one sheet"),
    "no sheet": (Across(sheets=(0.5, 0.0)), "one sheet"),
    "reaches": (Across(reach=0.4799), ""),
    "does not reach": (Across(reach=0.4801), "reach as far"),
    "an angle": (Across(strip=(2e-4, 1.999e-4, 0.5, 0.02), image=(3e-4, 0, 0.25, 0)), ""),
    "no angle": (Across(strip=(2e-4, 2.001e-4, 0.5, 0.02)), "each other"),
    "no graph": (Across(strip=(2e-4, 1e-5, 0.5, 0.501), reach=-1.0), "each other"),
    # d + s g grows with u by at least -c + s/4, and with v by at most 2e-5 + s/100.
    "crosses": (Across(image=(2e-5 + 0.01 * STEEP - 0.25 * FLAT + 1e-8, 2e-5, 0.25, 0.01)), ""),
    "is along": (
        Across(image=(2e-5 + 0.01 * STEEP - 0.25 * FLAT - 1e-8, 2e-5, 0.25, 0.01)),
        "the stable surface",
    ),
    "crosses the other way": (Across(image=(-2e-5 - 0.26 * STEEP - 1e-8, 2e-5, 0.25, 0.01)), ""),
    "is along it the other way": (
        Across(image=(-2e-5 - 0.26 * STEEP + 1e-8, 2e-5, 0.25, 0.01)),
        "the stable surface",
    ),
}


@pytest.mark.parametrize("name", CROSSINGS)
def test_C9_images_cross_at_an_angle(name: str) -> None:
    across, words = CROSSINGS[name]
    agree(words, *across.checks())


def test_the_second_checker_takes_points_of_sets_as_wide_as_they_are_told(
    stored: Stored, monkeypatch: pytest.MonkeyPatch
) -> None:
    """gamma2 of a set to 2^-5, which C1 leaves open; of images it is enclosed already."""
    nothing = [Interval.of(0)] * 3
    found: Any = [SimpleNamespace(begin=nothing, box=nothing, g=script.Series.of(0))] * 5
    for name in ("check_middle", "check_strip", "check_graph", "farthest"):
        monkeypatch.setattr(script, name, lambda *_: None)
    asked: list[Any] = []
    monkeypatch.setattr(script, "check_crossings", lambda *of: asked.append(of))
    quads = list(map(quad_of, stored.quads))
    strip: Any = None, None, found[4]
    script.check_transversal(problem(), strip, quads, found[:4])
    [(start, _, sheets, images)] = asked
    assert (start, images) == (found[4], found[2:4])
    assert sorted(float(x.above) for x in sheets) == [0.0] * 3 + [2.0**-5] * 2
    assert sorted(-float((-x).above) for x in sheets) == [-(2.0**-5)] * 2 + [0.0] * 3


@pytest.mark.slow
def test_the_unstable_surface_is_where_C9_says_in_113_bits(stored: Stored) -> None:
    """Points of it in the strip, found by where orbits backward leave, and where they cross M3 = 0.

    They are nearer to each other across the strip than along it, and cross on a curve whose slope
    the proof encloses.
    """

    pieces, found = stored.orbits[4], []
    slope, begin = connections.slope_of(stored.image), begun(pieces[0])
    for u in (-0.9, 0.1, 0.8):
        low, high = -1.0, 1.0
        for _ in range(4):
            v = np.linspace(low, high, 17)
            side = leaves(begin, u, v)
            assert side[0] == -side[-1] != 0
            change = int(np.flatnonzero(side[1:] != side[:-1])[0])
            low, high = v[change], v[change + 1]
        v0 = (low + high) / 2
        assert high - low < 1e-3
        found.append((u, v0, *crossed(pieces, u, v0)))
    points = np.array(found)
    assert np.abs(points[:, 1]).max() < 0.5
    for k, j in ((0, 1), (0, 2), (1, 2)):
        du, dv, dd, dg = points[j] - points[k]
        assert abs(dv) <= abs(du)
        assert slope.contains(arb(float(dd / dg)))


def strip_states(begin: Any, u: float, v: Any) -> Any:
    """States (6, n) of the strip's first polynomials, in doubles."""
    return np.array([
        [value(each, u, float(x)) for x in v] for each in begin
    ])  # fmt: skip


def crossed(pieces: Sequence[FamilyStep], u: float, v: float) -> tuple[float, float]:
    """d and gamma3 of the crossing of an orbit of a strip, in 113 bits."""
    begin = WIDE.array(strip_states(begun(pieces[0]), u, np.array([v])))
    end = crossings(begin, duration(pieces, u, v)).states[:, 0]
    return float(end[1]), float(end[5])


def leaves(begin: Any, u: float, v: Any) -> Any:
    """On which side orbits backward from a strip leave, in 113 bits."""
    # Backward in time is forward beside the mirror image.
    mirrored = strip_states(begin, u, v) * np.array([1, 1, -1, 1, 1, -1])[:, None]
    past = states_at(flow().aligned, WIDE.array(mirrored), WIDE.array([26.0]), 113)
    return np.sign(np.asarray(past)[1, 0].astype(float))
