"""Engine `taylor`, the states at a crossing of M3 = 0, by the kernel `notes`.

The kernel notes all six series of a step on which M3 may have been zero. On that of the crossing
asked for Newton's method finds the time, and the series the state, to the last digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate.batch import Batch
from rigidpend.orbits.integrate.bigint import fixed, value_at
from rigidpend.orbits.integrate.kernel.aligned_field import COMPONENTS
from rigidpend.orbits.integrate.passages import Steps
from rigidpend.orbits.integrate.records import Orbits

NEWTON = 4
"""Iterations from a crossing time in doubles; each doubles the digits."""
SPARE_BITS = 64
"""Bits below the precision in which series are looked at: a small Qm keeps its own digits."""

Array = NDArray[np.float64]


def first_in_doubles(
    coefficients: AlignedCoefficients, states: Array, limit: float, tolerance: float
) -> tuple[Array, Array]:
    """First crossings of orbits in doubles.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Floats.
    states : (6, n) array
    limit : float
        How long, in t', to wait for the crossing.
    tolerance : float

    Returns
    -------
    times : (n,) array
        NaN for an orbit that does not cross within the limit.
    states : (6, n) array
    """
    run = _ToCrossings(Orbits(coefficients, states, 1, limit), 53, tolerance)
    times, found = np.full(states.shape[1], np.nan), np.full(states.shape, np.nan)
    columns, steps, crossed = run.there()
    if columns.size:
        begin = steps.fields["time"]
        x, found[:, columns] = _at_zero(steps.series[..., 0], crossed - begin)
        times[columns] = begin + x
    return times, found


def first_in_parts(
    states: Sequence[Sequence[Fraction]],
    coefficients: AlignedCoefficients,
    limit: float,
    bits: int,
    tolerance: float,
) -> list[tuple[Fraction, tuple[Fraction, ...]] | None]:
    """First crossings of orbits in sums of doubles: time and state of each, or None.

    Parameters are those of :func:`first_in_doubles`, the numbers Fractions; `bits` are
    those of `engines.LADDER`.
    """
    run = _ToCrossings(Orbits(coefficients, list(states), 1, limit), bits, tolerance)
    found: list[tuple[Fraction, tuple[Fraction, ...]] | None] = [None] * len(states)
    columns, steps, crossed = run.there()
    for k, column in enumerate(columns):
        begin = steps.fields["time"][k]
        late, x = steps.fields["late"][k], crossed[k] - begin
        found[column] = _polished(steps.series[k], begin, late, x, bits + SPARE_BITS)
    return found


class _ToCrossings(Batch):
    """Orbits on their way to the last of so many crossings, with the steps that may have one."""

    def __init__(self, orbits: Orbits, bits: int, tolerance: float) -> None:
        finest = tolerance * 2.0 ** (53 - bits)
        super().__init__(orbits, bits, finest, noted=len(COMPONENTS))
        self.kept: list[tuple[NDArray[np.int64], Steps]] = []

    def there(self) -> tuple[NDArray[np.int64], Steps, Array]:
        """The orbits that come so far, the step of each on which they do, its time in doubles."""
        times = self.run().time[-1]
        of_orbit, steps = self._all_steps()
        at, begin = times[of_orbit], steps.fields["time"]
        # A crossing between two steps is on either, to rounding.
        inside = (at >= begin) & (at <= begin + steps.fields["length"])
        columns, where = np.unique(of_orbit[inside], return_index=True)
        chosen = steps.chosen(np.flatnonzero(inside)[where])
        return columns, chosen, times[columns]

    def _take(self, taken: Steps, number: int) -> None:
        self.kept.append((self.columns[taken.fields["lane"].astype(np.int64)], taken))
        super()._take(taken, number)

    def _all_steps(self) -> tuple[NDArray[np.int64], Steps]:
        columns, steps = zip(*self.kept, strict=True)
        return np.concatenate(columns), Steps.joined(list(steps))


def _at_zero(series: Any, x: Array) -> tuple[Any, Any]:
    """Time from the beginning of steps to the zero of M3 near x, and the states (6, m) there."""
    series = series.transpose(1, 2, 0)
    M3 = series[2]
    slopes = M3[1:] * np.arange(1.0, len(M3))[:, None]
    for _ in range(NEWTON):
        x = x - _value(M3, x) / _value(slopes, x)
    return x, np.stack([_value(one, x) for one in series])


def _value(series: Array, x: Array) -> Array:
    """Polynomials (order + 1, n) at a place each, by Horner's rule."""
    total = series[-1]
    for term in series[-2::-1]:
        total = total * x + term
    return total


def _whole(x: Array, P: int) -> Any:
    """Doubles as whole numbers in units of 2^-P, in nested lists."""
    return np.vectorize(int, otypes=[object])(np.ldexp(x, P)).tolist()


def _polished(
    series: Array, begin: float, late: float, x: float, P: int
) -> tuple[Fraction, tuple[Fraction, ...]]:
    """Time and state of the crossing near x, from series (6, order + 1, parts) of its step.

    They are computed in integers of P fractional bits.
    """
    whole = [list(map(sum, one)) for one in _whole(series, P)]
    at = fixed(Fraction(x), P)
    slopes = [k * term for k, term in enumerate(whole[2])][1:]
    for _ in range(NEWTON):
        at -= (value_at(whole[2], at, P) << P) // value_at(slopes, at, P)
    state = tuple(Fraction(value_at(one, at, P), 1 << P) for one in whole)
    return Fraction(begin) + Fraction(late) + Fraction(at, 1 << P), state
