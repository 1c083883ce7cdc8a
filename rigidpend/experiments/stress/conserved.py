"""Conserved quantities, kept by the computation: symmetries, and integrals over 1e6 rotations.

Changes of sign are exact, so reflection and time reversal must hold bit for bit. Integrals of
motion drift like a random walk of roundings.
"""

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.roundings import DEVIATIONS, NOISE, deviations, step
from rigidpend.experiments.stress.scenes import (
    SIGMAS,
    Claim,
    Findings,
    Place,
    Scene,
    Trial,
    followed,
)
from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import energy
from rigidpend.mechanics.free_body import MIRRORED
from rigidpend.numbers import Array
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.arithmetic import DEFAULT_TOLERANCE, FINEST_TOLERANCE
from rigidpend.orbits.integrate.states import states_at

FEW = 4
"""Number of orbits on which the symmetries are tested."""
MIRROR = np.array([-1, -1, 1, 1, 1, -1])
"""Reflection in the plane of r: gamma3 and, M being axial, M1 and M2 change sign."""
REVERSAL = np.array([1, 1, -1, 1, 1, -1])
"""Time reversal (M changes sign) combined with that reflection: M3 and gamma3 change sign."""
BACK = 30.0
"""t' after which an orbit returns."""
SIZED = DEVIATIONS * math.sqrt(2)
"""Bound for the difference of two computations: the squares of their roundings add."""
BITWISE = "a change of sign rounds nothing: the same numbers, bit for bit"
SYMMETRIES = (
    Claim("reflection", 0, "crossings that differ from those of the mirrored orbits", BITWISE),
    Claim(
        "time reversal", 0,
        "numbers that differ between an orbit backwards and the reversed orbit forwards", BITWISE,
    ),
    Claim(
        "there and back", SIZED,
        f"largest difference after t' = {BACK:g} and back, over its predicted root mean square",
        "roundings on both ways, carried back to the start by the variational equations",
    ),
)  # fmt: skip

INTEGRALS = ("energy", "gamma", "M.gamma")
"""Integrals of motion, in the order of :func:`integrals`."""
POINTS = 61
"""Number of times at which the integrals are evaluated, evenly spread in their logarithm."""
BEGIN = 100
"""Rotations after which a slope is fitted: before, rounding in the evaluation exceeds the drift."""
FACTOR = 4.0
"""Allowed factor of a drift above the predicted random walk."""
BIASED = (
    "the series' truncation at the default tolerance, chosen for routes of some hundred t', has"
    " a bias of 1e-16 a rotation in |gamma|; for long times take the finest tolerance"
)
BIAS = 4e-16
"""Relative bias per rotation: four times the measured one, and the most that `BIASED` explains."""
SIDE_BY_SIDE = 8
"""Orbits in a part of the work."""


def symmetries(scene: Scene) -> Trial:
    """Trial of all symmetries, on a few orbits."""
    return Trial("symmetries", "all", SYMMETRIES, lambda: (_symmetric(scene), {}))


def _symmetric(scene: Scene) -> list[float]:
    """Measured values for the claims `SYMMETRIES`, in their order.

    Orbits start beside separatrix 2 with M . gamma from 0 to J2/2.
    """
    each = zip(np.linspace(0, scene.J2 / 2, FEW), np.linspace(0.1, 6.2, FEW), strict=True)
    begun = [Place("", 2, 1e-4, scene.J2, 1e-6, J3).state(scene.body, x) for J3, x in each]
    c, states = scene.c, np.stack(begun, axis=1)

    plain, mirrored = (
        followed(scene, Orbits(c, x, 5, 300 / scene.u)) for x in (states, MIRROR[:, None] * states)
    )
    other = plain.separatrix != MIRRORED[mirrored.separatrix]
    # An orbit backward in time is the image of the orbit of the reversed state forward in time.
    times = np.linspace(0, BACK, 7)
    forward = states_at(c, REVERSAL[:, None] * states, times)
    backward = states_at(c, states, -times)
    # Forward and back again: the distance from the start over the predicted rounding errors.
    there = states_at(c, states, [BACK])[:, 0]
    missed = np.abs(states_at(c, there, [-BACK])[:, 0] - states).max(axis=0)
    *_, carried = deviations(scene, there, -BACK)
    return [
        float(((plain.time != mirrored.time) | other).sum()),
        float((REVERSAL[:, None, None] * forward != backward).sum()),
        float(np.max(missed / carried[-1].max(axis=0))),
    ]


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """Trials of the integrals at the finest tolerance and at the default one."""
    sizes, scene = asked.long_time, scenes.of_problem(asked, jobs)
    for tolerance in (FINEST_TOLERANCE["taylor"], DEFAULT_TOLERANCE["taylor"]):
        yield drift_trial(scene, tolerance, sizes.rotations, sizes.orbits)


