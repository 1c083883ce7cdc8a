"""Engines that follow orbits in any precision: to their crossings, or to given times.

They answer three questions: :func:`crossings` finds successive crossings of M3 = 0 of many orbits,
`states.first_crossings` the state at the first one, `states.states_at` states at given times.

======== ============================================ ==================
engine   how                                          precisions (bits)
======== ============================================ ==================
taylor   Taylor series in vectors of doubles, or of   53, up to 106,
         sums of two, four or eight, in machine code  212, 424
scipy    DOP853, many orbits as one system            53
bigint   Taylor series in integers, by FLINT          any; serves where
                                                      the engine ends
======== ============================================ ==================

An engine is imported when it is first used.
"""

from enum import IntEnum
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers import Scalar
from rigidpend.orbits import joined
from rigidpend.orbits.integrate.arithmetic import in_kernel


class Outcome(IntEnum):
    """Outcome of an orbit's integration."""

    COMPLETE = 0
    """All crossings were found."""
    ASYMPTOTIC = 1
    """The orbit stays on an invariant plane Qp = 0 or Qm = 0 and never crosses again."""
    NO_CROSSING = 2
    """No crossing came within the passage limit."""
    FAILED = 3
    """The integrator gave up (a number that is not finite, an undecided touch)."""
    STAYS = 4
    """No crossing came within the passage limit, as two computations agree."""
    TOO_LONG = 5
    """No crossing came within the step limit, which more bits reach as well."""


class Orbits(NamedTuple):
    """A task for an engine: orbits of one body, in aligned components and time t'."""

    coefficients: AlignedCoefficients
    """Floats at 53 bits, else Fractions rounded to the working precision."""
    states: Any
    """States at t' = 0, (6, n): doubles at 53 bits, else Fractions."""
    n_crossings: int
    """Number of crossings of M3 = 0 to find on each orbit."""
    passage_limit: float
    """Longest wait for the next crossing, t'."""


class Crossings(NamedTuple):
    """The crossings of M3 = 0 (J1 = J2/2), in their order along each orbit."""

    time: NDArray[np.float64]
    """Times t', (n_crossings, n); NaN where there is no crossing."""
    separatrix: NDArray[np.uint8]
    """Unperturbed separatrix beside which a crossing lies, 1 to 4, (n_crossings, n); 0 for none."""
    outcome: NDArray[np.uint8]
    """Values of `Outcome`, (n,)."""


def no_crossings(n_crossings: int, n: int) -> Crossings:
    """A record to be filled in: no crossings, and every orbit counts as failed."""
    return Crossings(
        np.full((n_crossings, n), np.nan),
        np.zeros((n_crossings, n), dtype=np.uint8),
        np.full(n, Outcome.FAILED, dtype=np.uint8),
    )


def silent_outcome(Qp: Scalar, Qm: Scalar) -> Outcome:
    """Outcome of an orbit that did not cross again, from Qp and Qm at the end.

    A component with a force is never exactly zero for long, so that a zero tells an invariant
    plane.
    """
    return Outcome.ASYMPTOTIC if Qp == 0 or Qm == 0 else Outcome.NO_CROSSING


def in_turn(found: Crossings) -> Crossings:
    """Mark orbits as failed from the first crossing that does not alternate between rise and fall.

    A crossing that is lost, or found twice where two steps meet, thus makes no wrong symbol. The
    record is changed in place, and returned.
    """
    # M3 rises through zero beside separatrices 2 and 4. Two such crossings in a row are impossible.
    rising = np.isin(found.separatrix, (2, 4))
    twice = (found.separatrix[1:] > 0) & (rising[1:] == rising[:-1])
    bad = np.vstack((np.zeros((1, twice.shape[1]), dtype=bool), np.logical_or.accumulate(twice)))
    found.time[bad], found.separatrix[bad] = np.nan, 0
    found.outcome[bad.any(axis=0)] = Outcome.FAILED
    return found


WEIGHTS = ("force_p", "force_m", "mu_r1", "mu_r2")
"""Names of the coefficients that are proportional to mu."""
UNSCALED_BITS = 212
"""Bits up to which series are so short that no unit of M is needed, at any energy."""
NEAR_UNIT = 16
"""Factor by which |M| may differ from 1 before numbers of more bits need a unit of M."""


def in_unit(
    c: AlignedCoefficients, states: Any, bits: int | None = None
) -> tuple[Fraction, AlignedCoefficients, Any]:
    """A unit of M, with coefficients and states (6, n) for M in this unit and time in its inverse.

    The unit is a power of two, from a quarter of the largest component of M up to that component,
    so that numbers, and steps in its time, are near 1. Terms of a series grow as powers of |M|:
    with 110 orders and more they leave the range of doubles, or become denormal, which is slow.
    Kernels in numbers of `bits` bits (None: integers) take the unit 1 where that does no harm.
    """
    if bits is not None and bits <= UNSCALED_BITS:
        return Fraction(1), c, states
    largest = max(abs(x) for x in np.ravel(states[:3]))
    unit = Fraction(2) ** (largest.numerator.bit_length() - largest.denominator.bit_length() - 1)
    if bits is not None and 1 / NEAR_UNIT < unit < NEAR_UNIT:
        return Fraction(1), c, states
    # With M = unit M* and t' = t*/unit the equations keep their form with mu* = mu/unit^2. Division
    # by a power of two rounds nothing.
    c = c._replace(**{x: getattr(c, x) / unit**2 for x in WEIGHTS})
    return unit, c, np.array([*(x / unit for x in states[:3]), *states[3:]])


def crossings(orbits: Orbits, *, engine: str, bits: int, tolerance: float, jobs: int) -> Crossings:
    """Integrate orbits, in numbers of `bits` bits, and find their crossings of M3 = 0.

    `tolerance` is the local tolerance at 53 bits. Every further bit halves it, and integers have
    errors of rounding only. `jobs` is the number of orbits, or batches of them, that are integrated
    at a time; no result depends on it.
    """
    n, compiled = orbits.states.shape[1], in_kernel(engine, bits)
    if not n:
        return no_crossings(orbits.n_crossings, 0)
    work, further, together = _serving(engine, bits, tolerance)
    # The orbits of a part may share their steps: only the kernel's parts may depend on `jobs`.
    count = -(-n // together)
    count = min(jobs, count) if compiled else count
    parts = [orbits._replace(states=states) for states in spread(orbits.states, count, axis=1)]
    return joined(side_by_side(work, further, not compiled, parts, jobs))


def on_one_thread(engine: str, bits: int, n: int) -> bool:
    """True if n orbits are too few to be shared by several threads or processes."""
    return n <= _serving(engine, bits, 0.0)[2]


def _serving(engine: str, bits: int, tolerance: float) -> tuple[Any, tuple[Any, ...], int]:
    """The function that finds crossings, its further arguments, and how many orbits to give it."""
    if in_kernel(engine, bits):
        from rigidpend.orbits.integrate import batch

        return batch.crossings, (bits, tolerance), batch.worth_a_thread(bits)
    if bits == 53:
        from rigidpend.orbits.integrate import dop853

        return dop853.crossings, (tolerance,), dop853.SIDE_BY_SIDE
    from rigidpend.orbits.integrate import reference_orbit

    return reference_orbit.crossings, (bits, engine, tolerance), 1
