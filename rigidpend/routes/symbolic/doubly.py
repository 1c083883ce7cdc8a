"""Doubly asymptotic orbits: from the unstable surface of a periodic orbit to a stable one.

They arrive from the lower periodic orbit with I = 0, and their last crossing has U = 0. With an
even number of symbols they end at the upper orbit (heteroclinic), with an odd number at the lower
one again (homoclinic). The reversor swaps the two periodic orbits, and left and right. So it takes
a heteroclinic orbit to another of these, with symbols and half rotations read backward, 0 and 1
exchanged, and homoclinic orbits to those of the upper orbit. Orbits from the upper orbit to the
lower one are no images of these.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.generic import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.address import Address, cells_of
from rigidpend.routes.symbolic.chain import Chain, NoOrbit, System, on_surface, signs_of
from rigidpend.routes.symbolic.levels import Level
from rigidpend.routes.symbolic.skeleton import Skeleton

MOVED = 1e-3
"""Largest correction of a track's chi, radians: its error is 1e-16, grown along the orbit."""


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


class DoublyAsymptotic(NamedTuple):
    """Doubly asymptotic orbits with n symbols, one in each column."""

    chain: Chain
    """Their crossings; `unknown` is the angle b on the unstable surface."""
    symbols: NDArray[np.uint8]
    """(n, N)."""
    arrival: Array
    """(N,) constant of the time up to the first crossing, t'."""
    end: Leaving
    """The last crossings."""
    theta3: Array
    """(N,) growth of theta3 from one end to the other, radians."""
    I_slope: Array
    """(N,) derivative of I behind the last crossing in b."""

    @property
    def b(self) -> Array:
        """(N,) radians: the angle on the unstable surface."""
        return np.asarray(self.chain.unknown)

    @property
    def flight(self) -> Array:
        """(N,) t' from the first crossing to the last."""
        found: Array = self.chain.time.sum(axis=0)
        return found

    @property
    def cells(self) -> NDArray[np.int64]:
        """(n + 1, N) the multiples of pi to which chi is nearest."""
        return cells_of(self.chain.chi)

    def begun(self, level: Level) -> Array:
        """(N,) t' of the first crossings, on the clock of `Launch`."""
        found: Array = level.rates(np.zeros(1)).rotation * self.chain.chi[0] - self.arrival
        return found

    def faded(self, level: Level, distance: Array | float) -> Array:
        """(N,) t' from the last crossings on until v of the normal form is `distance`."""
        rates = level.rates(np.zeros(1))
        turned = np.log(np.abs(self.end.V) / distance) / rates.exponent
        found: Array = self.end.constant + rates.rotation * turned
        return found

    def address(self, k: int) -> Address:
        """The address of an orbit; that of one without symbols is its cell alone."""
        return Address.of(self.chain.chi[:, k], self.symbols[:, k])


def doubly_asymptotic(level: Level, rough: Skeleton) -> DoublyAsymptotic:
    """The orbits of a skeleton to rounding: chains from the one surface to the other.

    Raises
    ------
    NoOrbit
        Newton's method does not settle, or only at another orbit.
    """
    track, n = rough.track, rough.n
    system = System(level, on_surface, signs_of(track.symbols), None)
    chain = system.solved(system.nearer(track.chi, rough.b))
    off = (chain.chi - track.chi, chain.unknown - rough.b)
    moved = max(float(np.abs(x).max(initial=0.0)) for x in off)
    if moved > MOVED:
        raise NoOrbit(f"an orbit with {n} symbols is found elsewhere: it moved by {moved:.2g}")
    made, arrival = level.map_level, level.arriving(np.zeros_like(rough.b), chain.unknown)
    # Growth of theta3 from the periodic orbit to the first crossing.
    theta3 = made.charts[True].inverse.look_up(0 * rough.b, -chain.unknown, made.a)[3]
    change, side = np.stack((arrival.d_by[1], arrival.chi_by[1])), np.ones(len(rough.b))
    for k in range(n):
        passed = made.passage(SectionPoint(k % 2 == 0, chain.d[k], chain.chi[k]), slopes=True)
        if not (passed.inside & (passed.symbol == track.symbols[k])).all():
            raise NoOrbit(f"passage {k + 1} of an orbit has another symbol than its track")
        change = np.einsum("ijn,jn->in", passed.slopes[:2], change)
        theta3 = theta3 + side * passed.theta3
        side = np.where(passed.mirrored, -side, side)
    end = leaving(level, n % 2 == 0, chain.d[-1], chain.chi[-1])
    slope = end.I_by[0] * change[0] + end.I_by[1] * change[1]
    gained = theta3 + side * end.theta3
    return DoublyAsymptotic(chain, track.symbols, arrival.constant, end, gained, slope)


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
