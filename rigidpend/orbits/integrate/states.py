"""States of orbits at given times, in any precision: exact numbers in, exact numbers out."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Numbers, Scalar
from rigidpend.orbits.integrate import DEFAULT_TOLERANCE, FINEST_TOLERANCE, bigint
from rigidpend.orbits.integrate.batch_samples import sample_aligned
from rigidpend.orbits.integrate.engines import LADDER, PAIRS, kernel_bits
from rigidpend.orbits.integrate.kernel.parts import exactly, in_parts

SPARE_BITS = 8
"""Bits below the precision to which series are cut off, where the numbers have them."""

Array = NDArray[np.float64]


def states_at(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    times: Sequence[Fraction],
    bits: int,
) -> list[list[Fraction]]:
    """The aligned components of an orbit at times t' of either sign, away from 0.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions.
    state : 6 Fractions
        At time 0.
    times : sequence of Fraction
    bits : int
        Working precision, more than 53.

    Returns
    -------
    list of 6 Fractions for each of the times

    Raises
    ------
    ArithmeticError
        The orbit did not reach the last of the times.
    """
    begin = np.array(state, dtype=object)[:, None]
    found = carried(coefficients, begin, np.array(times, dtype=object), bits)
    return [list(row) for row in found[..., 0].T]


def carried(coefficients: AlignedCoefficients, states: Any, times: Any, bits: int) -> Any:
    """Orbits at the same times: (6, k, n) Fractions from states (6, n) and times (k,)."""
    if bits <= LADDER[-1]:
        kind = kernel_bits(bits)
        begin, grid = in_parts(states, kind), in_parts(times, kind)
        return exactly(in_kernel_s_numbers(coefficients, begin, grid, bits))
    columns = [_in_integers(coefficients, state, times, bits) for state in states.T]
    return np.array(columns, dtype=object).transpose(2, 1, 0)


def in_kernel_s_numbers(c: AlignedCoefficients, states: Array, times: Array, bits: int) -> Array:
    """The same in parts: (parts, 6, k, n) from states (parts, 6, n) and times (parts, k)."""
    kind = kernel_bits(bits)
    tolerance = FINEST_TOLERANCE["taylor"] * 2.0 ** (53 - min(kind, bits + SPARE_BITS))
    grid = np.concatenate((np.zeros((len(times), 1)), times), axis=1)[..., None]
    return sample_aligned(c, states, grid, kind, tolerance)[:, :, 1:]


def _in_integers(
    c: AlignedCoefficients, state: Sequence[Fraction], times: Sequence[Fraction], bits: int
) -> list[list[Fraction]]:
    """6 Fractions for each of the times, by Taylor series of an error below their rounding."""
    unit = bigint.unit_of(state)
    scaled, here = bigint.in_units(c, state, unit)
    P = bigint.fractional_bits((*here, *scaled), bits)
    backward = times[0] < 0
    if backward:
        # With t and M3 reversed, and gamma3 with them, the field is the same.
        here = _reversed(here)
    flow = bigint.Flow([bigint.fixed(x, P) for x in scaled], P)
    fixed, time = [bigint.fixed(x, P) for x in here], 0
    found: list[list[Fraction]] = []
    goals = [bigint.fixed(abs(t) * unit, P) for t in times]
    while len(found) < len(goals):
        series, step = flow.expand(fixed)
        while len(found) < len(goals) and goals[len(found)] <= time + step:
            at = goals[len(found)] - time
            there = [Fraction(bigint.value_at(s, at, P), 1 << P) for s in series]
            there = [*(x * unit for x in there[:3]), *there[3:]]
            found.append(_reversed(there) if backward else there)
        fixed = [bigint.value_at(s, step, P) for s in series]
        time += step
    return found


def _reversed(state: Numbers) -> list[Any]:
    Qp, Qm, M3, gamma1, gamma2, gamma3 = state
    return [Qp, Qm, -M3, gamma1, gamma2, -gamma3]


def states_after(
    coefficients: AlignedCoefficients,
    states: Sequence[Sequence[Fraction]],
    durations: Sequence[float],
    jobs: int = 1,
) -> list[list[Fraction]]:
    """The aligned components of many orbits, each carried on for a time t' of its own, in 106 bits.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions.
    states : sequence of 6 Fractions each
        At time 0.
    durations : sequence of float
        Positive.
    jobs : int, optional
        Threads.

    Returns
    -------
    list of 6 Fractions for each orbit
    """
    if not len(states):
        return []
    parts = spread(np.arange(len(states)), jobs, 0)
    tasks = [([states[k] for k in part], [durations[k] for k in part]) for part in parts]
    found = side_by_side(_pairs_after, (coefficients,), False, tasks, jobs)
    return [state for part in found for state in part]


def _pairs_after(
    task: tuple[Sequence[Sequence[Fraction]], Sequence[float]], coefficients: AlignedCoefficients
) -> list[list[Fraction]]:
    states, durations = task
    begin = in_parts(np.array(states, dtype=object).T, PAIRS)
    times = np.zeros((2, 2, len(states)))
    times[0, 1] = durations
    tolerance = DEFAULT_TOLERANCE["taylor"] * 2.0 ** (53 - PAIRS)
    found = sample_aligned(coefficients, begin, times, PAIRS, tolerance)[:, :, -1]
    return [list(state) for state in exactly(found).T]


def rational(x: Scalar) -> Fraction:
    """The value of an mpmath number."""
    from mpmath.libmp import to_rational

    return Fraction(*map(int, to_rational(x._mpf_)))
