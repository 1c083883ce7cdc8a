"""Certainty of symbols: independent computations agree, or the precision is raised.

A symbol changes when the error of the phase reaches about 1 radian. Two computations hide such
an error only if both err alike. An orbit has one deviation that grows; computations in units that
share no rounding err by different multiples of it, so that two with errors of a radian agree to
d radians with a chance of about d. This gives the limits, which `ladder` lists with what they are
for. That of unequal precisions is larger, because errors differ two thousandfold at least; where
these differ by less the limit is smaller in proportion. Among orbits that err by a radian at all,
the rules of equal precision are wrong about once in a million, the others once in 70,000 to two
million, as each limit tells. Of orbits of 15 symbols at J1_0 = 1e-8 one in 4,000 errs so in double
precision; of longer codes more.

Measured: on 250 orbits of 44 symbols in 64 bits, pairs of computations that agreed to 0.1, 0.01
and 0.001 radians erred by 4.6, 0.23 and 0.016 radians at most. Some roundings do not depend on the
units (1/3 in a Taylor series does not): over ten units the mean error is about half of the spread
in 53 bits, and up to three times the spread in 64, where a false agreement is therefore some ten
times likelier.

Computations of one precision share some inputs. Integrations share those that `start` rounds with
guard bits: an error of 2^-32 of the roundings that differ. Two maps in doubles share the rounded
alpha0 + beta0, sin(alpha0), beta0, J2_0 and J1_0 themselves. This was measured on five bodies, four
of them random, at 23,000 crossings where a map in doubles erred by 1e-10 to 0.3 radians against a
map in 64 bits. Its error was more than R times its difference from the other map in doubles in
0.57/R, 0.55/R, 0.53/R and 0.95/R of the crossings, for R of 3, 10, 100 and 1,000, and 3,400 times
at most. Independent errors behave in the same way.
"""

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.checked import GAP_BITS
from rigidpend.orbits import M_UNITS, joined, put
from rigidpend.orbits import columns as columns_of
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.routes.ladder import COARSE_BITS, Columns, Rung, Third
from rigidpend.routes.start import Scales

SCALES = FIRST_SCALES, SECOND_SCALES, THIRD_SCALES = tuple(
    Scales(unit, vertical) for unit, vertical in zip(M_UNITS, ("1", "0.73", "1.43"), strict=True)
)
"""The scales of the first, second and third computation in a precision."""

