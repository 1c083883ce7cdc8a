"""First crossings of the Poincare section M3 = 0 (J1 = J2/2): states, in any precision.

`integrate.crossings` follows many orbits through many passages and keeps times only. Here each
orbit ends at its first crossing, and the state there is given to the last bit of the working
precision.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate import bigint
from rigidpend.orbits.integrate.batch_sections import first_in_doubles, first_in_parts
from rigidpend.orbits.integrate.engines import in_kernel, kernel_bits
from rigidpend.orbits.integrate.kernel.aligned_field import COMPONENTS
from rigidpend.orbits.integrate.roots import UndecidedTouch


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
        Working precision, 53 or more.
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
    by_kernel: Any = _in_doubles if bits == 53 else _in_parts
    follow = by_kernel if compiled else _in_integers
    parts = [states[k::jobs] for k in range(min(jobs, len(states)))]
    done = side_by_side(follow, (coefficients, limit, bits, tolerance), not compiled, parts, jobs)
    found: list[Crossing | None] = [None] * len(states)
    for k, part in enumerate(done):
        found[k::jobs] = part
    return found


def _in_doubles(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, _: int, tolerance: float
) -> list[Crossing | None]:
    """Find the crossings by the kernel, in doubles."""
    begin = np.array(states, dtype=float).reshape(-1, len(COMPONENTS)).T
    floats = AlignedCoefficients(*map(float, c))
    times, found = first_in_doubles(floats, begin, limit, tolerance)
    return [
        None if math.isnan(time) else Crossing(Fraction(time), tuple(map(Fraction, state)))
        for time, state in zip(times.tolist(), found.T.tolist(), strict=True)
    ]


def _in_parts(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, bits: int, tolerance: float
) -> list[Crossing | None]:
    """Find the crossings by the kernel, in sums of doubles."""
    found = first_in_parts(states, c, limit, kernel_bits(bits), tolerance)
    return [None if one is None else Crossing(*one) for one in found]


def _in_integers(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, bits: int, _: float
) -> list[Crossing | None]:
    """Find the crossings by Taylor series in integers, of an error below their rounding."""
    found: list[Crossing | None] = []
    for state in states:
        try:
            found.append(_integer_crossing(c, state, limit, bits))
        except UndecidedTouch:
            found.append(None)
    return found


def _integer_crossing(
    c: AlignedCoefficients, state: Sequence[Fraction], limit: float, bits: int
) -> Crossing | None:
    unit = bigint.unit_of(state)
    c, state = bigint.in_units(c, state, unit)
    P = bigint.fractional_bits((*state, *c), bits)
    flow = bigint.Flow([bigint.fixed(x, P) for x in c], P)
    here, time = [bigint.fixed(x, P) for x in state], 0
    depth = bigint.depth_of_touch(state, bits, P)
    while time < bigint.fixed(Fraction(limit) * unit, P):
        series, step = flow.expand(here)
        for at in bigint.crossings_within(series[2], step, P, depth):
            there = [Fraction(bigint.value_at(s, at, P), 1 << P) for s in series]
            momenta = (x * unit for x in there[:3])
            return Crossing(Fraction(time + at, 1 << P) / unit, (*momenta, *there[3:]))
        here = [bigint.value_at(s, step, P) for s in series]
        time += step
    return None
