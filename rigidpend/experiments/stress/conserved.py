"""Conserved quantities, kept by the computation: symmetries, and integrals over 1e6 rotations.

Changes of sign round nothing, so reflection and time reversal must hold bit for bit. Integrals of
motion drift as roundings walk; so does the period of the pendulum.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.stress import passages, scenes
from rigidpend.experiments.stress.passages import DEVIATIONS, NOISE, SIGMAS, step
from rigidpend.experiments.stress.scenes import Claim, Findings, Place, Scene, Trial, followed
from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import AlignedCoefficients, energy
from rigidpend.numbers.exact import PI, exact
from rigidpend.numbers.generic import Array, Scalar
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.orbits.integrate.arithmetic import DEFAULT_TOLERANCE, FINEST_TOLERANCE
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.cycle import MIRRORED
from rigidpend.routes.problem import RouteProblem, rotation_period

FEW = 4
"""Orbits that show the symmetries."""
MIRROR = np.array([-1, -1, 1, 1, 1, -1])
"""Reflection in the plane of r: gamma3 and, M being axial, M1 and M2 change sign."""
REVERSAL = np.array([1, 1, -1, 1, 1, -1])
"""Time reversal (M changes sign), seen in that mirror: M3 and gamma3 change sign."""
BACK = 30.0
"""t' after which an orbit returns."""
UNITS = ((2.0, 4.0), (1.37, 0.73))
"""Other units of M and of gamma: powers of two, and others."""
TURNED = 1e-5
"""Allowed angle between two computations of ten symbols in doubles, radians.

Times of the second crossing differ by 2e-11, as measured on 4,000 other orbits, and by three
and a half as much at each of the nine that follow, which makes 3e-6."""
SIZED = DEVIATIONS * math.sqrt(2)
"""Bound where two computations differ: the squares of their roundings add."""
BITWISE = "a change of sign rounds nothing: the same numbers, bit for bit"
IN_UNITS = "largest phase error between both units, over its predicted root mean square"
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
    Claim(
        "units of 2 and 4", SIZED, IN_UNITS,
        "no number rounds otherwise, but steps are of other length",
    ),
    Claim(
        "units of 1.37 and 0.73", SIZED, IN_UNITS, "two computations round independently"
    ),
    Claim(
        "theta2_0 + 2 pi", TURNED, "largest phase difference over ten symbols",
        "one orbit, whose roundings grow by three and a half a passage at most", "rad",
    ),
)  # fmt: skip

INTEGRALS = ("energy", "gamma", "M.gamma")
"""Integrals of motion, in the order of :func:`integrals`."""
POINTS = 61
"""Times at which the integrals are looked at, evenly spread in their logarithm."""
BEGIN = 100
"""Rotations from which on a slope is fitted: before, evaluation shows more than drift."""
FACTOR = 4.0
"""Allowed factor of a drift above the predicted random walk."""
BIASED = (
    "the series' truncation at the default tolerance, chosen for routes of some hundred t', has"
    " a bias of 1e-16 a rotation in |gamma|; for long times take the finest tolerance"
)
BIAS = 4e-16
"""A rotation, relative: four times what was measured, and the most that `BIASED` explains."""
SIDE_BY_SIDE = {"taylor": 8, "scipy": 2}
"""Orbits in a part of the work; those of one part share their steps with `scipy`."""
PERIOD = Claim(
    "pendulum at J1 = 0",
    FACTOR,
    "phase error after any number of periods, over the predicted root mean square",
    "roundings of J2 walk, and the phase adds them up: t sqrt(steps/3); the period is rounded",
)


def symmetries(scene: Scene) -> Trial:
    """All symmetries, of a few orbits."""
    return Trial("symmetries", "all", SYMMETRIES, lambda: (_symmetric(scene), {}))


