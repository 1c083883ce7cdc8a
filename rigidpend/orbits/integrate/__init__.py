"""Engines that follow orbits in any precision: to their crossings, or to given times.

There are three questions: :func:`crossings`, the many crossings of M3 = 0 of many orbits;
`sections.first_crossings`, the state at the first one; `states.states_at`, states at times.

======== ============================================ ==================
engine   how                                          precisions (bits)
======== ============================================ ==================
taylor   Taylor series in vectors of doubles, or of   53, up to 106,
         sums of two, four or eight, in machine code  212, 424
scipy    DOP853, many orbits as one system            53
bigint   Taylor series in integers, by FLINT          any; serves where
                                                      the engine ends
======== ============================================ ==================

Engines are imported when they are used, not before.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.orbits.integrate.arithmetic import (
    DEFAULT_TOLERANCE,
    ENGINES,
    FINEST_TOLERANCE,
    EngineError,
    check_engine,
    default_engine,
    in_kernel,
    kernel_bits,
)
from rigidpend.orbits.integrate.records import (
    Crossings,
    Orbits,
    Outcome,
    joined,
    no_crossings,
)

__all__ = [
    "DEFAULT_TOLERANCE",
    "ENGINES",
    "FINEST_TOLERANCE",
    "Crossings",
    "EngineError",
    "Orbits",
    "Outcome",
    "check_engine",
    "crossings",
    "default_engine",
    "in_kernel",
]


def crossings(orbits: Orbits, *, engine: str, bits: int, tolerance: float, jobs: int) -> Crossings:
    """Integrate orbits and find their crossings of M3 = 0.

    Parameters
    ----------
    orbits : Orbits
        In numbers of `bits` bits: see the record.
    engine : str
        One of `ENGINES`.
    bits : int
        Working precision, 53 or more.
    tolerance : float
        Local tolerance at 53 bits; every bit more halves it. Integers err by rounding alone.
    jobs : int
        How many orbits, or batches, are integrated at a time.

    Returns
    -------
    Crossings
        In the time unit of the orbits. It does not depend on `jobs`.
    """
    if not len(orbits.states) or not np.size(orbits.states):
        return no_crossings(orbits.n_crossings, 0)
    work, further, holds_interpreter, parts = _plan(orbits, engine, bits, tolerance, jobs)
    return joined(side_by_side(work, further, holds_interpreter, parts, jobs))


def _plan(
    orbits: Orbits, engine: str, bits: int, tolerance: float, jobs: int
) -> tuple[Any, tuple[Any, ...], bool, list[Orbits]]:
    """The function that integrates, its further arguments, whether it holds the GIL, the parts."""
    if in_kernel(engine, bits):
        from rigidpend.orbits.integrate import batch

        n = len(orbits.states) if bits > 53 else orbits.states.shape[1]
        count = min(jobs, -(-n // batch.WORTH[kernel_bits(bits)]))
        return batch.crossings_batch, (bits, tolerance), False, _split(orbits, count)
    if bits == 53:
        from rigidpend.orbits.integrate import dop853

        # Parts that don't depend on `jobs`: orbits of one part share their steps.
        count = -(-orbits.states.shape[1] // dop853.SIDE_BY_SIDE)
        return dop853.crossings, (tolerance,), True, _split(orbits, count)
    from rigidpend.orbits.integrate import reference_orbit

    parts = [orbits._replace(states=[state]) for state in orbits.states]
    return reference_orbit.crossings, (bits, engine, tolerance), True, parts


def _split(orbits: Orbits, count: int) -> list[Orbits]:
    if isinstance(orbits.states, list):
        size = -(-len(orbits.states) // count)
        starts = range(0, len(orbits.states), size)
        return [orbits._replace(states=orbits.states[k : k + size]) for k in starts]
    return [orbits._replace(states=states) for states in spread(orbits.states, count, axis=1)]