LIMIT_OF_TWO = 1e-6
"""Phase difference, in radians, up to which two computations of equal precision suffice."""
LIMIT_OF_THREE = 1e-3
"""Phase difference, in radians, up to which three computations of equal precision suffice."""
LIMIT_OF_UNEQUAL = 1e-2
"""Phase difference, in radians, up to which two computations suffice that are `GAP_BITS` apart.

For every bit less between them the limit is halved. Of 16,631 orbits of one body, followed by maps
of 64 and 72 bits, the second map erred by more than R times the difference of both in 39, 8 and 2
orbits, for R of 1, 3 and 10: a share of 0.0014/R, so that at 1e-2 about one in 70,000 would be
wrong by a radian; with 8 bits between them the limit is an eighth of this. Of 3,200 orbits of four
bodies, followed by maps of 82 and 90 bits, it did so in a share of 0.37, 0.09 and 0.0025 for R of
0.01, 0.1 and 1, which leaves less. Of 7,500 orbits of five bodies with narrower tables it was
0.0063/R, and 0.012/R with the worst of them, for R of 0.1 to 3: at an eighth of the limit one in
120,000 and in 65,000; the map of 82 bits never erred by 0.1 times its difference from doubles."""
LIMIT_OF_COARSE = 0.25
"""Phase difference, in radians, up to which a less sharp computation is a third one.

It serves beside two of equal precision that agree to `LIMIT_OF_THREE`, which is 250 times less. A
symbol is wrong if the error of a radian is R = 1,000 times the difference of these two, and R/250
times that from the third. Of 3,200 orbits of four bodies that maps of 82 and 90 bits left open, one
map in 90 bits erred by more than R times its difference from the other one in a share of 0.27/R
to 0.41/R, for R of 1 to 100; and by more than R/250 times that from the one of 82 bits as well in
0.15, 0.017 and 0.0013, for R of 1, 3 and 10, and in none for 30. As this falls faster than 1/R,
fewer than one in 100,000 of those that err by a radian would be wrong. None of the 2,319 that were
decided so was. Of 8,869 orbits of five bodies with narrower tables it was 0.17/R to 0.36/R; and
0.27, 0.026 and 0.0015, for R of 1, 3 and 10, and none for 30. Up to here errors grow in
proportion."""
LIMIT_OF_SHARPER = 0.02
"""Phase difference, in radians, up to which two maps confirm an integration in pairs of doubles.

They err 2^3 to 2^6 times as much as it does. Of 6,732 orbits of five bodies that maps of 82 and 90
bits left open, an integration that was handed over to one of the maps erred by more than R times
its difference from either map in 0.08/R and 0.13/R, and by more than R times both in 2 to 2.3 times
the product: 0.021, 0.003 and 0.0003, for R of 1, 3 and 10. So about one in 100,000 of those that
err by a radian would be wrong. Even of the 6,462 that agreed to 0.25 none was. Where 98 bits are
asked for and passages take 10 to 13 rotations, the integration is hardly sharper than the maps: of
900 orbits it erred by more than R times all three differences in 0.064 and 0.0022, for R of 1 and
3, and in none for 10, which leaves about as many."""


class Contradiction(Exception):
    """Error: two computations call different symbols certain, so that neither is to be believed.

    No computation may go on with either of them. So this class derives from no error that is
    caught on the way to the user.
    """


class Decided(NamedTuple):
    """Crossings of n orbits, with the symbols that are certain, and how each orbit was found."""

    crossings: Crossings
    certain: NDArray[np.bool_]
    """(n_symbols, n), True where the symbol is established."""
    bits: NDArray[np.uint16]
    """(n,), the precision of the crossings that are kept."""
    by_map: NDArray[np.bool_]
    """(n,), True where return maps alone followed the orbit, which `choice` tells: else False."""


Compute: TypeAlias = Callable[[int, Scales, Any], Crossings]
"""Computation of some columns in a precision (bits) and scales."""
Division: TypeAlias = Callable[[int, int], tuple[int, int]]
"""Columns in a piece, of so many in a precision (bits), and threads that share the pieces."""


def agreement(a: Crossings, b: Crossings, rate: float, limit: float) -> NDArray[np.bool_]:
    """Mask (n_crossings - 1, n) of the symbols that two computations establish.

    Symbol i is certain if, at every crossing up to i + 1, the one behind it, both computations find
    the same separatrix and times t' that differ by at most ``limit / rate``: the limit in radians,
    the rate in radians per unit of t'. An orbit that both find on an invariant plane is certain to
    have no further symbol.
    """
    # A missing crossing has the time NaN, and no comparison with NaN holds.
    with np.errstate(invalid="ignore"):
        close = rate * np.abs(a.time - b.time) <= limit
    same = close & (a.separatrix == b.separatrix)
    ended = np.flatnonzero((a.outcome == Outcome.ASYMPTOTIC) & (b.outcome == Outcome.ASYMPTOTIC))
    if ended.size:
        # On an invariant plane there are no further crossings: both computations agree on none.
        same[:, ended] |= (a.separatrix[:, ended] == 0) & (b.separatrix[:, ended] == 0)
    # A symbol is worth no more than those before it, and needs the crossing behind it. Most orbits
    # agree throughout; only the others need the running conjunction.
    broken = np.flatnonzero(~same.all(axis=0))
    same[:, broken] = np.logical_and.accumulate(same[:, broken], axis=0)
    return same[1:]


