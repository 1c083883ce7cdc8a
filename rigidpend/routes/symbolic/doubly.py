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

from rigidpend.numbers.doubles import Array
from rigidpend.orbits.return_map import Passage, SectionPoint
from rigidpend.routes.symbolic.address import Address, cells_of
from rigidpend.routes.symbolic.chain import SETTLED, NoOrbit, corrections
from rigidpend.routes.symbolic.skeleton import Skeleton
from rigidpend.routes.symbolic.tables import Level

MOST_ITERATIONS = 8
MOVED = 1e-3
"""Largest correction of a track, radians or widths: its error is 1e-16, grown along the orbit."""


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

    b: Array
    """(N,) radians: the angle on the unstable surface."""
    chi: Array
    """(n + 1, N) radians at the crossings, whole turns included."""
    d: Array
    """(n + 1, N) dimensionless."""
    symbols: NDArray[np.uint8]
    """(n, N)."""
    passage_time: Array
    """(n, N) t'."""
    arrival: Array
    """(N,) constant of the time up to the first crossing, t'."""
    end: Leaving
    """The last crossings."""
    theta3: Array
    """(N,) growth of theta3 from one end to the other, radians."""
    I_slope: Array
    """(N,) derivative of I behind the last crossing in b."""
    residual: Array
    """(N,) largest disagreement where passages meet: radians, or shares of the tables' width."""

    @property
    def flight(self) -> Array:
        """(N,) t' from the first crossing to the last."""
        found: Array = self.passage_time.sum(axis=0)
        return found

    @property
    def cells(self) -> NDArray[np.int64]:
        """(n + 1, N) the multiples of pi to which chi is nearest."""
        return cells_of(self.chi)

    def begun(self, level: Level) -> Array:
        """(N,) t' of the first crossings, on the clock of `Launch`."""
        found: Array = level.rates(np.zeros(1)).rotation * self.chi[0] - self.arrival
        return found

    def faded(self, level: Level, distance: Array | float) -> Array:
        """(N,) t' from the last crossings on until v of the normal form is `distance`."""
        rates = level.rates(np.zeros(1))
        turned = np.log(np.abs(self.end.V) / distance) / rates.exponent
        found: Array = self.end.constant + rates.rotation * turned
        return found

    def address(self, k: int) -> Address:
        """The address of an orbit; that of one without symbols is its cell alone."""
        return Address.of(self.chi[:, k], self.symbols[:, k])


def doubly_asymptotic(level: Level, rough: Skeleton) -> DoublyAsymptotic:
    """The orbits of a skeleton to rounding.

    Newton's method for all crossings at once: each passage must lead to the next crossing, and
    the last crossing lie on the stable surface. So no error grows along the orbit.

    Raises
    ------
    NoOrbit
        Newton's method does not settle, or only at another orbit.
    """
    track, moved = rough.track, 0.0
    places = _Places(level, rough.b, track.d[1:], track.chi[1:], track.symbols)
    for _ in range(MOST_ITERATIONS):
        step = places.step()
        size = float(np.abs(step).max(initial=0.0))
        moved += size
        if not moved < MOVED:
            break
        places = places.moved(step)
        if size < SETTLED:
            return places.record()
    raise NoOrbit(f"an orbit with {rough.n} symbols does not settle; it moved by {moved:.2g}")


class _Places:
    """Crossings that may still lie beside their orbits, and where the passages lead from them."""

    def __init__(
        self, level: Level, b: Array, d: Array, chi: Array, symbols: NDArray[np.uint8]
    ) -> None:
        self.level, self.b, self.symbols, self.n = level, b, symbols, len(symbols)
        self.unit = np.array([level.unit, 1.0])[:, None]
        self.arrival = level.arriving(np.zeros_like(b), b)
        self.d = np.concatenate((self.arrival.d[None], d))
        self.chi = np.concatenate((self.arrival.chi[None], chi))
        self.passed = [self._passage(k) for k in range(self.n)]
        self.end = leaving(level, self.n % 2 == 0, self.d[-1], self.chi[-1])

    def _passage(self, k: int) -> Passage:
        point = SectionPoint(k % 2 == 0, self.d[k], self.chi[k])
        passed = self.level.map_level.passage(point, slopes=True)
        if not (passed.inside & (passed.symbol == self.symbols[k])).all():
            raise NoOrbit(f"passage {k + 1} of an orbit has another symbol than its track")
        return passed

    def gaps(self) -> Array:
        """(n, 2, N) where passages lead, less the next crossing: widths of the tables, radians."""
        d = [each.point.d - self.d[k + 1] for k, each in enumerate(self.passed)]
        chi = [self.chi[k] + each.turned - self.chi[k + 1] for k, each in enumerate(self.passed)]
        found = np.stack((d, chi), axis=1) if self.n else np.zeros((0, 2, len(self.b)))
        return np.asarray(found / self.unit)

    def slopes(self) -> Array:
        """(n, 2, 2, N) derivatives of the crossings behind passages in those before."""
        parts = [each.slopes[:2] for each in self.passed]
        return np.array(parts).reshape(self.n, 2, 2, len(self.b))

    def first(self) -> Array:
        """(2, N) derivatives of the first crossing's d and chi in b."""
        return np.stack((self.arrival.d_by[1], self.arrival.chi_by[1]))

    def step(self) -> Array:
        """(N, 2 n + 1) Newton's step of b and of d (in widths) and chi at the other crossings."""
        slopes = self.slopes() / self.unit[:, None] * self.unit
        end = self.end.I, np.stack(self.end.I_by) * self.unit
        return corrections(slopes, self.gaps(), self.first() / self.unit, end)

    def moved(self, step: Array) -> _Places:
        """The crossings after a step."""
        d = self.d[1:] + step[:, 1::2].T * self.level.unit
        chi = self.chi[1:] + step[:, 2::2].T
        return _Places(self.level, self.b + step[:, 0], d, chi, self.symbols)

    def record(self) -> DoublyAsymptotic:
        """The orbits with all that follows from their crossings."""
        change, theta3, side = self.first(), self._arriving(), np.ones(len(self.b))
        for each, slope in zip(self.passed, self.slopes(), strict=True):
            change = np.einsum("ijn,jn->in", slope, change)
            theta3 = theta3 + side * each.theta3
            side = np.where(each.mirrored, -side, side)
        by_d, by_chi = self.end.I_by
        gaps = np.abs(self.gaps()).max(axis=(0, 1), initial=0.0)
        return DoublyAsymptotic(
            self.b,
            self.chi,
            self.d,
            self.symbols,
            np.array([each.time for each in self.passed]).reshape(self.n, len(self.b)),
            self.arrival.constant,
            self.end,
            theta3 + side * self.end.theta3,
            by_d * change[0] + by_chi * change[1],
            np.maximum(gaps, np.abs(self.end.I / self.level.widest)),
        )

    def _arriving(self) -> Array:
        """Growth of theta3 from the periodic orbit to the first crossing."""
        made = self.level.map_level
        found: Array = made.charts[True].inverse.look_up(0 * self.b, -self.b, made.a)[3]
        return found


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
