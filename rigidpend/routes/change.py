"""Change of a symbol: the phase of a doubly asymptotic orbit, narrowed by bisection.

Beside a reference orbit a bisection is cheap down to a small part of their distance: what
doubles resolve. Then the next reference begins there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from rigidpend.numbers.exact import GUARD_BITS, Exact, fraction, rational
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.routes import certainty
from rigidpend.routes.cycle import symbols
from rigidpend.routes.neighbourhood import Neighbourhood
from rigidpend.routes.problem import RouteProblem

GAIN = 38
"""Bits that are gained beside one reference orbit: doubles then still have some ten to spare."""
AT_ONCE = 6
"""Bits that are gained at a time, by as many phases as they tell apart."""


class NoChange(ValueError):
    """Error: the symbol does not change between two phases, or one before it does."""


class Bracket(NamedTuple):
    """Two phases theta2_0, radians, between which a symbol changes."""

    low: Exact
    high: Exact

    @property
    def width(self) -> float:
        """Their distance, radians."""
        return float(self.high - self.low)

    def between(self, k: int, n: int) -> Exact:
        """The phase at k nths of the way; where it is not rational one close to it that is."""
        x = self.low + (self.high - self.low) * k / n
        # Enough to tell the n parts apart, and guard bits beyond.
        bits = GUARD_BITS - min(0, math.floor(math.log2(self.width / n)))
        return rational(fraction(x.at(bits), bits) if x.fraction is None else x.fraction, None)


Prefix: TypeAlias = list[int]
Prefixes: TypeAlias = Callable[[Sequence[Exact]], list[Prefix]]


def narrowed(
    problem: RouteProblem,
    bracket: Bracket,
    width: float,
    arithmetic: Arithmetic,
    report: Callable[[float], None] = lambda width: None,
) -> list[Bracket]:
    """Narrow two phases between which the last symbol of a problem changes.

    The symbols on the way are those of one computation; whoever needs them certain computes the
    ends again (`Neighbourhood.routes`).

    Parameters
    ----------
    problem : RouteProblem
        With the symbols up to the one that changes.
    bracket : Bracket
    width : float
        Largest distance to end with, radians.
    arithmetic : Arithmetic
    report : callable, optional
        Told the distance now and then.

    Returns
    -------
    list of Bracket
        The given one, and each half of the one before it up to the last.

    Raises
    ------
    NoChange
        The symbol is the same on both sides, or an earlier one differs.
    """
    path = [bracket]
    while True:
        wide = path[-1]
        finest = max(wide.width / 2**GAIN, width)
        path += bisect(_by_differences(problem, wide, finest, arithmetic), wide, finest)[1:]
        report(path[-1].width)
        if path[-1].width <= width:
            return path


def _by_differences(
    problem: RouteProblem, bracket: Bracket, finest: float, arithmetic: Arithmetic
) -> Prefixes:
    around = Neighbourhood(
        problem, bracket.between(1, 2), finest, arithmetic._replace(precisions=(53,))
    )

    def prefixes(phases: Sequence[Exact]) -> list[Prefix]:
        found = around.crossings(53, certainty.FIRST, phases)
        return [list(map(int, column)) for column in symbols(found.separatrix).T]

    return prefixes


def bisect(prefixes: Prefixes, bracket: Bracket, width: float) -> list[Bracket]:
    """Halve the distance of two phases, between which a symbol changes, down to `width` or less.

    Parameters
    ----------
    prefixes : callable
        The symbols up to that one of each of some phases.
    bracket, width : as in :func:`narrowed`, whose result it has, and whose error
    """
    path = [bracket]
    left, right = prefixes(bracket)
    check_change(left, right, bracket)
    while path[-1].width > width:
        whole, n = path[-1], 2**AT_ONCE
        points = [whole.low, *(whole.between(k, n) for k in range(1, n)), whole.high]
        # Orbits side by side cost little more than one: six halvings at a time.
        found = prefixes(points[1:-1])
        a, b = 0, n
        while b - a > 1 and path[-1].width > width:
            middle = (a + b) // 2
            # `found` begins with the second point.
            a, b = (middle, b) if found[middle - 1] == left else (a, middle)
            path.append(Bracket(points[a], points[b]))
    return path


def check_change(left: Prefix, right: Prefix, bracket: Bracket) -> None:
    """Raise NoChange unless two lists of symbols differ in the last one alone."""
    if left[:-1] != right[:-1] or left == right:
        found = f"{left} at {bracket.low} and {right} at {bracket.high}"
        message = f"symbol {len(left)} must change, and no other before it; it is {found}"
        raise NoChange(message)
