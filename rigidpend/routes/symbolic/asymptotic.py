"""Doubly asymptotic orbits: from the unstable surface of a periodic orbit to a stable one.

The orbits arrive from the lower periodic orbit with I = 0, and their last crossing has U = 0. With
an even number of symbols they end at the upper orbit (heteroclinic), with an odd number at the
lower one again (homoclinic). The reversor exchanges the two periodic orbits, and left and right. It
takes a heteroclinic orbit to another one of this kind, with symbols and half rotations read
backward and 0 and 1 exchanged, and it takes homoclinic orbits to those of the upper orbit. Orbits
from the upper orbit to the lower one are not images of these.

The skeleton consists of the orbits with few symbols and few half rotations. They are the zeros of U
along the unstable surface of the lower periodic orbit, a curve with one angle b. Between two zeros
of U behind n passages U has one sign, and the phase of the next crossing, chi = -ln|U|/Lambda +
..., falls from infinity and rises to infinity again. Far out it is monotone, and the crossing runs
along the unstable surface of the orbit just passed. This surface meets the stable surface of the
next orbit once in each half rotation: in every cell there is a zero of U behind n + 1 passages.
Where chi is least, the curve turns back, and zeros end in pairs, in folds.

So every arc between two zeros is sampled on a grid that is uniform in chi far out. A pair of zeros
between two samples requires two extrema of U; wherever |U| has a minimum on the grid, the minimum
itself is computed. An arc is followed further if any of its samples has few half rotations,
whatever its ends have.

That no orbit is missed is an argument and not a proof: it assumes that the surfaces meet once in
each half rotation, and that a grid sees every extremum of U. Scans with evenly spaced angles and
other grids find the same orbits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from rigidpend.machine.wording import counted
from rigidpend.numbers import Array
from rigidpend.orbits import columns, joined
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.address import cells_of
from rigidpend.routes.symbolic.chain import (
    MOVED,
    Chain,
    NoOrbit,
    System,
    check_split,
    on_surface,
    signs_of,
)
from rigidpend.routes.symbolic.levels import ChainLevel, Mask, Signs, onward
from rigidpend.routes.symbolic.shortest import MORE_HALF_TURNS

TOGETHER = 2000
"""Number of orbits that are followed at a time: their tables then stay in the processor's cache."""
PER_CELL = 10
"""Samples of an arc for each half rotation of its last passage."""
AROUND = 720
"""Samples of the whole surface, between which the zeros of U at the first crossing are sought."""
HALVINGS = 26
"""Halvings between samples, for a zero or a minimum of U: to some 1e-8 of their distance.

From there Newton's method goes on to the zero, and |U| is flat to rounding about its minimum."""
WIDENINGS = 8
"""Number of attempts to sample arcs, each with a third more samples than the one before."""


class Track(NamedTuple):
    """Orbits of the unstable surface through their first n passages, one in each column."""

    b: Array
    """(N,) radians: the angle on the unstable surface."""
    chi: Array
    """(n + 1, N) radians, whole turns included."""
    symbols: NDArray[np.uint8]
    """(n, N) 0 left, 1 right."""
    inside: Mask
    """(N,) True where the tables reach so far; elsewhere the other fields are void."""
    U: Array
    """(N,) coordinate of the last crossings in the unstable direction of the next periodic orbit.

    Its sign gives the next symbol; where it is 0 the orbit is doubly asymptotic."""

    @property
    def half_turns(self) -> Signs:
        """(n, N) half rotations of the passages."""
        return np.diff(cells_of(self.chi), axis=0)


def track(level: ChainLevel, b: Array, n: int) -> Track:
    """Follow orbits of the surface, by their angles b, (N,), through n passages."""
    starts = range(0, max(len(b), 1), TOGETHER)
    return joined([_track(level, b[k : k + TOGETHER], n) for k in starts])


def _track(level: ChainLevel, b: Array, n: int) -> Track:
    """:func:`track` of orbits that are few enough to be followed at once."""
    at = level.arriving(np.zeros_like(b), b)
    made, last = level.map_level, SectionPoint(True, at.d, at.chi)
    passed = list(onward(made, last, n))
    # A downward crossing is followed by a passage past the lower orbit. The reversor takes it to
    # the end of one past the upper orbit, and the unstable direction U to the stable one, V.
    last = passed[-1].point if n else last
    angle = last.chi if last.rising else -last.chi
    U = made.charts[last.rising].forward.look_up(last.d, angle, made.a)[0 if last.rising else 1]
    return Track(
        b,
        np.cumsum([at.chi, *(each.turned for each in passed)], axis=0),
        np.array([each.symbol for each in passed], dtype=np.uint8).reshape(n, len(b)),
        np.logical_and.reduce([np.full(len(b), True), *(each.inside for each in passed)]),
        U,
    )


