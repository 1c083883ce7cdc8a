"""Tables of a finished map as the kernel reads them: its significant terms, one after the other.

A table is a staircase: for each Chebyshev polynomial of d or I the harmonics up to the last that
is significant, and for each of these a sum over as many polynomials of the energy.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS
from rigidpend.orbits.integrate.pair_arrays import in_doubles
from rigidpend.orbits.return_map.legs import Leg
from rigidpend.orbits.return_map.rates import radians
from rigidpend.orbits.return_map.starts import Entry

STAGE = 10
"""Whole numbers that describe a stage: two tables and the rates.

Of a table: its rows, the place of its first coefficients, the place of its list of harmonics and
the most of them. Of the rates: how many powers of I, and the place of the first."""


class Program(NamedTuple):
    """A map's data for the kernel, for orbits that begin within some starts."""

    starts: Entry
    bits: int
    """53, in doubles, or 106, in pairs of them."""
    energies: int
    most: int
    """Most harmonics of a table."""
    stages: Any
    """(3, STAGE) int64: from the start, past upward crossings, past downward ones."""
    harmonics: Any
    """int64: for each row of each table, how many."""
    lengths: Any
    """int64: for each three coefficients, how many polynomials of the energy."""
    values: Any
    """(parts, terms, 3): the polynomials' factors, the last polynomial's first."""
    limits: Any
    """(3, 3): of each stage the largest |W|, and its turns in radians as a sum of two doubles."""


def program(starts: Entry, stages: tuple[Leg, Leg, Leg], bits: int) -> Program:
    """The program of three legs, in doubles (53 bits) or pairs of them (106)."""
    writer = _Writer(KINDS[bits].parts)
    rows = [
        [*writer.table(stage.into), *writer.table(stage.out), *writer.rates(stage.rates)]
        for stage in stages
    ]
    limits = [[stage.largest, *radians(stage.turns)] for stage in stages]
    return Program(
        starts,
        bits,
        max(len(x.into) for x in stages),
        max(writer.harmonics),
        np.array(rows, dtype=np.int64),
        np.array(writer.harmonics, dtype=np.int64),
        np.array(writer.lengths, dtype=np.int64),
        np.concatenate(writer.values, axis=1),
        np.array(limits, dtype=float),
    )


class _Writer:
    """Tables written one behind the other; a table that two stages share is written once."""

    def __init__(self, parts: int) -> None:
        self.parts = parts
        self.harmonics: list[int] = []
        self.lengths: list[int] = []
        self.values: list[Any] = []
        self.known: dict[int, tuple[int, int, int, int]] = {}

    def table(self, terms: Any) -> tuple[int, int, int, int]:
        """Write a table: its rows from the second on, then the first."""
        if id(terms) not in self.known:
            first, listed = len(self.lengths), len(self.harmonics)
            values = in_doubles(terms, self.parts)
            used = (values[0] != 0).any(axis=(0, 3))
            rows = 1 + int(np.flatnonzero(used.any(axis=1)).max(initial=0))
            counts = [(1 + int(np.flatnonzero(row).max(initial=0))) // 2 for row in used[:rows]]
            self.harmonics += counts
            for i in (*range(1, rows), 0):
                # The sums over harmonics begin with zero, and the constant comes last.
                for k in (*range(1, 2 * counts[i] + 1), 0):
                    self._write(values[:, :, i, k])
            self.known[id(terms)] = rows, first, listed, max(counts)
        return self.known[id(terms)]

    def rates(self, coefficients: Any) -> tuple[int, int]:
        """Write polynomials in I, the highest power first."""
        first = len(self.lengths)
        values = in_doubles(coefficients, self.parts)
        for k in range(coefficients.shape[1] - 1, -1, -1):
            self._write(values[:, :, k])
        return coefficients.shape[1], first

    def _write(self, series: Any) -> None:
        """Write three sums over polynomials of the energy, (parts, energies, 3)."""
        length = 1 + int(np.flatnonzero((series[0] != 0).any(axis=1)).max(initial=0))
        self.lengths.append(length)
        self.values.append(series[:, length - 1 :: -1])
