"""Exact symmetries of the equations, kept by the computation.

Changes of sign round nothing, so reflection and time reversal must hold bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from rigidpend.experiments.stress import scenes
from rigidpend.experiments.stress.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.growth import (
    DEVIATIONS,
    NOISE,
    predicted_errors,
    step,
    with_tangent,
)
from rigidpend.experiments.stress.scenes import Place, Scene, followed, sampled, state
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.exact import PI, exact
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.cycle import MIRRORED
from rigidpend.routes.problem import RouteProblem

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
REVERSED = "numbers that differ between an orbit backwards and the reversed orbit forwards"
RETURNED = f"largest difference after t' = {BACK:g} and back, over its predicted root mean square"
CARRIED = "roundings on both ways, carried back to the start by the variational equations"
IN_UNITS = "largest phase error between both units, over its predicted root mean square"
STEPS = "no number rounds otherwise, but steps are of other length"
GROWN = "one orbit, whose roundings grow by three and a half a passage at most"
CLAIMS = (
    Claim("reflection", 0, "crossings that differ from those of the mirrored orbits", BITWISE),
    Claim("time reversal", 0, REVERSED, BITWISE),
    Claim("there and back", SIZED, RETURNED, CARRIED),
    Claim("units of 2 and 4", SIZED, IN_UNITS, STEPS),
    Claim("units of 1.37 and 0.73", SIZED, IN_UNITS, "two computations round independently"),
    Claim("theta2_0 + 2 pi", TURNED, "largest phase difference over ten symbols", GROWN, "rad"),
)


def trials(asked: Any, jobs: int) -> Iterator[Trial]:
    """All symmetries, on four orbits."""
    yield trial(scenes.of_problem(asked, jobs), 4)


def trial(scene: Scene, n: int) -> Trial:
    """All symmetries, on n orbits."""
    return Trial("symmetries", "all", CLAIMS, lambda: Findings(_measured(scene, n)))


def fan(scene: Scene, n: int) -> Array:
    """States (6, n) beside separatrix 2 with M . gamma from 0 to J2/2."""
    places = [Place("", 2, 1e-4, scene.J2, 1e-6, J3) for J3 in np.linspace(0, scene.J2 / 2, n)]
    each = zip(places, np.linspace(0.1, 6.2, n), strict=True)
    return np.stack([state(a, scene.body, x) for a, x in each], axis=1)


def _measured(scene: Scene, n: int) -> list[float]:
    """The values of `CLAIMS`, in their order."""
    c, states = scene.c, fan(scene, n)

    def follow(states: Array, coefficients: AlignedCoefficients = c, unit: float = 1) -> Crossings:
        found = followed(scene, Orbits(coefficients, states, 5, 300 / scene.u / unit))
        return found._replace(time=found.time * unit)

    plain, mirrored = follow(states), follow(MIRROR[:, None] * states)
    other = plain.separatrix != MIRRORED[mirrored.separatrix]
    predicted = predicted_errors(scene, states, plain.time)
    apart = [
        scenes.phase_errors(follow(*in_units(states, c, k, v), unit=k), plain, scene.rate)
        for k, v in UNITS
    ]
    return [
        float(((plain.time != mirrored.time) | other).sum()),
        _turned(states, scene),
        _returned(states, scene),
        *(float(np.max(x / predicted)) for x in apart),
        _full_turn(scene, n),
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


def _turned(states: Array, scene: Scene) -> float:
    """Numbers that differ: backwards in time is forwards in the mirror."""
    times = np.linspace(0, BACK, 7)
    forward, backward = (
        sampled(x, scene, t) for x, t in ((REVERSAL[:, None] * states, times), (states, -times))
    )
    return float((REVERSAL[:, None, None] * forward != backward).sum())


def _returned(states: Array, scene: Scene) -> float:
    """There and back again: what is not found again, over the roundings carried along."""
    there = sampled(states, scene, np.array([BACK]))[:, 0]
    missed = np.abs(sampled(there, scene, np.array([-BACK]))[:, 0] - states).max(axis=0)
    return float(np.max(missed / np.array([_carried(scene, x) for x in there.T])))


def _carried(scene: Scene, there: Array) -> float:
    """Size of roundings on the way back, root mean square.

    The tangent vectors of all six directions, each with a component's rounding: its growth from
    the far end bounds that from any place nearer.
    """
    field = with_tangent(scene.c)
    starts = [np.r_[there, v] for v in np.diag(there)]
    ends = np.array([states_at(field, y, [-BACK])[6:, 0] for y in starts])
    return NOISE * math.sqrt(BACK / step(scene.u) * (ends**2).sum(axis=0).max())


def _full_turn(scene: Scene, n: int) -> float:
    """The largest phase difference: theta2_0 and theta2_0 + 2 pi are one orbit."""
    problem = RouteProblem(scene.body, exact(scene.h0), exact("1e-8"), 10)
    phases = [exact(f"{k}/7") for k in range(1, n + 1)]
    once, again = (
        scenes.routes(problem, x, scene.jobs).crossing_time
        for x in (phases, [x + 2 * PI for x in phases])
    )
    return float(scene.J2 * scene.body.kappa * np.abs(once - again).max())
