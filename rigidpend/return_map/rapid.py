"""Rapid passages: many orbits through a finished map, compiled where heyoka is.

What `passage` and `itinerary` do with derivatives and theta3 in any precision is done here for
codes and times alone, in doubles and in 64 bits. The lines that compute a passage run over
heyoka's symbols, over arrays of doubles and over long doubles alike.

Phases are kept sharper than in `passage`: ln|W|/Lambda is tens of radians, of which all but
ln|W/scale|/Lambda is a smooth function of I and h, reduced by whole turns before it is rounded.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rigidpend.integrate.engines import default_engine
from rigidpend.numbers.generic import Scalar
from rigidpend.return_map.charts import ChartTable, fitted, grid
from rigidpend.return_map.conjugacy import inverted
from rigidpend.return_map.normal_form import MapError, NormalForm
from rigidpend.return_map.passage import reduced_angle
from rigidpend.return_map.precision import Precision, precision
from rigidpend.return_map.terms import (
    Terms,
    evaluated,
    halves,
    in_doubles,
    nested,
    polynomial,
    significant,
    significant_powers,
)

STAGES = "up", "down"
"""Names of the passages from upward and from downward crossings."""
MOST_NODES = 20
"""Chebyshev nodes in Qp from which on a start counts as outside of the normal form."""

ROUNDINGS = 8
"""Roundings in a coefficient of the table of starts; relative, for the largest is of order 1."""

ChartSum: TypeAlias = Callable[[Any, Any, Any], list[Any]]
"""Three functions of x, a phase and an energy."""
Stage: TypeAlias = Callable[[Any], Any]
"""From rows (3, N) to rows (5, N)."""


class Rates(NamedTuple):
    """Coefficients (energies, K) in I; a depth is ln(W^2)/(2 Lambda) less whole turns."""

    reciprocal: Any
    """Coefficients of 1/Lambda."""
    rest: Any
    """Coefficients of ln(scale)/Lambda less 2 pi `turns`."""
    rotation: Any
    """Coefficients of the mean dt'/dpsi."""
    turns: float
    scale: float
    """W is divided by it."""


class Followed(NamedTuple):
    """Orbits through their crossings of M3 = 0, (n + 1, N) each."""

    time: Any
    """t' in the map's unit, doubles."""
    separatrix: Any
    """uint8, 1..4."""
    inside: Any
    """True where the tables reach as far as that crossing; elsewhere the rest is void."""


