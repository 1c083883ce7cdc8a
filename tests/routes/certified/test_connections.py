"""Connections: what orbits do beside the sets, how surfaces cross; limits as both checkers tell."""

import itertools
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any
from unittest.mock import Mock, patch

import numpy as np
import pytest
from flint import arb

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.certified import connections, sections
from rigidpend.routes.certified.proof_data import StartLine, Undecided
from scripts import check_connections, check_sections
from scripts.check_certificate import Fails, Interval
from tests.routes.certified import offered
from tests.routes.certified.offered import WIDE, Stored, agree, problem, said, same_limit, whole

# ---- C8


BODIES = [(("2", "1", "3/2"), ("1", "1", "0")), (("57/50", "1", "128/125"), ("1", "3", "0"))]


@pytest.mark.parametrize(
    ("words", "body", "good", "bad"),
    [
        ("C8: M3 is not shown to rise", 0, 0.2, 0.3),
        ("C8: orbits beside", 1, 5e-4, 2e-3),
        ("C8: the middle", 0, 0.07, 0.12),
        ("C8: M3 is not shown to fall", 0, 0.01, 0.03),
    ],
)
def test_C8_each_fails_beyond_its_own_weight(
    words: str, body: int, good: float, bad: float
) -> None:
    same_limit(words, good, bad, lambda mu: of_middle(*of_body(*BODIES[body], mu), 1e-3))


def test_C8_how_far_from_the_separatrix_sets_may_lie(stored: Stored) -> None:
    same_limit("C8: orbits beside", 1e-3, 1.0, lambda d: of_middle(stored.numbers, problem(), d))


@pytest.mark.parametrize("mu", [0.01, 0.02, 0.07, 0.3, 30.0])
def test_C8_and_the_graph_of_C9_hold_of_a_lighter_body(mu: float) -> None:
    """However heavy it is, and where each of the doubts says that this would help."""
    weights = itertools.takewhile(lambda x: x > 1e-6, (mu / 4**k for k in itertools.count()))
    numbers = [of_body(*BODIES[0], weight)[0] for weight in weights]
    doubts = [
        said(lambda x=x: connections.check_middle(x, arb(1e-4)).check_graph()) for x in numbers
    ]
    assert doubts[0].endswith("; a smaller mu/h would help")
    assert doubts == sorted(doubts, key=bool, reverse=True)
    assert doubts[-1] == ""


def test_a_body_that_is_too_heavy_is_named_before_the_strip_that_it_lacks(monkeypatch: Any) -> None:
    """By both, of crossings next to the separatrix."""
    monkeypatch.setattr(connections, "check_strip", Mock(side_effect=Undecided("no strip")))
    monkeypatch.setattr(check_connections, "check_strip", Mock(side_effect=Fails("no strip")))
    mine, theirs = offered.arrived([offered.constant(1e-4), offered.constant(0)], [arb(1)] * 3)
    nothing: Any = None
    for mu, words in ((1e-3, "no strip"), (6e-3, "C9: the unstable surface is not shown to be a")):
        numbers, p = of_body(*BODIES[0], mu)
        agree(
            words,
            partial(connections.prove_transversal, numbers, (nothing, [nothing], mine), [], []),
            partial(check_connections.check_transversal, p, (nothing, nothing, theirs), [], []),
        )


def of_body(A: Any, r: Any, weight: float) -> tuple[sections.Numbers, check_sections.Problem]:
    """The numbers of a body for both."""
    mu = Fraction(weight).limit_denominator(10**9)
    given = {"A": A, "r": r, "mu": f"{mu.numerator}/{mu.denominator}", "h": offered.GIVEN["h"]}
    body = Body(A=A, r=r, mu=given["mu"])
    return sections.Numbers.of(body, exact(offered.GIVEN["h"])), check_sections.problem_of(given)


