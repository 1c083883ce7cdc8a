"""Inverse charts of a return map at one energy, values and slopes looked up at once, in doubles."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial.chebyshev import chebder
from numpy.typing import NDArray

from rigidpend.numbers.doubles import Array
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map import EnergyLevel, ReturnMap
from rigidpend.orbits.return_map.charts import LevelTable
from rigidpend.orbits.return_map.conjugacy import TorusRates, torus_rates
from rigidpend.orbits.return_map.expansions import chebyshev_basis, fourier_basis
from rigidpend.orbits.return_map.precision import precision

Mask: TypeAlias = NDArray[np.bool_]
Signs: TypeAlias = NDArray[np.int64]

LOOKS = 128
"""Phases at which the splitting is looked at."""


class PassageEnds(NamedTuple):
    """Crossings as functions of I and an angle at an end of their passages, (N,) each."""

    chi: Array
    """Radians, whole turns included."""
    d: Array
    """Dimensionless."""
    constant: Array
    """Share of the passage's time that belongs to this end, t'."""
    chi_by: tuple[Array, Array]
    """Derivatives of chi in I and in the angle."""
    d_by: tuple[Array, Array]

    def part(self, where: slice | Signs) -> PassageEnds:
        """Some of the crossings."""
        (chi_I, chi_angle), (d_I, d_angle) = self.chi_by, self.d_by
        return PassageEnds(
            self.chi[where],
            self.d[where],
            self.constant[where],
            (chi_I[where], chi_angle[where]),
            (d_I[where], d_angle[where]),
        )


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
        self._tables = [_Sloped(chart.inverse) for chart in charts]
        self.exponent = float(self.map_level.exponent[0, 0])
        self.splitting = self._splitting()
        self.shift = self._shift()

    def rates(self, I: Array) -> TorusRates:
        """Lambda(I) and the mean dt'/dchi."""
        return torus_rates(self.map_level.exponent, self.map_level.rotation, I)

    def crossings(self, rising: Mask, upper: Mask, I: Array, angle: Array) -> PassageEnds:
        """The crossings at one end of passages past the upper or the lower periodic orbit.

        Parameters
        ----------
        rising : (N,) array
            Whether the crossings are upward.
        upper : (N,) array
            Which orbit is passed. The lower one is the reversed upper one: angles change sign.
        I, angle : (N,) arrays
        """
        side = np.where(upper, 1.0, -1.0)
        seen = np.empty((len(I), 12))
        for kind in (False, True):
            here = np.flatnonzero(rising == kind)
            if here.size:
                seen[here] = self._tables[kind].at(I[here], (side * angle)[here])
        value, by_I, by_angle = seen[:, :4].T, seen[:, 4:8].T, seen[:, 8:].T
        return PassageEnds(
            angle + side * value[1],
            value[0],
            side * value[2],
            (side * by_I[1], 1 + by_angle[1]),
            (by_I[0], side * by_angle[0]),
        )

    def invariants(self, signs: Signs, growth: Array) -> tuple[Array, Array]:
        """I of passages in which the angle grows by `growth`, and its derivative; (N,) each.

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
        none, yes = np.zeros(LOOKS, dtype=bool), np.ones(LOOKS, dtype=bool)
        on = self.crossings(yes, none, np.zeros(LOOKS), b)
        U, V, *_ = level.charts[True].forward.look_up(on.d, on.chi, a)
        return float(np.abs(U * V).max())

    def _shift(self) -> float:
        """Growth of chi in a passage beyond -ln|I|/Lambda, from 0 to a multiple of pi."""
        both, zero = np.array([True, False]), np.zeros(2)
        at = self.crossings(both, np.array([True, True]), zero, zero)
        return float(at.chi[1] - at.chi[0])


class _Sloped:
    """A table at one energy whose slopes are further columns of its coefficients."""

    def __init__(self, table: LevelTable) -> None:
        self.width, self.n_x, self.n_phase = float(table.width), table.n_x, table.n_phase
        grid = table.values[0].astype(float).reshape(self.n_x, self.n_phase, 4)
        by_x = np.zeros_like(grid)
        by_x[:-1] = chebder(grid, axis=0) / self.width if self.n_x > 1 else 0
        k = np.arange(1, self.n_phase // 2 + 1)[:, None]
        by_phase = np.zeros_like(grid)
        by_phase[:, 1::2], by_phase[:, 2::2] = k * grid[:, 2::2], -k * grid[:, 1::2]
        columns = np.concatenate((grid, by_x, by_phase), axis=2)
        self.coefficients = columns.reshape(-1, 12)

    def at(self, x: Array, phase: Array) -> Array:
        """Values, slopes in x and slopes in the phase, (N, 12)."""
        a = precision(53)
        T = chebyshev_basis(x / self.width, self.n_x, a)
        F = fourier_basis(phase, self.n_phase, a)
        found: Array = (T[:, :, None] * F[:, None, :]).reshape(len(x), -1) @ self.coefficients
        return found