def integrals(scene: Scene, M: Array, gamma: Array) -> Array:
    """Energy over h0, |gamma| and M . gamma over |M|, (3, ...), from physical vectors."""
    A, r, mu = scene.body.floats()
    # To first order |gamma|^2/2 deviates from 1/2 by as much as |gamma| from 1.
    parts = (gamma**2).sum(axis=0) / 2, (M * gamma).sum(axis=0) * float(scale(A)) / scene.J2
    return np.stack((energy(M, gamma, A, r, mu) / scene.h0, *parts))


def drift_trial(scene: Scene, tolerance: float, rotations: int, orbits: int) -> Trial:
    """Trial of the drift of integrals: a random walk at the finest local tolerance.

    A coarser tolerance has a declared bias.
    """
    name, biased = f"taylor at {tolerance:.1e}", tolerance > FINEST_TOLERANCE["taylor"]
    marks = np.r_[0.0, np.geomspace(1, rotations, POINTS)] * scene.rotation
    steps, at = marks[1:] / step(scene.u), marks[1:] / scene.rotation
    walk = NOISE * np.sqrt(steps)
    claims = [
        claim
        for integral in INTEGRALS
        for claim in _walk_claims(f"{name}, {integral}", at, walk[-1], orbits, biased)
    ]

    def measure() -> Findings:
        drift = _drift(scene, tolerance, marks, orbits)
        powers = np.array([slope(at, row) for row in drift])
        curve = {"name": name, "rotations": at, "drift": drift, "walk": walk, "power": powers}
        each = zip(powers, drift[:, -1], strict=True)
        return [x for power, size in each for x in (abs(power - 0.5), size)], curve

    return Trial("long_time", f"taylor {tolerance:.1e}", claims, measure)


def _walk_claims(
    name: str, rotations: Array, walk: float, orbits: int, biased: bool
) -> Iterator[Claim]:
    """Claims of the fitted power and of the size of a drift."""
    # An rms of n values errs by 1/sqrt(2 n), a slope between two by 1/sqrt(n) over this reach.
    reach = float(np.ptp(np.log(rotations[_late(rotations)])))
    spread, most = SIGMAS / math.sqrt(orbits) / reach, FACTOR * float(walk)
    power = Claim(
        f"{name}: power",
        spread,
        "how far the fitted power of t is from 1/2",
        "four standard errors of a slope between two rms of so many random walks",
    )
    size = Claim(
        f"{name}: size",
        most,
        f"rms drift after {rotations[-1]:.0e} rotations, relative",
        "one rounding of each component a step, independent: sqrt(steps); series add some more",
    )
    for claim, up_to in (power, 0.5 + spread), (size, most + BIAS * float(rotations[-1])):
        yield claim._replace(limit=BIASED, up_to=up_to) if biased else claim


def _drift(scene: Scene, tolerance: float, marks: Array, orbits: int) -> Array:
    """Root mean square drifts of the integrals at all marks but the first, (3, k)."""
    # Orbits that pass the separatrices.
    starts = scene.starts(orbits, 1e-4, 0.2 * scene.J2)
    parts = spread(starts, -(-orbits // SIDE_BY_SIDE), axis=1)
    work = partial(states_at, scene.c, times=marks, tolerance=tolerance)
    found = side_by_side(work, (), False, parts, scene.jobs)
    # In long doubles, because rounding in the evaluation of the integrals would hide their drift.
    aligned = Aligned(*np.concatenate(found, axis=2).astype(np.longdouble))
    s = float(scale(scene.body.floats()[0]))
    there = integrals(scene, *body_from_aligned(aligned, scene.body.angles(113).alpha0, s))
    return np.sqrt(((there[:, 1:] - there[:, :1]) ** 2).mean(axis=2)).astype(float)


def _late(rotations: Array) -> Array:
    """Mask of the times to which a slope is fitted."""
    return np.asarray(rotations >= min(BEGIN, rotations[-1] / 10))


def slope(rotations: Array, row: Array) -> float:
    """The fitted power of t."""
    late = _late(rotations)
    return float(np.polyfit(np.log(rotations[late]), np.log(row[late]), 1)[0])
