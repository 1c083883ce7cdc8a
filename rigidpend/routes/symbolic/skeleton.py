"""The skeleton: the doubly asymptotic orbits with few symbols and few half rotations.

They are the zeros of U along the unstable surface of the lower periodic orbit, a curve with one
angle b. Between two zeros of U behind n passages U has one sign, and the phase of the next
crossing, chi = -ln|U|/Lambda + ..., falls from infinity and rises to infinity again. Far out it is
monotone, and the crossing runs along the unstable surface of the orbit just passed. That meets
the stable surface of the next orbit once in each half rotation: a zero of U behind n + 1 passages
in every cell. Where chi is least the curve turns back, and zeros end in pairs, in folds.

So every arc between two zeros is looked at on a grid that is even in chi far out. Between two
samples a pair of zeros needs two extrema of U; where |U| has a minimum on the grid it is found.
An arc is followed on if any of its samples has few half rotations, whatever its ends have.

That no orbit is missed is an argument and not a proof: it takes for granted that the surfaces meet
once in each half rotation, and that a grid sees every extremum of U. Scans with evenly spaced
angles and other grids find the same orbits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.generic import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.address import cells_of
from rigidpend.routes.symbolic.chain import NoOrbit
from rigidpend.routes.symbolic.levels import Level, Mask, Signs, columns, onward

TOGETHER = 2000
"""Orbits that are followed at a time, so that their tables stay in the processor's cache."""
PER_CELL = 10
"""Samples of an arc for each half rotation of its end."""
AROUND = 720
"""Samples of the whole surface, whose first zeros are sought."""
HALVINGS = 26
"""Bisections of a sample: Newton's method goes on from 1e-8 of it."""
GOLDEN = (math.sqrt(5) - 1) / 2
WIDENINGS = 8
"""Number of times that the samples of arcs are extended, by a third each."""
NARROWINGS = 40
"""Narrowings of a minimum of |U|: to 1e-8 of two samples, where it is flat to rounding."""


class Track(NamedTuple):
    """Orbits through their first n passages, one in each column."""

    chi: Array
    """(n + 1, N) radians, whole turns included."""
    d: Array
    """(n + 1, N) dimensionless."""
    symbols: NDArray[np.uint8]
    """(n, N) 0 left, 1 right."""
    inside: Mask
    """(N,) True where the tables reach so far; elsewhere the rest is void."""
    U: Array
    """(N,) share of the last crossings in the unstable direction of the next periodic orbit.

    Its sign is the next symbol's; where it is 0 the orbit is doubly asymptotic."""

    @property
    def cells(self) -> Signs:
        """(n + 1, N) the multiples of pi to which chi is nearest."""
        return cells_of(self.chi)

    @property
    def half_turns(self) -> Signs:
        """(n, N) half rotations of the passages."""
        return np.diff(self.cells, axis=0)


def track(level: Level, b: Array, n: int) -> Track:
    """Follow orbits through n passages.

    Parameters
    ----------
    level : Level
    b : (N,) array
        The angles by which orbits of the surface differ, radians.
    n : int
    """
    starts = range(0, max(len(b), 1), TOGETHER)
    parts = [_track(level, b[k : k + TOGETHER], n) for k in starts]
    return Track(*(np.concatenate(x, axis=-1) for x in zip(*parts, strict=True)))


def _track(level: Level, b: Array, n: int) -> Track:
    at = level.arriving(np.zeros_like(b), b)
    begin = SectionPoint(True, at.d, at.chi)
    passed = list(onward(level.map_level, begin, n))
    points = [begin, *(each.point for each in passed)]
    return Track(
        np.cumsum([at.chi, *(each.turned for each in passed)], axis=0),
        np.array([point.d for point in points]),
        np.array([each.symbol for each in passed], dtype=np.uint8).reshape(n, len(b)),
        np.logical_and.reduce([np.full(len(b), True), *(each.inside for each in passed)]),
        unstable(level, n % 2 == 0, points[-1].d, points[-1].chi),
    )


def unstable(level: Level, rising: bool, d: Array, chi: Array) -> Array:
    """U of crossings: of downward ones V of their image in the reversor."""
    made, angle = level.map_level, chi if rising else -chi
    found: Array = made.charts[rising].forward.look_up(d, angle, made.a)
    return found[0 if rising else 1]


class Skeleton(NamedTuple):
    """The orbits with n symbols, (N,) each, by b from an arbitrary first arc on."""

    n: int
    b: Array
    """Radians."""
    track: Track
    arcs: int
    """Arcs between zeros with one symbol less on which they were sought."""


class _Brackets(NamedTuple):
    """Bounds of zeros of U."""

    low: Array
    high: Array
    arc: Signs
    sample: Signs
    """Place of the sample before."""


class _Zeros(NamedTuple):
    """Zeros of U on arcs, in their order on each."""

    b: Array
    track: Track
    inside: Mask
    """True where all half rotations are as few as is asked for."""
    opens: Mask
    """True where an arc to be looked at begins; it ends with the next zero."""


