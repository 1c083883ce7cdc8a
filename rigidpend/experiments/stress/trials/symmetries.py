"""Exact symmetries of the equations, kept by the computation.

Changes of sign round nothing, so reflection and time reversal must hold bit for bit.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.stress.trials.claims import Claim, Findings, Trial
from rigidpend.experiments.stress.trials.growth import (
    DEVIATIONS,
    noise,
    predicted_errors,
    step,
    with_tangent,
)
from rigidpend.experiments.stress.trials.scenes import (
    Place,
    Scene,
    Way,
    followed,
    phase_errors,
    state,
)
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import PI, exact
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.routes.codes import route_codes
from rigidpend.routes.cycle import MIRRORED

MIRROR = np.array([-1, -1, 1, 1, 1, -1])
"""Reflection in the plane of r: gamma3 and, M being axial, M1 and M2 change sign."""
REVERSAL = np.array([1, 1, -1, 1, 1, -1])
"""Time reversal (M changes sign), seen in that mirror: M3 and gamma3 change sign."""
BACK = 30.0
"""t' after which an orbit returns."""
BITWISE = "a change of sign rounds nothing: the same numbers, bit for bit"
"""Reason for bounds of zero."""


def fan(body: Body, n: int, J2: float) -> Array:
    """States (6, n) beside separatrix 2 with M . gamma from 0 to J2/2."""
    places = [Place("", 2, 1e-4, J2, 1e-6, J3) for J3 in np.linspace(0, J2 / 2, n)]
    phases = np.linspace(0.1, 6.2, n)
    return np.stack([state(a, body, x) for a, x in zip(places, phases, strict=True)], axis=1)


TURNED = 1e-5
"""Allowed angle between two computations of ten symbols in doubles, radians.

Times of the second crossing differ by 2e-11, as measured on 4,000 other orbits, and by three
and a half as much at each of the nine that follow, which makes 3e-6."""
SIZED = DEVIATIONS * math.sqrt(2)
"""Bound where two computations differ: the squares of their roundings add."""
CLAIMS = (
    Claim("reflection", 0, "crossings that differ from those of the mirrored orbits", BITWISE),
    Claim(
        "time reversal",
        0,
        "numbers that differ between an orbit backwards and the reversed orbit forwards",
        BITWISE,
    ),
    Claim(
        "there and back",
        SIZED,
        f"largest difference after t' = {BACK:g} and back, over its predicted root mean square",
        "roundings on both ways, carried back to the start by the variational equations",
    ),
    *(
        Claim(
            f"units of {units}",
            SIZED,
            "largest phase error between both units, over its predicted root mean square",
            why,
        )
        for units, why in (
            ("2 and 4", "no number rounds otherwise, but steps are of other length"),
            ("1.37 and 0.73", "two computations round independently"),
        )
    ),
    Claim(
        "theta2_0 + 2 pi",
        TURNED,
        "largest phase difference over ten symbols",
        "one orbit, whose roundings grow by three and a half a passage at most",
        "rad",
    ),
)


def trial(scene: Scene, n: int, way: Way) -> Trial:
    """All symmetries, on n orbits."""
    return Trial("all", CLAIMS, lambda: Findings(_measured(scene, n, way)))


def _measured(scene: Scene, n: int, way: Way) -> list[float]:
    """The values of `CLAIMS`, in their order."""
    c, states, rate = scene.c, fan(scene.body, n, scene.J2), scene.rate

    def follow(states: Array, coefficients: AlignedCoefficients = c, unit: float = 1) -> Crossings:
        found = followed(Orbits(coefficients, states, 5, 300 / scene.u / unit), way)
        return found._replace(time=found.time * unit)

    plain, mirrored = follow(states), follow(MIRROR[:, None] * states)
    predicted = predicted_errors(scene, states, plain.time, way.engine)
    other_units = [
        follow(*in_units(states, c, k, v), unit=k) for k, v in ((2.0, 4.0), (1.37, 0.73))
    ]
    return [
        _unequal(plain, mirrored._replace(separatrix=MIRRORED[mirrored.separatrix])),
        _turned(states, c, way.engine),
        _returned(states, scene, way.engine),
        *(float(np.max(phase_errors(other, plain, rate) / predicted)) for other in other_units),
        _full_turn(scene, n, way),
    ]


def _unequal(a: Crossings, b: Crossings) -> float:
    return float(((a.time != b.time) | (a.separatrix != b.separatrix)).sum())


def in_units(
    states: Array, c: AlignedCoefficients, momentum: float, vertical: float
) -> tuple[Array, AlignedCoefficients]:
    """The same orbits with M and gamma in other units; t' is then in units of 1/momentum."""
    # mu has the unit of M^2 over that of gamma.
    weight = momentum**2 / vertical
    forces = {name: getattr(c, name) * weight for name in ("force_p", "force_m", "mu_r1", "mu_r2")}
    units = np.array([momentum] * 3 + [vertical] * 3)[:, None]
    return units * states, c._replace(**forces)


def _turned(states: Array, c: AlignedCoefficients, engine: str) -> float:
    """Numbers that differ: backwards in time is forwards in the mirror."""
    times = np.linspace(0, BACK, 7)
    forward = integrate.sample_orbits(c, REVERSAL[:, None] * states, times, engine=engine)
    backward = integrate.sample_orbits(c, states, -times, engine=engine)
    return float((REVERSAL[:, None, None] * forward != backward).sum())


def _returned(states: Array, scene: Scene, engine: str) -> float:
    """There and back again: what is not found again, over the roundings carried along."""
    times, c = np.array([0.0, BACK]), scene.c
    there = integrate.sample_orbits(c, states, times, engine=engine)[:, -1]
    back = integrate.sample_orbits(c, there, times[::-1], engine=engine)[:, -1]
    missed = np.abs(back - states).max(axis=0)
    allowed = [_carried(scene, x, engine) for x in there.T]
    return float(np.max(missed / np.array(allowed)))


def _carried(scene: Scene, there: Array, engine: str) -> float:
    """Size of roundings on the way back, root mean square.

    The tangent vectors of all six directions, each with a component's rounding: its growth from
    the far end bounds that from any place nearer.
    """
    field, times = with_tangent(scene.c), np.array([BACK, 0.0])
    ends = [
        integrate.sample(field, np.r_[there, v], times, engine=engine)[6:, -1]
        for v in np.diag(there)
    ]
    return noise(engine) * math.sqrt(BACK / step(scene.u) * (np.array(ends) ** 2).sum(axis=0).max())


def _full_turn(scene: Scene, n: int, way: Way) -> float:
    """The largest phase difference: theta2_0 and theta2_0 + 2 pi are one orbit."""
    kappa, J2 = scene.body.kappa, scene.J2
    given: dict[str, Any] = {"h0": kappa * J2**2 / 2, "J1_0": "1e-8", "n_symbols": 10}
    phases = [exact(f"{k}/7") for k in range(1, n + 1)]
    once, again = (
        route_codes(scene.body, x, **given, **way._asdict())
        for x in (phases, [x + 2 * PI for x in phases])
    )
    return float(J2 * kappa * np.abs(once.crossing_time - again.crossing_time).max())