def undivided(n: int, _: int) -> tuple[int, int]:
    """All columns are one piece, for one thread."""
    return max(1, n), 1


def decide(
    compute: Compute, n: int, rate: float, ladder: Sequence[Rung], division: Division = undivided
) -> Decided:
    """Compute `n` columns, and those with an uncertain symbol again on higher rungs.

    Every column is computed twice on the lowest rung, and a third time where this may establish a
    further symbol. A single computation, where no more are allowed, leaves all columns uncertain.
    Columns that are still uncertain are computed once on the next rung and compared with the last
    result; where the two differ, up to two further computations follow. A symbol that is certain
    stays so unless one of these differs by more than `LIMIT_OF_COARSE` up to there. None follows
    where two computations agree that an orbit stays, without a further crossing: its missing
    symbols stay uncertain.

    Parameters
    ----------
    compute : callable
        ``compute(bits, scales, columns)`` gives the crossings of those columns in t'.
    n : int
        Number of columns.
    rate : float
        Radians per unit of t', for :func:`agreement`.
    ladder : sequence of Rung
        Ascending.
    division : callable, optional
        ``division(n, bits)`` is the number of columns, of n, that are decided together in that
        precision, and the number of threads that decide such pieces side by side. By default all
        columns are one piece.
    """
    least, most, *_ = ladder[0]

    def settle(columns: Columns) -> Decided:
        """Decide some columns on the lowest rung."""
        if most == 1:
            # It is compared with the next precision's in the first scales. The second ones are
            # those of another map, for errors of a map's tables are the same in every precision.
            only = compute(least, SECOND_SCALES, columns)
            certain = np.zeros((len(only.time) - 1, columns.size), dtype=bool)
            return _decided(only, certain, least)
        first, second = (compute(least, x, columns) for x in (FIRST_SCALES, SECOND_SCALES))
        certain = agreement(first, second, rate, LIMIT_OF_TWO)
        if most > 2:
            third = functools.partial(compute, least, THIRD_SCALES)
            limits = LIMIT_OF_THREE, LIMIT_OF_THREE
            _confirm(certain, first, second, rate, columns, third, limits)
        return _decided(_agreed(first, second, certain), certain, least)

    pieces = _in_pieces(settle, np.arange(n), division(n, least))
    # The pieces come back in the order of the columns, so that joining them is enough.
    found = joined([piece for _, piece in pieces])
    climb(compute, found, rate, ladder[1:], division)
    return found


def climb(
    compute: Compute,
    found: Decided,
    rate: float,
    ladder: Iterable[Rung],
    division: Division = undivided,
) -> None:
    """Decide the open columns on further rungs; `found` is changed in place.

    The arguments are those of :func:`decide`.
    """
    for rung in ladder:
        left = open_columns(found)
        if not left.size:
            break
        further = functools.partial(_further, compute, found, rate, rung)
        for columns, piece in _in_pieces(further, left, division(left.size, rung.bits)):
            put(found, columns, piece)


def _in_pieces(
    work: Callable[[Columns], Decided], columns: Columns, divided: tuple[int, int]
) -> list[tuple[Columns, Decided]]:
    """Let threads decide the columns in pieces, which keep the columns' order."""
    size, jobs = divided
    parts = [columns[k : k + size] for k in range(0, len(columns), size)] or [columns]
    return list(zip(parts, side_by_side(work, (), False, parts, jobs), strict=True))


