"""First crossings of the Poincare section M3 = 0 (J1 = J2/2): states, in any precision.

`integrate.crossings` follows many orbits through many passages and keeps times only, as doubles.
Here each orbit is carried to its first one, and on by Newton's method, step by step, until M3
vanishes in the working precision.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.orbits.integrate import Orbits, Outcome, crossings
from rigidpend.orbits.integrate.arithmetic import (
    FINEST_TOLERANCE,
    PAIRS,
    default_engine,
    in_kernel,
    kernel_bits,
)
from rigidpend.orbits.integrate.states import states_at

FIRST = default_engine()
"""Engine that tells in doubles which crossing it is, for no touch escapes it."""
GAINED = 40
"""Bits of the time that an iteration gains at least: steps of Newton's are told in doubles."""


def first_crossings(
    coefficients: AlignedCoefficients,
    states: Any,
    limit: float,
    *,
    engine: str,
    bits: int,
    tolerance: float,
    jobs: int,
) -> tuple[Any, Any] | None:
    """Follow orbits to their first crossing of M3 = 0.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Doubles at 53 bits by engine `taylor`, else Fractions of the working precision.
    states : (6, n) array
        Aligned components at time 0, such numbers too.
    limit : float
        How long, in t', to wait for the crossing.
    engine : str
        One of `integrate.ENGINES`; integers serve where its numbers end.
    bits : int
        Working precision.
    tolerance : float
        Of a compiled Taylor series at 53 bits; every bit more halves it.
    jobs : int
        How many orbits at a time.

    Returns
    -------
    times : (n,) array
        t' since the start.
    states : (6, n) array
        None for both if an orbit does not cross within the limit, or that is not decided.
    """
    exact = states.dtype == object
    # The whole of the kernel's numbers, if it computes.
    whole = kernel_bits(max(bits, PAIRS)) if in_kernel(engine, bits) else max(bits, 54)
    floats = AlignedCoefficients(*map(float, coefficients))
    seen = crossings(
        Orbits(floats, states.astype(float), 1, limit),
        engine=FIRST,
        bits=53,
        tolerance=max(tolerance, FINEST_TOLERANCE[FIRST]),
        jobs=jobs,
    )
    if exact and (seen.outcome == Outcome.FAILED).any():
        # What doubles do not decide.
        each = Orbits(coefficients, [list(state) for state in states.T], 1, limit)
        seen = crossings(each, engine=engine, bits=whole, tolerance=tolerance, jobs=jobs)
    if (seen.outcome != Outcome.COMPLETE).any():
        return None
    late: Any = seen.time[0]
    local = tolerance * 2.0 ** (53 - whole if exact else 0)
    times = np.zeros(len(late), dtype=states.dtype)
    for _ in range(2 + bits // GAINED):
        steps = np.array([Fraction(t) for t in late]) if exact else late
        given = coefficients, states, steps[None], whole if exact else 53, jobs
        states = states_at(*given, engine=engine, tolerance=local)[:, 0]
        times = times + steps
        late = (-states[2] / aligned(states, coefficients)[2]).astype(float)
        if np.abs(late).max() < 2.0 ** (2 - bits):
            break
    return times, states