def _symmetric(scene: Scene) -> list[float]:
    """The values of `SYMMETRIES`, in their order.

    Orbits start beside separatrix 2 with M . gamma from 0 to J2/2.
    """
    each = zip(np.linspace(0, scene.J2 / 2, FEW), np.linspace(0.1, 6.2, FEW), strict=True)
    begun = [Place("", 2, 1e-4, scene.J2, 1e-6, J3).state(scene.body, x) for J3, x in each]
    c, states = scene.c, np.stack(begun, axis=1)

    def follow(states: Array, coefficients: AlignedCoefficients = c, unit: float = 1) -> Crossings:
        found = followed(scene, Orbits(coefficients, states, 5, 300 / scene.u / unit))
        return found._replace(time=found.time * unit)

    plain, mirrored = follow(states), follow(MIRROR[:, None] * states)
    other = plain.separatrix != MIRRORED[mirrored.separatrix]
    predicted = passages.predicted_errors(scene, states, plain.time)
    apart = [
        scenes.phase_errors(follow(*in_units(states, c, k, v), unit=k), plain, scene.rate)
        for k, v in UNITS
    ]
    # Backwards in time is forwards in the mirror.
    times = np.linspace(0, BACK, 7)
    forward = states_at(c, REVERSAL[:, None] * states, times)
    backward = states_at(c, states, -times)
    # There and back again: what is not found again, over the roundings carried along.
    there = states_at(c, states, [BACK])[:, 0]
    missed = np.abs(states_at(c, there, [-BACK])[:, 0] - states).max(axis=0)
    *_, carried = passages.deviations(scene, there, -BACK)
    return [
        float(((plain.time != mirrored.time) | other).sum()),
        float((REVERSAL[:, None, None] * forward != backward).sum()),
        float(np.max(missed / carried[-1].max(axis=0))),
        *(float(np.max(x / predicted)) for x in apart),
        _full_turn(scene),
    ]


def in_units(
    states: Array, c: AlignedCoefficients, momentum: float, vertical: float
) -> tuple[Array, AlignedCoefficients]:
    """The same orbits with M and gamma in other units; t' is then in units of 1/momentum."""
    # mu has the unit of M^2 over that of gamma.
    weight = momentum**2 / vertical
    forces = {name: getattr(c, name) * weight for name in ("force_p", "force_m", "mu_r1", "mu_r2")}
    units = np.array([momentum] * 3 + [vertical] * 3)[:, None]
    return units * states, c._replace(**forces)


