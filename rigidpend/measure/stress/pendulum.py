"""The motion with J1 = 0 against its period, for as long as 1e6 units of t'."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend import integrate
from rigidpend.body import Body
from rigidpend.integrate import FINEST_TOLERANCE
from rigidpend.measure.stress.cases import Case, tree
from rigidpend.measure.stress.growth import noise, step
from rigidpend.measure.stress.long_time import FACTOR, POINTS, unit_r
from rigidpend.measure.stress.truth import float_coefficients
from rigidpend.numbers.exact import exact
from rigidpend.results.tree import Dataset, Tree
from rigidpend.routes.problem import RouteProblem, rotation_period


def pendulum(body: Body, h0: Any, *, rotations: int, engine: str) -> Tree:
    """The motion with J1 = 0 over many periods of (sol_3): after each it is where it was.

    Parameters
    ----------
    body : Body
    h0 : number
        Energy constant.
    rotations : int
    engine : str
    """
    problem = RouteProblem(body, exact(h0), exact("1e-8"), 1)
    p, period = body.angles(), rotation_period(problem)
    # From the lowest position, where the kinetic energy is h0 + mu.
    J2 = math.sqrt(2 * (float(exact(h0)) + p.mu) / p.kappa)
    lowest = -unit_r(body)
    counts = np.unique(np.geomspace(1, rotations, POINTS).astype(int))
    times, start = np.r_[0.0, counts] * period, np.r_[0.0, 0.0, -J2, lowest]
    tolerance = FINEST_TOLERANCE[engine]
    found = integrate.sample_orbits(
        float_coefficients(body), start[:, None], times, engine=engine, tolerance=tolerance
    )[:, 1:, 0]
    gamma = found[3:]
    across = lowest[0] * gamma[1] - lowest[1] * gamma[0]
    phase = np.abs(np.arctan2(across, lowest @ gamma))
    steps = times[1:] / step(J2 * math.sin(p.alpha0))
    rate = p.kappa * J2
    walk = noise(engine) * rate * times[1:] * np.sqrt(steps / 3)
    bound = FACTOR * walk + 4 * rate * times[1:] * 2.0**-52
    worst = int(np.argmax(phase / bound))
    case = Case(
        "pendulum at J1 = 0",
        f"phase error after {counts[worst]} of {counts[-1]} periods, t' to {times[-1]:.1e}",
        "rad",
        float(phase[worst]),
        float(bound[worst]),
        "roundings of J2 walk, and the phase adds them up: t sqrt(steps/3); the period is rounded",
    )
    curves = {
        "rotations": Dataset(counts, "1", "periods"),
        "phase": Dataset(phase, "rad", "phase error"),
        "walk": Dataset(walk, "rad", "predicted"),
    }
    return tree([case], curves)
