"""The motion with J1 = 0 against its period, for as long as 1e6 units of t'."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.data import layout
from rigidpend.experiments.stress.layout import PENDULUM
from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.growth import noise, step
from rigidpend.experiments.stress.trials.long_time import FACTOR, POINTS, unit_r
from rigidpend.experiments.stress.trials.truth import Scene
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import Exact, exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import FINEST_TOLERANCE
from rigidpend.routes.problem import RouteProblem, rotation_period

CLAIM = Claim(
    "pendulum at J1 = 0",
    FACTOR,
    "phase error after any number of periods, over the predicted root mean square",
    "roundings of J2 walk, and the phase adds them up: t sqrt(steps/3); the period is rounded",
)


def trial(body: Body, h0: Scalar, engine: str, *, rotations: int) -> Trial:
    """The motion with J1 = 0 over many periods of (sol_3): after each it is where it was."""

    def measure() -> Findings:
        counts, times, phase, walk = _followed(body, exact(h0), rotations, engine)
        worst = int(np.argmax(phase / walk))
        curves = layout.datasets(PENDULUM, {"rotations": counts, "phase": phase, "walk": walk})
        said = f"{phase[worst]:.1e} rad at {counts[worst]} of {counts[-1]}, t' = {times[-1]:.1e}"
        return Findings([phase[worst] / walk[worst]], curves, [said])

    return Trial("pendulum", (CLAIM,), measure)


def _followed(body: Body, h0: Exact, rotations: int, engine: str) -> tuple[Any, ...]:
    """Numbers of periods, their times t', the phase errors there and the predicted ones."""
    # J1_0 and the number of symbols have no part in the period.
    problem = RouteProblem(body, h0, exact("1e-8"), 1)
    p, period = body.angles(), rotation_period(problem)
    # From the lowest position, where the kinetic energy is h0 + mu.
    J2 = math.sqrt(2 * (float(h0) + p.mu) / p.kappa)
    lowest = -unit_r(body)
    counts = np.unique(np.geomspace(1, rotations, POINTS).astype(int))
    times, start = np.r_[0.0, counts] * period, np.r_[0.0, 0.0, -J2, lowest]
    tolerance = FINEST_TOLERANCE[engine]
    scene = Scene(body, J2)
    found = integrate.sample_orbits(
        scene.c, start[:, None], times, engine=engine, tolerance=tolerance
    )[:, 1:, 0]
    gamma, times = found[3:], times[1:]
    # The angle from the lowest position, to which every whole period returns.
    phase = np.abs(np.arctan2(lowest[0] * gamma[1] - lowest[1] * gamma[0], lowest @ gamma))
    rate = p.kappa * J2
    walk = noise(engine) * np.sqrt(times / step(scene.u) / 3)
    # The rounding of the period itself adds up as well, in proportion to the time.
    return counts, times, phase, rate * times * (walk + 2.0**-52)
