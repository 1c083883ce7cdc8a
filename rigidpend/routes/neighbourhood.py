"""Routes of phases that lie close together, as differences from one reference orbit.

Phases that doubles cannot tell apart need higher precision, but only for one orbit: the reference,
computed once in each of the scales of `certainty`. All others are differences from it, in doubles,
whatever their distance (`integrate.neighbours`), and their symbols become certain by the same rule
as elsewhere. An orbit that this leaves open is integrated by itself, in as many bits more as its
distance from the reference requires.

The phase at which a symbol changes, that of a doubly asymptotic orbit, is narrowed by bisection.
Beside one reference this is cheap down to the part of the distance that doubles resolve; then the
next reference begins there.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers.exact import GUARD_BITS, PI, Exact, fraction, rational
from rigidpend.orbits import joined
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.integrate.arithmetic import Arithmetic, rung
from rigidpend.orbits.integrate.neighbours import Walk
from rigidpend.orbits.integrate.reference_orbit import ReferenceOrbit, reference_bits
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes, routes_of
from rigidpend.routes.ladder import rungs
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.run import Run, tolerance_of
from rigidpend.routes.start import Scales, start, states_exact

SPARE = 64
"""Bits of the reference orbit beyond those of the distance: more than doubles have."""
FIXED = 212
"""Bits up to which the kernel in one precision is faster than an orbit with a falling precision.

The latter needs a tangent beside the orbit."""
GAIN = 38
"""Bits that are gained beside one reference orbit: doubles then still have some ten to spare."""
BITS_AT_ONCE = 6
"""Bits that are gained at a time: 2^6 - 1 phases divide the bracket."""


@dataclass(eq=False)
class Neighbourhood:
    """Routes in the neighbourhood of one phase.

    Precisions are relative to the distance from it: 53 bits are differences in doubles, higher ones
    are integrations in as many bits more as the distance takes.
    """

    problem: RouteProblem
    centre: Exact
    """The phase theta2_0 of the reference orbit, radians."""
    finest: float
    """The least distance of phases that is to be resolved, radians."""
    arithmetic: Arithmetic
    jobs: int = 1

    def __post_init__(self) -> None:
        self.bits = reference_bits(self.finest, SPARE)
        """Bits of the reference orbit at its start."""
        most = max(self.bits, self.arithmetic.precisions[-1])
        # One limit in all bits: what two computations do not see return has no symbol in more.
        self.longest = passage_limit(self.problem, most)
        """Longest wait for a crossing, t'."""
        self._references: dict[Scales, ReferenceOrbit] = {}

    def routes(self, phases: Sequence[Exact]) -> RouteCodes:
        """The routes of some phases theta2_0, radians; symbols that stay uncertain are marked."""
        taken = Phases(phases)
        known = certainty.decide(
            lambda bits, scales, columns: self.crossings(bits, scales, taken.exactly(columns)),
            len(taken),
            phase_rate(self.problem),
            rungs(self.arithmetic.precisions),
        )
        return routes_of(taken, known)

    def prefixes(self, phases: Sequence[Exact]) -> list[list[int]]:
        """The symbols of each of some phases, found by one computation in doubles, unconfirmed."""
        found = self.crossings(53, certainty.FIRST_SCALES, phases)
        return [list(map(int, column)) for column in symbols(found.separatrix).T]

    def crossings(self, bits: int, scales: Scales, phases: Sequence[Exact]) -> Crossings:
        """The crossings of some phases, t', in `bits` bits relative to their distances."""
        if bits == 53:
            return self._beside(scales, phases)
        # At the centre itself the distance is 0: no phase gets more bits than `finest` takes.
        apart = [max(self.finest, abs(float(phase - self.centre))) for phase in phases]
        each = [rung(reference_bits(distance, bits)) for distance in apart]
        return joined([self._alone(*x, scales) for x in zip(phases, each, strict=True)])

    def _beside(self, scales: Scales, phases: Sequence[Exact]) -> Crossings:
        """The crossings of some phases, as differences in doubles from the reference orbit."""
        # Each of the scales has a reference of its own, as they must share no rounding.
        if scales not in self._references:
            self._references[scales] = self._orbit(self.centre, self.bits, scales)
        begin = start(self.problem, self.bits, scales)
        states = states_exact(begin, [self.centre, *phases], self.bits)
        walk = Walk(
            self._references[scales],
            # Differences of fractions are exact. States have `self.bits`, which leave even the
            # least difference more bits than a double has.
            (states[:, 1:] - states[:, :1]).astype(float),
            np.array([float(phase - self.centre) for phase in phases]),
            n_crossings=self.problem.n_symbols + 1,
            passage_limit=self.longest / scales.time_unit,
            tolerance=tolerance_of(self.arithmetic, 53, scales),
        )
        return _timed(walk.crossings(self.jobs), scales)

    def _alone(self, phase: Exact, bits: int, scales: Scales) -> Crossings:
        """The crossings of one orbit by itself, in `bits` bits at its start."""
        # In many bits it pays to let the precision fall along the orbit, as rounding errors grow.
        if bits > FIXED:
            reference = self._orbit(phase, bits, scales)
            return _timed(reference.followed(self.problem.n_symbols + 1), scales)
        one = Run(self.problem, Phases([phase]), self.arithmetic)
        return one.crossings(bits, scales, np.arange(1))

    def _orbit(self, phase: Exact, bits: int, scales: Scales) -> ReferenceOrbit:
        """The orbit of a phase in `bits` bits, with its derivative in the phase as tangent."""
        begin = start(self.problem, bits, scales)
        # gamma is linear in cos and sin of the phase, so that its derivative is gamma a quarter
        # turn later. M does not depend on the phase: its derivative is 0.
        state, further = states_exact(begin, [phase, phase + PI / 2], bits).T
        return ReferenceOrbit(
            begin.coefficients,
            state,
            further * np.repeat([0, 1], 3),
            longest=self.longest / scales.time_unit,
            engine=self.arithmetic.engine,
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
        )