class Rapid:
    """Passages of a finished map, in doubles or in the map's own 64 bits.

    Parameters
    ----------
    nf : NormalForm
    charts : 2 Chart
        Of downward and upward crossings.
    error : float
        Of the tables, relative: terms far below it are left out.
    bits : int
        53 or 64.
    many : bool
        Whether to compile the small terms of sums in 64 bits as well: it takes half a second.
    """

    def __init__(self, nf: NormalForm, charts: Any, error: float, bits: int, many: bool) -> None:
        own = self._precision = precision(64 if nf.exponent.dtype == np.longdouble else 53)
        self.a, self._nf = precision(bits), nf
        self._begin: Entry
        self._entry: Terms
        self._entry_rates: Rates
        threshold = self._threshold = max(2.0 ** -(bits + 2), error / 16)
        self._terms = [[significant(table, threshold) for table in chart] for chart in charts]
        self._widths = [[float(table.width) for table in chart] for chart in charts]
        reach = self._widths[1][1]
        self._rates = [
            _rates(nf, self._terms[rising][0], 1 - rising, reach, threshold, own)
            for rising in (0, 1)
        ]
        self._stages: dict[str, Stage] = {}
        self._parts: dict[int, tuple[Terms, list[Any], Stage]] = {}
        self.compiles = default_engine() == "taylor" and (bits == 53 or many)

    def beginning(self, begin: Entry) -> Rapid:
        """The same passages, for orbits with these starts."""
        made = copy.copy(self)
        made._begin = begin
        made._entry = significant(begin.table, self._threshold)
        most = float(begin.centre + begin.half_width)
        made._entry_rates = _rates_at(
            self._nf, most, self._widths[1][1], self._threshold, self._precision
        )
        return made

    def enter(self, Qp: Scalar, phase: Scalar, e: Scalar) -> tuple[Any, Any, Any, Any]:
        """First crossings of orbits that start at Qp > 0, Qm = 0, M3 < 0: see `itinerary.enter`.

        Returns
        -------
        d, chi, time, inside : (N,) arrays
            Of upward crossings beside separatrix 2; whether the tables reach so far.
        """
        d, chi, time, v, I = self._stage(self._begin.name)(np.stack((Qp + 0 * phase, phase, e)))
        inside = (np.abs(v) <= self._nf.radius) & (np.abs(I) <= self._widths[1][1])
        return d, -chi, time, inside

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
        found = self._stage(STAGES[not rising])(rows)
        width, reach = self._widths[rising][0], self._widths[not rising][1]
        inside = (np.abs(rows[0]) <= width) & (np.abs(found[4]) <= reach) & (found[3] != 0)
        return found, inside

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
        d, chi, time, inside = self.enter(Qp, phase, e)
        found = Followed(
            np.empty((n + 1, d.size)),
            np.empty((n + 1, d.size), dtype=np.uint8),
            np.empty((n + 1, d.size), dtype=bool),
        )
        image, rising, rows = np.zeros(d.size, dtype=bool), True, np.stack((d, chi, e))
        for k in range(n + 1):
            found.time[k], found.inside[k] = time, inside
            found.separatrix[k] = np.where(image, 4, 2) if rising else np.where(image, 1, 3)
            if k == n:
                break
            # Past the lower orbit the reversor leads: chi and time change their signs.
            side = 1 if rising else -1
            rows[1] = reduced_angle(side * chi, self.a)
            passed, within = self.passage(rising, rows)
            rows[0], chi, time = passed[0], side * passed[1], time + side * passed[2]
            image, inside, rising = image ^ (passed[3] < 0), inside & within, not rising
        return found

    def _stage(self, name: str) -> Stage:
        if name not in self._stages:
            compiles = self.compiles and self.a.bits == 53
            lines = functools.partial(self._past, name == "up") if name in STAGES else self._enter
            self._stages[name] = (_compiled if compiles else _interpreted)(lines)
        return self._stages[name]

    def _past(self, rising: bool, d: Scalar, chi: Scalar, e: Scalar, m: Any) -> list[Any]:
        """The lines of a passage."""
        U, V, begin = self._sum(self._terms[rising][0], d, chi, e, m)
        I, W, rates = U * V, U if rising else V, self._cast(self._rates[rising])
        depth = _depth(W, I, e, rates, m)
        s = chi - depth if rising else chi + depth
        there, beyond, end = self._sum(self._terms[not rising][1], I, s, e, m)
        new = s + beyond
        turned = new - chi - (1 if rising else -1) * 2 * self.a.pi * rates.turns
        time = begin - end + polynomial(rates.rotation, I, e) * turned
        return [there, new, time, W, I]

    def _enter(self, Qp: Scalar, phase: Scalar, e: Scalar, m: Any) -> list[Any]:
        """The lines from a start to the first crossing, mirrored."""
        rates = self._cast(self._entry_rates)
        x = 0 * Qp
        if self._begin.half_width:
            centre, half_width = map(self._own, self._begin[:2])
            x = (Qp - centre) * (1 / half_width)
        v, u, begin = self._sum(self._entry, x, phase, e, m)
        v, u = v * Qp, u * Qp
        I = u * v
        s = phase + _depth(v, I, e, rates, m)
        there, beyond, end = self._sum(self._terms[1][1], I, s, e, m)
        new = s + beyond
        turned = new - phase + 2 * self.a.pi * rates.turns
        return [there, new, begin + end - polynomial(rates.rotation, I, e) * turned, v, I]

    def _sum(self, terms: Terms, x: Scalar, phase: Scalar, e: Scalar, m: Any) -> list[Any]:
        if self.a.bits == 53:
            doubles = in_doubles(terms)
            return evaluated(doubles, nested(doubles), x, phase, e, m)
        head, lists, tail = self._halves(terms)
        small = tail(np.stack([np.asarray(z).astype(float) for z in (x, phase, e)]))
        large = evaluated(head, lists, x, phase, e, m)
        return [a + b for a, b in zip(large, small, strict=True)]

    def _halves(self, terms: Terms) -> tuple[Terms, list[Any], Stage]:
        """The large terms, and the sum of the small ones."""
        if id(terms) not in self._parts:
            head, tail = halves(terms)
            lines = functools.partial(evaluated, tail, nested(tail))
            stage = (_compiled if self.compiles else _interpreted)(lines)
            self._parts[id(terms)] = head, nested(head), stage
        return self._parts[id(terms)]

    def _own(self, z: Scalar) -> Any:
        return float(z) if self.a.bits == 53 else z

    def _cast(self, rates: Rates) -> Rates:
        reciprocal, rest, rotation = (x.astype(self.a.dtype) for x in rates[:3])
        return Rates(reciprocal, rest, rotation, rates.turns, rates.scale)


