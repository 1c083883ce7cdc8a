"""A finished map as data for the kernel: three legs, each with the significant terms of its tables.

A leg leads from one crossing of M3 = 0 to the next, or from a start to the first crossing: there
is one leg for the starts, whose place in the normal form is a table too, one from upward and one
from downward crossings. Units are chosen so that d and I go from -1 to 1 and that W, which is U or
V, is near 1. Signs are chosen so that all legs are computed alike, as passages past the upper
orbit: the leg from downward crossings is run backward and mirrored, and so is that from the starts.

A table over (x, phase, energy) has a term for each combination of orders, but the terms shrink with
the sum of their orders, so that most lie below rounding. The others are summed as they are: some 80
of 640 terms of a function with the body of Fig. 4. They form a staircase: for each Chebyshev
polynomial of d or I all harmonics up to the last significant one, and for each of these a sum over
polynomials of the energy, likewise up to the last significant one.

In a program of pairs of doubles most terms are so small that doubles have digits enough for them.
Only those whose roundings in doubles would come to more than `threshold`, some 5 to 25 % of all,
are summed in pairs. They come last in each sum, which continues from the sum in doubles. Of all
other coefficients the kernel keeps no second part: it reads its memory as fast as it computes.

Phases are sharper than in `passage`: ln|W|/Lambda is tens of radians, but all of it other than
ln|W/scale|/Lambda is a smooth function of I and h, reduced by whole turns before it is rounded.
"""

import math
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.precision import Precision
from rigidpend.orbits.return_map.charts import Charts
from rigidpend.orbits.return_map.conjugacy import TorusForm
from rigidpend.orbits.return_map.expansions import chebyshev_analysis
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm
from rigidpend.orbits.return_map.tables import INVERSE_POWER, ChartTable, fitted

FUNCTIONS = 3
"""Number of functions of a chart that codes and times need: all but that of theta3."""
TABLE, RATES = 7, 3
"""Numbers of integers that describe a table, and the rates of a leg.

For a table: the number of its rows; the number of rows summed in the program's own numbers; the
number of its first triple; the place of that among the vectors of the coefficients at an energy;
the place of its list of harmonics; the largest number of harmonics of a row; and the largest number
of them in the program's own numbers. For the rates: the number of powers of I, the number of powers
summed in doubles, and the place of the first coefficients."""
LEG = 2 * TABLE + RATES
"""Number of integers that describe a leg: two tables and the rates."""
HEADROOM = 2.0**2
"""Factor by which terms in doubles may err more than by a rounding of each coefficient.

A harmonic of order some tens has as many roundings, most of which cancel."""
BASE = 4
"""Base of a sum in pairs, relative to all terms of the table: 3 suffices if these are exact."""
MOST_NODES = 20
"""Number of Chebyshev nodes in Qp from which on starts count as outside of the normal form."""
ROUNDINGS = 8
"""Roundings in a coefficient of the table of starts.

They are relative to 1, which is the order of the largest coefficient."""


class Entry(NamedTuple):
    """Table of starts at Qm = 0, which puts them into the normal form."""

    centre: Any
    half_width: Any
    """Half of the width of the interval of Qp; 0 if it is a single point."""
    table: ChartTable
    """v/Qp, u/Qp and tau (t') over (x, psi), with x = (Qp - centre)/half_width."""

    def place(self, Qp: Scalar) -> Any:
        """The coordinate x of starts, in doubles or pairs of doubles as Qp is."""
        if not self.half_width:
            return 0 * Qp
        centre, half_width = (z if isinstance(Qp, SumArray) else float(z) for z in self[:2])
        x = (Qp - centre) * (1 / half_width)
        # The ends of the interval may come out beyond 1 by a rounding, and would count as outside.
        return np.where(x > 1, 1.0, np.where(x < -1, -1.0, x))


def entry(nf: NormalForm, least: Scalar, most: Scalar, a: Precision) -> Entry:
    """The table of starts at Qp from `least` to `most`, which are numbers of the precision.

    Raises
    ------
    MapError
        The normal form does not reach as far as `most`.
    """
    centre, half_width = (least + most) / 2, (most - least) / 2

    def placed(x: Any, psi: Any, form: TorusForm) -> Any:
        Qp = centre + half_width * x
        at = form.inverted(psi, Qp, 0 * Qp)
        # Quotients that are smooth for Qp to 0, so that relative precision is kept down to there.
        return np.stack((at.v / Qp, at.u / Qp, at.tau))

    for n_x in range(6, MOST_NODES, 3) if half_width else (1,):
        table = fitted(placed, a.number(1), n_x, nf.n, nf, INVERSE_POWER, a)
        last = table.values.reshape(nf.energies.n, n_x, nf.n, -1)[:, -2:]
        if n_x == 1 or a.largest(last) <= ROUNDINGS * a.epsilon:
            return Entry(centre, half_width, table)
    raise MapError("the start lies outside of the range of the normal form")


