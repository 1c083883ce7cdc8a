"""Increments of theta3 along the heteroclinic orbits of each separatrix, by the full dynamics.

The surfaces cross at g = +-pi/2 on the section, so that two heteroclinic orbits remain of each
separatrix. Both are their own mirror images in time: theta3 grows by as much before the section as
after it. Where the surfaces coincide (in the Hess case, on separatrices 1 and 3) all orbits are
heteroclinic, and these are two of them.
"""

import functools
import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, cos_sin_half
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
START = math.pi / 2
"""theta2 at the start, radians."""
NEAR, ROUNDED = 1e-12, 2e-15
"""Change of g, radians, at which the search for an orbit ends: at least, and over nu^(3/2).

theta2 turns by nu `DEPTH`/pi on its way to the section, in as many more steps, and roundings of all
of these move g: by 3e-16 to 1e-13 nu^(3/2) in bodies of nu from 99 to 25,000."""
LARGEST_OFF = 1e-3
"""Distance of g from its goal, radians, beyond which it jumps over it and no orbit meets it."""
PARTS = 64
"""Number of parts of a period in which an orbit is sought that is not near the unperturbed one."""
STEPS, TURN = 24, 8
"""Numbers of steps of the trapezoid rule in a time 2 pi/u: a constant one, and one for each turn.

Turns are those of theta2 in this time. An overtone of the rotation whose period is the step would
be summed as if it were constant, and in coarser steps likewise, so that no difference between sums
would show it. Overtones from the eighth on are below rounding."""


class Missed(ArithmeticError):
    """Error: an orbit that does not meet the section beside its separatrix before anywhere else."""


class Increments(NamedTuple):
    """Increments of theta3 along the separatrices 1, 2, 3, 4."""

    gained: Array
    """Increments along the orbits at g = pi/2 and g = -pi/2 of each separatrix, radians, (2, 4)."""
    error: Array
    """Errors of the quadrature, estimated with coarser steps, and by that of g, radians, (2, 4)."""


def increments(body: Body, h0: Exact, arithmetic: Arithmetic) -> Increments:
    """Integrate theta3 along the heteroclinic orbits of energy h0 of all separatrices.

    Raises ArithmeticError if one of the orbits is not found.
    """
    found = np.zeros((2, 2, 4))
    for separatrix in (1, 2):
        s = surface(body, h0, 53, separatrix)
        orbits = [_gain(s, g, arithmetic) for g in (math.pi / 2, -math.pi / 2)]
        gained, error, off = np.array(orbits).T
        # Increments depend on g as far as those of the two orbits differ.
        both = np.array([gained, error + np.abs(off) * np.ptp(gained)])
        # The reflection that takes 2 to 1 negates theta3, and so does the one from 2 to 4, 1 to 3.
        sense = {1: -1, 2: 1}[separatrix]
        found[:, :, separatrix - 1] = sense * both
        found[:, :, separatrix + 1] = -sense * both
    return Increments(found[0], np.abs(found[1]))


class FoundStart(NamedTuple):
    """Start of an orbit of S1-, at theta2 = `START`."""

    depth: Any
    """-ln(J1/J2), with guard bits."""
    time: float
    """Time t' from the start to the section."""
    off: float
    """Phase g at the section less what it is to be, radians, within half a turn."""


def beginning(s: UnstableSurface, g: float, arithmetic: Arithmetic) -> FoundStart:
    """Find the start of the orbit of S1- that meets the section at g, to within rounding.

    Orbits pass `START` once in each turn of theta2, and g grows with their depth there. Over the
    phases of starts of one depth it would go to and fro where much weight lets J1 shrink in a part
    of a turn, so that orbits pass that depth several times.

    Raises ArithmeticError if no orbit is found.
    """
    rate = float(s.p.nu) / math.pi
    near = max(NEAR, ROUNDED * float(s.p.nu) ** 1.5) / rate

    # The search begins with both ends of a bracket, and ends where it has been.
    @functools.cache
    def met(more: float) -> FoundStart:
        return _met(s, g, more, arithmetic)

    for ends in _brackets(s, g, rate, met):
        try:
            found = met(brentq(lambda more: met(more).off, *ends, xtol=near))
        except Missed:
            continue
        if abs(found.off) < LARGEST_OFF:
            return found
    raise ArithmeticError(
        f"no orbit of S1- was found that meets the section at g = {g:.6f} before anywhere else"
    )


