"""Inverse charts of a return map at one energy, values and slopes looked up at once, in doubles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.doubles import Array
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map import EnergyLevel, Passage, ReturnMap, SectionPoint
from rigidpend.orbits.return_map.conjugacy import TorusRates, torus_rates

Mask: TypeAlias = NDArray[np.bool_]
Signs: TypeAlias = NDArray[np.int64]

LOOKS = 128
"""Phases at which the splitting is looked at."""


class PassageEnds(NamedTuple):
    """Crossings as functions of I and an angle at an end of their passages, of one shape."""

    chi: Array
    """Radians, whole turns included."""
    d: Array
    """Dimensionless."""
    constant: Array
    """Share of the passage's time that belongs to this end, t'."""
    chi_by: tuple[Array, Array]
    """Derivatives of chi in I and in the angle."""
    d_by: tuple[Array, Array]


Record = TypeVar("Record", bound=tuple[Any, ...])


def columns(record: Record, where: slice | Signs | Mask) -> Record:
    """Some of the columns of a record of arrays, or all in another order."""
    return _parts(record, (..., where))


def rows_of(record: Record, where: slice | Signs) -> Record:
    """Some of the rows."""
    return _parts(record, (where,))


def _parts(record: Record, where: tuple[Any, ...]) -> Record:
    found = [_parts(x, where) if isinstance(x, tuple) else x[where] for x in record]
    make = getattr(record, "_make", type(record))
    return make(found)


def onward(
    level: EnergyLevel, point: SectionPoint, n: int, slopes: bool = False
) -> Iterator[Passage]:
    """The n passages that follow crossings, one after the other."""
    for _ in range(n):
        passed = level.passage(point, slopes=slopes)
        yield passed
        point = passed.point


def widest_d(level: EnergyLevel) -> float:
    """Largest |d| of the tables of a map, the scale of d in Newton's method and in roundings."""
    return max(float(chart.forward.width) for chart in level.charts)


class Level:
    """A map's inverse charts at one energy, in the form in which chains use them.

    Attributes
    ----------
    map_level : EnergyLevel
    h : float
    widest : float
        Largest |I| of the tables.
    unit : float
        Largest |d| of the tables.
    """

    def __init__(self, made: ReturnMap, h: Scalar) -> None:
        self.map_level: EnergyLevel = made.at(h)
        self.h = float(h)
        charts = self.map_level.charts
        self.widest = min(float(chart.inverse.width) for chart in charts)
        self.unit = widest_d(self.map_level)
        self.exponent = float(self.map_level.exponent[0, 0])
        self.splitting = self._splitting()
        self.shift = self._shift()

    def rates(self, I: Array) -> TorusRates:
        """Lambda(I) and the mean dt'/dchi, in the shape of I."""
        found = torus_rates(self.map_level.exponent, self.map_level.rotation, I.ravel())
        return TorusRates(*(x.reshape(I.shape) for x in found))

    def crossings(self, rising: Mask, upper: Mask, I: Array, angle: Array) -> PassageEnds:
        """The crossings at one end of passages past the upper or the lower periodic orbit.

        Parameters
        ----------
        rising : array
            Whether the crossings are upward.
        upper : array
            Which orbit is passed. The lower one is the reversed upper one: angles change sign.
        I, angle : arrays
            All four of shapes that fit each other.
        """
        rising, upper, I, angle = np.broadcast_arrays(rising, upper, I, angle)
        side = np.where(upper, 1.0, -1.0)
        value, by_I, by_angle = seen = np.empty((3, 4, *I.shape))
        for kind in (False, True):
            here, level = rising == kind, self.map_level
            if here.any():
                table = level.charts[kind].inverse
                found = table.look_up_slopes(I[here], (side * angle)[here], level.a)
                seen[..., here] = np.array(found)
        return PassageEnds(
            angle + side * value[1],
            value[0],
            side * value[2],
            (side * by_I[1], 1 + by_angle[1]),
            (by_I[0], side * by_angle[0]),
        )

    def arriving(self, I: Array, b: Array) -> PassageEnds:
        """Upward crossings at the ends of passages past the lower periodic orbit."""
        return self.crossings(np.array(True), np.array(False), I, b)

    def invariants(self, signs: Signs, growth: Array) -> tuple[Array, Array]:
        """I of passages in which the angle grows by `growth`, and its derivative.

        Beyond the tables' range it is its border, so that an iteration may come back.
        """
        size = np.minimum(np.exp(-growth * self.exponent), self.widest)
        slope = size
        for _ in range(8):
            I = np.asarray(signs * size, dtype=float)
            rates = self.rates(I)
            depth = -np.log(size) / rates.exponent
            slope = -1 / (1 / (I * rates.exponent) + depth * rates.exponent_slope / rates.exponent)
            ratio = np.clip(slope * (growth - depth) / I, -0.9, 9.0)
            size = np.minimum(size * (1 + ratio), self.widest)
            if np.abs(ratio).max(initial=0.0) < 1e-15:
                break
        return np.asarray(signs * size, dtype=float), slope

    def half_turns(self, I: float) -> float:
        """The half rotations that a passage takes between crossings at multiples of pi."""
        return (-math.log(abs(I)) / self.exponent + self.shift) / math.pi

    @property
    def fewest_half_turns(self) -> int:
        """The half rotations that any passage takes at least."""
        return math.floor(self.half_turns(2 * self.splitting))

    def invariant(self, half_turns: float) -> float:
        """The |I| of passages with so many half rotations, the inverse of `half_turns`."""
        return math.exp((self.shift - math.pi * half_turns) * self.exponent)

    def _splitting(self) -> float:
        """Largest |I| that a crossing on the unstable surface of the lower orbit leads to."""
        level, a = self.map_level, self.map_level.a
        b = np.linspace(0, 2 * np.pi, LOOKS)
        on = self.arriving(np.zeros(LOOKS), b)
        U, V, *_ = level.charts[True].forward.look_up(on.d, on.chi, a)
        return float(np.abs(U * V).max())

    def _shift(self) -> float:
        """Growth of chi in a passage beyond -ln|I|/Lambda, from 0 to a multiple of pi."""
        both, zero = np.array([True, False]), np.zeros(2)
        at = self.crossings(both, np.array([True, True]), zero, zero)
        return float(at.chi[1] - at.chi[0])
