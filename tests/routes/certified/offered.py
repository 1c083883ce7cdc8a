"""What is offered to both checkers: the stored full shift, steps of one orbit, forms of both."""

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import aligned
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.poincare import state_of
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.certified import approximation, intervals, passages, proof_data, sections
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.orbit import enclosed, proof_of
from rigidpend.routes.certified.proof_data import (
    CLOCK,
    FamilyStep,
    Quad,
    StartLine,
    Step,
    Undecided,
)
from rigidpend.routes.problem import RouteProblem
from scripts import (
    check_certificate,
    check_full_shift,
    check_intervals,
    check_passages,
    check_proof_data,
    check_sections,
    check_series,
)
from scripts.check_certificate import Fails, Interval
from tests.cli.calls import REFERENCE
from tests.experiments.trees import reference

GIVEN: Any = {"A": ("2", "1", "3/2"), "r": ("1", "1", "0"), "mu": "1/1000", "h": "1.3342"}
H0, J1 = exact("1.3342"), Fraction("1e-8")
CONFIG = Path(__file__).parents[3] / "configs" / "full_shift.yaml"
STORED = REFERENCE / "full_shift.h5"
BODY = Body(A=GIVEN["A"], r=GIVEN["r"], mu=GIVEN["mu"])
BARELY = 0.005
"""Share of a limit by which it is kept or broken."""
BITS = 60
CALM: dict[Any, int] = {(0, 0, 0): 0}
"""Terms of a component that is zero."""


def problem() -> check_sections.Problem:
    return check_sections.problem_of(GIVEN)


def series(terms: Mapping[Any, int], bits: int) -> check_series.Series:
    """Terms as the second checker reads them."""
    found = {at: w * (1 if at[0] == 0 else 2) for at, w in terms.items()}
    return check_series.Series.made(found, bits + 1)


def step(piece: FamilyStep) -> check_sections.Step:
    states = [series(terms, piece.bits) for terms in piece.terms]
    return check_sections.Step(series(piece.half_length, check_proof_data.CLOCK), states)


def of_one(orbit: Sequence[Any]) -> list[FamilyStep]:
    """The steps of one orbit as those of a family, the same for all its orbits."""
    return [
        FamilyStep(
            bits,
            {(0, 0, 0): half << (CLOCK - proof_data.ORBIT_CLOCK + 1)},
            [{(j, 0, 0): w for j, w in enumerate(row)} for row in rows],
        )
        for half, bits, rows in orbit
    ]


def quad_of(quad: Quad) -> check_sections.Quad:
    p, *moves = map(list, quad.p)
    return check_sections.Quad(*quad[:5], p, moves)


def line_of(line: StartLine) -> check_sections.Line:
    J1, e1, e2, (centre, *moves), half, wide = line
    return check_sections.Line(J1, e1, e2, centre, half, moves, wide)


def interval(x: arb) -> Interval:
    (m, e), radius = x.mid().man_exp(), Fraction(float(x.rad().upper()))
    middle = Fraction(int(m)) * Fraction(2) ** int(e)
    return Interval(Interval.of(middle - radius).low, Interval.of(middle + radius).high)


def constant(x: float) -> dict[Any, int]:
    return whole({(0, 0, 0): 2 * x})


def whole(terms: Mapping[Any, float]) -> dict[Any, int]:
    return {at: round(x * 2**BITS) for at, x in terms.items()}


def said(check: Callable[..., Any], *arguments: Any) -> str:
    """The reason for which something is not shown; empty where it is."""
    try:
        check(*arguments)
    except (Undecided, Fails) as doubt:
        return str(doubt)
    return ""


def agree(words: str, *checks: Callable[[], Any]) -> None:
    """Each is refused in these words, or none where there are no words."""
    for check in checks:
        found = said(check)
        assert words in found, found
        assert bool(found) is bool(words), found


def same_limit(
    words: str,
    good: float,
    bad: float,
    checks: Callable[[float], Sequence[Callable[[], Any]]],
    barely: float = BARELY,
) -> float:
    """The number beyond which all refuse in these words, by the first one; at `bad` in any."""
    low, high = math.log(good), math.log(bad)
    while abs(high - low) > barely / 2:
        half = (low + high) / 2
        low, high = (low, half) if words in said(checks(math.exp(half))[0]) else (half, high)
    beside = math.copysign(barely, high - low)
    for check in checks(math.exp(low - beside)):
        assert words not in said(check)
    for check in checks(math.exp(high + beside)):
        assert words in said(check)
    assert all(map(said, checks(bad)))
    return math.exp(low)


def moved(piece: FamilyStep, component: int, at: Any, by: float) -> FamilyStep:
    """A step of which a coefficient is off."""
    terms = [dict(each) for each in piece.terms]
    terms[component][at] = terms[component].get(at, 0) + round(by * 2**piece.bits)
    return piece._replace(terms=terms)


