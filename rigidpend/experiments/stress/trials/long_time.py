"""Integrals over up to 1e6 rotations, with engines and splittings; the pendulum's period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data import layout
from rigidpend.experiments.data.tree import Dataset
from rigidpend.experiments.lie_poisson import splitting, stages
from rigidpend.experiments.stress.layout import DRIFT, PENDULUM
from rigidpend.experiments.stress.trials.claims import Claim, Findings, Limit, Trial
from rigidpend.experiments.stress.trials.growth import ROUNDING, noise, step
from rigidpend.experiments.stress.trials.scenes import Place, Scene, Way, at_random
from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import energy
from rigidpend.numbers.exact import Exact, exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import FINEST_TOLERANCE
from rigidpend.routes.problem import RouteProblem, rotation_period

Array = NDArray[Any]

INTEGRALS = ("energy", "gamma", "M.gamma")
"""Integrals of motion, in the order of `Setting.integrals`."""
POINTS = 61
"""Times at which the integrals are looked at, evenly spread in their logarithm."""
BEGIN = 100
"""Rotations from which on a slope is fitted: before, evaluation shows more than drift."""
FACTOR = 4.0
"""Allowed factor of a drift above the predicted random walk."""
SIGMAS = 4.0
"""Standard errors by which a fitted power may miss 1/2."""
BIASED = (
    "the series' truncation at the default tolerance, chosen for routes of some hundred t', has"
    " a bias of 1e-16 a rotation in |gamma|; for long times take the finest tolerance"
)
BIAS = 4e-16
"""A rotation, relative: four times what was measured, and the most that `BIASED` explains."""
ENERGIES = {2: 1.6e-3, 4: 5e-6, 6: 9e-7, 8: 4e-8}
"""Bound of the energy's error for a splitting of each order, relative to h0.

It is two and a half times what two other sets of 16 orbits showed (6.6e-4, 2.0e-6, 3.7e-7,
1.7e-8)."""
STEPS = {2: 1 / 50, 4: 1 / 25, 6: 1 / 15, 8: 1 / 10}
"""Length of a step of each order, in rotations: errors of the energy from 1e-4 to 1e-10."""
SIDE_BY_SIDE = {"taylor": 8, "scipy": 2}
"""Orbits in a part of the work; those of one part share their steps with `scipy`."""
SUBSTEPS = 6
"""Substeps of a splitting of order 2, the neighbouring kicks being one."""


class Setting(NamedTuple):
    """Orbits that pass the separatrices, with M . gamma = 0.2 |M|."""

    scene: Scene
    seed: int

    def states(self, n: int) -> Array:
        """Aligned components of n orbits, (6, n)."""
        body, J2 = self.scene
        return at_random(Place("", 2, 1e-4, J2 - 1e-4, 0.0, 0.2 * J2), body, n, self.seed)

    @property
    def rotation(self) -> float:
        """t' of a rotation without weight."""
        return 2 * math.pi / (self.scene.body.kappa * self.scene.J2)

    @property
    def moments(self) -> Array:
        """A1, A2 and A3, floats."""
        return np.array([float(x) for x in self.scene.body.A])

    def integrals(self, M: Array, gamma: Array) -> Array:
        """Energy over h0, |gamma| and M . gamma over |M|, (3, ...), from physical vectors."""
        body, J2 = self.scene
        s = float(scale(self.moments))
        h = energy(M, gamma, self.moments, unit_r(body), float(body.mu))
        h0 = body.kappa * J2**2 / 2
        # Half of |gamma|^2 deviates from 1/2 as |gamma| from 1.
        return np.stack((h / h0, (gamma**2).sum(axis=0) / 2, (M * gamma).sum(axis=0) * s / J2))


