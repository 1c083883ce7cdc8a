"""States of orbits at given times, in any precision: exact numbers in, exact numbers out."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate import (
    DEFAULT_TOLERANCE,
    FINEST_TOLERANCE,
    default_engine,
    has_own_type,
)
from rigidpend.orbits.integrate.arcs import arcs, rational
from rigidpend.orbits.integrate.engines import PAIRS

SLOWER = 113
"""Bits that serve in the place of pairs where there is no kernel for them."""


def states_at(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    times: Sequence[Fraction],
    bits: int,
) -> list[list[Fraction]]:
    """The aligned components of an orbit at times t', ascending from 0, which is not among them.

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
    own = default_engine() == "taylor" and has_own_type("taylor", bits)
    if own and bits > PAIRS:
        from rigidpend.orbits.integrate.compiled import in_series

        return in_series(coefficients, state, times, bits, FINEST_TOLERANCE["taylor"])
    m = context(bits)

    def number(x: Fraction) -> Any:
        return m.mpf(x.numerator) / x.denominator

    found = arcs(
        AlignedCoefficients(*map(number, coefficients)),
        np.array([[number(x)] for x in state], dtype=object),
        np.array([number(x) for x in times], dtype=object),
        bits,
    )
    return [[rational(x) for x in row] for row in found[:, :, 0].T]


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
        Positive. They are met to the rounding of doubles, the orbits to that of 106 bits.
    jobs : int, optional
        Threads, or processes where Python itself computes.

    Returns
    -------
    list of 6 Fractions for each orbit
    """
    if not len(states):
        return []
    pairs = default_engine() == "taylor"
    parts = spread(np.arange(len(states)), jobs if pairs else len(states), 0)
    tasks = [([states[k] for k in part], [durations[k] for k in part]) for part in parts]
    found = side_by_side(_pairs_after if pairs else _after, (coefficients,), not pairs, tasks, jobs)
    return [state for part in found for state in part]


def _pairs_after(
    task: tuple[Sequence[Sequence[Fraction]], Sequence[float]], coefficients: AlignedCoefficients
) -> list[list[Fraction]]:
    from rigidpend.orbits.integrate.batch_samples import sample_aligned
    from rigidpend.orbits.integrate.kernel.parts import in_parts

    states, durations = task
    begin = in_parts(np.array(states, dtype=object).T, PAIRS)
    times = np.stack((np.zeros(len(states)), durations))
    tolerance = DEFAULT_TOLERANCE["taylor"] * 2.0 ** (53 - PAIRS)
    high, low = sample_aligned(coefficients, begin, times, PAIRS, tolerance)[:, :, -1]
    exact = np.vectorize(Fraction, otypes=[object])
    return [list(state) for state in (exact(high) + exact(low)).T]


def _after(
    task: tuple[Sequence[Sequence[Fraction]], Sequence[float]], coefficients: AlignedCoefficients
) -> list[list[Fraction]]:
    return [
        states_at(coefficients, state, [Fraction(float(time))], SLOWER)[0]
        for state, time in zip(*task, strict=True)
    ]
