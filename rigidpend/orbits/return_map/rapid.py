"""Rapid passages: many orbits through a finished map, in machine code where LLVM is.

What `passage` and `itinerary` do with derivatives and theta3 in any precision is done here for
codes and times alone, in doubles and in pairs of them: by `kernel`, or over arrays.

Phases are kept sharper than in `passage`: ln|W|/Lambda is tens of radians, of which all but
ln|W/scale|/Lambda is a smooth function of I and h, reduced by whole turns before it is rounded.
"""

from __future__ import annotations

import copy
import functools
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.engines import default_engine
from rigidpend.orbits.return_map import kernel
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.passage import reduced_angle
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.program import (
    Leg,
    Program,
    joined_rates,
    program,
    scaled,
)
from rigidpend.orbits.return_map.rates import (
    Rates,
    chart_rates,
    depth_of,
    rates_at,
)
from rigidpend.orbits.return_map.starts import Entry
from rigidpend.orbits.return_map.terms import (
    Terms,
    evaluated,
    in_doubles,
    nested,
    polynomial,
    significant,
)


class Followed(NamedTuple):
    """Orbits through their crossings of M3 = 0, (n + 1, N) each."""

    time: Any
    """t' in the map's unit, doubles; NaN where the tables do not reach so far."""
    separatrix: Any
    """uint8, 1..4; 0 where the tables do not reach as far as that crossing."""