def engine_trial(
    setting: Setting, way: Way, tolerance: float, *, rotations: int, orbits: int
) -> Trial:
    """Drift of the integrals with an engine: a random walk at its finest tolerance.

    The tolerance is local; a coarser one than the finest has a declared bias.
    """
    engine = way.engine
    name = f"{engine} at {tolerance:.1e}"
    marks = np.r_[0.0, np.geomspace(1, rotations, POINTS)] * setting.rotation
    steps, at = marks[1:] / step(setting.scene.u), marks[1:] / setting.rotation
    walk = ROUNDING * 2.0**-52 * np.sqrt(steps)
    named = [f"{name}, {integral}" for integral in INTEGRALS]
    if engine == "taylor":
        biased = tolerance > FINEST_TOLERANCE[engine]
        claims = [x for each in named for x in _walk_claims(each, at, walk, orbits, biased)]
    else:
        claims = [_tolerated(each) for each in named]

    def measure() -> Findings:
        drift = _engine_drift(setting, way, tolerance, marks, orbits)
        if engine == "taylor":
            values = [x for row in drift for x in (abs(slope(at, row)[0] - 0.5), row[-1])]
        else:
            values = [(row / (tolerance * steps)).max() for row in drift]
        return Findings(values, _curves(name, at, drift, walk))

    return Trial(f"{engine} {tolerance:.1e}", tuple(claims), measure)


