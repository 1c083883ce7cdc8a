"""A finished map as the kernel reads it: three legs, each the significant terms of its tables.

A leg leads from one crossing of M3 = 0 to the next: from the starts, which are a table too, past
the upper orbit from upward crossings, and from downward ones. Units are such that d and I go from
-1 to 1 and that W is near 1; signs such that all legs are alike: what follows a downward crossing
is run backward and mirrored, and so is the way from a start.

A table over (x, phase, energy) holds the product of its orders; but its terms shrink with the sum
of these, so that most lie below rounding. What is left is summed as it stands: some 80 of 640 terms
a function with the body of Fig. 4. It is a staircase: for each Chebyshev polynomial of d or I the
harmonics up to the last that is significant, and for each of these a sum over as many polynomials
of the energy.

In pairs of doubles most terms are so small that doubles have digits enough for them: only those
whose roundings in doubles would come to more than `threshold`, some 5 to 25 % of all, are summed in
pairs. They come last in each sum, which goes on from what doubles have summed.

Phases are kept sharper than in `passage`: ln|W|/Lambda is tens of radians, of which all but
ln|W/scale|/Lambda is a smooth function of I and h, reduced by whole turns before it is rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.exact import context, fraction
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS
from rigidpend.orbits.integrate.pair_arrays import PairArray, in_doubles
from rigidpend.orbits.return_map.charts import INVERSE, Charts, ChartTable, fitted
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import chebyshev_analysis
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm
from rigidpend.orbits.return_map.precision import Precision

FUNCTIONS = 3
"""Functions of a chart that codes and times follow from: all but that of theta3."""
TABLE, RATES = 6, 3
"""Whole numbers that describe a table, and the rates of a leg.

Of a table: its rows, those of them that are summed in the program's own numbers, the place of its
first coefficients, the place of its list of harmonics, the most of them, and of those in its own
numbers. Of the rates: how many powers of I, how many of them in doubles, and the place of the
first."""
STAGE = 2 * TABLE + RATES
"""Those of a leg: two tables and the rates."""
HEADROOM = 2.0**2
"""Factor by which terms in doubles may err more than by a rounding of each coefficient.

