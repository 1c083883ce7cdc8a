"""Records that go into an engine and come out of it: plain data, no integrator object."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Scalar


class Outcome(IntEnum):
    """Outcome of an orbit's integration."""

    COMPLETE = 0
    """All crossings were found."""
    ASYMPTOTIC = 1
    """It stays on an invariant plane Q = 0 and never crosses again."""
    NO_CROSSING = 2
    """No crossing came within the passage limit."""
    FAILED = 3
    """The integrator gave up (step limit, a number that is not finite)."""


class Orbits(NamedTuple):
    """A task for an engine: orbits of one body, in aligned components and time t'."""

    coefficients: AlignedCoefficients
    """Floats at 53 bits, else Fractions that are numbers of the working precision."""
    states: Any
    """At 53 bits an array (6, n), else n lists of 6 Fractions; at time 0."""
    n_crossings: int
    """Number of crossings of M3 = 0 to find on each orbit."""
    passage_limit: float
    """Longest wait for the next crossing, t'."""


class Crossings(NamedTuple):
    """The crossings of M3 = 0 (J1 = J2/2), in their order along each orbit."""

    time: NDArray[np.float64]
    """(n_crossings, n), t'; NaN where there is none."""
    separatrix: NDArray[np.uint8]
    """(n_crossings, n), 1..4: the unperturbed separatrix beside which it lies; 0 for none."""
    outcome: NDArray[np.uint8]
    """(n,), values of `Outcome`."""


def no_crossings(n_crossings: int, n: int) -> Crossings:
    """A record to be filled in: every orbit not yet integrated."""
    return Crossings(
        np.full((n_crossings, n), np.nan),
        np.zeros((n_crossings, n), dtype=np.uint8),
        np.full(n, Outcome.FAILED, dtype=np.uint8),
    )


def joined(parts: list[Crossings]) -> Crossings:
    """Records of successive orbits as one."""
    return Crossings(*(np.concatenate(x, axis=-1) for x in zip(*parts, strict=True)))


def silent_outcome(Qp: Scalar, Qm: Scalar) -> Outcome:
    """The outcome of an orbit that did not cross again, from where it is at the end.

    A forced component is never exactly zero for long, so a zero is an invariant plane.
    """
    return Outcome.ASYMPTOTIC if Qp == 0 or Qm == 0 else Outcome.NO_CROSSING


def in_turn(found: Crossings) -> Crossings:
    """Mark orbits as failed, from there on, whose crossings do not rise and sink in turn.

    So a crossing that is lost or found twice where two steps meet makes no symbol.
    """
    rising = np.isin(found.separatrix, (2, 4))
    twice = (found.separatrix[1:] > 0) & (rising[1:] == rising[:-1])
    bad = np.vstack((np.zeros((1, twice.shape[1]), dtype=bool), np.logical_or.accumulate(twice)))
    found.time[bad], found.separatrix[bad] = np.nan, 0
    found.outcome[bad.any(axis=0)] = Outcome.FAILED
    return found