def skeleton(level: Level, symbols: int, half_turns: int) -> list[Skeleton]:
    """The doubly asymptotic orbits of the surface, for each number of symbols up to `symbols`.

    Parameters
    ----------
    level : Level
    symbols : int
        Symbols, that is passages between the first crossing and the last.
    half_turns : int
        Half rotations of a passage at most.

    Raises
    ------
    NoOrbit
        The surfaces do not cross, or an arc leaves the tables.
    """
    b = np.linspace(0, 2 * np.pi, AROUND + 1)
    U = track(level, b, 0).U
    at = np.flatnonzero(np.signbit(U[:-1]) != np.signbit(U[1:]))
    if at.size < 2:
        raise NoOrbit("the asymptotic surfaces do not cross")
    zeros = _bisected(level, b[at], b[at + 1], 0)
    found = [Skeleton(0, zeros, track(level, zeros, 0), 1)]
    ends = np.append(zeros, zeros[0] + 2 * np.pi)
    low, high = ends[:-1], ends[1:]
    for n in range(1, symbols + 1):
        arcs = _Arcs(level, low, high, n, half_turns)
        seen = arcs.zeros()
        kept = columns(seen.track, seen.inside)
        found.append(Skeleton(n, seen.b[seen.inside], kept, len(low)))
        begin = np.flatnonzero(seen.opens)
        low, high = seen.b[begin], seen.b[begin + 1]
    return found


class _Arcs:
    """Arcs between zeros of U behind n - 1 passages, sampled behind n."""

    def __init__(self, level: Level, low: Array, high: Array, n: int, half_turns: int) -> None:
        self.level, self.n, self.most = level, n, half_turns
        self.low, self.width = low, high - low
        least = level.fewest_half_turns
        reach = PER_CELL * max(half_turns + 3 - least, 3)
        for _ in range(WIDENINGS):
            if self._sampled(reach):
                return
            reach = math.ceil(1.3 * reach)
        raise NoOrbit("the samples of an arc end before its passages are long enough")

    def _sampled(self, reach: int) -> bool:
        """Sample the arcs; whether the samples reach far enough towards the ends."""
        step = math.pi * self.level.exponent / PER_CELL
        shares = 1 / (1 + np.exp(-step * np.arange(-reach, reach + 1)))
        self.b = self.low[:, None] + self.width[:, None] * shares
        seen = track(self.level, self.b.ravel(), self.n)
        self.U, self.inside = seen.U.reshape(self.b.shape), seen.inside.reshape(self.b.shape)
        turns = seen.half_turns.reshape(self.n, *self.b.shape)
        # One more half rotation than is asked for closes the last arc.
        before = self.inside & (turns[:-1] <= self.most).all(axis=0)
        self.wanted = before & (turns[-1] <= self.most + 1)
        return not self.wanted[:, [0, -1]].any()

    def zeros(self) -> _Zeros:
        """The zeros of U at the ends of all arcs with few half rotations somewhere."""
        pairs = [self._changes(), *self._minima()]
        low, high, arc, sample = (np.concatenate(x) for x in zip(*pairs, strict=True))
        if not low.size:
            least, most = self.level.fewest_half_turns, self.most
            said = (
                f"passages of at most half_turns = {most} half rotations; they take {least} or more"
            )
            raise NoOrbit(f"no orbit with a symbol has only {said}: allow more")
        order = np.lexsort((low, arc))
        low, high, arc, sample = low[order], high[order], arc[order], sample[order]
        passed = np.pad(np.cumsum(self.wanted, axis=1), ((0, 0), (1, 0)))
        few = passed[arc[1:], sample[1:] + 2] > passed[arc[:-1], sample[:-1]]
        opens = np.append((arc[1:] == arc[:-1]) & few, False)
        kept = opens.copy()
        kept[1:] |= opens[:-1]
        b = _bisected(self.level, low[kept], high[kept], self.n)
        seen = track(self.level, b, self.n)
        inside = seen.inside & (seen.half_turns <= self.most).all(axis=0)
        return _Zeros(b, seen, inside, opens[kept])

    def _changes(self) -> _Brackets:
        """Samples between which U changes its sign."""
        negative, known = np.signbit(self.U), self.inside[:, 1:] & self.inside[:, :-1]
        arc, k = np.nonzero((negative[:, 1:] != negative[:, :-1]) & known)
        return _Brackets(self.b[arc, k], self.b[arc, k + 1], arc, k)

    def _minima(self) -> list[_Brackets]:
        """Pairs of zeros between samples: where the least |U| has the other sign."""
        negative, size = np.signbit(self.U), np.abs(self.U)
        same = (negative[:, 1:-1] == negative[:, :-2]) & (negative[:, 1:-1] == negative[:, 2:])
        least = (size[:, 1:-1] <= size[:, :-2]) & (size[:, 1:-1] < size[:, 2:])
        arc, k = np.nonzero(same & least & self.inside[:, 1:-1])
        low, high = self.b[arc, k], self.b[arc, k + 2]
        at = self._least(low, high, np.where(negative[arc, k], -1, 1))
        crossed = np.signbit(track(self.level, at, self.n).U) != negative[arc, k]
        low, at, high, arc, k = (x[crossed] for x in (low, at, high, arc, k))
        return [_Brackets(low, at, arc, k), _Brackets(at, high, arc, k)]

    def _least(self, low: Array, high: Array, side: Signs) -> Array:
        """The least side U between bounds, by golden sections."""
        for _ in range(NARROWINGS):
            width = GOLDEN * (high - low)
            left, right = high - width, low + width
            U = side * track(self.level, np.concatenate((left, right)), self.n).U.reshape(2, -1)
            lower = U[0] < U[1]
            low, high = np.where(lower, low, left), np.where(lower, right, high)
        return (low + high) / 2


def _bisected(level: Level, low: Array, high: Array, n: int) -> Array:
    """The zeros of U behind n passages between bounds."""
    negative = np.signbit(track(level, low, n).U)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        same = np.signbit(track(level, middle, n).U) == negative
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2
