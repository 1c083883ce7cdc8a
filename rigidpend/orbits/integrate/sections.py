"""First crossings of the Poincare section M3 = 0 (J1 = J2/2): states, in any precision.

`integrate.crossings` follows many orbits through many passages and keeps times only. Here each
orbit ends at its first crossing, and the state there is given to the last bit of the working
precision. On the step of the crossing Newton's method finds the time, and the series the state.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.arithmetic import PAIRS, in_kernel, kernel_bits
from rigidpend.orbits.integrate.batch import Batch
from rigidpend.orbits.integrate.kernel.tape import COMPONENTS
from rigidpend.orbits.integrate.passages import UNDECIDED, Steps, touch, value_at

NEWTON = 4
"""Iterations from a crossing time in doubles; each doubles the digits."""
SPARE_BITS = 64
"""Bits below the precision in which series are looked at: a small Qm keeps its own digits."""


class Crossing(NamedTuple):
    """A point of the section."""

    time: Fraction
    """t' since the start."""
    state: tuple[Fraction, ...]
    """The six aligned components."""


def first_crossings(
    coefficients: AlignedCoefficients,
    states: Sequence[Sequence[Fraction]],
    limit: float,
    *,
    engine: str,
    bits: int,
    tolerance: float,
    jobs: int,
) -> list[Crossing | None]:
    """Follow orbits to their first crossing of M3 = 0.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions, numbers of the working precision.
    states : n lists of 6 Fractions
        Aligned components at time 0.
    limit : float
        How long, in t', to wait for the crossing.
    engine : str
        One of `integrate.ENGINES`; integers serve where its numbers end.
    bits : int
        Working precision; the kernel takes pairs of doubles or longer numbers.
    tolerance : float
        Of a compiled Taylor series at 53 bits; every bit more halves it.
    jobs : int
        How many orbits at a time.

    Returns
    -------
    list of n Crossing or None
        None for an orbit that does not cross within the limit.
    """
    compiled = in_kernel(engine, bits)
    follow = _in_parts if compiled else _in_integers
    parts = [states[k::jobs] for k in range(min(jobs, len(states)))]
    done = side_by_side(follow, (coefficients, limit, bits, tolerance), not compiled, parts, jobs)
    found: list[Crossing | None] = [None] * len(states)
    for k, part in enumerate(done):
        found[k::jobs] = part
    return found


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
        begin = steps.field("time")
        x, found[:, columns] = _at_zero(steps.series[..., 0], crossed - begin)
        times[columns] = begin + x
    return times, found


def _in_parts(
    states: Sequence[Sequence[Fraction]],
    c: AlignedCoefficients,
    limit: float,
    bits: int,
    tolerance: float,
) -> list[Crossing | None]:
    """Find the crossings by the kernel, in sums of doubles."""
    kind = kernel_bits(max(bits, PAIRS))
    run = _ToCrossings(Orbits(c, states, 1, limit), kind, tolerance)
    found: list[Crossing | None] = [None] * len(states)
    columns, steps, crossed = run.there()
    begins, lates = steps.field("time"), steps.field("late")
    each = zip(columns, steps.series, begins, lates, crossed - begins, strict=True)
    for column, series, begin, late, x in each:
        found[column] = _polished(series, begin, late, x, kind + SPARE_BITS)
    return found


class _ToCrossings(Batch):
    """Orbits on their way to the last of so many crossings, with the steps that may have one."""

    def __init__(self, orbits: Orbits, bits: int, tolerance: float) -> None:
        finest = tolerance * 2.0 ** (53 - bits)
        super().__init__(orbits, bits, finest, noted=len(COMPONENTS))
        self.kept: list[tuple[NDArray[np.int64], Array]] = []

    def there(self) -> tuple[NDArray[np.int64], Steps, Array]:
        """The orbits that come so far, the step of each on which they do, its time in doubles."""
        times = self.run().time[-1]
        of_orbit, notes = map(np.concatenate, zip(*self.kept, strict=True))
        steps = Steps(notes, self.bits, self.noted)
        at, begin = times[of_orbit], steps.field("time")
        # A crossing between two steps is on either, to rounding.
        inside = (at >= begin) & (at <= begin + steps.field("length"))
        columns, where = np.unique(of_orbit[inside], return_index=True)
        chosen = steps.chosen(np.flatnonzero(inside)[where])
        return columns, chosen, times[columns]

    def _take(self, taken: Steps, number: int) -> None:
        self.kept.append((self.columns[taken.field("lane").astype(np.int64)], taken.notes.copy()))
        super()._take(taken, number)


def _at_zero(series: Any, x: Array) -> tuple[Any, Any]:
    """Time from the beginning of steps to the zero of M3 near x, and the states (6, m) there."""
    series = series.transpose(1, 2, 0)
    M3 = series[2]
    slopes = M3[1:] * np.arange(1.0, len(M3))[:, None]
    for _ in range(NEWTON):
        x = x - value_at(M3, x) / value_at(slopes, x)
    return x, np.stack([value_at(one, x) for one in series])


def _polished(series: Array, begin: float, late: float, x: float, P: int) -> Crossing:
    """The crossing near x, from series (6, order + 1, parts) of its step, in integers."""
    from rigidpend.orbits.integrate import bigint

    whole = np.vectorize(int, otypes=[object])(np.ldexp(series, P)).sum(axis=2).tolist()
    at = bigint.zero_near(whole[2], bigint.fixed(Fraction(x), P), P)
    state = tuple(Fraction(bigint.value_at(one, at, P), 1 << P) for one in whole)
    return Crossing(Fraction(begin) + Fraction(late) + Fraction(at, 1 << P), state)


def _in_integers(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, bits: int, _: float
) -> list[Crossing | None]:
    """Find the crossings by Taylor series in integers, of an error below their rounding."""
    return [_integer_crossing(c, state, limit, bits) for state in states]


def _integer_crossing(
    c: AlignedCoefficients, state: Sequence[Fraction], limit: float, bits: int
) -> Crossing | None:
    from rigidpend.orbits.integrate import bigint

    for step in bigint.steps(c, state, bits):
        if step.time(0) > limit:
            break
        for share, separatrix in step.crossings(step.length, touch(bits)):
            if separatrix == UNDECIDED:
                return None
            near = int(Fraction(share) * step.length)
            at = bigint.zero_near(step.series[2], near, step.P)
            return Crossing(step.time(at), step.at(at))
    return None
