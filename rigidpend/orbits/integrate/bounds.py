"""Bounds on M3 between two states of an orbit: where it cannot have become zero.

They follow from the equations alone, for the exact orbit through a state, whatever its step
sizes. With J = |M|, g = |gamma| (which is constant) and w = mu |r|, ``aligned`` gives

    |M3'| <= (J^2 - M3^2)/2 + w g <= (a^2 - M3^2)/2,    a^2 = J^2 + 2 w g,

since M3' = M1 M2 + ... and 2 |M1 M2| <= J^2 - M3^2. So M3 takes at least the time
(2/a) artanh(|M3|/a) to come to zero. An orbit along a separatrix does just that: for those of
Fig. 4 the bound is nearly sharp, and a stretch of three units of t' needs no closer look.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.equations import AlignedCoefficients, aligned

Array = NDArray[np.float64]

TOUCH = 1e-5
"""Depth of a touch of M3 = 0, relative to |M|, up to which doubles do not decide it.

Two computations whose crossing times agree well enough for a certain symbol may err by 5e-6
radians (see `rigidpend.routes.certainty`), and by as much in M3."""


def touch(bits: int) -> float:
    """The depth of a touch that numbers of so many bits leave undecided, relative to |M|."""
    return TOUCH * 2.0 ** min(0, 64 - bits)


class Bounds(NamedTuple):
    """Sizes along each of n stretches of orbit, none smaller than the true one."""

    a: Array
    """sqrt(J^2 + 2 w g), so that |M3'| <= (a^2 - M3^2)/2."""
    bend: Array
    """Bound of |M3''|."""

    def time_to_zero(self, M3: Array) -> Array:
        """Least time in which M3 comes from this value to a touch of zero."""
        level = np.minimum(np.abs(M3) / self.a, 1.0)
        with np.errstate(divide="ignore"):
            return 2 / self.a * (np.arctanh(level) - TOUCH)

    def time_near(self, M3: Array, slope: Array) -> tuple[Array, Array]:
        """Time for which M3 certainly moves in the sense of this slope, and |M3| at its end."""
        near = np.abs(slope) / self.bend
        return near, np.abs(M3) + np.abs(slope) * near / 2


def bounds(states: Array, durations: Array, c: AlignedCoefficients) -> Bounds:
    """The bounds over stretches that begin at these states.

    Parameters
    ----------
    states : (6, n) array
        Aligned components.
    durations : (n,) array
        t'.
    c : AlignedCoefficients
        Floats.
    """
    cosine = np.hypot(c.omega1, np.sqrt(c.kappa)) - c.omega1
    sine = c.half_sigma / cosine
    Qp, Qm, M3, *gamma = states
    g = np.sqrt(sum(x * x for x in gamma))
    weight = np.hypot(c.mu_r1, c.mu_r2)
    momentum = ((Qp + Qm) / (2 * cosine)) ** 2 + ((Qp - Qm) / (2 * sine)) ** 2 + M3 * M3
    # |M|' is at most w g.
    J = np.sqrt(momentum) + weight * g * np.abs(durations)
    forced = 2 * c.twist * (abs(c.force_p) + abs(c.force_m)) + weight * (c.kappa + 1)
    # 2 twist (Qp Qp' - Qm Qm') holds |M3| (Qp^2 + Qm^2)/2 <= |M3| (J^2 - M3^2) <= 2 J^3/sqrt(27).
    return Bounds(np.sqrt(J * J + 2 * weight * g), 0.385 * J**3 + forced * g * J)


def slopes(states: Array, c: AlignedCoefficients) -> Array:
    """M3' at the states (6, n)."""
    return np.asarray(aligned(states, c)[2])


def without_zero(b: Bounds, before: Array, after: Array, durations: Array) -> NDArray[np.bool_]:
    """Mask of intervals in which M3 has no zero, nor touches it, between values of one sign."""
    enough = b.time_to_zero(before) + b.time_to_zero(after) > durations
    return enough & ((before < 0) == (after < 0))


def leaving_zero(
    b: Bounds, ends: tuple[Array, Array], slopes: tuple[Array, Array], durations: Array
) -> NDArray[np.bool_]:
    """The same, where an end is near zero and M3 moves away from it there, seen from inside."""
    time = -durations
    for M3, slope, inwards in zip(ends, slopes, (1, -1), strict=True):
        near, there = b.time_near(M3, slope)
        away = inwards * slope * M3 > 0
        time += np.where(away, near + b.time_to_zero(there), b.time_to_zero(M3))
    return (time > 0) & ((ends[0] < 0) == (ends[1] < 0))