class Program(NamedTuple):
    """A map's data for the kernel, for orbits with starts in a given interval.

    Its own numbers are doubles or pairs of doubles. Coefficients come in triples, one for each of
    the three functions of a table.
    """

    starts: Entry
    bits: int
    """53 in doubles, 106 in pairs of doubles."""
    energies: int
    """Number of Chebyshev polynomials of the energy."""
    vectors: int
    """Number of vectors that the coefficients of a group of orbits, at their energies, fill."""
    legs: Any
    """(3, LEG) int64: the legs from the start, from upward and from downward crossings."""
    harmonics: Any
    """(rows, 2) int64: for each row of each table the number of harmonics.

    The second number is that of harmonics summed in pairs, 0 in doubles."""
    lengths: Any
    """(triples, 3) int64: for each triple the number of polynomials of the energy.

    The second number is that of polynomials summed in pairs, 0 in doubles; the third is 1 if the
    kernel reads the sums in the program's own numbers, 0 if it reads them in doubles."""
    values: Any
    """(parts, terms, 3): factors of the polynomials of the energy, the highest polynomial first."""
    bases: Any
    """(triples, 3): bases of the sums in pairs of each triple and of its table."""
    limits: Any
    """(3, 3): for each leg the largest |W|, and its turns in radians as a sum of two doubles."""


class Leg(NamedTuple):
    """The way from one crossing to the next: into the normal form and out of it.

    Tables are coefficients (energies, n_x, n_phase, 3), 0 where a term is left out.
    """

    into: Any
    """W, the other one of U and V, and the time, over d (or x of a start) and a phase."""
    rising: bool
    """True if the orbit leaves the normal form as after an upward crossing: see `ways_out`."""
    rates: Any
    """(energies, K, 3): coefficients of powers of I in 1/Lambda, the rest of the depth, dt'/dpsi.

    The depth is ln|W|/Lambda less whole turns, and its rest all but ln|W/scale|/Lambda."""
    largest: float
    """Largest |W|, in units of its scale."""
    turns: float
    """Number of whole turns that are left out of depths."""


def program(
    nf: NormalForm, charts: Charts, starts: Entry, threshold: float, a: Precision, bits: int
) -> Program:
    """The program of a map, in doubles (53 bits) or pairs of doubles (106 bits).

    Terms that together come to less than `threshold`, relative to the largest term, are left out.
    """
    three, out = legs(nf, charts, starts, threshold, a), ways_out(charts, threshold)
    parts = KINDS[bits].parts
    # Terms up to this size, relative, may be rounded to doubles: their roundings of 2^-53 come to
    # `threshold`.
    writer = _Writer(parts, threshold * 2.0**53 / HEADROOM)
    ends = [writer.table(terms) for terms in out]
    rows = [[*writer.table(x.into), *ends[x.rising], *writer.rates(x.rates)] for x in three]
    limits = [[x.largest, *radians(x.turns)] for x in three]
    return Program(
        starts,
        bits,
        nf.energies.n,
        writer.vectors,
        np.array(rows, dtype=np.int64),
        np.array(writer.harmonics, dtype=np.int64),
        np.array(writer.lengths, dtype=np.int64),
        np.concatenate(writer.values, axis=1),
        np.array(writer.bases),
        np.array(limits, dtype=float),
    )