def for_script(
    source: Quad | StartLine, steps: Sequence[FamilyStep]
) -> tuple[Any, list[check_sections.Step]]:
    """A set or a line with its steps, for the second checker."""
    other: Any = line_of(source) if isinstance(source, StartLine) else quad_of(source)
    return other, list(map(step, steps))


def in_units(k: int, source: Any, orbit: Sequence[FamilyStep]) -> tuple[Any, list[FamilyStep]]:
    """A set or a line with its steps, M being 2^k times as large: exactly, but for half-lengths."""
    by, up, down = Fraction(2) ** k, max(k, 0), max(-k, 0)
    if isinstance(source, Quad):
        a, b, l0, l1 = (by * x for x in source[1:5])
        other: Any = Quad(
            source.rising, a, b, l0, l1, tuple(tuple(by * x for x in p) for p in source.p)
        )
    else:
        other = source._replace(J1=by * source.J1, wide=by * source.wide)
    steps = []
    for piece in orbit:
        terms = [
            {at: w << (up if j < 3 else down) for at, w in each.items()}
            for j, each in enumerate(piece.terms)
        ]
        half = {at: round(w / by) for at, w in piece.half_length.items()}
        steps.append(FamilyStep(piece.bits + down, half, terms))
    return other, steps


def arrived(
    rows: Sequence[Mapping[Any, int]], box: Sequence[arb]
) -> tuple[Any, check_passages.Arrival]:
    """Crossings with d and g as terms, for both."""
    at, up = (Family.of(row, BITS) for row in rows)
    slopes = [(at.partial(x), up.partial(x), sections.W_FAMILY.partial(x)) for x in "uvw"]
    Q, gamma1, gamma2 = box
    there = Q, gamma1, gamma2
    mine = passages.Reached(at, up, True, there, 0.0, 0.0, (1.0, 1.0), list(box), slopes)
    d, g = (series(row, BITS) for row in rows)
    along = [
        (d.partial(i), g.partial(i), check_series.Series.of(i == 3)) for i in check_series.ALONG
    ]
    return mine, check_passages.Arrival(
        d, g, 1, [interval(x) for x in box], [], Interval.of(0), along
    )


def value(family: Family, u: float, v: Any = 0.0, w: float = 0.0) -> Any:
    """At the end z = 1, of what does not depend on time; v may be an array."""
    terms = ((map(int, at), int(c)) for at, c in family.doubled.to_dict().items())
    total = sum(c * u**k * v**l * w**m for (_, k, l, m), c in terms)
    return total / 2.0 ** (family.bits + 1)


WIDE = precision(106)
"""In which the orbits are followed that proofs are held against."""
FLOW = coefficients(BODY.angles(160), "1", WIDE)
FIELD = FLOW.aligned


def points(quad: Quad, u: Any, v: Any, h: Any = Fraction(GIVEN["h"])) -> Any:
    """States (6, n) of points of a set, at one energy."""
    a = WIDE
    by_u, by_v, l0, l1 = (a.number(x) for x in (quad.a, quad.b, quad.l0, quad.l1))
    u, v = a.array(list(map(a.number, u))), a.array(list(map(a.number, v)))
    g = (by_u * u - by_v * v - l0) / l1
    d = 0 * g
    for x in quad.p[0][::-1]:
        d = d * g + a.number(x)
    return state_of(quad.rising, d + by_u * u, a.sqrt(1 - g * g), -g, a.number(h), FLOW, a)


def crossings(begin: Any, time: float) -> tuple[Any, Any]:
    """Crossings of M3 = 0 of orbits, and when, after a time beside them, by arcs that get short."""
    end = states_at(FIELD, begin, WIDE.array([time]), WIDE.bits)[:, -1]
    late = 0 * end[0]
    for _ in range(4):
        passed = -end[2] / np.array(aligned(end, FIELD))[2]
        end, late = states_at(FIELD, end, passed[None], WIDE.bits)[:, -1], late + passed
    return end, late


def duration(pieces: Sequence[FamilyStep], *place: float) -> float:
    """Time of the polynomials at a place of a set."""
    return sum(2 * value(Family.of(piece.half_length, CLOCK), *place) for piece in pieces)


PHASE, DEPTH = exact("1"), 60
"""That of a start, and halvings of an interval about it that is hardly more than a point."""