def of_middle(
    numbers: sections.Numbers, p: check_sections.Problem, d: float
) -> list[Callable[[], Any]]:
    """C8 by both, of orbits as far as d from the separatrix."""
    return [
        lambda: connections.check_middle(numbers, arb(d)),
        lambda: check_connections.check_middle(p, Fraction(d)),
    ]


# ---- C9

FIELDS = connections.Middle._fields[1:]
"""Numbers of C8, in the order of both checkers."""


def middles(numbers: sections.Numbers, **changed: float) -> tuple[Any, Any]:
    """Those of Fig. 4's body, some of them changed, for both."""
    mine = connections.check_middle(numbers, arb(1e-3))
    balls: Any = {name: arb(x) for name, x in changed.items()}
    theirs = check_connections.check_middle(problem(), Fraction(1, 1000))
    kept = dict(zip(FIELDS, theirs._fields, strict=True))
    exactly: Any = {kept[name]: Interval.of(Fraction(x)) for name, x in changed.items()}
    return mine._replace(**balls), theirs._replace(**exactly)


@pytest.mark.parametrize(("A", "r"), BODIES)
def test_both_have_the_same_numbers_of_C8(A: Any, r: Any) -> None:
    """Of Fig. 4's body k and K are the same, of the other one they are not."""
    numbers, p = of_body(A, r, 5e-4)
    mine = connections.check_middle(numbers, arb(1e-3))
    theirs = check_connections.check_middle(p, Fraction(1, 1000))
    for name, x in zip(FIELDS, theirs, strict=True):
        found = float(Interval.of(x).above)
        assert found == pytest.approx(float(getattr(mine, name)), rel=1e-12, abs=0), name
    assert float(mine.share) == pytest.approx(float(theirs.ratio(p).above), rel=1e-12, abs=0)


def of_graph(stored: Stored, **numbers: float) -> list[Callable[[], Any]]:
    """C9 of the graph over gamma3 by both, some numbers of C8 changed."""
    mine, theirs = middles(stored.numbers, **numbers)
    return [mine.check_graph, lambda: check_connections.check_graph(problem(), theirs)]


OFF = ("off", "off_u", "off_v")
"""How far a strip's points and their derivatives are from its polynomials, as C1 says."""


def of_strip(
    stored: Stored, line: StartLine | None = None, piece: Any = None, **numbers: float
) -> list[Callable[[], Any]]:
    """C9 of the stored strip or of another by both, some numbers of C1 and C8 changed."""
    line, piece = line or stored.line, piece or stored.orbits[4][0]
    bounds = [numbers.pop(name, 0.0) for name in OFF]
    mine, theirs = middles(stored.numbers, **numbers)

    def by_package() -> None:
        with patch.object(connections, "beginning", lambda *_: ([], list(map(arb, bounds)))):
            connections.check_strip(stored.numbers, mine, line, piece)

    def by_script() -> None:
        with patch.object(
            check_connections, "line_beginning", lambda *_: list(map(Fraction, bounds))
        ):
            check_connections.check_strip(
                problem(), theirs, offered.line_of(line), offered.step(piece)
            )

    return [by_package, by_script]