def _full_turn(scene: Scene) -> float:
    """The largest phase difference: theta2_0 and theta2_0 + 2 pi are one orbit."""
    problem = RouteProblem(scene.body, exact(scene.h0), exact("1e-8"), 10)
    phases = [exact(f"{k}/7") for k in range(1, FEW + 1)]
    once, again = (
        scenes.routes(problem, x, scene.jobs).crossing_time
        for x in (phases, [x + 2 * PI for x in phases])
    )
    return float(scene.J2 * scene.body.kappa * np.abs(once - again).max())


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """The pendulum's period; integrals with each engine."""
    sizes, scene = asked.long_time, scenes.of_problem(asked, jobs)
    yield pendulum_trial(asked.body, asked.h0, jobs, sizes.rotations // 3)
    yield engine_trial(scene, "scipy", DEFAULT_TOLERANCE["scipy"], sizes.rotations_scipy, 4)
    for tolerance in (FINEST_TOLERANCE["taylor"], DEFAULT_TOLERANCE["taylor"]):
        yield engine_trial(scene, "taylor", tolerance, sizes.rotations, sizes.orbits)


def passing(scene: Scene, n: int) -> Array:
    """Orbits that pass the separatrices, with M . gamma = 0.2 |M|: aligned components, (6, n)."""
    return scene.starts(n, 1e-4, 0.2 * scene.J2)


def integrals(scene: Scene, M: Array, gamma: Array) -> Array:
    """Energy over h0, |gamma| and M . gamma over |M|, (3, ...), from physical vectors."""
    A, r, mu = scene.body.floats()
    # Half of |gamma|^2 deviates from 1/2 as |gamma| from 1.
    parts = (gamma**2).sum(axis=0) / 2, (M * gamma).sum(axis=0) * float(scale(A)) / scene.J2
    return np.stack((energy(M, gamma, A, r, mu) / scene.h0, *parts))


def engine_trial(scene: Scene, engine: str, tolerance: float, rotations: int, orbits: int) -> Trial:
    """Drift of the integrals with an engine: a random walk at its finest tolerance.

    The tolerance is local; a coarser one than the finest has a declared bias.
    """
    name = f"{engine} at {tolerance:.1e}"
    marks = np.r_[0.0, np.geomspace(1, rotations, POINTS)] * scene.rotation
    steps, at = marks[1:] / step(scene.u), marks[1:] / scene.rotation
    walk = NOISE * np.sqrt(steps)
    if engine == "taylor":
        biased = tolerance > FINEST_TOLERANCE[engine]
        claims = [
            claim
            for integral in INTEGRALS
            for claim in _walk_claims(f"{name}, {integral}", at, walk[-1], orbits, biased)
        ]
    else:
        claims = [
            Claim(
                f"{name}, {integral}",
                1.0,
                "largest ratio of the rms drift to the tolerances of all steps added up",
                "every step keeps its tolerance, and no integral leans on a component more than"
                " once",
            )
            for integral in INTEGRALS
        ]

    def measure() -> Findings:
        drift = _engine_drift(scene, engine, tolerance, marks, orbits)
        powers = np.array([slope(at, row) for row in drift])
        curve = {"name": name, "rotations": at, "drift": drift, "walk": walk, "power": powers}
        if engine == "taylor":
            each = zip(powers, drift[:, -1], strict=True)
            return [x for power, size in each for x in (abs(power - 0.5), size)], curve
        return (drift / (tolerance * steps)).max(axis=1), curve

    return Trial("long_time", f"{engine} {tolerance:.1e}", claims, measure)


def _walk_claims(
    name: str, rotations: Array, walk: float, orbits: int, biased: bool
) -> Iterator[Claim]:
    """Claims of the fitted power and of the size of a drift."""
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


def _engine_drift(scene: Scene, engine: str, tolerance: float, marks: Array, orbits: int) -> Array:
    """Root mean square drifts of the integrals at all marks but the first, (3, k)."""
    parts = spread(passing(scene, orbits), -(-orbits // SIDE_BY_SIDE[engine]), axis=1)
    work = partial(states_at, scene.c, times=marks, engine=engine, tolerance=tolerance)
    found = side_by_side(work, (), engine == "scipy", parts, scene.jobs)
    # In long doubles, or the evaluation of the integrals would hide their drift.
    aligned = Aligned(*np.concatenate(found, axis=2).astype(np.longdouble))
    s = float(scale(scene.body.floats()[0]))
    there = integrals(scene, *body_from_aligned(aligned, scene.body.alpha0, s))
    return np.sqrt(((there[:, 1:] - there[:, :1]) ** 2).mean(axis=2)).astype(float)


def _late(rotations: Array) -> Array:
    """Mask of the times to which a slope is fitted."""
    return np.asarray(rotations >= min(BEGIN, rotations[-1] / 10))


def slope(rotations: Array, row: Array) -> float:
    """The fitted power of t."""
    late = _late(rotations)
    return float(np.polyfit(np.log(rotations[late]), np.log(row[late]), 1)[0])


def pendulum_trial(body: Body, h0: Scalar, jobs: int, rotations: int) -> Trial:
    """The motion with J1 = 0 over many periods of (sol_3): after each it is where it was."""

    def measure() -> Findings:
        # J1_0 and the number of symbols have no part in the period.
        period = rotation_period(RouteProblem(body, exact(h0), exact("1e-8"), 1))
        p, lowest = body.angles(), -np.array(body.floats()[1])
        # From the lowest position, where the kinetic energy is h0 + mu.
        J2 = math.sqrt(2 * (float(h0) + p.mu) / p.kappa)
        counts = np.unique(np.geomspace(1, rotations, POINTS).astype(int))
        times, start = np.r_[0.0, counts] * period, np.r_[0.0, 0.0, -J2, lowest]
        scene = Scene(body, J2, jobs)
        gamma = states_at(scene.c, start, times)[3:, 1:]
        # The angle from the lowest position, to which every whole period returns.
        phase = np.abs(np.arctan2(lowest[0] * gamma[1] - lowest[1] * gamma[0], lowest @ gamma))
        times = times[1:]
        walk = NOISE * np.sqrt(times / step(scene.u) / 3)
        # The rounding of the period itself adds up as well, in proportion to the time.
        walk = p.kappa * J2 * times * (walk + 2.0**-52)
        return [np.max(phase / walk)], {}

    return Trial("long_time", "pendulum", (PERIOD,), measure)
