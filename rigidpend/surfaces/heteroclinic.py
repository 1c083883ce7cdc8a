"""Increments of theta3 along the heteroclinic orbits of each separatrix, by the full dynamics.

The surfaces cross at g = +-pi/2 on the section, so that each separatrix leaves two heteroclinic
orbits, both their own mirror images in time: theta3 gains as much before the section as after
it. Where the surfaces coincide (Hess, separatrices 1 and 3) every orbit is heteroclinic and
these two are two of them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.mechanics.floquet import periodic_orbit
from rigidpend.mechanics.free_body import exponent
from rigidpend.mechanics.in_space import turning_rate
from rigidpend.numbers.exact import Exact
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.orbits.integrate.states import states_at
from rigidpend.surfaces.surface_orbits import (
    J2_0,
    UnstableSurface,
    coefficients,
    lag,
    launch,
    meet,
    numbers,
    surface,
)

DEPTH = 76.0
"""Depth of the start, -ln(J1/J2).

What is left out before the start is exp(-DEPTH/2) = 3e-17 of the increment, below rounding."""
NEAR = 1e-12
"""Allowed distance of g from +-pi/2 at the section, radians."""
SECANTS, BEGINNINGS = 30, 8
"""Secant steps at most, and the number of phases from which they begin in turn."""
STEPS, TURN = 24, 8
"""Steps of the trapezoid rule in a time 2 pi/u, plus so many for each turn of theta2 in it.

An overtone of the rotation that falls on the steps is summed as if it were constant, in coarser
steps as well, so that no difference tells. Those from the eighth on are below rounding."""


class Increments(NamedTuple):
    """Increments of theta3 along the separatrices 1, 2, 3, 4."""

    gained: Array
    """Increments along the orbits at g = pi/2 and g = -pi/2 of each separatrix, radians, (2, 4)."""
    error: Array
    """Error of the quadrature alone, from coarser steps, radians, (2, 4)."""


def increments(body: Body, h0: Exact, arithmetic: Arithmetic) -> Increments:
    """Integrate the heteroclinic orbits of energy h0 of all separatrices.

    ArithmeticError is raised where one was not found.
    """
    found = np.zeros((2, 2, 4))
    for separatrix in (1, 2):
        s = surface(body, h0, 53, separatrix)
        both = np.array([_gain(s, g, arithmetic) for g in (math.pi / 2, -math.pi / 2)]).T
        # The reflection that makes 1 of 2 turns the sense of theta3, and so does 2 to 4, 1 to 3.
        sense = {1: -1, 2: 1}[separatrix]
        found[:, :, separatrix - 1] = sense * both
        found[:, :, separatrix + 1] = -sense * both
    return Increments(found[0], np.abs(found[1]))


def phase_at_start(s: UnstableSurface, g: float, arithmetic: Arithmetic) -> tuple[float, float]:
    """Find theta2_0 of the orbit of S1- that meets the section at g, and its time, by secants."""
    m = numbers(s.bits)
    goal, depth, turn = m.mpf(g), m.mpf(DEPTH), 2 * m.pi
    for k in range(BEGINNINGS):
        # Without weight g is the phase at the start plus a constant: the first slope is 1.
        phase, slope = goal - lag(s, depth) + k * turn / BEGINNINGS, m.mpf(1)
        before: tuple[Any, Any] | None = None
        for _ in range(SECANTS):
            points = meet(s, [phase], depth, arithmetic)
            if points is None:
                break
            gap = points.phase[0] - goal
            gap -= turn * m.nint(gap / turn)
            if abs(gap) < NEAR:
                return float(phase), float(points.time[0])
            if before is not None:
                slope = (gap - before[1]) / (phase - before[0])
            before = phase, gap
            phase -= gap / slope
    # The reason, where it is that a periodic orbit without an unstable direction has no S1-.
    periodic_orbit(Angles(*map(float, s.p)), float(s.h0))
    raise ArithmeticError(
        f"no orbit of S1- was found that meets the section at g = {g:.6f} before anywhere else"
    )


def _gain(s: UnstableSurface, g: float, arithmetic: Arithmetic) -> tuple[float, float]:
    """Increment of theta3 over both halves of an orbit, and its error.

    The trapezoid rule converges exponentially on the whole line: half the step squares what it
    errs by. Its nodes lie evenly about the section, so the mirrored half has the same values.
    """
    theta2_0, time = phase_at_start(s, g, arithmetic)
    rate = float(exponent(J2_0(s), s.p, numbers(s.bits)))
    step = math.tau / (rate * (STEPS + TURN * float(s.p.nu) / math.pi))
    before = step * np.arange(4 * int(time / (4 * step)))
    turning = _turning(s, theta2_0, np.append(0.0, time - before[::-1]), arithmetic)[:0:-1]
    fine, coarse, coarser = (
        float(step * every * (2 * turning[::every].sum() - turning[0])) for every in (1, 2, 4)
    )
    change, before_that = abs(fine - coarse), abs(coarse - coarser)
    # C q^4 from C q^2 and C q; where even that change is rounding, it tells no rate.
    rate = min(1.0, change / before_that) if before_that else 1.0
    return fine, change * rate**2


def _turning(s: UnstableSurface, theta2_0: float, times: Array, arithmetic: Arithmetic) -> Array:
    """Rate of theta3 along an orbit, radians per t'."""
    p = s.p
    state = np.array([float(x) for x in launch(s, theta2_0, DEPTH)])
    floats = AlignedCoefficients(*map(float, coefficients(s)))
    orbit = states_at(
        floats, state, times, engine=arithmetic.engine, tolerance=arithmetic.tolerance
    )
    M, _ = body_from_aligned(Aligned(*orbit), float(p.alpha0), 1.0)
    r = math.cos(float(p.beta0) / 2), math.sin(float(p.beta0) / 2), 0.0
    # Of dimensionless M it is the rate in t'.
    return np.asarray(turning_rate(M, r, float(p.mu)))