def legs(
    nf: NormalForm, charts: Charts, starts: Entry, threshold: float, a: Precision
) -> tuple[Leg, Leg, Leg]:
    """The legs from the starts, from upward and from downward crossings, in this order."""
    # All legs share it: 1/Lambda(I) at the nodes of the energy.
    reciprocal = reciprocal_of(nf.energies.basis(nf.energies.nodes(a), a) @ nf.exponent)

    # `time` is the sign of the function of time in the leg's first table.
    def leg(into: Any, rising: bool, time: int, size: float, largest: float) -> Leg:
        # The leg from a downward crossing is run backward and mirrored.
        reach, side = charts[not rising].inverse.width, 1 if rising else -1
        scale, turns, rates = _rates(nf, reciprocal, size, reach, threshold, a)
        into = into * np.stack((1 / scale, scale / reach, time))
        return Leg(into, rising, side * rates, largest / scale, side * turns)

    def passage(rising: bool) -> Leg:
        # W is U beside upward crossings, V beside downward ones.
        order = [*((0, 1) if rising else (1, 0)), 2]
        into = significant(charts[rising].forward, threshold)[..., order]
        size = float(np.abs(into[..., 0]).max())
        return leg(into, rising, 1 if rising else -1, size, math.inf)

    begin, size = significant(starts.table, threshold), float(starts.centre + starts.half_width)
    # A start is beside the lower orbit and, mirrored, beside the upper one. Its orbit leaves as one
    # from a downward crossing does. Tau of the starts is minus their constant of time.
    return leg(begin, False, 1, size, nf.radius), passage(True), passage(False)


def ways_out(charts: Charts, threshold: float) -> list[Any]:
    """Tables of legs that leave as after downward, and after upward crossings (`Leg.rising`).

    They give d, chi - s and the time over I and s: coefficients as those of a `Leg`.
    """
    down, up = charts
    return [
        # d in units of the width of the next leg's table, which is the chart of the same section.
        significant(there.inverse, threshold) * np.stack((1 / there.forward.width, 1, side))
        for there, side in ((up, -1), (down, 1))
    ]


def significant(table: ChartTable, threshold: float) -> Any:
    """The coefficients (energies, n_x, n_phase, 3) of a table, 0 for :func:`negligible` terms."""
    count = len(table.values)
    values = table.values.reshape(count, table.n_x, table.n_phase, -1)[..., :FUNCTIONS]
    sizes = np.abs(values.astype(float))
    return np.where(sizes > negligible(sizes, threshold), values, 0)


def negligible(sizes: Any, threshold: float) -> Any:
    """The sizes up to which all terms together come to less than `threshold`, for each function.

    Functions are along the last axis. Terms together come to the root of the sum of their squares,
    relative to the largest term: there are hundreds, with signs that vary from place to place.
    """
    ascending = np.sort(sizes.reshape(-1, sizes.shape[-1]), axis=0)
    small = np.sqrt(np.cumsum(ascending**2, axis=0)) <= threshold * ascending[-1]
    return np.max(np.where(small, ascending, 0), axis=0)


def _rates(
    nf: NormalForm, reciprocal: Any, size: float, reach: Any, threshold: float, a: Precision
) -> tuple[float, float, Any]:
    """The scale, turns and rates of a leg with |W| of the order of `size` and |I| <= reach.

    They are the number by which W is divided, the number of whole turns of the depth, and the
    coefficients (energies, K, 3) of powers of I/reach. `reciprocal` is 1/Lambda(I), (nodes, K).
    """
    # A power of two, by which W is divided without a rounding.
    scale = 2.0 ** round(math.log2(size))
    # The rest of the depth, ln(scale)/Lambda(I), tens of radians: whole turns are taken away from
    # its constant in the tables' precision, before it is rounded to the program's.
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
    # From powers of I to powers of I/reach.
    power = reach
    for k in range(1, most):
        joined[:, k] = joined[:, k] * power
        power = power * reach
    return scale, turns, joined


def radians(turns: float) -> tuple[float, float]:
    """Whole turns in radians, rounded to a sum of two doubles."""
    exactly = fraction(2 * context(160).pi * int(turns), 160)
    return float(exactly), float(exactly - Fraction(float(exactly)))


def shortened(coefficients: Any, reach: float, threshold: float) -> Any:
    """The coefficients of powers of x, |x| <= reach, 0 for the :func:`negligible` ones."""
    sizes = np.abs(coefficients.astype(float)) * reach ** np.arange(coefficients.shape[1])
    kept = sizes > negligible(sizes[..., None], threshold)
    return np.where(kept, coefficients, 0)[:, : 1 + np.flatnonzero(kept.any(axis=0)).max(initial=0)]


def reciprocal_of(series: Any) -> Any:
    """The coefficients of the reciprocal of power series with coefficients (nodes, K)."""
    found = np.zeros_like(series)
    found[:, 0] = 1 / series[:, 0]
    for k in range(1, series.shape[1]):
        known = sum(series[:, j] * found[:, k - j] for j in range(1, k + 1))
        found[:, k] = -known * found[:, 0]
    return found


