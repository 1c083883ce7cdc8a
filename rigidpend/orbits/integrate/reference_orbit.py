"""Reference orbits: one orbit in high precision, step by step, for others to be followed beside it.

A neighbour at a distance d needs of the reference no more bits than tell the two apart, with
those of d itself. As d grows, fewer and fewer suffice: the precision falls with the tangent, the
derivative of the orbit along the family of its neighbours. So it is for a single orbit in many
bits: what rounding has done to it has grown as much.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import chain, islice
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    in_turn,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.arithmetic import LADDER, in_kernel
from rigidpend.orbits.integrate.batch import advance
from rigidpend.orbits.integrate.differences import (
    DifferenceField,
    array,
    scaled,
    series_order,
    summed,
)
from rigidpend.orbits.integrate.passages import UNDECIDED, crossings_of_series, touch

BLOCK = 8
"""Steps at a time, all in one precision."""
PARTS = 3
"""Parts of a step in integers: they are longer than tangents in doubles are carried at once."""
PRECISIONS = (*LADDER[1:], *range(448, 10_000, 32))
"""Precisions that are taken: the kernel's, and for integers steps of some ten per cent in time."""
MAX_STEPS = 10_000_000
"""Steps after which an orbit counts as failed: some 300,000 passages."""
TINY = 2.0**-800
"""Size of the differences that stand for a tangent: their squares vanish beside them."""


class Point(NamedTuple):
    """End of a step of a reference orbit."""

    exact_time: Fraction
    """t' since the start."""
    state: tuple[Fraction, ...]
    """The six aligned components."""
    time: float
    step: float
    """Length t' of the step that ends here."""


class Passed(NamedTuple):
    """A crossing of M3 = 0."""

    time: float
    """t' since the start; of a reference orbit the nearest double, but for a rare last bit."""
    separatrix: int


def crossings(orbits: Orbits, bits: int, engine: str, tolerance: float) -> Crossings:
    """Crossings of orbits in `bits` bits at first, one by one, in a precision that falls.

    The tangent that tells how it falls is as large in M and in gamma, so that it has its share in
    whatever grows; roundings stay below by `GUARD_BITS`.

    Parameters
    ----------
    orbits : Orbits
        With states as lists of Fractions.
    bits : int
        Relative precision of the smallest initial component.
    engine : str
    tolerance : float
        As for :class:`ReferenceOrbit`.
    """
    alone = (
        ReferenceOrbit(
            orbits.coefficients,
            state,
            [Fraction(1 / x) for x in _units(state)],
            tangent_bits=53,
            longest=orbits.passage_limit,
            engine=engine,
            bits=bits + GUARD_BITS,
            tolerance=tolerance,
        )
        for state in orbits.states
    )
    return followed(list(alone), orbits.n_crossings)