A harmonic of some tens has as many roundings, of which most cancel."""
MOST_NODES = 20
"""Chebyshev nodes in Qp from which on a start counts as outside of the normal form."""
ROUNDINGS = 8
"""Roundings in a coefficient of the table of starts; relative, for the largest is of order 1."""


class Entry(NamedTuple):
    """Starts at Qm = 0 put into the normal form, as a table."""

    centre: Any
    half_width: Any
    """Half of the interval of Qp; 0 where it is a point."""
    table: ChartTable
    """v/Qp, u/Qp and tau over (x, psi), x = (Qp - centre)/half_width."""

    def place(self, Qp: Scalar) -> Any:
        """x of starts, in their numbers: doubles or pairs of them."""
        if not self.half_width:
            return 0 * Qp
        centre, half_width = (z if isinstance(Qp, PairArray) else float(z) for z in self[:2])
        x = (Qp - centre) * (1 / half_width)
        return np.where(x > 1, 1.0, np.where(x < -1, -1.0, x))


def entry(nf: NormalForm, least: Scalar, most: Scalar, a: Precision) -> Entry:
    """Starts at Qp from `least` to `most`, numbers of the precision.

    Raises
    ------
    MapError
        The normal form does not reach as far as `most`.
    """
    centre, half_width = (least + most) / 2, (most - least) / 2

    def placed(x: Any, psi: Any, form: TorusForm) -> Any:
        Qp = centre + half_width * x
        at = form.inverted(psi, Qp, 0 * Qp)
        return np.stack((at.v / Qp, at.u / Qp, at.tau))

    for n_x in range(6, MOST_NODES, 3) if half_width else (1,):
        table = fitted(placed, a.number(1), n_x, nf.n, nf, INVERSE, a)
        last = table.values.reshape(nf.energies.n, n_x, nf.n, -1)[:, -2:]
        if n_x == 1 or a.largest(last) <= ROUNDINGS * a.epsilon:
            return Entry(centre, half_width, table)
    raise MapError("the start lies outside of the range of the normal form")


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
    """(rows, 2) int64: for each row of each table how many, and how many in its own numbers."""
    lengths: Any
    """(triples, 2) int64: for each three coefficients, of how many polynomials of the energy."""
    values: Any
    """(parts, terms, 3): the polynomials' factors, the last polynomial's first."""
    limits: Any
    """(3, 3): of each stage the largest |W|, and its turns in radians as a sum of two doubles."""


class Leg(NamedTuple):
    """From one crossing to the next: into the normal form and out of it.

    Tables are (energies, n_x, n_phase, 3) coefficients, 0 where a term is left out.
    """

    into: Any
    """W, the other and the time, over d (or the place of a start) and a phase."""
    out: Any
    """d, chi - s and the time, over I and s."""
    rates: Any
    """(energies, K, 3): coefficients of I in 1/Lambda, the rest of the depth, and dt'/dpsi.

    A depth is ln|W|/Lambda less whole turns."""
    largest: float
    """Largest |W|."""
    turns: float
    """Whole turns that depths are short of."""


def program(
    nf: NormalForm, charts: Charts, starts: Entry, threshold: float, a: Precision, bits: int
) -> Program:
    """The program of a map, in doubles (53 bits) or pairs of them (106).

    Terms of tables that come to less than `threshold`, relative to the largest, are left out.
    """
    stages = legs(nf, charts, starts, threshold, a)
    parts = KINDS[bits].parts
    writer = _Writer(parts, threshold * 2.0**53 / HEADROOM if parts > 1 else 0.0)
    rows = [[*writer.table(x.into), *writer.table(x.out), *writer.rates(x.rates)] for x in stages]
    limits = [[x.largest, *radians(x.turns)] for x in stages]
    return Program(
        starts,
        bits,
        max(len(x.into) for x in stages),
        max(count for count, _ in writer.harmonics),
        np.array(rows, dtype=np.int64),
        np.array(writer.harmonics, dtype=np.int64),
        np.array(writer.lengths, dtype=np.int64),
        np.concatenate(writer.values, axis=1),
        np.array(limits, dtype=float),
    )


def legs(
    nf: NormalForm, charts: Charts, starts: Entry, threshold: float, a: Precision
) -> tuple[Leg, Leg, Leg]:
    """From the starts, and past the upper orbit from upward and from downward crossings."""

    def leg(into: Any, back: int, sides: tuple[int, int], size: float, largest: float) -> Leg:
        forward, inverse = charts[back]
        scale, turns, rates = _rates(nf, size, inverse.width, threshold, a)
        # d in units of the width of the table that comes next.
        out = significant(inverse, threshold) * np.stack((1 / forward.width, 1, sides[1]))
        into = into * np.stack((1 / scale, scale / inverse.width, sides[0]))
        return Leg(into, out, sides[1] * rates, largest / scale, sides[1] * turns)

    def passage(rising: bool) -> Leg:
        # What follows a downward crossing is run backward and mirrored.
        side = 1 if rising else -1
        # W is U beside upward crossings, V beside downward ones.
        order = [*((0, 1) if rising else (1, 0)), 2]
        into = significant(charts[rising].forward, threshold)[..., order]
        return leg(into, not rising, (side, side), float(np.abs(into[..., 0]).max()), math.inf)

    up, down = passage(True), passage(False)
    begin, size = significant(starts.table, threshold), float(starts.centre + starts.half_width)
    # It leaves as from a downward crossing, by the same table.
    return leg(begin, True, (1, -1), size, nf.radius)._replace(out=down.out), up, down


def significant(table: ChartTable, threshold: float) -> Any:
    """The terms of a table without those that come to less than `threshold` (see `negligible`)."""
    count = len(table.values)
    values = table.values.reshape(count, table.n_x, table.n_phase, -1)[..., :FUNCTIONS]
    sizes = np.abs(values.astype(float))
    return np.where(sizes > negligible(sizes, threshold), values, 0)


def negligible(sizes: Any, threshold: float) -> Any:
    """The size up to which terms of each function, the last axis, come to less than `threshold`.

    That is the root of the sum of their squares, relative to the largest term: there are hundreds
    whose signs vary from one place to another.
    """
    ascending = np.sort(sizes.reshape(-1, sizes.shape[-1]), axis=0)
    small = np.sqrt(np.cumsum(ascending**2, axis=0)) <= threshold * ascending[-1]
    return np.max(np.where(small, ascending, 0), axis=0)


def _rates(
    nf: NormalForm, size: float, reach: Any, threshold: float, a: Precision
) -> tuple[float, float, Any]:
    """Rates of a leg where |W| is of the order of `size`, for |I| <= reach.

    The scale by which W is divided, whole turns of the depth, and the coefficients
    (energies, K, 3) of powers of I/reach.
    """
    scale = 2.0 ** round(math.log2(size))
    reciprocal = reciprocal_of(nf.energies.basis(nf.energies.nodes(a), a) @ nf.exponent)
    deep = a.log(a.number(scale)) * reciprocal
    turns = float(np.round(float(deep[0, 0]) / (2 * math.pi)))
    for part in radians(turns):
        deep[:, 0] = deep[:, 0] - part
    back, far = chebyshev_analysis(nf.energies.n, a), float(reach)
    found = [shortened(x, far, threshold) for x in (back @ reciprocal, back @ deep, nf.rotation)]
    most = max(x.shape[1] for x in found)
    joined = np.zeros_like(found[0], shape=(len(found[0]), most, FUNCTIONS))
    for j, x in enumerate(found):
        joined[:, : x.shape[1], j] = x
    power = reach
    for k in range(1, most):
        joined[:, k] = joined[:, k] * power
        power = power * reach
    return scale, turns, joined


def radians(turns: float) -> tuple[float, float]:
    """Whole turns in radians, as a sum of two doubles."""
    exactly = fraction(2 * context(160).pi * int(turns), 160)
    return float(exactly), float(exactly - Fraction(float(exactly)))


def shortened(coefficients: Any, reach: float, threshold: float) -> Any:
    """Coefficients of powers of x, |x| <= reach, less those that come to below `threshold`."""
    sizes = np.abs(coefficients.astype(float)) * reach ** np.arange(coefficients.shape[1])
    kept = sizes > negligible(sizes[..., None], threshold)
    return np.where(kept, coefficients, 0)[:, : 1 + np.flatnonzero(kept.any(axis=0)).max(initial=0)]


def reciprocal_of(series: Any) -> Any:
    """Coefficients (nodes, K) of one over a power series."""
    found = np.zeros_like(series)
    found[:, 0] = 1 / series[:, 0]
    for k in range(1, series.shape[1]):
        known = sum(series[:, j] * found[:, k - j] for j in range(1, k + 1))
        found[:, k] = -known * found[:, 0]
    return found


class _Writer:
    """Tables written one behind the other; a table that two stages share is written once.

    Terms that come to less than a limit, relative to the largest of their function, are summed in
    doubles, the others, the sharp ones, behind them in the program's own numbers.
    """

    def __init__(self, parts: int, limit: float) -> None:
        self.parts, self.limit = parts, limit
        self.harmonics: list[tuple[int, int]] = []
        self.lengths: list[tuple[int, int]] = []
        self.values: list[Any] = []
        self.known: dict[int, tuple[int, ...]] = {}

    def table(self, terms: Any) -> tuple[int, ...]:
        """Write a table: its rows from the second on, then the first."""
        if id(terms) not in self.known:
            first, listed = len(self.lengths), len(self.harmonics)
            values, sharp = self._parted(terms)
            rows, counts = _extent(values[0] != 0)
            own, sharp_counts = _extent(sharp)
            sharp_counts += [0] * (rows - own)
            self.harmonics += zip(counts, sharp_counts, strict=True)
            self._write(values, sharp, _places(counts, sharp_counts))
            most = max(1, *sharp_counts)
            self.known[id(terms)] = rows, own, first, listed, max(counts), most
        return self.known[id(terms)]

    def rates(self, coefficients: Any) -> tuple[int, int, int]:
        """Write polynomials in I, the highest power first."""
        first = len(self.lengths)
        values, sharp = self._parted(coefficients)
        count = coefficients.shape[1]
        own = 1 + int(_last(sharp.any(axis=(0, 2))))
        self._write(values, sharp, ((k,) for k in range(count - 1, -1, -1)))
        return count, max(1, count - own), first

    def _parted(self, terms: Any) -> tuple[Any, Any]:
        """Coefficients (parts, energies, ..., 3), and a mask of those that are sharp."""
        values = in_doubles(terms, self.parts)
        sizes = np.abs(values[0])
        return values, sizes > negligible(sizes, self.limit)

    def _write(self, values: Any, sharp: Any, places: Iterable[tuple[int, ...]]) -> None:
        """Write three sums over polynomials of the energy for each place, in their order.

        Values are (parts, energies, ..., 3), and a mask of sharp ones (energies, ..., 3).
        """
        counts, own = (1 + _last(x.any(axis=-1), -1) for x in (values[0] != 0, sharp))
        for at in places:
            length = max(1, counts[at])
            self.lengths.append((length, own[at]))
            self.values.append(values[:, length - 1 :: -1, *at])


def _places(counts: list[int], sharp_counts: list[int]) -> Iterator[tuple[int, int]]:
    """The places of a table's series, as they are summed: by rows, from the second on."""
    for i in (*range(1, len(counts)), 0):
        # The sums over harmonics begin with zero, and the constant comes last.
        later, last = 2 * sharp_counts[i] + 1, 2 * counts[i] + 1
        for k in (*range(later, last), *range(1, later), 0):
            yield i, k


def _extent(used: Any) -> tuple[int, list[int]]:
    """Rows of a table up to the last with a term, and up to which harmonic each of them goes."""
    terms = used.any(axis=(0, 3))
    rows = 1 + int(_last(terms.any(axis=1)))
    return rows, ((1 + _last(terms.T)) // 2)[:rows].tolist()


def _last(mask: Any, none: int = 0) -> Any:
    """Index of the last True along the first axis."""
    found = len(mask) - 1 - np.argmax(mask[::-1], axis=0)
    return np.where(mask.any(axis=0), found, none)
