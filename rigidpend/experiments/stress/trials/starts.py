"""Starts on and beside each separatrix, with any M . gamma: doubles against 113 bits.

A start is given by J1 and J2 - J1 apart, so that both may be as small as 1e-300. The bound is
the rounding error that the variational equations predict for this very orbit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.growth import predicted_errors
from rigidpend.experiments.stress.trials.truth import BITS, Scene, Way, followed, phase_errors
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.separatrices import theta1
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import exacts
from rigidpend.orbits.integrate import Orbits

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


def trial(body: Body, place: Place, way: Way, *, columns: int, n_crossings: int) -> Trial:
    """The claim of a start: doubles err as predicted against the same numbers in 113 bits."""
    claim = Claim(
        place.name,
        DEVIATIONS,
        "largest phase error of a crossing over its predicted root mean square",
        "a sum of independent roundings, carried by the variational equations, stays within"
        " ten standard deviations; an error of method would not",
    )

    def measure() -> Findings:
        scene, phases = Scene(body, place.J1 + place.J2mJ1), exacts(PHASES[:columns])
        states = np.stack([state(place, body, float(x)) for x in phases], axis=1)
        # From 1e-300 an orbit takes some 700 units of 1/u to arrive.
        errors, predicted, floor = compared(scene, states, n_crossings, 2000 / scene.u, way)
        return Findings([np.max(errors / (predicted + floor))])

    return Trial(place.name, (claim,), measure)


def compared(
    scene: Scene, states: Array, n_crossings: int, limit: float, way: Way
) -> tuple[Array, Array, Array]:
    """Phase errors of doubles, against 113 bits, and as predicted, and the last bit of the times.

    All are in radians, (n_crossings, n); each passage may take t' = `limit`.
    """
    orbits = Orbits(scene.c, states, n_crossings, limit)
    # The truth of the very same doubles: what rounds their starts is no error of integration.
    found, true = followed(orbits, way), followed(orbits, way, BITS)
    predicted = predicted_errors(scene, states, true.time, way.engine)
    floor = scene.rate * np.spacing(true.time)
    return phase_errors(found, true, scene.rate), predicted, floor