def _further(
    compute: Compute, found: Decided, rate: float, rung: Rung, columns: Columns
) -> Decided:
    """Decide some columns on a rung, starting from what is known of them.

    The first computation is compared with the last one below it, and with one `beside` that. Where
    these differ, a second one is compared with the first and with the last one, and a third one
    with the first two, if the rung allows it.
    """
    bits, most, more, beside = rung
    # A copy: threads decide their own columns side by side, and `found` changes afterwards.
    known = columns_of(found, columns)
    for scales in SCALES[: min(2, most)]:
        open_ = open_columns(known)
        if not open_.size:
            break
        # `known` has been overwritten by the first computation when the second begins.
        before, sharper = columns_of(known.crossings, open_), compute(bits, scales, columns[open_])
        given = before, sharper, rate, columns[open_]
        # What was certain stays so unless this contradicts it: its own limits may be narrower.
        certain = known.certain[:, open_] & agreement(before, sharper, rate, LIMIT_OF_COARSE)
        if scales == FIRST_SCALES:
            if beside:
                _confirm(certain, *given, beside, (LIMIT_OF_SHARPER, LIMIT_OF_SHARPER))
            else:
                limit = LIMIT_OF_UNEQUAL * 2.0 ** min(0, more - GAP_BITS)
                certain |= agreement(before, sharper, rate, limit)
        else:
            certain |= agreement(before, sharper, rate, LIMIT_OF_TWO)
            if more >= COARSE_BITS:
                coarse = functools.partial(columns_of, found.crossings)
                _confirm(certain, *given, coarse, (LIMIT_OF_THREE, LIMIT_OF_COARSE))
            if most > 2:
                third = functools.partial(compute, bits, THIRD_SCALES)
                _confirm(certain, *given, third, (LIMIT_OF_THREE, LIMIT_OF_THREE))
        put(known, open_, _decided(_agreed(before, sharper, certain), certain, bits))
    return known


def open_columns(found: Decided) -> Columns:
    """The columns with an uncertain symbol, but for those of which more bits decide none."""
    ended = np.isin(found.crossings.outcome, (Outcome.STAYS, Outcome.TOO_LONG))
    return np.flatnonzero(~(found.certain.all(axis=0) | ended))


def _agreed(a: Crossings, b: Crossings, certain: NDArray[np.bool_]) -> Crossings:
    """The second of two computations; its outcome is STAYS where the first has no crossing either.

    All symbols before must be certain. Of each of five bodies at mu = 0.2 or 0.4 h0 256 orbits were
    all computed in more bits, which wait as long: no code and no certain symbol was another one.
    That took 1.8 to 8.6 times as long in 64 or in 106 bits, and some 30 times, with two of the
    bodies, in 106 and 160.
    """
    silent = (a.outcome == Outcome.NO_CROSSING) & (b.outcome == Outcome.NO_CROSSING)
    crossings = [np.count_nonzero(x.separatrix, axis=0) for x in (a, b)]
    alike = (crossings[0] == crossings[1]) & (certain.sum(axis=0) >= crossings[1] - 1)
    return b._replace(outcome=np.where(silent & alike, Outcome.STAYS, b.outcome))


def _decided(found: Crossings, certain: NDArray[np.bool_], bits: int) -> Decided:
    """Crossings of one precision, with the symbols that it establishes."""
    n = certain.shape[1]
    return Decided(found, certain, np.full(n, bits, dtype=np.uint16), np.zeros(n, dtype=bool))


def _confirm(
    certain: NDArray[np.bool_],
    a: Crossings,
    b: Crossings,
    rate: float,
    columns: Columns,
    third: Third,
    limits: tuple[float, float],
) -> None:
    """Add to the `certain` symbols, in place, those that two computations and a third establish.

    `limits` are that of the two, and that of the third with each of them. It is made only for
    columns in which it can establish a further symbol.
    """
    # The last symbol is certain only if all are.
    left = np.flatnonzero(~certain[-1])
    near = agreement(columns_of(a, left), columns_of(b, left), rate, limits[0])
    some = (near & ~certain[:, left]).any(axis=0)
    doubtful, near = left[some], near[:, some]
    if doubtful.size:
        c = third(columns[doubtful])
        for each in (a, b):
            near &= agreement(columns_of(each, doubtful), c, rate, limits[1])
        certain[:, doubtful] |= near