class Entry(NamedTuple):
    """Starts at Qm = 0 put into the normal form, as a table."""

    centre: Any
    half_width: Any
    """Half of the interval of Qp; 0 where it is a point."""
    table: ChartTable
    """v/Qp, u/Qp, tau and sigma over (x, psi), x = (Qp - centre)/half_width."""

    @property
    def name(self) -> str:
        """Name of the interval."""
        return f"{self.centre!r} {self.half_width!r}"


def entry(nf: NormalForm, least: Scalar, most: Scalar, a: Precision) -> Entry:
    """Starts at Qp from `least` to `most`, numbers of the precision.

    Raises
    ------
    MapError
        The normal form does not reach as far as `most`.
    """
    centre, half_width = (least + most) / 2, (most - least) / 2
    for n_x in range(6, MOST_NODES, 3) if half_width else (1,):
        x, psi = grid(a.number(1), n_x, nf.n, a)
        Qp, found = centre + half_width * x, []
        for h in nf.energies.nodes(a):
            at = inverted(nf, nf.energies.basis(h, a)[None], psi, Qp, 0 * Qp, a)
            found.append(np.stack((at.v / Qp, at.u / Qp, at.tau, at.sigma)).T)
        values = np.stack([one.reshape(n_x, nf.n, 4) for one in found], axis=2)
        table = fitted(values, a.number(1), nf.energies, a)
        last = table.values.reshape(len(found), n_x, nf.n, 4)[:, -2:, :, :3]
        if n_x == 1 or a.largest(last) <= ROUNDINGS * a.epsilon:
            return Entry(centre, half_width, table)
    raise MapError("the start lies outside of the range of the normal form")


def _rates(
    nf: NormalForm, chart: Terms, which: int, reach: float, threshold: float, a: Precision
) -> Rates:
    """The rates for a chart's U (`which` 0) or V (1)."""
    size = float(np.abs(chart.values[..., which]).max())
    return _rates_at(nf, size, reach, threshold, a)


def _rates_at(nf: NormalForm, size: float, reach: float, threshold: float, a: Precision) -> Rates:
    """The rates where |W| is of the order of `size`."""
    scale = 2.0 ** round(math.log2(size))
    at_nodes = nf.energies.basis(nf.energies.nodes(a), a)
    exponent = at_nodes @ nf.exponent
    reciprocal = _reciprocal(exponent)
    deep = a.log(a.number(scale)) * reciprocal
    turns = float(np.round(float(deep[0, 0]) / (2 * math.pi)))
    deep[:, 0] = deep[:, 0] - 2 * a.pi * turns
    back = nf.energies.analysis(a)
    kept = functools.partial(significant_powers, reach=reach, threshold=threshold)
    return Rates(kept(back @ reciprocal), kept(back @ deep), kept(nf.rotation), turns, scale)


def _reciprocal(series: Any) -> Any:
    """Coefficients (nodes, K) of one over a power series."""
    found = np.zeros_like(series)
    found[:, 0] = 1 / series[:, 0]
    for k in range(1, series.shape[1]):
        known = sum(series[:, j] * found[:, k - j] for j in range(1, k + 1))
        found[:, k] = -known * found[:, 0]
    return found


def _depth(W: Scalar, I: Scalar, e: Scalar, rates: Rates, m: Any) -> Any:
    """ln|W|/Lambda(I) less the whole turns."""
    share = W * (1 / rates.scale)
    near = m.log(share * share) * 0.5 * polynomial(rates.reciprocal, I, e)
    return near + polynomial(rates.rest, I, e)


def _compiled(lines: Callable[..., list[Any]]) -> Stage:
    """The lines as a function compiled for many points at a time."""
    from rigidpend.integrate.compiled import heyoka

    hy = heyoka()
    names = hy.make_vars("x", "phase", "e")
    function = hy.cfunc(lines(*names, hy), vars=names)
    return lambda rows: function(np.ascontiguousarray(rows))


def _interpreted(lines: Callable[..., list[Any]]) -> Stage:
    """The lines over arrays."""

    def run(rows: Any) -> Any:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return np.stack(lines(*rows, np))

    return run
