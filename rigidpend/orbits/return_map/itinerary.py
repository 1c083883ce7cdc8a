"""Itineraries: orbits followed through many passages, and how they enter the map.

An orbit that starts beside the lower periodic orbit is mirrored by the reversor, put into the
normal form there, and leaves it at its first crossing: nothing is integrated.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map.conjugacy import inverted, torus_rates
from rigidpend.orbits.return_map.passage import EnergyLevel, SectionPoint, reduced_angle
from rigidpend.orbits.return_map.precision import Precision


class Entered(NamedTuple):
    """First crossings of orbits from beside the lower periodic orbit."""

    point: SectionPoint
    time: Any
    """(N,) t' from the start."""
    theta3: Any
    """(N,) radians, growth from the start."""
    inside: Any
    """(N,), whether the tables reach so far."""


class Itinerary(NamedTuple):
    """Orbits through their crossings of M3 = 0."""

    time: Any
    """(n + 1, N) t' of the crossings."""
    separatrix: Any
    """(n + 1, N) uint8, 1..4."""
    theta3: Any
    """(n + 1, N) radians, growth from the start."""
    inside: Any
    """(n + 1, N), whether the tables reach as far as that crossing; elsewhere the rest is void."""
    point: SectionPoint
    """The last crossings."""


def enter(level: EnergyLevel, Qp: Scalar, phase: Scalar) -> Entered:
    """Orbits that start at Qp > 0, Qm = 0, M3 < 0, and first cross beside separatrix 2.

    Parameters
    ----------
    level : EnergyLevel
    Qp : number
        Dimensionless.
    phase : (N,) array
        pi/2 - beta0/2 - theta2: psi of the mirrored state, radians.

    Raises
    ------
    MapError
        Qp lies outside of the range of the normal form.
    """
    a, nf = level.a, level.nf
    zero = 0 * phase
    at = inverted(nf, level.weights, phase, zero + Qp, zero, a)
    inverse = level.charts[True].inverse
    I = at.u * at.v
    rates = torus_rates(level.exponent, level.rotation, I)
    s = phase + a.log(at.v) / rates.exponent
    inside = (np.abs(I) <= inverse.width) & (np.abs(at.v) <= nf.radius)
    seen = inverse.look_up(np.where(inside, I, zero), s, a)
    chi = s + seen[1]
    time = at.tau + seen[2] - rates.rotation * (chi - phase)
    point = SectionPoint(True, seen[0], reduced_angle(-chi, a))
    return Entered(point, time, at.sigma + seen[3], inside)


def follow(level: EnergyLevel, begin: Entered, n: int) -> Itinerary:
    """Orbits through n passages, from crossings beside separatrix 2.

    Parameters
    ----------
    level : EnergyLevel
    begin : Entered
    n : int
        Passages.
    """
    a, point = level.a, begin.point
    N = len(np.atleast_1d(point.chi))
    times, turns = (a.zeros((n + 1, N)) for _ in range(2))
    separatrix, inside = np.empty((n + 1, N), dtype=np.uint8), np.empty((n + 1, N), dtype=bool)
    time, theta3, within = begin.time, begin.theta3, begin.inside
    image = np.zeros(N, dtype=bool)
    for k in range(n + 1):
        times[k], turns[k], inside[k] = time, theta3, within
        separatrix[k] = _separatrix(point.rising, image)
        if k < n:
            passed = level.passage(point)
            time = time + passed.time
            theta3 = theta3 + np.where(image, -1, 1) * passed.theta3
            within, point, image = within & passed.inside, passed.point, image ^ passed.mirrored
    return Itinerary(times, separatrix, turns, inside, point)


def _separatrix(rising: bool, image: Any) -> Any:
    return np.where(image, 4, 2) if rising else np.where(image, 1, 3)


def entry_phase(cos: Any, sin: Any, beta0: Any, a: Precision) -> Any:
    """pi/2 - beta0/2 - theta2 to rounding, from the cosine and the sine of theta2; radians."""
    return a.pi / 2 - beta0 / 2 - a.atan2(sin, cos)
