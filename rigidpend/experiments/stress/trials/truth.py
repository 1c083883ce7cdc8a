"""The same orbits in other arithmetic, and how far two computations are apart."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import exacts
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.routes.problem import RouteProblem, passage_limit
from rigidpend.routes.start import Scales, start, states_exact

BITS = 113
"""Precision of the truth about what fewer bits decided."""
INTEGER_BITS = 192
"""Precision, in integers, of the truth about what took `BITS` or more.

It is above the last of the default precisions, so that nothing judges itself."""


def float_coefficients(body: Body) -> AlignedCoefficients:
    """The body for an engine in doubles."""
    return AlignedCoefficients(*map(float, aligned_coefficients(body.angles(), np)))


def route_crossings(
    problem: RouteProblem, phases: Sequence[Any], *, engine: str, bits: int, jobs: int
) -> Crossings:
    """The crossings of a route problem in one precision of 64 bits or more, in t'.

    ``engine="scipy"`` computes in integers, which share no arithmetic with the other engine.
    """
    begin = start(problem, bits, Scales())
    states = states_exact(begin, exacts(phases), bits)
    limit = passage_limit(problem, bits)
    orbits = Orbits(begin.coefficients, states, problem.n_symbols + 1, limit)
    # The tolerance is that of doubles, and halved by every bit beyond.
    return integrate.crossings(orbits, engine=engine, bits=bits, tolerance=1e-13, jobs=jobs)


def exactly(orbits: Orbits) -> Orbits:
    """Orbits in doubles as the same orbits, number by number, for a higher precision."""
    coefficients = AlignedCoefficients(*map(Fraction, orbits.coefficients))
    states = [[Fraction(float(x)) for x in state] for state in orbits.states.T]
    return orbits._replace(coefficients=coefficients, states=states)


def phase_errors(found: Crossings, true: Crossings, rate: float) -> Any:
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
