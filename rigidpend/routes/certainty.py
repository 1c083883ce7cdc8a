"""Codes that can be trusted: independent computations that agree, or higher precision.

A symbol turns over when the error of the phase reaches about 1 radian. Computations hide such
an error only if they err alike. In units that share no rounding they err by different multiples
of the one deviation that grows, so two with errors of a radian agree to d radians with a chance
of about d. Hence the limits below: two computations of equal precision that agree to `CLOSE`,
three that agree to `AGREEMENT`, and two of different precision that agree to `LINEAR`, as their
errors differ two thousandfold at least, or to less in proportion, are each wrong about once in a
million orbits among those that err by a radian at all. Of orbits of 15 symbols at J1_0 = 1e-8 one
in 4,000 does so in double precision; the longer the codes the more do.

Measured: on 250 orbits of 44 symbols in 64 bits, pairs that agreed to 0.1, 0.01 and 0.001
radians erred by 4.6, 0.23 and 0.016 at most. Not all roundings depend on the units (1/3 in a
Taylor series does not): over ten units the mean error is about half of the spread in 53 bits,
and up to three times the spread in 64, where the chances are some ten times larger therefore.

Computations of one precision share some inputs. By integration these are rounded in `start` with
guard bits, 2^-32 of the roundings that differ. Two maps in doubles share alpha0 + beta0, beta0,
J2_0 and J1_0 themselves. Measured on five bodies, four of them random, at 23,000 crossings where a
map in doubles erred by 1e-10 to 0.3 radians of the truth, a map in 64 bits: it erred by more than R
times its difference from the other one in 0.57/R, 0.55/R, 0.53/R and 0.95/R of them, for R of 3,
10, 100 and 1,000, and by 3,400 times at most. So it is for errors that are independent.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.checked import GAP
from rigidpend.orbits import UNITS
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.records import columns as columns_of
from rigidpend.orbits.records import joined, put
from rigidpend.routes.start import Scales

FIRST, SECOND, THIRD = (
    Scales(unit, vertical) for unit, vertical in zip(UNITS, ("1", "0.73", "1.43"), strict=True)
)
"""The scales of the computations in a precision."""

CLOSE = 1e-6
"""Phase difference, in radians, up to which two computations of equal precision suffice."""
AGREEMENT = 1e-3
"""Phase difference up to which three do."""
LINEAR = 1e-2
"""Phase difference up to which two of different precision do, by `GAP` bits or more.