def followed(orbits: Sequence[ReferenceOrbit], n_crossings: int) -> Crossings:
    """The first crossings of orbits, each for itself in a precision that falls.

    FAILED where they do not rise and sink in turn.
    """
    found = no_crossings(n_crossings, len(orbits))
    for column, orbit in enumerate(orbits):
        path, found.outcome[column] = orbit.path(n_crossings)
        for k, passed in enumerate(path):
            found.time[k, column], found.separatrix[k, column] = passed
    return in_turn(found)


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
    tangent_bits : int
        Precision of the tangents, 53 or 64.
    longest : float
        Longest wait for the next crossing, t', after which the orbit is not continued.
    engine : str
        One of `ENGINES`; integers serve where its numbers end.
    bits : int
        Precision at time 0; the computation's own is one of `PRECISIONS`.
    tolerance : float
        Of a compiled Taylor series in 53 bits; every bit more halves it.

    Attributes
    ----------
    points : list of Point
        As far as the orbit is known; the first is the start.
    crossings : list of lists of Passed
        The crossings on each step.
    growth : list of float
        The size of the tangent at each point.
    """

    def __init__(
        self,
        coefficients: AlignedCoefficients,
        state: Sequence[Fraction],
        tangent: Sequence[Fraction],
        *,
        tangent_bits: int,
        longest: float,
        engine: str,
        bits: int,
        tolerance: float,
    ) -> None:
        self.coefficients, self.longest = coefficients, longest
        self.engine, self.bits, self.tolerance = engine, bits, tolerance
        self.tangent_bits = tangent_bits
        self.points = [Point(Fraction(0), tuple(state), 0.0, 0.0)]
        self.crossings: list[list[Passed]] = []
        self._fields: dict[int, DifferenceField] = {}
        self._states: dict[tuple[int, int], Any] = {}
        self._units = _units(state)
        self._last = 0.0
        self.tangents = [array(tangent, self.tangent_bits)]
        self.growth = [float(self.size(self.tangents[0][:, None])[0])]

    def reaches(self, k: int) -> bool:
        """Continue the orbit to point k; False if it has long had no crossing before that."""
        while k >= len(self.points):
            if self.points[-1].time - self._last > self.longest:
                return False
            self._extend()
        return True

    def state(self, k: int, bits: int) -> Any:
        """The state at a known point as an array in 53 or 64 bits."""
        if (k, bits) not in self._states:
            self._states[k, bits] = array(self.points[k].state, bits)
        return self._states[k, bits]

    def field(self, bits: int) -> DifferenceField:
        """The field of differences from this orbit in 53 or 64 bits."""
        if bits not in self._fields:
            self._fields[bits] = DifferenceField(self.coefficients, bits)
        return self._fields[bits]

    def size(self, differences: Any) -> Any:
        """The sizes of differences (6, n), relative to |M| and to |gamma|."""
        return (np.abs(differences) * self._units[:, None]).max(axis=0)

    def last_below(self, size: float) -> int:
        """The last point up to which the tangent has always been smaller than `size`, or 0."""
        k = 0
        while self.reaches(k + 1) and self.growth[k + 1] < size:
            k += 1
        return k

    def crossed_before(self, k: int) -> Iterator[Passed]:
        """The crossings before point k."""
        return chain.from_iterable(self.crossings[:k])

    def path(self, n_crossings: int) -> tuple[list[Passed], Outcome]:
        """The first crossings, and how the orbit ended."""
        path: list[Passed] = []
        for k in range(MAX_STEPS):
            if not self.reaches(k + 1):
                return path, silent_outcome(*self.points[-1].state[:2])
            for passed in self.crossings[k]:
                if passed.separatrix == UNDECIDED:
                    return path, Outcome.FAILED
                if passed.time - (path[-1].time if path else 0.0) > self.longest:
                    return path, Outcome.NO_CROSSING
                path.append(passed)
                if len(path) == n_crossings:
                    return path, Outcome.COMPLETE
        return path, Outcome.FAILED

    def bits_at(self, k: int) -> float:
        """Bits that are left at a known point."""
        return self.bits - math.log2(max(self.growth[: k + 1]) / self.growth[0])

    def _extend(self) -> None:
        """Take some further steps."""
        first = len(self.points) - 1
        begin = self.points[first]
        for time, state in self.advanced(begin.state, rung(self.bits_at(first))):
            last, here = self.points[-1].exact_time, begin.exact_time + time
            self.points.append(Point(here, state, float(here), float(here - last)))
        for k in range(first, len(self.points) - 1):
            self._carry_tangent(k)

    def advanced(self, state: Sequence[Fraction], bits: int) -> Any:
        if in_kernel(self.engine, bits):
            return advance(self.coefficients, state, BLOCK, bits, self.tolerance)
        from rigidpend.orbits.integrate import bigint

        taken = islice(bigint.steps(self.coefficients, state, bits), BLOCK)
        return [(step.time(at), step.at(at)) for step in taken for at in step.parts(PARTS)]

    def _carry_tangent(self, k: int) -> None:
        """Carry the tangent over step k, and note what the orbit crosses there."""
        here, tiny = self.state(k, self.tangent_bits), TINY * self.tangents[k][:, None]
        order, step = series_order(self.tangent_bits, self.tolerance), self.points[k + 1].step
        series = scaled(self.field(self.tangent_bits).series(here, tiny, order), step)
        depth = touch(self.tangent_bits) * float(np.linalg.norm(here[:3].astype(float)))
        found = list(crossings_of_series(series[:, :3, 0].T.astype(float), depth))
        if any(separatrix == UNDECIDED for _, separatrix in found):
            found = self._finely(k)
        began = self.points[k].exact_time
        self.crossings.append([Passed(float(began + Fraction(x * step)), s) for x, s in found])
        self._last = max([self._last, *(passed.time for passed in self.crossings[-1])])
        self.tangents.append(summed(series)[:, 1] / TINY)
        self.growth.append(float(self.size(self.tangents[-1][:, None])[0]))

    def _finely(self, k: int) -> list[tuple[float, int]]:
        """The crossings on step k as the bits that are left decide them."""
        from rigidpend.orbits.integrate import bigint

        bits = math.ceil(self.bits_at(k))
        step = next(bigint.steps(self.coefficients, self.points[k].state, bits))
        length = step.since_begin(self.points[k + 1].exact_time - self.points[k].exact_time)
        return list(step.crossings(length, touch(bits - GUARD_BITS)))


def reference_bits(finest: float, bits: int) -> int:
    """Bits of a reference orbit for neighbours in `bits` bits, at distances from `finest` on."""
    return math.ceil(bits + GUARD_BITS - math.log2(min(finest, 1.0)))


def rung(bits: float) -> int:
    """The precision in which so many bits, or more, are computed."""
    return next((one for one in PRECISIONS if one >= bits), math.ceil(bits))


def _units(state: Sequence[Fraction]) -> Any:
    """The inverse sizes of M and of gamma, for each component; of nothing 1."""
    M, gamma = (math.hypot(*map(float, part)) or 1.0 for part in (state[:3], state[3:]))
    return np.repeat((1 / M, 1 / gamma), 3)