def _engine_drift(setting: Setting, way: Way, tolerance: float, marks: Array, orbits: int) -> Array:
    """Root mean square drifts of the integrals at all marks but the first, (3, k)."""
    engine, scene, states = way.engine, setting.scene, setting.states(orbits)
    parts = spread(states, -(-orbits // SIDE_BY_SIDE[engine]), axis=1)
    given = scene.c, marks, engine, tolerance
    found = side_by_side(_sampled, given, engine == "scipy", parts, way.jobs)
    # In long doubles, or the evaluation of the integrals would hide their drift.
    aligned = Aligned(*np.concatenate(found, axis=2).astype(np.longdouble))
    s = float(scale(setting.moments))
    return _drift(setting.integrals(*body_from_aligned(aligned, scene.body.alpha0, s)))


def _sampled(states: Array, c: Any, marks: Array, engine: str, tolerance: float) -> Array:
    return integrate.sample_orbits(c, states, marks, engine=engine, tolerance=tolerance)


def _drift(integrals: Array) -> Array:
    """Root mean square over the orbits of what integrals (3, k + 1, n) drift: (3, k)."""
    apart = integrals[:, 1:] - integrals[:, :1]
    return np.sqrt((apart**2).mean(axis=2)).astype(float)


def _late(rotations: Array) -> Array:
    """Mask of the times to which a slope is fitted."""
    return np.asarray(rotations >= min(BEGIN, rotations[-1] / 10))


def slope(rotations: Array, row: Array) -> tuple[float, float]:
    """The fitted power of t, and ln of the range fitted."""
    late = _late(rotations)
    x = np.log(rotations[late])
    return float(np.polyfit(x, np.log(row[late]), 1)[0]), float(np.ptp(x))


def _walk_claims(
    name: str, rotations: Array, walk: Array, orbits: int, biased: bool
) -> tuple[Claim, Claim]:
    reach = float(np.ptp(np.log(rotations[_late(rotations)])))
    spread, most = SIGMAS / math.sqrt(orbits) / reach, FACTOR * float(walk[-1])
    return (
        Claim(
            f"{name}: power",
            spread,
            "how far the fitted power of t is from 1/2",
            "four standard errors of a slope between two rms of so many random walks",
            limit=Limit(BIASED, 0.5 + spread) if biased else None,
        ),
        Claim(
            f"{name}: size",
            most,
            f"rms drift after {rotations[-1]:.0e} rotations, relative",
            "one rounding of each component a step, independent: sqrt(steps); series add some more",
            limit=Limit(BIASED, most + BIAS * float(rotations[-1])) if biased else None,
        ),
    )


def _tolerated(name: str) -> Claim:
    return Claim(
        name,
        1.0,
        "largest ratio of the rms drift to the tolerances of all steps added up",
        "every step keeps its tolerance, and no integral leans on a component more than once",
    )


def _curves(name: str, rotations: Array, drift: Array, walk: Array) -> dict[str, Dataset]:
    powers = np.array([slope(rotations, row)[0] for row in drift])
    values = {"name": name, "rotations": rotations, "drift": drift, "walk": walk, "power": powers}
    return layout.datasets(DRIFT, values)


def splitting_trial(setting: Setting, *, order: int, rotations: int, orbits: int) -> Trial:
    """A Lie-Poisson splitting: energy bounded, |gamma| and M . gamma kept to rounding."""
    name = f"splitting {order}"
    counts = np.unique(np.geomspace(1, max(10, rotations / STEPS[order]), POINTS).astype(int))
    walk = ROUNDING * 2.0**-52 * np.sqrt(counts * SUBSTEPS * stages(order))
    at = counts * STEPS[order]

    def measure() -> Findings:
        drift = splitting_drift(setting, order, counts, orbits)
        return Findings([drift[0].max(), *drift[1:, -1]], _curves(name, at, drift, walk))

    return Trial(name, _splitting_claims(name, order, at, walk), measure)


def _splitting_claims(name: str, order: int, at: Array, walk: Array) -> tuple[Claim, ...]:
    return (
        Claim(
            f"{name}, energy",
            ENERGIES[order],
            "largest rms error of the energy at any time, relative to h0",
            "a Poisson map keeps a nearby energy, of a distance of the step's power: its error"
            " comes and goes, and does not grow",
        ),
        *(
            Claim(
                f"{name}, {integral}",
                FACTOR * float(walk[-1]),
                f"rms drift after {at[-1]:.0f} rotations, relative",
                "turns and kicks keep it exactly; what is left is one rounding a substep",
            )
            for integral in INTEGRALS[1:]
        ),
    )


def splitting_drift(setting: Setting, order: int, counts: Any, orbits: int) -> Array:
    """Root mean square drifts of the integrals after so many steps, (3, k)."""
    s, body = float(scale(setting.moments)), setting.scene.body
    made = splitting(setting.moments, unit_r(body), float(body.mu), order)
    vectors = body_from_aligned(Aligned(*setting.states(orbits)), body.alpha0, s)
    # Splittings know physical time alone.
    h = STEPS[order] * setting.rotation / s
    now: list[Any] = [np.stack(pair) for pair in zip(*vectors, strict=True)]
    kept = [setting.integrals(*_pair(now))]
    for steps in np.diff(counts, prepend=0):
        now = made.advance(now, h, int(steps))
        kept.append(setting.integrals(*_pair(now)))
    return _drift(np.stack(kept, axis=1))


def _pair(components: Sequence[Array]) -> tuple[Array, Array]:
    """M and gamma, in long doubles, from 3 arrays (2, n)."""
    M, gamma = np.stack(components, axis=1).astype(np.longdouble)
    return M, gamma


def unit_r(body: Body) -> Array:
    """r, in floats."""
    return np.array([float(x) for x in body.r])


PERIOD = Claim(
    "pendulum at J1 = 0",
    FACTOR,
    "phase error after any number of periods, over the predicted root mean square",
    "roundings of J2 walk, and the phase adds them up: t sqrt(steps/3); the period is rounded",
)


def pendulum_trial(body: Body, h0: Scalar, engine: str, *, rotations: int) -> Trial:
    """The motion with J1 = 0 over many periods of (sol_3): after each it is where it was."""

    def measure() -> Findings:
        counts, times, phase, walk = _followed(body, exact(h0), rotations, engine)
        worst = int(np.argmax(phase / walk))
        curves = layout.datasets(PENDULUM, {"rotations": counts, "phase": phase, "walk": walk})
        said = f"{phase[worst]:.1e} rad at {counts[worst]} of {counts[-1]}, t' = {times[-1]:.1e}"
        return Findings([phase[worst] / walk[worst]], curves, [said])

    return Trial("pendulum", (PERIOD,), measure)


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