class _Writer:
    """Writer of tables one behind the other.

    In each sum the terms that together come to less than `limit`, relative to the largest term of
    their function, come first: the kernel sums them in doubles. The other terms, called sharp, come
    behind them and are summed in the program's own numbers.
    """

    def __init__(self, parts: int, limit: float) -> None:
        self.parts, self.limit = parts, limit
        self.harmonics: list[tuple[int, int]] = []
        self.lengths: list[tuple[int, int, bool]] = []
        self.values, self.bases = list[Any](), list[Any]()
        self.vectors = 0

    def table(self, terms: Any) -> tuple[int, ...]:
        """Write a table, its rows from the second on, then the first; return what describes it."""
        triple, first, listed = len(self.lengths), self.vectors, len(self.harmonics)
        values, sharp = self._parted(terms)
        rows, counts = _extent(values[0] != 0)
        own, sharp_counts = _extent(sharp)
        sharp_counts += [0] * (rows - own)
        # The kernel reads coefficients one after the other, in the order in which it sums.
        self.harmonics += zip(counts, sharp_counts, strict=True)
        self._write(values, sharp, _places(counts, sharp_counts, own))
        return rows, own, triple, first, listed, max(counts), max(1, *sharp_counts)

    def rates(self, coefficients: Any) -> tuple[int, int, int]:
        """Write polynomials in I, the highest power first for Horner's rule; describe them."""
        first = self.vectors
        values, sharp = self._parted(coefficients)
        count = coefficients.shape[1]
        plain = max(1, count - 1 - int(_last(sharp.any(axis=(0, 2)))))
        # Horner's rule begins with the highest power in the program's own numbers.
        powers = range(count - 1, -1, -1)
        places = (((k,), k == count - 1 or k < count - plain) for k in powers)
        self._write(values, sharp, places)
        return count, plain, first

    def _parted(self, terms: Any) -> tuple[Any, Any]:
        """Coefficients as sums of doubles, (parts, energies, ..., 3), and a mask of sharp ones."""
        values = SumArray.of(terms).parts[: self.parts]
        sizes = np.abs(values[0])
        # In doubles nothing is to be divided.
        return values, (sizes > negligible(sizes, self.limit)) & (self.parts > 1)

    def _write(
        self, values: Any, sharp: Any, places: Iterable[tuple[tuple[int, ...], bool]]
    ) -> None:
        """Write three sums over polynomials of the energy for each of the places, in their order.

        `values` are (parts, energies, ..., 3), and `sharp` is a mask (energies, ..., 3). With each
        place it is told whether the sums are read in the program's own numbers.
        """
        # A sum goes up to the last polynomial that any of the three functions needs.
        counts, own = (1 + _last(x.any(axis=-1), -1) for x in (values[0] != 0, sharp))
        base = BASE * np.abs(values[0]).reshape(-1, FUNCTIONS).sum(axis=0)
        for at, whole in places:
            length = max(1, counts[at])
            self.lengths.append((length, own[at], whole))
            self.vectors += FUNCTIONS * (self.parts if whole else 1)
            self.values.append(values[:, length - 1 :: -1, *at])
            self.bases.append(base)


def _places(
    counts: list[int], sharp_counts: list[int], own: int
) -> Iterator[tuple[tuple[int, int], bool]]:
    """The places (row, phase term) of a table in the order of summation, the first row last.

    With each place it is told whether it is read in the program's own numbers, as the sharp
    harmonics and the constants of the first `own` rows are.
    """
    for i in (*range(1, len(counts)), 0):
        # Harmonics in doubles, then the sharp ones, and the constant, the largest term, last.
        later, last = 2 * sharp_counts[i] + 1, 2 * counts[i] + 1
        for k in (*range(later, last), *range(1, later), 0):
            yield (i, k), i < own and k < later


def _extent(used: Any) -> tuple[int, list[int]]:
    """The number of rows up to the last that is used, and the number of harmonics of each row."""
    terms = used.any(axis=(0, 3))
    rows = 1 + int(_last(terms.any(axis=1)))
    # Phase terms 2 m - 1 and 2 m are the cosine and the sine of harmonic m.
    return rows, ((1 + _last(terms.T)) // 2)[:rows].tolist()


def _last(mask: Any, none: int = 0) -> Any:
    """The index of the last True along the first axis, or `none` if there is no True."""
    found = len(mask) - 1 - np.argmax(mask[::-1], axis=0)
    return np.where(mask.any(axis=0), found, none)