def skeleton(level: ChainLevel, symbols: int, half_turns: int) -> list[tuple[Track, int]]:
    """The doubly asymptotic orbits of the surface, for each number of symbols from 0 to `symbols`.

    The symbols belong to the passages between the first crossing and the last, each of which takes
    at most `half_turns` half rotations. The orbits of each number are ordered by b, from an
    arbitrary first arc on, and come with the number of arcs, between orbits with one symbol less,
    on which they were sought. NoOrbit is raised where the surfaces do not cross, where they cross
    at such small angles that doubles do not place their orbits, or where an arc leaves the tables.
    """
    check_split(level, level.splitting)
    b = np.linspace(0, 2 * np.pi, AROUND + 1)
    U = track(level, b, 0).U
    at = np.flatnonzero(np.signbit(U[:-1]) != np.signbit(U[1:]))
    if at.size < 2:
        raise NoOrbit("the asymptotic surfaces do not cross")
    zeros = _bisected(level, b[at], b[at + 1], 0)
    found = [(track(level, zeros, 0), 1)]
    # The surface is a closed curve: the last arc ends at the first zero.
    ends = np.append(zeros, zeros[0] + 2 * np.pi)
    low, high = ends[:-1], ends[1:]
    for n in range(1, symbols + 1):
        seen, inside, opens = _Arcs(level, low, high, n, half_turns).zeros()
        found.append((columns(seen, inside), len(low)))
        begin = np.flatnonzero(opens)
        low, high = seen.b[begin], seen.b[begin + 1]
    return found


def least_half_turns(level: ChainLevel, symbols: int, beyond: int) -> int | None:
    """The least bound on half rotations with which orbits of up to `symbols` symbols each exist.

    It is sought `beyond` a bound that is too small; None if doubles do not reach so far.
    """
    # A passage from or to a surface has |I| of at most the splitting at its last crossing.
    first = max(beyond + 1, level.fewest_half_turns(level.splitting))
    for bound in range(first, first + MORE_HALF_TURNS):
        try:
            found = skeleton(level, symbols, bound)
        except NoOrbit:
            break
        if all(rough.b.size for rough, _ in found):
            return bound
    return None