@pytest.mark.parametrize(
    ("of", "name", "words", "times", "held"),
    [
        # How far sets lie from the separatrix counts where the weight does.
        (of_graph, "small", "C9: the", 1e3, {"mu": 0.18}),
        (of_graph, "level", "C9: the", 1e-3, {}),
        (of_graph, "mu", "C9: the", 1e3, {}),
        (of_graph, "least", "C9: the", 1e-3, {}),
        (of_graph, "most", "C9: the", 1e2, {}),
        (of_graph, "lean", "C9: the", 1e1, {}),
        (of_graph, "thin", "C9: the", 1e-1, {}),
        (of_graph, "m0", "C9: the", 1e-1, {}),
        (of_graph, "time", "C9: the", 1e1, {}),
        (of_graph, "widest", "C9: the", 1e1, {}),
        (of_graph, "follow", "C9: the", 1e1, {}),
        # The weight turns gamma further than it is turned; before that all else is small enough.
        (of_graph, "mu", "C9: the weight", 1e15, {"time": 1e-30, "follow": 0.0, "lean": 1e-9}),
        (of_strip, "m1", "to be beside", 1e1, {}),
        (of_strip, "lean", "pass between", 1e2, {}),
        (of_strip, "m0", "pass between", 1e-1, {}),
        (of_strip, "level", "C9: the", 1e-2, {}),
        (of_strip, "kappa", "C9: the", 1e2, {}),
        (of_strip, "most", "C9: the", 1e9, {}),
        # As h - mu sinks to K n1^2 nothing is left for M3; r0 counts where it is large.
        (of_strip, "level", "to be beside", 1e-9, {"lean": 12.0}),
        # The surface may be between the sides where M3 is allowed to be off, or M3 anything.
        (of_strip, "off", "to be beside", 1e9, {"lean": 1e-9}),
        (of_strip, "off", "pass between", 1e9, {"m1": -9.0}),
        (of_strip, "off_u", "lie along", 1e9, {}),
        (of_strip, "off_v", "lie along", 1e9, {}),
    ],
)
def test_C9_each_number_may_change_until_nothing_is_told_any_more(
    stored: Stored, of: Any, name: str, words: str, times: float, held: dict[str, float]
) -> None:
    """By so many times at most; without that all is told."""
    size = 1e-9 if name in OFF else float(getattr(middles(stored.numbers)[0], name))
    agree("", *of(stored, **held))
    same_limit(words, size, times * size, lambda x: of(stored, **held | {name: x}))


@pytest.mark.parametrize("aside", [0.0, 0.3])
def test_C9_slopes_are_less_than_1_where_M3_is_large_enough(stored: Stored, aside: float) -> None:
    mine, _ = middles(stored.numbers)

    def both(upright: float) -> list[Callable[[], Any]]:
        exactly = [Interval.of(Fraction(x)) for x in (upright, aside)]
        return [
            lambda: mine.slant(arb(upright), arb(aside)),
            lambda: check_connections.slant(problem(), *exactly)[0].above,
        ]

    limit = same_limit("C9", 10.0, 0.1, both)
    found, other = (float(check()) for check in both(2 * limit))
    assert found == pytest.approx(other, rel=1e-9)


@pytest.mark.parametrize("side", [0, -1])
def test_C9_a_line_alone_is_no_strip(stored: Stored, side: int) -> None:
    """Neither is one that is turned over, both with the polynomials that are theirs."""
    line, first = stored.line._replace(wide=side * stored.line.wide), stored.orbits[4][0]
    terms = [
        {at: w * side ** at[2] for at, w in each.items() if side ** at[2]} for each in first.terms
    ]
    checks = of_strip(stored, line, first._replace(terms=terms))
    agree("pass between", *checks)
    assert said(checks[0]).endswith("; a J1_0 of about 1e-9 J2_0 may help")


