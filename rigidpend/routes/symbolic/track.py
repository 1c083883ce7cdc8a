"""Orbits of the unstable surface of the lower periodic orbit, followed by the map in doubles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.doubles import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.address import cells_of
from rigidpend.routes.symbolic.tables import Level, Mask, Signs

TOGETHER = 2000
"""Orbits that are followed at a time, so that their tables stay in the processor's cache."""


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

    def part(self, where: Mask) -> Track:
        """Some of the orbits."""
        return Track(
            self.chi[:, where],
            self.d[:, where],
            self.symbols[:, where],
            self.inside[where],
            self.U[where],
        )

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
    at = level.crossings(*arrivals(len(b)), b)
    d, chi, turned = at.d, at.chi, at.chi
    whole, small, symbols, inside = [chi], [d], [], np.ones(len(b), dtype=bool)
    for k in range(n):
        passed = level.map_level.passage(SectionPoint(k % 2 == 0, d, chi))
        inside = inside & passed.inside
        turned, (_, d, chi) = turned + passed.turned, passed.point
        whole.append(turned)
        small.append(d)
        symbols.append(passed.symbol)
    found = np.array(symbols, dtype=np.uint8).reshape(n, len(b))
    return Track(
        np.array(whole), np.array(small), found, inside, unstable(level, n % 2 == 0, d, chi)
    )


def arrivals(n: int) -> tuple[Mask, Mask, Array]:
    """n upward crossings past the lower orbit with I = 0: arguments of `Level.crossings`."""
    return np.ones(n, dtype=bool), np.zeros(n, dtype=bool), np.zeros(n)


def unstable(level: Level, rising: bool, d: Array, chi: Array) -> Array:
    """U of crossings: of downward ones V of their image in the reversor."""
    made, angle = level.map_level, chi if rising else -chi
    found: Array = made.charts[rising].forward.look_up(d, angle, made.a)
    return found[0 if rising else 1]


class Leaving(NamedTuple):
    """Crossings on the stable surface of the next periodic orbit, (N,) each."""

    I: Array
    V: Array
    """Share in the stable direction; I is U V."""
    I_by: tuple[Array, Array]
    """Derivatives of I in d and in chi."""
    constant: Array
    """Share of the time beyond the crossing that is not rotation, t'."""
    theta3: Array
    """Growth of theta3 from there to the periodic orbit, as if on separatrix 2 or 3, radians."""

    def part(self, where: Signs) -> Leaving:
        """Some of the crossings."""
        by_d, by_chi = self.I_by
        return Leaving(
            self.I[where],
            self.V[where],
            (by_d[where], by_chi[where]),
            self.constant[where],
            self.theta3[where],
        )


def leaving(level: Level, rising: bool, d: Array, chi: Array) -> Leaving:
    """The last crossings of doubly asymptotic orbits."""
    made, side = level.map_level, 1.0 if rising else -1.0
    seen = made.charts[rising].forward.look_up_slopes(d, side * chi, made.a)
    out = 0 if rising else 1
    V = seen.value[1 - out]
    by_d, by_chi = seen.by_x[out] * V, side * seen.by_phase[out] * V
    return Leaving(
        seen.value[out] * V, V, (by_d, by_chi), side * seen.value[2], side * seen.value[3]
    )