class Start(NamedTuple):
    """A config, and what both say of its orbit and of all those beside it."""

    A: tuple[str, str, str] = GIVEN["A"]
    r: tuple[str, str, str] = GIVEN["r"]
    mu: str = "1/1000"
    h0: str = "6671/5000"
    J1_0: str = "1e-8"

    @property
    def problem(self) -> RouteProblem:
        body = Body(A=self.A, r=self.r, mu=self.mu)
        return RouteProblem(body, exact(self.h0), exact(self.J1_0), 1)

    def approximation(self, bits: int, Qm: float = 0.0) -> approximation.Approximation:
        """The orbit, or one from a state of which Qm is off."""
        start = enclosed(self.problem, PHASE, bits + 64)
        state = [x + Qm * (k == 1) for k, x in enumerate(start.state)]
        return approximation.Approximation(start.numbers.field, state)

    def checks(self, steps: Sequence[Step]) -> list[Callable[[], Any]]:
        """Of the orbit, whose last crossing is never reached."""

        def by_package() -> None:
            reason = proof_of(self.problem, PHASE, steps).reason
            if reason != "the steps end before the last crossing":
                raise Undecided(reason)

        def by_script() -> None:
            other = [check_certificate.Step(*step) for step in steps]
            if reason := check_certificate.prove(self._asdict(), PHASE.text, other).reason:
                raise Fails(reason)

        return [by_package, by_script]

    def checks_of_interval(self, steps: Sequence[Step]) -> list[Callable[[], Any]]:
        """Of the orbits beside it, as if all were as that one."""
        starts = intervals.EnclosedStarts.of(self.problem.body, exact(self.h0), Fraction(self.J1_0))
        place = math.floor(float(PHASE) / (2 * math.pi) * 2**DEPTH)
        own, again = of_one(steps), [step(x) for x in of_one(steps)]
        return [
            lambda: intervals.symbols(starts, intervals.PhaseInterval(place, DEPTH), own),
            lambda: check_intervals.prove(self._asdict(), place, DEPTH, again),
        ]


class Stored:
    """The stored full shift, followed once by each checker; M is 2^k times as large as it is."""

    def __init__(self, k: int = 0) -> None:
        self.k = k
        self.given = GIVEN | {
            name: str(Fraction(GIVEN[name]) * Fraction(4) ** k) for name in ("mu", "h")
        }

    @cached_property
    def data(self) -> Any:
        return reference("full_shift")["data"]

    @cached_property
    def every(self) -> list[tuple[Any, list[FamilyStep]]]:
        """The four sets and the line, with their steps."""
        sources = (
            *proof_data.unpacked_quads(self.data["sets"]),
            proof_data.unpacked_line(J1, self.data["line"]),
        )
        orbits = proof_data.unpacked(self.data["proof"], 5)
        return [in_units(self.k, *each) for each in zip(sources, orbits, strict=True)]

    @cached_property
    def quads(self) -> list[Quad]:
        return [source for source, _ in self.every[:4]]

    @cached_property
    def line(self) -> StartLine:
        return self.every[4][0]

    @cached_property
    def orbits(self) -> list[list[FamilyStep]]:
        """Steps of the four sets and of the line."""
        return [steps for _, steps in self.every]

    @cached_property
    def numbers(self) -> sections.Numbers:
        body = Body(*(self.given[name] for name in ("A", "r", "mu")))
        return sections.Numbers.of(body, exact(self.given["h"]))

    @cached_property
    def problem(self) -> check_sections.Problem:
        return check_sections.problem_of(self.given)

    @cached_property
    def arrivals(self) -> list[passages.Reached]:
        """Those of the four sets and of the line."""
        starts: list[Quad | StartLine] = [*self.quads, self.line]
        of = zip(starts, self.orbits, strict=True)
        return [passages.arrival(self.numbers, *each) for each in of]

    @cached_property
    def theirs(self) -> list[check_passages.Arrival]:
        """The same by the second checker, as it reads the file."""
        found = check_full_shift.read(STORED)
        starts: list[check_sections.Quad | check_sections.Line] = [
            *found.quads,
            check_sections.Line(J1, *found.line),
        ]
        of = zip(starts, found.orbits, strict=True)
        return [check_passages.arrival(problem(), *each) for each in of]

    def beginning(self, start: Quad | StartLine, piece: FamilyStep) -> list[Callable[[], Any]]:
        """C1 of a set or of a line by both: each gives its bounds."""
        other, [again] = for_script(start, [piece])

        def by_script() -> list[Fraction]:
            if isinstance(start, StartLine):
                return check_sections.line_beginning(self.problem, other, again)
            return check_sections.beginning(self.problem, other, again)[1]

        return [lambda: sections.beginning(self.numbers, start, piece)[1], by_script]

    def of(self, start: Quad | StartLine, pieces: Sequence[FamilyStep]) -> list[Any]:
        """What both check of the orbits of a set, or of a line."""
        return [
            lambda: passages.arrival(self.numbers, start, pieces),
            lambda: check_passages.arrival(self.problem, *for_script(start, pieces)),
        ]

    def followed(self, found: Sequence[Any]) -> Callable[..., Any]:
        """What gives orbits of a set or line, whatever its width and place: all are known."""
        known = dict(zip([x[1] for x in (*self.quads, self.line)], found, strict=True))
        return lambda _, start, __: known[start[1]]
