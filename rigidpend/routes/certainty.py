"""Codes that can be trusted: two independent computations, then higher precision."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.integrate.records import Crossings, Outcome
from rigidpend.routes.start import Scales

FIRST, SECOND = Scales(), Scales(momentum="1.37", vertical="0.73")
"""The scales of the two computations in the first precision."""

AGREEMENT = 2e-4
"""Largest phase difference, in radians, of two computations in double precision."""
LINEAR = 0.1
"""Largest phase difference of any two: below it an error still grows in proportion."""


class Decided(NamedTuple):
    """Crossings with what is known of them."""

    crossings: Crossings
    certain: NDArray[np.bool_]
    """(n_symbols, n)."""
    bits: NDArray[np.uint16]
    """(n,), the precision that decided."""


def threshold(bits: int) -> float:
    """The phase difference, in radians, up to which two computations agree.

    Parameters
    ----------
    bits : int
        The precision of the more precise of the two, whose result is kept.

    Notes
    -----
    A symbol turns over when the error of the phase reaches about 1 radian. Two computations
    hide such an error only if they err alike. In double precision, on 2,000 random phases
    each at J1_0 = 1e-6 and 1e-10 (body of Fig. 4, 113 bits as the truth), pairs that agreed
    to 2e-4 radian erred by 2e-3 at most: the difference understates the error by a factor of
    ten in the worst of 4,000 cases, while a wrong symbol needs 5,000. Every bit more halves
    the share of orbits with an error of a radian, so the threshold may double with it, up to
    where errors cease to grow in proportion.
    """
    return min(LINEAR, AGREEMENT * 2.0 ** min(bits - 53, 60))


def agreement(a: Crossings, b: Crossings, rate: float, limit: float) -> NDArray[np.bool_]:
    """Which symbols two computations establish.

    Symbol i is certain where at every crossing up to i + 1, the one behind it, both find the
    same separatrix and times that differ by less than ``limit / rate``. An orbit that both
    find on an invariant plane is certain to have no further symbol.

    Parameters
    ----------
    a, b : Crossings
        In t'.
    rate : float
        Radians per unit of t'.
    limit : float
        As from :func:`threshold`.

    Returns
    -------
    (n_crossings - 1, n) array of bool
    """
    with np.errstate(invalid="ignore"):
        close = rate * np.abs(a.time - b.time) <= limit
    ended = (a.outcome == Outcome.ASYMPTOTIC) & (b.outcome == Outcome.ASYMPTOTIC)
    absent = (a.separatrix == 0) & (b.separatrix == 0) & ended
    same = (close & (a.separatrix == b.separatrix)) | absent
    return np.logical_and.accumulate(same, axis=0)[1:]


def decide(
    compute: Callable[[int, Scales, Any], Crossings],
    n: int,
    rate: float,
    precisions: tuple[int, ...],
) -> Decided:
    """Compute `n` columns, and those with an uncertain symbol again in higher precision.

    Every column is computed in the first precision in both scales. What is uncertain then
    climbs: one computation in the next precision, compared with the last one before, and
    where these differ a second one in the other scales.

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
    """
    best = compute(precisions[0], FIRST, np.arange(n))
    certain = np.zeros((len(best.time) - 1, n), dtype=bool)
    bits = np.full(n, precisions[0], dtype=np.uint16)
    climb = [(precision, scales) for precision in precisions for scales in (FIRST, SECOND)]
    for precision, scales in climb[1:]:
        columns = np.flatnonzero(~certain.all(axis=0))
        if not columns.size:
            break
        sharper = compute(precision, scales, columns)
        limit = threshold(precision)
        certain[:, columns] = agreement(_columns(best, columns), sharper, rate, limit)
        _put(best, columns, sharper)
        bits[columns] = precision
    return Decided(best, certain, bits)


def _columns(crossings: Crossings, columns: Any) -> Crossings:
    time, separatrix, outcome = crossings
    return Crossings(time[:, columns], separatrix[:, columns], outcome[columns])


def _put(target: Crossings, columns: Any, source: Crossings) -> None:
    target.time[:, columns] = source.time
    target.separatrix[:, columns] = source.separatrix
    target.outcome[columns] = source.outcome