class _Arcs:
    """Arcs of the surface between zeros of U behind n - 1 passages, sampled behind n passages."""

    def __init__(self, level: ChainLevel, low: Array, high: Array, n: int, half_turns: int) -> None:
        self.level, self.n, self.most_turns = level, n, half_turns
        self.low, self.width = low, high - low
        least = level.fewest_half_turns(level.splitting)
        # Zeros are only where |I| is at most the splitting at the crossing. Up to there and along
        # the next half rotation |U| rises and falls. Nearer to the end it falls with the distance,
        # of which a half rotation is exp(-2) or more wherever doubles tell the surfaces apart.
        cell = math.pi * level.exponent
        ratio = level.splitting / min(level.splitting, level.downward_splitting)
        beyond = (3 + math.log(ratio)) / cell
        reach = math.ceil(PER_CELL * (3 + max(half_turns - least, beyond)))
        for _ in range(WIDENINGS):
            if self._sampled(reach):
                return
            reach = math.ceil(1.3 * reach)
        raise NoOrbit(
            f"doubles do not tell apart orbits with {counted(n, 'symbol')} and passages of up to"
            f" half_turns = {half_turns} half rotations: allow {self.reached - 2} at most, or fewer"
            " symbols"
        )

    def _sampled(self, reach: int) -> bool:
        """Sample the arcs; True if the samples reach far enough towards the ends."""
        # A logistic grid. Near an end |U| is proportional to the distance from it, so that a factor
        # exp(-pi Lambda) in the distance is one half rotation more of chi.
        step = math.pi * self.level.exponent / PER_CELL
        shares = expit(step * np.arange(-reach, reach + 1))
        self.b = self.low[:, None] + self.width[:, None] * shares
        seen = track(self.level, self.b.ravel(), self.n)
        self.U, self.inside = seen.U.reshape(self.b.shape), seen.inside.reshape(self.b.shape)
        turns = seen.half_turns.reshape(self.n, *self.b.shape)
        # The last passage may take one half rotation more: far out, its zero ends the last arc.
        before = self.inside & (turns[:-1] <= self.most_turns).all(axis=0)
        self.wanted = before & (turns[-1] <= self.most_turns + 1)
        ends = [0, -1]
        # Long passages between two dips of chi end no arc: from there chi falls outwards.
        falls = turns[-1][:, ends] < turns[-1][:, [PER_CELL, -1 - PER_CELL]]
        short = self.wanted[:, ends] | (self.inside[:, ends] & falls)
        # The fewest half rotations at an end: with two fewer as a bound, no end is wanted.
        self.reached = turns[-1][:, ends][short].min(initial=self.most_turns + 1)
        return not short.any()

    def zeros(self) -> tuple[Track, Mask, Mask]:
        """The zeros of U that bound arcs with few half rotations somewhere, in their order.

        Two masks come with them: True where all half rotations of the zero itself are as few as is
        asked for, and True where an arc to be followed further begins, which ends at the next zero.
        """
        low, high, arc, sample = self._brackets()
        order = np.lexsort((low, arc))
        low, high, arc, sample = low[order], high[order], arc[order], sample[order]
        # passed[:, j] counts the wanted samples before sample j. An arc between two zeros is open
        # if any sample is wanted from the one before the first zero to the one behind the second.
        passed = np.pad(np.cumsum(self.wanted, axis=1), ((0, 0), (1, 0)))
        few = passed[arc[1:], sample[1:] + 2] > passed[arc[:-1], sample[:-1]]
        opens = np.append((arc[1:] == arc[:-1]) & few, False)[: arc.size]
        # Both ends of an open arc are kept.
        kept = opens.copy()
        kept[1:] |= opens[:-1]
        seen = track(self.level, _bisected(self.level, low[kept], high[kept], self.n), self.n)
        inside = seen.inside & (seen.half_turns <= self.most_turns).all(axis=0)
        return seen, inside, opens[kept]

    def _brackets(self) -> tuple[Array, Array, Signs, Signs]:
        """Bounds low and high of the zeros of U, indices of their arcs and of the samples before.

        A zero lies between two samples of different sign. A pair of zeros lies about a minimum of
        |U| on the grid, if U at the minimum itself has the other sign.
        """
        b, negative, size, inside = self.b, np.signbit(self.U), np.abs(self.U), self.inside
        known = inside[:, 1:] & inside[:, :-1]
        arc, k = np.nonzero((negative[:, 1:] != negative[:, :-1]) & known)
        found = [(b[arc, k], b[arc, k + 1], arc, k)]
        # Inner samples that are less in |U| than both neighbours, all of one sign.
        same = (negative[:, 1:-1] == negative[:, :-2]) & (negative[:, 1:-1] == negative[:, 2:])
        least = (size[:, 1:-1] <= size[:, :-2]) & (size[:, 1:-1] < size[:, 2:])
        arc, k = np.nonzero(same & least & inside[:, 1:-1])
        low, high = b[arc, k], b[arc, k + 2]
        at = self._least(low, high, np.where(negative[arc, k], -1, 1))
        crossed = np.signbit(track(self.level, at, self.n).U) != negative[arc, k]
        low, at, high, arc, k = (x[crossed] for x in (low, at, high, arc, k))
        found += [(low, at, arc, k), (at, high, arc, k)]
        low, high, arc, k = (np.concatenate(x) for x in zip(*found, strict=True))
        return low, high, arc, k

    def _least(self, low: Array, high: Array, side: Signs) -> Array:
        """The places b of the least ``side * U`` between bounds, where it has one minimum each."""
        every = np.arange(len(low))
        for _ in range(HALVINGS):
            # The minimum lies between the neighbours of the least of three inner points: these two
            # are half as far apart as the bounds.
            grid = np.linspace(low, high, 5)
            inner = side * track(self.level, grid[1:-1].ravel(), self.n).U.reshape(3, -1)
            least = inner.argmin(axis=0)
            low, high = grid[least, every], grid[least + 2, every]
        return (low + high) / 2


def _bisected(level: ChainLevel, low: Array, high: Array, n: int) -> Array:
    """The zeros b of U behind n passages, between bounds at which U has different signs."""
    negative = np.signbit(track(level, low, n).U)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        same = np.signbit(track(level, middle, n).U) == negative
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2