def _met(s: UnstableSurface, g: float, more: float, arithmetic: Arithmetic) -> FoundStart:
    """The orbit that starts at `DEPTH` and `more`; Missed is raised if it misses the section."""
    m, depth = numbers(s.bits), numbers(s.bits).mpf(DEPTH) + more
    points = meet(s, [m.mpf(START)], depth, arithmetic)
    if points is None:
        raise Missed
    off = points.phase[0] - g
    return FoundStart(depth, float(points.time[0]), float(off - 2 * m.pi * m.nint(off / m.pi / 2)))


def _brackets(
    s: UnstableSurface, g: float, rate: float, met: Callable[[float], FoundStart]
) -> Iterator[tuple[float, float]]:
    """Depths beyond `DEPTH`, in pairs: g is below its goal at the first, above it at the second.

    Without weight it grows at the rate nu/pi with the depth.
    """
    m = numbers(s.bits)
    first = float((g - START - lag(s, m.mpf(DEPTH))) % (2 * m.pi)) / rate

    def off(more: float) -> float:
        try:
            return met(more).off
        except Missed:
            return math.nan

    begin, here = off(first), first
    step = -math.copysign(max(2 * abs(begin), NEAR), begin) / rate
    while abs(step) * rate < math.tau:
        before, here, step = here, here + step, 2 * step
        if not off(here) * begin > 0:
            yield min(before, here), max(before, here)
            break
    # If the periodic orbit has no unstable direction, and so no S1-, this raises that reason.
    orbit = periodic_orbit(s.p, float(s.h0))
    # In a period J1 grows by the square of the multiplier: the orbits repeat.
    depths = first + 2 * orbit.exponent_per_period * np.linspace(0, 1, PARTS + 1)
    for below, above in itertools.pairwise((x, off(x)) for x in depths.tolist()):
        if below[1] <= 0 <= above[1]:
            yield below[0], above[0]


def _gain(s: UnstableSurface, g: float, arithmetic: Arithmetic) -> tuple[float, float, float]:
    """Increment of theta3 along an orbit, over both its halves, its error, and that of g, radians.

    The trapezoid rule converges exponentially on the whole line: with half the step its error is
    squared. Its nodes lie symmetrically about the section, so that the mirrored half has the same
    values.
    """
    depth, time, off = beginning(s, g, arithmetic)
    rate = float(exponent(J2_0(s), s.p, numbers(s.bits)))
    step = math.tau / (rate * (STEPS + TURN * float(s.p.nu) / math.pi))
    # Times before the section, in whole fours of steps: coarser sums take every second or fourth.
    before = step * np.arange(4 * int(time / (4 * step)))
    # The first value is that on the section, which belongs to both halves.
    turning = _turning(s, depth, np.append(0.0, time - before[::-1]), arithmetic)[:0:-1]
    fine, coarse, coarser = (
        float(step * every * (2 * turning[::every].sum() - turning[0])) for every in (1, 2, 4)
    )
    change, before_that = abs(fine - coarse), abs(coarse - coarser)
    # The errors are C q, C q^2 and C q^4 with ever finer steps: the last follows from the first two
    # and q from their ratio. If the changes are rounding, they give no ratio below 1.
    q = min(1.0, change / before_that) if before_that else 1.0
    return fine, change * q**2, off


def _turning(s: UnstableSurface, depth: Any, times: Array, arithmetic: Arithmetic) -> Array:
    """Rate of theta3 along the orbit of S1- from a depth, radians per t', at `times`."""
    p = s.p
    state = np.array([float(x) for x in launch(s, START, depth)])
    floats = AlignedCoefficients(*map(float, coefficients(s)))
    orbit = states_at(
        floats, state, times, engine=arithmetic.engine, tolerance=arithmetic.tolerance
    )
    M, _ = body_from_aligned(Aligned(*orbit), p.alpha0, 1.0)
    r = *cos_sin_half(p.beta0), 0.0
    # From dimensionless M follows the rate in t', and not in physical t.
    return np.asarray(turning_rate(M, r, float(p.mu)))