For every bit less it is half of that. Of 16,631 orbits of one body, followed by maps of 64 and 72
bits, the second erred by more than R times the difference of both in 39, 8 and 2, for R of 1, 3 and
10: in 0.0014/R, so that about one in 70,000 would be wrong by a radian at 1e-2. Of 348 orbits of
four bodies, followed by maps of 82 and 90 bits, it did so in 43 and 1, for R of 0.01 and 0.1, and
erred by half of the difference at most."""


class Contradiction(Exception):
    """Error: two computations call different symbols certain, so that neither is to be believed.

    It is no reason to go on with one of the two, and so derives from no error that is caught on
    the way to the user.
    """


class Decided(NamedTuple):
    """Crossings with what is known of them."""

    crossings: Crossings
    certain: NDArray[np.bool_]
    """(n_symbols, n)."""
    bits: NDArray[np.uint16]
    """(n,), the precision that decided."""


Columns: TypeAlias = NDArray[np.intp]
Compute: TypeAlias = Callable[[int, Scales, Any], Crossings]
Third: TypeAlias = Callable[[Columns], Crossings]
Most: TypeAlias = Callable[[int], int]
Work: TypeAlias = Callable[[Columns], Decided]
Share: TypeAlias = Callable[[Work, Columns, int], list[tuple[Columns, Decided]]]


def agreement(a: Crossings, b: Crossings, rate: float, limit: Any) -> NDArray[np.bool_]:
    """Mask (n_crossings - 1, n) of the symbols that two computations establish.

    Symbol i is certain where at every crossing up to i + 1, the one behind it, both find the
    same separatrix and times, t', that differ by less than ``limit / rate``, radians over radians
    per unit of t', where the limit is that of all orbits or of each, (n,). An orbit that both find
    on an invariant plane is certain to have no further symbol.
    """
    with np.errstate(invalid="ignore"):
        close = rate * np.abs(a.time - b.time) <= limit
    same = close & (a.separatrix == b.separatrix)
    ended = np.flatnonzero((a.outcome == Outcome.ASYMPTOTIC) & (b.outcome == Outcome.ASYMPTOTIC))
    if ended.size:
        same[:, ended] |= (a.separatrix[:, ended] == 0) & (b.separatrix[:, ended] == 0)
    # A symbol is worth no more than those before it, and needs the crossing behind it.
    broken = np.flatnonzero(~same.all(axis=0))
    same[:, broken] = np.logical_and.accumulate(same[:, broken], axis=0)
    return same[1:]


def undivided(work: Work, columns: Columns, _: int) -> list[tuple[Columns, Decided]]:
    """All columns decided at once: what `share` is where nothing is shared."""
    return [(columns, work(columns))]


def decide(
    compute: Compute,
    n: int,
    rate: float,
    precisions: tuple[int, ...],
    share: Share = undivided,
    most: Most = lambda _: 3,
) -> Decided:
    """Compute `n` columns, and those with an uncertain symbol again in higher precision.

    Every column is computed twice in the first precision, and a third time where the two
    differ by more than `CLOSE`. What is uncertain then climbs: one computation in the next
    precision, compared with the last one before, and where these differ further ones.

    Parameters
    ----------
    compute : callable
        ``compute(bits, scales, columns)`` gives the crossings of those columns in t'.
    n : int
        Number of columns.
    rate : float
        Radians per unit of t', for :func:`agreement`.
    precisions : tuple of int
        Bits, ascending.
    share : callable, optional
        ``share(work, columns, bits)`` lets `work` decide the columns in a precision, some at a
        time: a list of the columns of each piece with what was decided. By default all at once.
    most : callable, optional
        ``most(bits)`` is how many computations of a precision there are at most, from 1 to 3; of
        the first precision at least 2.
    """
    least = precisions[0]

    def settle(columns: Columns) -> Decided:
        first, second = (compute(least, scales, columns) for scales in (FIRST, SECOND))
        third = functools.partial(compute, least, THIRD) if most(least) > 2 else None
        certain = _established(first, second, rate, third, columns)
        return Decided(second, certain, np.full(columns.size, least, dtype=np.uint16))

    pieces = share(settle, np.arange(n), least)
    found = joined([piece for _, piece in pieces])
    climb(compute, found, rate, precisions[1:], most, share)
    return found


def climb(
    compute: Compute,
    found: Decided,
    rate: float,
    precisions: tuple[int, ...],
    most: Most = lambda _: 3,
    share: Share = undivided,
) -> None:
    """Decide what is open further in higher precisions, from what is found on: in its place."""
    for bits in precisions:
        left = np.flatnonzero(~found.certain.all(axis=0))
        if not left.size:
            break
        further = functools.partial(_further, compute, found, rate, bits, most(bits))
        for columns, piece in share(further, left, bits):
            put(found, columns, piece)


def _further(
    compute: Compute, found: Decided, rate: float, bits: int, most: int, columns: Columns
) -> Decided:
    """Decide some columns in a precision, from what is found of them on.

    One computation is held against the last one of a lower precision; where these differ a second
    one is held against the first, and a third one against both, if there are so many.
    """
    known = columns_of(found, columns)
    for scales in (FIRST, SECOND)[:most]:
        open_ = np.flatnonzero(~known.certain.all(axis=0))
        if not open_.size:
            break
        before, sharper = columns_of(known.crossings, open_), compute(bits, scales, columns[open_])
        if scales == FIRST:
            more = bits - known.bits[open_].astype(int)
            limits = LINEAR * np.exp2(np.minimum(0, more - GAP))
            certain = agreement(before, sharper, rate, limits)
        else:
            third = functools.partial(compute, bits, THIRD) if most > 2 else None
            certain = _established(before, sharper, rate, third, columns[open_])
        decided = np.full(open_.size, bits, dtype=np.uint16)
        put(known, open_, Decided(sharper, certain, decided))
    return known


def _established(
    a: Crossings, b: Crossings, rate: float, third: Third | None, columns: Any
) -> NDArray[np.bool_]:
    """Mask of the symbols that computations of equal precision establish: two, or a third."""
    found = agreement(a, b, rate, CLOSE)
    if third is None:
        return found
    left = np.flatnonzero(~found[-1])
    near = agreement(columns_of(a, left), columns_of(b, left), rate, AGREEMENT)
    some = (near & ~found[:, left]).any(axis=0)
    doubtful, near = left[some], near[:, some]
    if doubtful.size:
        c = third(columns[doubtful])
        for each in (a, b):
            # The third must agree with both.
            near &= agreement(columns_of(each, doubtful), c, rate, AGREEMENT)
        found[:, doubtful] |= near
    return found