class DoublyAsymptotic(NamedTuple):
    """Doubly asymptotic orbits with n symbols, one in each column.

    The parameter of their chain is the angle b on the unstable surface.
    """

    chain: Chain
    symbols: NDArray[np.uint8]
    """(n, N)."""
    arrival: Array
    """(N,) t' before the first crossing less that of uniform rotation."""
    leaving: Array
    """(N,) t' behind the last crossing less that of uniform rotation."""
    V: Array
    """(N,) coordinate of the last crossing in the stable direction."""
    theta3: Array
    """(N,) growth of theta3 from one periodic orbit to the other, radians."""
    I_slope: Array
    """(N,) derivative in b of I behind the last crossing."""

    @property
    def b(self) -> Array:
        """(N,) radians: the angle on the unstable surface."""
        return np.asarray(self.chain.parameter)

    @property
    def flight(self) -> Array:
        """(N,) t' from the first crossing to the last."""
        return np.asarray(self.chain.time.sum(axis=0))

    @property
    def begun(self) -> Array:
        """(N,) t' of the first crossings, on the clock of `Launch`."""
        rotation = self.chain.level.rates(np.zeros(1)).rotation
        return np.asarray(rotation * self.chain.chi[0] - self.arrival)

    def faded(self, distance: Array | float) -> Array:
        """(N,) t' from the last crossings until v of the normal form is `distance`."""
        rates = self.chain.level.rates(np.zeros(1))
        turned = np.log(np.abs(self.V) / distance) / rates.exponent
        return np.asarray(self.leaving + rates.rotation * turned)


def doubly_asymptotic(level: ChainLevel, rough: Track) -> DoublyAsymptotic:
    """The orbits of a skeleton with n symbols to rounding, as chains from one surface to the other.

    NoOrbit is raised where Newton's method does not converge, or converges to another orbit.
    """
    n, made = len(rough.symbols), level.map_level
    system = System(level, on_surface, signs_of(rough.symbols), None)
    chain = system.solved(system.guess(rough.chi, rough.b))
    off = (chain.chi - rough.chi, chain.parameter - rough.b)
    moved = max(float(np.abs(x).max(initial=0.0)) for x in off)
    if moved > MOVED:
        check_split(level, level.narrowest(system.signs), chain.unknowns)
        raise NoOrbit(
            f"an orbit with {counted(n, 'symbol')} is found elsewhere, by {moved:.2g}: allow fewer"
            " half rotations of its passages, or fewer symbols"
        )
    arrival = level.arriving(np.zeros_like(rough.b), chain.parameter)
    # Growth of theta3 from the periodic orbit to the first crossing. That past the lower orbit is
    # read off the table of the upper one, at the angle of the reversed orbit.
    theta3 = made.charts[True].inverse.look_up(0 * rough.b, -chain.parameter, made.a)[3]
    # The derivative of (d, chi) in b, carried from crossing to crossing. `side` is -1 where the
    # orbit is at its mirror image, for which theta3 grows by the opposite.
    change, side = np.stack((arrival.d_by[1], arrival.chi_by[1])), np.ones_like(rough.b)
    for k in range(n):
        passed = made.passage(SectionPoint(k % 2 == 0, chain.d[k], chain.chi[k]), slopes=True)
        if not (passed.inside & (passed.symbol == rough.symbols[k])).all():
            raise NoOrbit(f"passage {k + 1} of an orbit has another symbol than its track")
        change = np.einsum("ijn,jn->in", passed.slopes[:2], change)
        theta3 = theta3 + side * passed.theta3
        side = np.where(passed.mirrored, -side, side)
    # Behind the last crossing, as if on separatrix 2 or 3. As U = 0, dI = V dU. Of a downward
    # crossing the reversed image is looked up: U and V change places there.
    rising, out = n % 2 == 0, n % 2
    turn = 1.0 if rising else -1.0
    seen = made.charts[rising].forward.look_up_slopes(chain.d[-1], turn * chain.chi[-1], made.a)
    V, leaving = seen.value[1 - out], turn * seen.value[2]
    slope = seen.by_x[out] * V * change[0] + turn * seen.by_phase[out] * V * change[1]
    gained = theta3 + side * (turn * seen.value[3])
    return DoublyAsymptotic(chain, rough.symbols, arrival.constant, leaving, V, gained, slope)
