"""Scenes that trials share: orbits of a body, their starts, and how far computations are apart.

The truth about doubles has 113 bits; about more bits it comes from integers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.mechanics.separatrices import exponent, fastest_rate, theta1
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import exacts
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import DEFAULT_TOLERANCE, Crossings, Orbits
from rigidpend.routes.problem import RouteProblem, passage_limit
from rigidpend.routes.start import Scales, start, states_exact

BITS = 113
"""Precision of the truth about what fewer bits decided."""
INTEGER_BITS = 192
"""Precision, in integers, of the truth about what took `BITS` or more.

It is above the last of the default precisions, so that nothing judges itself."""

PHASES = ("3/10", "29/10", "47/10", "7/5", "1/5", "6", "22/7", "13/4")
"""theta2_0 of columns, radians: nothing special."""


class Way(NamedTuple):
    """The way of all computations of a run: their engine, and how many at a time."""

    engine: str
    jobs: int = 1


class Scene(NamedTuple):
    """A body and |M|, dimensionless, of orbits near its separatrices."""

    body: Body
    J2: float

    @property
    def c(self) -> AlignedCoefficients:
        """The body for an engine in doubles."""
        return AlignedCoefficients(*map(float, aligned_coefficients(self.body.angles(), np)))

    @property
    def u(self) -> float:
        """Exponent of the separatrices, per t'."""
        return exponent(self.J2, self.body.angles(), math)

    @property
    def rate(self) -> float:
        """Radians per t', at most."""
        return fastest_rate(self.J2, self.body.angles(), math)


def followed(orbits: Orbits, way: Way, bits: int = 53) -> Crossings:
    """The crossings of orbits at the default tolerance; of more bits those of the same doubles."""
    return integrate.crossings(
        orbits if bits == 53 else exactly(orbits),
        engine=way.engine,
        bits=bits,
        tolerance=DEFAULT_TOLERANCE[way.engine],
        jobs=way.jobs,
    )


def route_crossings(problem: RouteProblem, phases: Sequence[Any], way: Way, bits: int) -> Crossings:
    """The crossings of a route problem in one precision of 64 bits or more, in t'.

    The engine `scipy` computes in integers, which share no arithmetic with the other engine.
    """
    begin = start(problem, bits, Scales())
    states = states_exact(begin, exacts(phases), bits)
    limit = passage_limit(problem, bits)
    orbits = Orbits(begin.coefficients, states, problem.n_symbols + 1, limit)
    # The tolerance is that of doubles, and halved by every bit beyond.
    return integrate.crossings(orbits, engine=way.engine, bits=bits, tolerance=1e-13, jobs=way.jobs)


def exactly(orbits: Orbits) -> Orbits:
    """Orbits in doubles as the same orbits, number by number, for a higher precision."""
    coefficients = AlignedCoefficients(*map(Fraction, orbits.coefficients))
    states = [[Fraction(float(x)) for x in state] for state in orbits.states.T]
    return orbits._replace(coefficients=coefficients, states=states)


def phase_errors(found: Crossings, true: Crossings, rate: float) -> Array:
    """Distances of crossings from the true ones, (n_crossings, n), in radians.

    Parameters
    ----------
    found, true : Crossings
        In the same unit of time.
    rate : float
        Radians per unit of time.

    Returns
    -------
    array
        Infinite where the separatrix is another one, or where only one of both crosses.
    """
    apart = rate * np.abs(found.time - true.time)
    absent = (found.separatrix == 0) & (true.separatrix == 0)
    return np.where(absent, 0.0, np.where(found.separatrix == true.separatrix, apart, np.inf))


class Place(NamedTuple):
    """Place where orbits start, with a bound of their own instead of a route problem."""

    name: str
    separatrix: int
    J1: float
    J2mJ1: float
    aside: float = 0.0
    """theta1 from the separatrix, radians."""
    J3: float = 0.0


def state(place: Place, body: Body, theta2: float) -> Array:
    """The aligned components (6,) of a start; on a separatrix its own Q is exactly 0."""
    p = body.angles()
    J2 = place.J1 + place.J2mJ1
    cosq = math.sqrt((J2 - place.J3) * (J2 + place.J3)) / J2
    at = float(theta1(place.separatrix, p, np)) + place.aside
    c = Canonical(place.J1, place.J2mJ1, place.J3, at, theta2, 0.0, cosq)
    made = aligned_from_canonical(c, p.alpha0, p.beta0)
    # The sine of a rounded theta1 is not quite 0, which the start must not depend on.
    if not place.aside:
        made = made._replace(**{"Qm" if place.separatrix in (2, 4) else "Qp": 0.0})
    return np.array(made)


def at_random(place: Place, body: Body, n: int, seed: int) -> Array:
    """The aligned components, (6, n), of starts at a place with random phases."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, n)
    return np.stack([state(place, body, x) for x in phases], axis=1)
