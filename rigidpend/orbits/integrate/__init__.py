"""Engines behind :func:`crossings` of orbits in any precision, :func:`sample` and :func:`ends`.

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

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits.integrate.engines import (
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
    "ends",
    "in_kernel",
    "sample",
    "sample_orbits",
]

Field: TypeAlias = Callable[[Any, Any], Any]


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


def sample(
    field: Field,
    state: Numbers,
    times: Numbers,
    *,
    engine: str | None = None,
    tolerance: float | None = None,
) -> NDArray[np.float64]:
    """An orbit of any field, in double precision, at given times.

    Parameters
    ----------
    field : callable
        ``field(state, m)`` gives the derivatives, from the functions of the namespace `m`.
    state : (d,) array
        At the first of the times.
    times : (n,) array
        Ascending or descending, in the field's unit of time.
    engine : {"taylor", "scipy"}, optional
    tolerance : float, optional
        Local tolerance; by default the engine's finest.

    Returns
    -------
    (d, n) array

    Raises
    ------
    ArithmeticError
        The integration did not reach the last of the times.
    ValueError
        The times neither ascend nor descend, or a tolerance that is not above 0.
    """
    engine, tolerance = _chosen(engine, tolerance)
    times, state = _checked_times(times), np.asarray(state, dtype=float)
    if times.size == 1:
        return state[:, None]
    if engine == "scipy":
        from rigidpend.orbits.integrate import dop853

        return dop853.sample(field, state, times, tolerance)
    from rigidpend.orbits.integrate import batch_samples

    return batch_samples.sample_field(field, state[:, None], times[:, None], tolerance)[..., 0]


def ends(
    field: Field,
    states: Numbers,
    times: Numbers,
    *,
    engine: str | None = None,
    tolerance: float | None = None,
) -> NDArray[np.float64]:
    """Orbits of any field, in double precision, each carried from time 0 to a time of its own.

    Parameters
    ----------
    field : callable
        As for :func:`sample`.
    states : (d, n) array
        At time 0.
    times : (n,) array
        In the field's unit of time.
    engine : {"taylor", "scipy"}, optional
    tolerance : float, optional
        Local tolerance; by default the engine's finest.

    Returns
    -------
    (d, n) array

    Raises
    ------
    ArithmeticError
        An orbit did not reach its time.
    ValueError
        A tolerance that is not above 0.
    """
    engine, tolerance = _chosen(engine, tolerance)
    times, states = np.asarray(times, dtype=float), np.asarray(states, dtype=float)
    if engine == "taylor" and states.size:
        from rigidpend.orbits.integrate import batch_samples

        return batch_samples.ends_of_field(field, states, times, tolerance)
    found = states.copy()
    for k in np.flatnonzero(times):
        each = sample(field, states[:, k], [0.0, times[k]], engine=engine, tolerance=tolerance)
        found[:, k] = each[:, -1]
    return found


def sample_orbits(
    coefficients: AlignedCoefficients,
    states: Numbers,
    times: Numbers,
    *,
    engine: str | None = None,
    tolerance: float | None = None,
) -> NDArray[np.float64]:
    """Orbits of the aligned field of one body, in double precision, at given times.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Floats.
    states : (6, n) array
        Aligned components at the first of the times.
    times : (k,) array
        t', ascending or descending.
    engine : {"taylor", "scipy"}, optional
    tolerance : float, optional
        Local tolerance; by default the engine's finest. A coarser one lets integrals drift in
        proportion to the time, where roundings alone drift as its root.

    Returns
    -------
    (6, k, n) array

    Raises
    ------
    ArithmeticError
        An orbit did not reach the last of the times.
    ValueError
        The times neither ascend nor descend, or a tolerance that is not above 0.
    """
    engine, tolerance = _chosen(engine, tolerance)
    times, states = _checked_times(times), np.asarray(states, dtype=float)
    if engine == "scipy":

        def together(flat: Any, _: Any) -> Any:
            return np.concatenate(aligned(flat.reshape(states.shape), coefficients))

        flat = sample(together, states.ravel(), times, engine=engine, tolerance=tolerance)
        return flat.reshape(*states.shape, times.size).transpose(0, 2, 1)
    if times.size == 1:
        return states[:, None]
    from rigidpend.orbits.integrate import batch_samples

    given = states[None], times[None, :, None], 53, tolerance
    return batch_samples.sample_aligned(coefficients, *given)[0]


def _chosen(engine: str | None, tolerance: float | None) -> tuple[str, float]:
    """An engine and a local tolerance, its finest where none is given."""
    engine = check_engine(engine or default_engine())
    tolerance = FINEST_TOLERANCE[engine] if tolerance is None else tolerance
    if not 0 < tolerance < float("inf"):
        raise ValueError(f"tolerance must be a number above 0, got {tolerance}")
    return engine, tolerance


def _checked_times(times: Numbers) -> NDArray[np.float64]:
    """Times as an array, if they ascend or descend."""
    checked = np.asarray(times, dtype=float)
    steps = np.diff(checked)
    if checked.ndim != 1 or not checked.size or not ((steps > 0).all() or (steps < 0).all()):
        raise ValueError("times must be a list that ascends or descends, with at least one time")
    return checked


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
