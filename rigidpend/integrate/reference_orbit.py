"""Reference orbits: one orbit in high precision, step by step, for others to be followed beside it.

A neighbour at a distance d needs of the reference no more bits than tell the two apart, with
those of d itself. As d grows, fewer and fewer suffice: the precision falls with the tangent, the
derivative of the orbit along the family of its neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.equations import AlignedCoefficients
from rigidpend.integrate.bounds import touch
from rigidpend.integrate.differences import DifferenceField, array
from rigidpend.integrate.engines import has_own_type
from rigidpend.integrate.passages import crossings_of_series
from rigidpend.numbers.exact import GUARD_BITS

BLOCK = 8
"""Steps at a time, all in one precision."""
RUNG = 64
"""Precisions are multiples of it, at least two: MPFR's numbers cost as much in between."""
TINY = 2.0**-800
"""Size of the differences that stand for a tangent: their squares vanish beside them."""
MORE_TERMS = 4
"""Terms of a difference's series beyond those that the reference's own would need."""


class Point(NamedTuple):
    """End of a step of a reference orbit."""

    time: Fraction
    """t' since the start."""
    state: tuple[Fraction, ...]
    """The six aligned components."""


class Passed(NamedTuple):
    """A crossing of M3 = 0."""

    time: float
    separatrix: int


class ReferenceOrbit:
    """An orbit in high precision, continued as far as it is asked for.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions.
    state : 6 Fractions
        Aligned components at time 0.
    tangent : 6 Fractions
        Derivative of the state at time 0 along the family of neighbours.
    engine : str
        One of `ENGINES`; integers serve where it has no type of so many bits.
    bits : int
        Working precision at time 0.
    tolerance : float
        Of a compiled Taylor series in 53 bits; every bit more halves it.
    """

    def __init__(
        self,
        coefficients: AlignedCoefficients,
        state: Sequence[Fraction],
        tangent: Sequence[Fraction],
        *,
        engine: str,
        bits: int,
        tolerance: float,
    ) -> None:
        self.coefficients, self.engine = coefficients, engine
        self.bits, self.tolerance = bits, tolerance
        self.finest = 64 if has_own_type(engine, 64) else 53
        """Bits of the tangents."""
        self._rounded: dict[tuple[int, int], Any] = {}
        self.points = [Point(Fraction(0), tuple(state))]
        self.tangents = [array(tangent, self.finest)]
        self.growth = [self._size(0)]
        """Sizes of the tangents relative to those of momenta and of gamma."""
        self.crossings: list[list[Passed]] = []
        """The crossings on each step."""
        self._field = DifferenceField(coefficients, self.finest)

    def point(self, k: int) -> Point:
        """The end of step k, the start for 0."""
        while k >= len(self.points):
            self._extend()
        return self.points[k]

    def step(self, k: int) -> float:
        """The length t' of the step from point k."""
        return float(self.point(k + 1).time - self.points[k].time)

    def state(self, k: int, bits: int) -> Any:
        """The state at point k as an array in 53 or 64 bits."""
        if (k, bits) not in self._rounded:
            self._rounded[k, bits] = array(self.point(k).state, bits)
        return self._rounded[k, bits]

    def last_below(self, size: float) -> int:
        """The last point up to which the tangent has always been smaller than `size`, or 0."""
        k = 0
        while self.point(k + 1) and self.growth[k + 1] < size:
            k += 1
        return k

    def _extend(self) -> None:
        """Take some further steps."""
        first, spent = len(self.points) - 1, math.log2(self.growth[-1] / self.growth[0])
        bits = max(2 * RUNG, RUNG * math.ceil((self.bits - spent) / RUNG))
        begin = self.points[first]
        for time, state in self._advanced(begin.state, min(bits, self.bits)):
            self.points.append(Point(begin.time + time, state))
        for k in range(first, len(self.points) - 1):
            self._carry_tangent(k)

    def _advanced(self, state: Sequence[Fraction], bits: int) -> Any:
        if self.engine == "taylor" and has_own_type(self.engine, bits):
            from rigidpend.integrate import taylor

            return taylor.advance(self.coefficients, state, BLOCK, bits, self.tolerance)
        from rigidpend.integrate import bigint

        return bigint.advance(self.coefficients, state, BLOCK, bits)

    def _carry_tangent(self, k: int) -> None:
        """Carry the tangent over step k, and note what the orbit crosses there."""
        here, tiny = self.state(k, self.finest), TINY * self.tangents[k][:, None]
        order = series_order(self.finest, self.tolerance)
        series = scaled(self._field.series(here, tiny, order), self.step(k))
        depth = touch(self.finest) * float(np.linalg.norm(here[:3].astype(float)))
        began = float(self.points[k].time)
        found = crossings_of_series(series[:, :3, 0].T.astype(float), depth)
        self.crossings.append([Passed(began + share * self.step(k), s) for share, s in found])
        self.tangents.append(summed(series)[:, 1] / TINY)
        self.growth.append(self._size(k + 1))

    def _size(self, k: int) -> float:
        return float(relative_size(self.tangents[k][:, None], self.state(k, self.finest))[0])


def reference_bits(finest: float, bits: int) -> int:
    """Bits of a reference orbit for neighbours in `bits` bits, at distances from `finest` on."""
    needed = bits + GUARD_BITS + max(0, math.ceil(-math.log2(finest)))
    return max(2 * RUNG, RUNG * math.ceil(needed / RUNG))


def series_order(bits: int, tolerance: float) -> int:
    """The order of a difference's Taylor series on the steps of a reference orbit.

    The steps are the radius of convergence over e^2, so that an order gains two nats.
    """
    return math.ceil(((bits - 53) * math.log(2) - math.log(tolerance)) / 2) + MORE_TERMS


def scaled(series: Any, step: float) -> Any:
    """Series with the step as the unit of time."""
    return series * (series.dtype.type(step) ** np.arange(len(series)))[:, None, None]


def summed(series: Any) -> Any:
    """The values of scaled series at the end of the step, small terms first."""
    return series[::-1].sum(axis=0)


def relative_size(differences: Any, state: Any) -> Any:
    """Sizes of differences (6, n) relative to |M| and |gamma| of a state, whichever is larger."""
    parts = [
        np.linalg.norm(differences[part].astype(float), axis=0)
        / np.linalg.norm(state[part].astype(float))
        for part in (slice(0, 3), slice(3, 6))
    ]
    return np.maximum(*parts)
