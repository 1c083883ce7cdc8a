"""Orbits of the aligned field at given times, in the numbers of any precision.

`integrate.sample_orbits` is the same in doubles.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import fraction
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits.integrate import FINEST_TOLERANCE, sample_orbits
from rigidpend.orbits.integrate.batch_samples import sample_aligned
from rigidpend.orbits.integrate.engines import LADDER, kernel_bits
from rigidpend.orbits.integrate.kernel.parts import exactly, in_parts
from rigidpend.orbits.integrate.pair_arrays import PairArray

SPARE_BITS = 8
"""Bits below the precision to which series are cut off, where the numbers have them."""


def states_at(
    coefficients: AlignedCoefficients, states: Numbers, times: Numbers, bits: int, jobs: int = 1
) -> Any:
    """The aligned components of orbits at times t' of either sign, away from 0.

    Parameters
    ----------
    coefficients : AlignedCoefficients
    states : (6, n) array
        At time 0, in numbers of the precision, as all others: doubles, pairs of them, Fractions
        or mpmath's.
    times : (k,) or (k, n) array
        For all orbits or for each its own: ascending from 0, or descending from 0.
    bits : int
        Working precision.
    jobs : int, optional
        Threads that share the orbits, or processes where integers serve.

    Returns
    -------
    (6, k, n) array of such numbers

    Raises
    ------
    ArithmeticError
        An orbit did not reach the last of the times.
    """
    if bits == 53:
        return sample_orbits(coefficients, states, np.concatenate(([0.0], times)))[:, 1:]
    if isinstance(states, PairArray):
        exact = AlignedCoefficients(*(x.exactly() for x in coefficients))
        return PairArray(_in_parts(exact, states.parts, times.parts, bits))
    states, times = (np.asarray(x, dtype=object) for x in (states, times))
    if isinstance(states.flat[0], Fraction):
        own = times.ndim > 1
        parts = spread(np.arange(states.shape[1]), jobs, 0)
        tasks = [(states[:, part], times[:, part] if own else times) for part in parts]
        found = side_by_side(_exact, (coefficients, bits), bits > LADDER[-1], tasks, jobs)
        return np.concatenate(found, axis=2)
    exactly_, number = np.frompyfunc(fraction, 1, 1), type(states.flat[0]).context.mpf
    given = AlignedCoefficients(*map(fraction, coefficients)), exactly_(states), exactly_(times)
    back = np.frompyfunc(lambda x: number(x.numerator) / x.denominator, 1, 1)
    return back(states_at(*given, bits, jobs))


def _exact(task: tuple[Any, Any], coefficients: AlignedCoefficients, bits: int) -> Any:
    """The same of Fractions, by the kernel or in integers."""
    states, times = task
    if bits <= LADDER[-1]:
        kind = kernel_bits(bits)
        return exactly(_in_parts(coefficients, in_parts(states, kind), in_parts(times, kind), bits))
    each = np.broadcast_to(times.reshape(len(times), -1), (len(times), states.shape[1]))
    columns = [_in_integers(coefficients, *one, bits) for one in zip(states.T, each.T, strict=True)]
    return np.array(columns, dtype=object).transpose(2, 1, 0)


def _in_parts(c: AlignedCoefficients, states: Any, times: Any, bits: int) -> Any:
    """The same in the kernel's parts, which come first."""
    kind = kernel_bits(bits)
    tolerance = FINEST_TOLERANCE["taylor"] * 2.0 ** (53 - min(kind, bits + SPARE_BITS))
    times = times.reshape(*times.shape[:2], -1)
    grid = np.concatenate((0 * times[:, :1], times), axis=1)
    return sample_aligned(c, states, grid, kind, tolerance)[:, :, 1:]


def _in_integers(
    c: AlignedCoefficients, state: Sequence[Fraction], times: Sequence[Fraction], bits: int
) -> list[Any]:
    """6 Fractions for each of the times, by Taylor series of an error below their rounding."""
    from rigidpend.orbits.integrate import bigint

    # With t and M3 reversed, and gamma3 with them, the field is the same.
    sense = np.array([1, 1, -1, 1, 1, -1]) if times[0] < 0 else np.ones(6, dtype=int)
    found: list[Any] = []
    for step in bigint.steps(c, state * sense, bits):
        while (at := step.since_begin(abs(times[len(found)]))) <= step.length:
            found.append(np.array(step.at(at)) * sense)
            if len(found) == len(times):
                return found
    raise AssertionError