def _timed(found: Crossings, scales: Scales) -> Crossings:
    """Crossings with times in t', from those in the unit of the scales."""
    return found._replace(time=found.time * scales.time_unit)


class NoChange(ValueError):
    """Error: between two phases the last symbol does not change, or an earlier one does."""


class Bracket(NamedTuple):
    """Two phases theta2_0, radians, between which a symbol changes."""

    low: Exact
    high: Exact

    @property
    def width(self) -> float:
        """The distance of the two phases, radians."""
        return float(self.high - self.low)

    def between(self, k: int, n: int) -> Exact:
        """The phase k/n of the way from low to high, or a rational one close to it."""
        x = self.low + (self.high - self.low) * k / n
        # Enough bits to tell the n parts apart, and guard bits. The result is a fraction, for an
        # expression would grow with every halving.
        bits = GUARD_BITS - min(0, math.floor(math.log2(self.width / n)))
        return rational(fraction(x.at(bits), bits) if x.fraction is None else x.fraction, None)


def narrowed(
    problem: RouteProblem,
    bracket: Bracket,
    width: float,
    arithmetic: Arithmetic,
    report: Callable[[float], None] = lambda width: None,
) -> list[Bracket]:
    """Narrow two phases between which the last symbol of a problem changes, to `width` radians.

    The result begins with the given bracket; each further bracket is a half of the one before. The
    symbols on the way come from one computation each; a caller that needs certain ones computes the
    ends again (`Neighbourhood.routes`). NoChange is raised if the symbol is the same on both sides,
    or an earlier one differs. `report` is called with the distance, radians, after each reference
    orbit.
    """
    path = [bracket]
    # Each pass takes a new reference, in the middle of what is left.
    while True:
        wide = path[-1]
        finest = max(wide.width / 2**GAIN, width)
        around = Neighbourhood(problem, wide.between(1, 2), finest, arithmetic)
        path += bisect(around.prefixes, wide, finest)[1:]
        report(path[-1].width)
        if path[-1].width <= width:
            return path


def bisect(
    prefixes: Callable[[Sequence[Exact]], list[list[int]]], bracket: Bracket, width: float
) -> list[Bracket]:
    """Halve the distance of two phases as :func:`narrowed` does, down to `width` radians or less.

    ``prefixes(phases)`` gives the symbols of each phase, up to the one that changes.
    """
    path = [bracket]
    left, right = prefixes(bracket)
    check_change(left, right, bracket)
    while path[-1].width > width:
        whole, n = path[-1], 2**BITS_AT_ONCE
        points = [whole.low, *(whole.between(k, n) for k in range(1, n)), whole.high]
        # Orbits side by side cost little more than one: all points of six halvings are computed.
        found = prefixes(points[1:-1])
        # points[a] has the symbols of the left end, and points[b] has not.
        a, b = 0, n
        while b - a > 1 and path[-1].width > width:
            middle = (a + b) // 2
            # `found` leaves out the first point, so that its index is one less.
            a, b = (middle, b) if found[middle - 1] == left else (a, middle)
            path.append(Bracket(points[a], points[b]))
    return path


def check_change(left: list[int], right: list[int], bracket: Bracket) -> None:
    """Raise NoChange unless the symbols at both ends of a bracket differ in the last one alone."""
    if left[:-1] != right[:-1] or left == right:
        low, high = map(float, (bracket.low, bracket.high))
        found = f"{left} at {low!r} and {right} at {high!r}"
        message = f"symbol {len(left)} must change, and no other before it; it is {found}"
        where = "the first one does beside the Melnikov zeros that `rigidpend describe` tells"
        raise NoChange(f"{message}; {where}")
