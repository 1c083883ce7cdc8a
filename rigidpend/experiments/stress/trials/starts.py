"""Starts on and beside each separatrix, with any M . gamma: doubles against 113 bits.

A start is given by J1 and J2 - J1 apart, so that both may be as small as 1e-300. The bound is
the rounding error that the variational equations predict for this very orbit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.stress.trials import truth
from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.growth import predicted_errors
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.separatrices import exponent, fastest_rate, theta1
from rigidpend.numbers.exact import exact
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import DEFAULT_TOLERANCE, Orbits

PHASES = ("3/10", "29/10", "47/10", "7/5", "1/5", "6", "22/7", "13/4")
"""theta2_0 of the columns, radians: nothing special."""
DEVIATIONS = 10
"""Bound over predicted root mean square, where one orbit's error is measured."""


class Place(NamedTuple):
    """Place where orbits start, with a bound of their own instead of a route problem."""

    name: str
    separatrix: int
    J1: float
    J2mJ1: float
    aside: float = 0.0
    """theta1 from the separatrix, radians."""
    J3: float = 0.0


PLACES = (
    *(Place(f"on {k}, J1 = 1e-8", k, 1e-8, 1.4) for k in (1, 2, 3, 4)),
    *(Place(f"on {k}, J2 - J1 = 1e-8", k, 1.4, 1e-8) for k in (1, 2, 3, 4)),
    *(Place(f"beside {k} by 1e-3", k, 1e-4, 1.4, 1e-3) for k in (1, 2, 3, 4)),
    *(Place(f"beside {k} by -1e-9", k, 1e-4, 1.4, -1e-9) for k in (1, 2, 3, 4)),
    Place("on 2, J1 = 1e-300", 2, 1e-300, 1.4),
    Place("on 1, J2 - J1 = 1e-300", 1, 1.4, 1e-300),
    Place("M.gamma = 0.3", 2, 1e-4, 1.4, 0.0, 0.3),
    Place("M.gamma = 1.2", 4, 1e-3, 1.4, 1e-5, 1.2),
    Place("M.gamma = -0.999 |M|", 3, 1e-2, 1.4, 0.0, -0.999 * 1.41),
)
"""Starts on every separatrix near both its ends, beside it, and with M . gamma."""


def state(place: Place, body: Body, theta2: float) -> NDArray[np.float64]:
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


def trial(
    body: Body, place: Place, *, columns: int, n_crossings: int, engine: str, jobs: int
) -> Trial:
    """The claim of a start: doubles err as predicted against the same numbers in 113 bits.

    Parameters
    ----------
    body : Body
    place : Place
    columns, n_crossings : int
        How many orbits, how many crossings on each.
    engine : str
    jobs : int
    """
    claim = Claim(
        place.name,
        "largest phase error of a crossing over its predicted root mean square",
        "1",
        DEVIATIONS,
        "a sum of independent roundings, carried by the variational equations, stays within"
        " ten standard deviations; an error of method would not",
    )

    def measure() -> Findings:
        ratio = _over_predicted(body, place, columns, n_crossings, engine, jobs)
        return Findings({claim.name: float(np.max(ratio))})

    return Trial(place.name, (claim,), measure)


def _over_predicted(
    body: Body, place: Place, columns: int, n_crossings: int, engine: str, jobs: int
) -> NDArray[np.float64]:
    """Phase errors of crossings over their predicted root mean squares, (n_crossings, columns)."""
    phases = np.array([float(exact(x)) for x in PHASES[:columns]])
    states = np.stack([state(place, body, x) for x in phases], axis=1)
    p, c = body.angles(), truth.float_coefficients(body)
    J2 = place.J1 + place.J2mJ1
    u, rate = exponent(J2, p, math), fastest_rate(J2, p, math)
    # From 1e-300 an orbit takes some 700 units of 1/u to arrive.
    orbits = Orbits(c, states, n_crossings, 2000 / u)
    tolerance = DEFAULT_TOLERANCE[engine]
    found = integrate.crossings(orbits, engine=engine, bits=53, tolerance=tolerance, jobs=jobs)
    true = integrate.crossings(
        truth.exactly(orbits), engine=engine, bits=truth.BITS, tolerance=tolerance, jobs=jobs
    )
    errors = truth.phase_errors(found, true, rate)
    predicted = [
        predicted_errors(c, states[:, k], true.time[:, k], u, rate, engine) for k in range(columns)
    ]
    return np.asarray(errors / (np.array(predicted).T + rate * np.spacing(true.time)))
