"""Increments of theta3 along the heteroclinic orbits of each separatrix, by the full dynamics.

The surfaces cross at g = +-pi/2 on the section, so that two heteroclinic orbits remain of each
separatrix. Both are their own mirror images in time: theta3 grows by as much before the section as
after it. Where the surfaces coincide (in the Hess case, on separatrices 1 and 3) all orbits are
heteroclinic, and these are two of them.
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
from rigidpend.numbers import Array
from rigidpend.numbers.exact import Exact
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

The part before the start, which is left out, is exp(-DEPTH/2) = 3e-17 of the increment: below
rounding."""
NEAR, ROUNDED = 1e-12, 2e-15
"""Allowed distance of g from +-pi/2 at the section, radians: at least, and over nu^(3/2).

theta2 turns by nu `DEPTH`/pi on its way to the section, in as many more steps, and roundings of all
of these move g. With six nearly symmetric bodies, whose nu is 99 to 25,000, the largest of 32
distances that secants could not lessen was 3e-16 to 9e-16 nu^(3/2)."""
SECANTS, BEGINNINGS = 30, 8
"""Largest number of secant steps, and the number of phases from which they begin in turn."""
STEPS, TURN = 24, 8
"""Numbers of steps of the trapezoid rule in a time 2 pi/u: a constant one, and one for each turn.

Turns are those of theta2 in this time. An overtone of the rotation whose period is the step would
be summed as if it were constant, and in coarser steps likewise, so that no difference between sums
would show it. Overtones from the eighth on are below rounding."""


class Increments(NamedTuple):
    """Increments of theta3 along the separatrices 1, 2, 3, 4."""

    gained: Array
    """Increments along the orbits at g = pi/2 and g = -pi/2 of each separatrix, radians, (2, 4)."""
    error: Array
    """Error of the quadrature alone, estimated with coarser steps, radians, (2, 4)."""


def increments(body: Body, h0: Exact, arithmetic: Arithmetic) -> Increments:
    """Integrate theta3 along the heteroclinic orbits of energy h0 of all separatrices.

    Raises ArithmeticError if one of the orbits is not found.
    """
    found = np.zeros((2, 2, 4))
    for separatrix in (1, 2):
        s = surface(body, h0, 53, separatrix)
        both = np.array([_gain(s, g, arithmetic) for g in (math.pi / 2, -math.pi / 2)]).T
        # The reflection that takes 2 to 1 negates theta3, and so does the one from 2 to 4, 1 to 3.
        sense = {1: -1, 2: 1}[separatrix]
        found[:, :, separatrix - 1] = sense * both
        found[:, :, separatrix + 1] = -sense * both
    return Increments(found[0], np.abs(found[1]))


def phase_at_start(s: UnstableSurface, g: float, arithmetic: Arithmetic) -> tuple[float, float]:
    """Find theta2_0 of the orbit of S1- that meets the section at g, and its time t' up to there.

    By secants, which begin anew from another phase if an orbit misses the section. Raises
    ArithmeticError if no orbit is found.
    """
    m = numbers(s.bits)
    goal, depth, turn = m.mpf(g), m.mpf(DEPTH), 2 * m.pi
    near = max(NEAR, ROUNDED * float(s.p.nu) ** 1.5)
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
            if abs(gap) < near:
                return float(phase), float(points.time[0])
            if before is not None:
                slope = (gap - before[1]) / (phase - before[0])
            before = phase, gap
            phase -= gap / slope
    # If the periodic orbit has no unstable direction, and so no S1-, this raises that reason.
    periodic_orbit(Angles(*map(float, s.p)), float(s.h0))
    raise ArithmeticError(
        f"no orbit of S1- was found that meets the section at g = {g:.6f} before anywhere else"
    )


def _gain(s: UnstableSurface, g: float, arithmetic: Arithmetic) -> tuple[float, float]:
    """Increment of theta3 along an orbit, over both its halves, and its error, radians.

    The trapezoid rule converges exponentially on the whole line: with half the step its error is
    squared. Its nodes lie symmetrically about the section, so that the mirrored half has the same
    values.
    """
    theta2_0, time = phase_at_start(s, g, arithmetic)
    rate = float(exponent(J2_0(s), s.p, numbers(s.bits)))
    step = math.tau / (rate * (STEPS + TURN * float(s.p.nu) / math.pi))
    # Times before the section, in whole fours of steps: coarser sums take every second or fourth.
    before = step * np.arange(4 * int(time / (4 * step)))
    # The first value is that on the section, which belongs to both halves.
    turning = _turning(s, theta2_0, np.append(0.0, time - before[::-1]), arithmetic)[:0:-1]
    fine, coarse, coarser = (
        float(step * every * (2 * turning[::every].sum() - turning[0])) for every in (1, 2, 4)
    )
    change, before_that = abs(fine - coarse), abs(coarse - coarser)
    # The errors are C q, C q^2 and C q^4 with ever finer steps: the last follows from the first two
    # and q from their ratio. If the changes are rounding, they give no ratio below 1.
    q = min(1.0, change / before_that) if before_that else 1.0
    return fine, change * q**2


def _turning(s: UnstableSurface, theta2_0: float, times: Array, arithmetic: Arithmetic) -> Array:
    """Rate of theta3 along the orbit of S1- with phase theta2_0, radians per t', at `times`."""
    p = s.p
    state = np.array([float(x) for x in launch(s, theta2_0, DEPTH)])
    floats = AlignedCoefficients(*map(float, coefficients(s)))
    orbit = states_at(
        floats, state, times, engine=arithmetic.engine, tolerance=arithmetic.tolerance
    )
    M, _ = body_from_aligned(Aligned(*orbit), float(p.alpha0), 1.0)
    r = math.cos(float(p.beta0) / 2), math.sin(float(p.beta0) / 2), 0.0
    # From dimensionless M follows the rate in t', and not in physical t.
    return np.asarray(turning_rate(M, r, float(p.mu)))