STRIP, IMAGE = (2e-4, 1e-5, 0.5, 0.02), (3e-4, 2e-5, 0.25, 0.01)
"""Images as linear functions: derivatives of d and of g in u and v."""
# The strip's slope is within (2e-4 -+ 1e-5)/(0.5 -+ 0.02).
STEEP, FLAT = 2.1e-4 / 0.48, 1.9e-4 / 0.52
# d + s g of an image grows with u by at least -c + s/4, and with v by at most 2e-5 + s/100.
LEAST, OTHER = 2e-5 + 0.01 * STEEP - 0.25 * FLAT, -2e-5 - 0.26 * STEEP


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, ""),
        ({"strip": (-2e-4, 1e-5, -0.5, 0.02)}, ""),
        ({"strip": (-2e-4, 1e-5, 0.5, 0.02), "image": (-3e-4, 2e-5, 0.25, 0.01)}, ""),
        ({"sheets": (-0.5, -0.4)}, ""),
        ({"sheets": (0.5, -0.4)}, "one sheet"),
        ({"sheets": (0.5, 0.0)}, "one sheet"),
        # The strip's image goes as far as 0.5 less 0.02.
        ({"reach": 0.4799}, ""),
        ({"reach": 0.4801}, "reach as far"),
        ({"reach": 0.45, "aside": 0.0301}, "reach as far"),
        ({"reach": 0.45, "aside": -0.0301}, "reach as far"),
        ({"reach": 0.45, "aside": 0.0299}, ""),
        ({"reach": 0.45, "aside": -0.0299}, ""),
        ({"strip": (2e-4, 1.999e-4, 0.5, 0.02), "image": (3e-4, 0, 0.25, 0)}, ""),
        ({"strip": (2e-4, 2.001e-4, 0.5, 0.02)}, "each other"),
        ({"strip": (2e-4, 1e-5, 0.5, 0.501), "reach": -1.0}, "each other"),
        ({"image": (LEAST + 1e-8, *IMAGE[1:])}, ""),
        ({"image": (LEAST - 1e-8, *IMAGE[1:])}, "the stable surface"),
        ({"image": (OTHER - 1e-8, *IMAGE[1:])}, ""),
        ({"image": (OTHER + 1e-8, *IMAGE[1:])}, "the stable surface"),
    ],
)
def test_C9_images_cross_at_an_angle(changed: dict[str, Any], words: str) -> None:
    given: Any = {"strip": STRIP, "image": IMAGE, "sheets": (0.5, 0.4), "reach": 0.4} | changed
    box, aside = [arb(1), arb(0), arb(0.5)], given.get("aside", 0.0)

    def image(d_u: float, d_v: float, g_u: float, g_v: float) -> Any:
        g = {(0, 1, 0): 2 * g_u, (0, 0, 1): 2 * g_v, (0, 0, 0): 2 * aside}
        return offered.arrived([whole({(0, 1, 0): 2 * d_u, (0, 0, 1): 2 * d_v}), whole(g)], box)

    of = [image(*given[name]) for name in ("strip", "image")]
    mine, theirs = zip(*of, strict=True)
    sheets, reach = given["sheets"], given["reach"]
    own = mine[0], arb(reach), [arb(x) for x in sheets], mine[1:]
    exactly = [Interval.of(Fraction(x)) for x in sheets]
    assert ("; a J1_0 of about 1e-9 J2_0" in said(connections.check_crossings, *own)) == (
        words == "reach as far"
    )
    agree(
        words,
        lambda: connections.check_crossings(*own),
        lambda: check_connections.check_crossings(theirs[0], Fraction(reach), exactly, theirs[1:]),
    )


@pytest.mark.slow
def test_the_unstable_surface_is_where_C9_says_in_pairs_of_doubles(stored: Stored) -> None:
    """Points where orbits backward leave are nearer across the strip than along, on a curve."""
    pieces, found = stored.orbits[4], list[Any]()
    begin = sections.begun(pieces[0])
    # Backward in time is forward beside the mirror image.
    mirror = np.array([1, 1, -1, 1, 1, -1])[:, None]
    for u in (-0.9, 0.8):
        low, high = -1.0, 1.0
        for _ in range(3):
            v = np.linspace(low, high, 17)
            states = np.array([offered.value(each, u, v) + 0 * v for each in begin])
            past = states_at(
                offered.FIELD, WIDE.array(mirror * states), WIDE.array([26.0]), WIDE.bits
            )
            side = np.sign(np.asarray(past)[1, 0].astype(float))
            assert side[0] == -side[-1] != 0
            change = int(np.flatnonzero(side[1:] != side[:-1])[0])
            low, high = v[change : change + 2].tolist()
        here = WIDE.array(states[:, change : change + 1])
        end = offered.crossings(here, offered.duration(pieces, u, low))[0][:, 0]
        found.append(np.array([u, low, *end[[1, 5]].astype(float)]))
    du, dv, dd, dg = found[1] - found[0]
    assert abs(dv) <= abs(du)
    assert connections.slope_of(stored.arrivals[4]).contains(arb(float(dd / dg)))