class Rapid:
    """Passages of a finished map, in doubles or in the map's own precision.

    Parameters
    ----------
    nf : NormalForm
    charts : 2 Chart
        Of downward and upward crossings.
    error : float
        Of the tables, relative: terms far below it are left out.
    bits : int
        53, or the map's own.
    own : Precision
        The map's.
    """

    def __init__(
        self, nf: NormalForm, charts: Any, error: float, bits: int, own: Precision
    ) -> None:
        self._precision = own
        self.a, self._nf = precision(bits), nf
        threshold = self._threshold = max(2.0 ** -(bits + 2), error / 16)
        self._terms = [[significant(table, threshold) for table in chart] for chart in charts]
        self._widths = [[table.width for table in chart] for chart in charts]
        self._start: _Start
        self._rates = [
            chart_rates(
                nf, self._terms[rising][0], 1 - rising, float(self._reach(rising)), threshold, own
            )
            for rising in (False, True)
        ]
        self.compiles = default_engine() == "taylor"

    def beginning(self, begin: Entry) -> Rapid:
        """The same passages, for orbits with these starts."""
        made = copy.copy(self)
        most = float(begin.centre + begin.half_width)
        reach = float(self._reach(False))
        rates = rates_at(self._nf, most, reach, self._threshold, self._precision)
        made._start = _Start(begin, significant(begin.table, self._threshold), rates)
        return made

    def enter(self, Qp: Scalar, phase: Scalar, e: Scalar) -> tuple[Any, Any, Any, Any]:
        """First crossings of orbits that start at Qp > 0, Qm = 0, M3 < 0: see `itinerary.enter`.

        Returns
        -------
        d, chi, time, inside : (N,) arrays
            Of upward crossings beside separatrix 2; whether the tables reach so far.
        """
        rates = self._cast(self._start.rates)
        x = self._start.entry.place(Qp, self.a)
        v, u, begin = evaluated(*self._listed(self._start.terms), x, phase, e, np)
        v, u = v * Qp, u * Qp
        I = u * v
        s = phase + depth_of(v, I, e, rates)
        there, beyond, end = self._sum(True, 1, I, s, e)
        new = s + beyond
        turned = new - phase + 2 * self.a.pi * rates.turns
        inside = (np.abs(v) <= self._nf.radius) & (np.abs(I) <= self._widths[1][1])
        return there, -new, begin + end - polynomial(rates.rotation, I, e) * turned, inside

    def passage(self, rising: bool, rows: Any) -> tuple[Any, Any]:
        """Past the upper periodic orbit, forward from upward crossings, backward from others.

        Parameters
        ----------
        rising : bool
        rows : (3, N) array
            d, chi and the energy, -1 to 1 in its interval.

        Returns
        -------
        (5, N) array
            d, chi and time; W, whose sign tells the side; I.
        (N,) array of bool
            Whether the tables reach so far.
        """
        d, chi, e = rows
        U, V, begin = self._sum(rising, 0, d, chi, e)
        I, W, rates = U * V, U if rising else V, self._cast(self._rates[rising])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            depth = depth_of(W, I, e, rates)
            s = chi - depth if rising else chi + depth
            there, beyond, end = self._sum(not rising, 1, I, s, e)
        new = s + beyond
        turned = new - chi - (1 if rising else -1) * 2 * self.a.pi * rates.turns
        time = begin - end + polynomial(rates.rotation, I, e) * turned
        inside = np.abs(d) <= self._widths[rising][0]
        inside &= (np.abs(I) <= self._reach(rising)) & (W != 0)
        return np.stack((there, new, time, W, I)), inside

    def follow(self, Qp: Scalar, phase: Scalar, e: Scalar, n: int) -> Followed:
        """Orbits from their start through n passages after the first crossing.

        Parameters
        ----------
        Qp : (N,) array
        phase : (N,) array
            psi of the mirrored start, radians.
        e : (N,) array
            Energies, -1 to 1 in the map's interval.
        n : int
        """
        if not self.compiles:
            return self.interpreted(Qp, phase, e, n)
        x = self._start.entry.place(Qp, self.a)
        return Followed(*kernel.follow(self._program, np.stack((x, phase, e, Qp)), n + 1))

    def interpreted(self, Qp: Scalar, phase: Scalar, e: Scalar, n: int) -> Followed:
        """The same by arrays."""
        d, chi, time, inside = self.enter(Qp, phase, e)
        times, beside = np.empty((n + 1, d.size)), np.empty((n + 1, d.size), dtype=np.uint8)
        image, rising, rows = np.zeros(d.size, dtype=bool), True, np.stack((d, chi, e))
        for k in range(n + 1):
            separatrix = np.where(image, 4, 2) if rising else np.where(image, 1, 3)
            times[k], beside[k] = (
                np.where(inside, self.a.floats(time), np.nan),
                np.where(inside, separatrix, 0),
            )
            if k == n:
                break
            # Past the lower orbit the reversor leads: chi and time change their signs.
            side = 1 if rising else -1
            rows[1] = reduced_angle(side * chi, self.a)
            passed, within = self.passage(rising, rows)
            rows[0], chi, time = passed[0], side * passed[1], time + side * passed[2]
            image, inside, rising = image ^ (passed[3] < 0), inside & within, not rising
        return Followed(times, beside)

    def _sum(self, rising: bool, which: int, x: Scalar, phase: Scalar, e: Scalar) -> list[Any]:
        return evaluated(*self._rounded[rising][which], x, phase, e, np)

    def _listed(self, terms: Terms) -> tuple[Terms, list[Any]]:
        """A table's terms in this precision."""
        rounded = in_doubles(terms) if self.a.bits == 53 else terms
        return rounded, nested(rounded)

    @functools.cached_property
    def _rounded(self) -> list[list[tuple[Terms, list[Any]]]]:
        return [[self._listed(terms) for terms in chart] for chart in self._terms]

    @functools.cached_property
    def _program(self) -> Program:
        """Data for the kernel: the way from the starts, and both passages."""
        _, terms, rates = self._start
        reach, out = self._reach(False), [self._out(rising) for rising in (False, True)]
        start = Leg(
            scaled(terms, (0, 1), (1 / rates.scale, rates.scale / reach, 1)),
            out[0],
            joined_rates(rates[:3], -1, reach),
            self._nf.radius / rates.scale,
            -rates.turns,
        )
        up, down = (self._stage(rising, out[rising]) for rising in (True, False))
        return program((start, up, down), 53 if self.a.bits == 53 else 106)

    def _stage(self, rising: bool, out: Terms) -> Leg:
        """Past the upper orbit from upward crossings; mirrored from downward ones."""
        side, reach, rates = 1 if rising else -1, self._reach(rising), self._rates[rising]
        return Leg(
            scaled(
                self._terms[rising][0],
                (0, 1) if rising else (1, 0),
                (1 / rates.scale, rates.scale / reach, side),
            ),
            out,
            joined_rates(rates[:3], side, reach),
            np.inf,
            side * rates.turns,
        )

    def _out(self, rising: bool) -> Terms:
        """The table that a passage ends with; d in units of the next one's width."""
        forward, inverse = self._terms[not rising]
        return scaled(inverse, (0, 1), (1 / forward.width, 1, 1 if rising else -1))

    def _reach(self, rising: bool) -> Any:
        """Largest |I| of the table that a passage ends with."""
        return self._widths[not rising][1]

    def _cast(self, rates: Rates) -> Rates:
        reciprocal, rest, rotation = (self.a.array(x) for x in rates[:3])
        return Rates(reciprocal, rest, rotation, rates.turns, rates.scale)


class _Start(NamedTuple):
    """Starts, the significant terms of their table, and the rates there."""

    entry: Entry
    terms: Terms
    rates: Rates
