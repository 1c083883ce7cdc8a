"""Chains and closed orbits held against integration of the full equations.

Every passage of a chain is integrated alone, in doubles, from crossing to crossing. So is the
action, the integral of p dq over a period: where M . gamma = 0 the form p dq is M . omega dt in
any coordinates, J1 dtheta1 + J2 dtheta2 or others, and on the sphere of gamma it has no ambiguity.
So the action is twice the kinetic energy, 2 (h - mu r . gamma), integrated. Along a family of
orbits its derivative in h is their period. Closed orbits are integrated over a period in many
bits, and come back to rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.exact import GUARD_BITS, context, exact, fraction
from rigidpend.numbers.generic import Array, Numbers, Scalar
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.cycle import symbols
from rigidpend.routes.symbolic.chain import Chain, NoOrbit, tangents
from rigidpend.routes.symbolic.closed import ClosedOrbit
from rigidpend.routes.symbolic.levels import Level, Mask

EARLY = 1e-3
"""Time t' below which a zero of M3 is the crossing that an orbit starts from."""
ROUNDED = 2.0**-51
"""Rounding of a passage's time, relative: its crossings, too, are rounded to doubles."""
PATIENCE = 4.0
"""Longest wait, in times of the longest passage."""
ROUNDS = 12
LOST = 12
"""Bits by which a passage may fail to meet the next."""
GUARD = 15
"""Bits that the numbers of the section have beyond those of the integration."""


class Confirmation(NamedTuple):
    """Passages of a chain, each integrated alone in doubles, (n,) each."""

    right: Mask
    """True where it has the chain's symbol."""
    error: Array
    """Error of the chain's time, t': that difference, and what both may round alike."""


def passages(body: Body, level: Level, chain: Chain) -> Confirmation:
    """Integrate the full equations from each crossing of a chain, upward at first, to the next."""
    c, rising = doubles(body), np.arange(len(chain.b)) % 2 == 0
    limit = float(chain.time.max()) * PATIENCE
    states = crossing_states(c, level, chain)[:, :-1]
    time, separatrix = _next(c.aligned, states, limit)
    found = symbols(np.stack((np.where(rising, 2, 3), separatrix)))[0]
    right = found == np.where((chain.I > 0) == rising, 1, 0)
    return Confirmation(right, np.abs(time - chain.time) + ROUNDED * chain.time)


def doubles(body: Body) -> Coefficients:
    """The coefficients of a body in doubles."""
    return coefficients(body.angles(53 + GUARD_BITS), "1", precision(53))


def crossing_states(c: Coefficients, level: Level, chain: Chain) -> Array:
    """The aligned components (6, n + 1) at a chain's crossings.

    They are those on separatrix 2 or 3, the orbit's own or their mirror images.
    """
    n, a = len(chain.d), precision(53)
    rising, states = np.arange(n) % 2 == 0, np.empty((6, n))
    for side in (True, False):
        here = rising == side
        states[:, here] = section_state(side, chain.d[here], chain.chi[here], level.h, c, a)
    return states


def section_points(states: Numbers, c: Coefficients, a: Precision) -> SectionPoint:
    """Points of the section from aligned components (6, N): the inverse of section_state.

    `rising` is an array as well, and chi lies in (-pi, pi].
    """
    rising = np.abs(states[0]) > np.abs(states[1])
    large, small = (np.where(rising, states[k], states[1 - k]) for k in (0, 1))
    # What lies beside separatrix 4 or 1 is described by its mirror image.
    sign = np.where(large < 0, -1, 1)
    M1 = sign * (states[0] + states[1]) * c.to_M1
    M2 = sign * (states[0] - states[1]) * c.to_M2
    cos = (states[4] * M1 - states[3] * M2) / a.sqrt(M1 * M1 + M2 * M2)
    return SectionPoint(rising, sign * small, a.atan2(-sign * states[5], cos))


def _next(c: AlignedCoefficients, states: Array, limit: float) -> tuple[Array, NDArray[np.uint8]]:
    """Time t' and separatrix of the first crossing behind the start."""
    engine = integrate.default_engine()
    found = integrate.crossings(
        Orbits(c, states, 2, limit),
        engine=engine,
        bits=53,
        tolerance=integrate.FINEST_TOLERANCE[engine],
        jobs=1,
    )
    which = np.where(found.time[0] > EARLY, 0, 1)
    columns = np.arange(states.shape[1])
    return found.time[which, columns], found.separatrix[which, columns]


def actions(body: Body, level: Level, chains: Sequence[Chain]) -> Array:
    """The actions of chains through all their passages, each integrated alone in doubles.

    They are dimensionless, as J1 and J2. Each chain begins with an upward crossing.
    """
    c = doubles(body)
    begun = [crossing_states(c, level, chain)[:, :-1] for chain in chains]
    states = np.concatenate(begun, axis=1)
    time = np.concatenate([chain.time for chain in chains])

    def rates(state: Any, _: Any) -> tuple[Any, ...]:
        """The aligned equations with the quadrature of the potential energy."""
        potential = c.aligned.mu_r1 * state[3] + c.aligned.mu_r2 * state[4]
        return (*aligned(state[:6], c.aligned), potential)

    lifted = states_at(rates, np.vstack((states, 0 * time)), time[None])[6, 0]
    of = np.repeat(np.arange(len(chains)), [len(chain.time) for chain in chains])
    found: Array = np.bincount(of, weights=2 * (level.h * time - lifted)).astype(float)
    return found


class Closing(NamedTuple):
    """A closed orbit, refined and integrated once round."""

    error: float
    """Distance of the end from the beginning in d and chi."""
    expected: float
    """Gap left where passages meet, and by roundings, enlarged by the period's derivative."""
    moved: float
    """Distance by which refinement moved the crossings: the error of the map in doubles."""
    period: Fraction
    """t' of its P passages."""
    place: tuple[Fraction, Fraction]
    """d and chi of the first crossing."""
    bits: int


def closing(body: Body, orbit: ClosedOrbit, level: Level, *, h: Scalar, bits: int = 113) -> Closing:
    """Refine a closed orbit of a level by the full equations until it closes, in 96 bits or more.

    Newton's method for (d, chi) at all crossings at once: passages are integrated one by one, and
    the map's derivatives, in doubles, gain some eight digits a time. Then the whole period is
    integrated from the first crossing: it ends there, but for rounding and its growth. NoOrbit is
    raised where it does not come to close.
    """
    a, m = precision(bits + GUARD), context(bits + GUARD)
    c = coefficients(body.angles(bits + GUARD + GUARD_BITS), "1", a)
    fractions = AlignedCoefficients(*(fraction(x, bits) for x in c.aligned))
    energy = a.array([exact(h).in_context(m)])

    def gap(rising: bool, here: Any, there: Any, time: Fraction) -> tuple[list[Fraction], Fraction]:
        """d and chi after a time less those that are expected there, and how late it crosses."""
        d, chi = (a.array([x]) for x in here)
        state = section_state(rising, d, chi, energy, c, a)
        rounded = np.array([[fraction(x, bits)] for x in state[:, 0]])
        reached = states_at(fractions, rounded, [time], bits)[:, 0, 0]
        rates = aligned(reached, fractions)
        late = -reached[2] / rates[2]
        end = a.array([[x + late * rate] for x, rate in zip(reached, rates, strict=True)])
        point = section_points(end, c, a)
        off, turned = point.d[0] - a.number(there[0]), point.chi[0] - a.number(there[1])
        turned -= 2 * a.pi * a.number(round(float(turned / (2 * a.pi))))
        return [fraction(off, a.bits), fraction(turned, a.bits)], late

    chain, slopes = orbit.chain, tangents(level, orbit.chain)[:, :2]
    pairs = zip(chain.d[:-1], chain.chi[:-1], strict=True)
    begin = places = np.array([[Fraction(float(x)) for x in pair] for pair in pairs])
    times = [Fraction(float(t)) for t in chain.time]
    for _ in range(ROUNDS):
        off: Any = []
        for k, (here, there) in enumerate(zip(places, np.roll(places, -1, axis=0), strict=True)):
            left, late = gap(k % 2 == 0, here, there, times[k])
            times[k] += late
            off.append(left)
        size = np.abs(np.array(off)).max()
        if size < Fraction(1, 2 ** (bits - LOST)):
            break
        step = _corrections(slopes, (np.array(off) / size).astype(float))
        places = places + fractions_of(step) * size
    else:
        raise NoOrbit(f"the orbit of {orbit.word} does not come to close, by {float(size):.2g}")
    matrix, period = np.eye(2), sum(times, Fraction(0))
    for slope in slopes:
        matrix = slope @ matrix
    round_once, _ = gap(True, places[0], places[0], period)
    expected = len(slopes) * float(np.abs(matrix).max()) * (float(size) + 2.0**-bits)
    moved = float(np.abs(places - begin).max())
    return Closing(
        max(abs(float(x)) for x in round_once), expected, moved, period, tuple(places[0]), bits
    )


fractions_of = np.frompyfunc(lambda x: Fraction(float(x)), 1, 1)


def _corrections(slopes: Array, gaps: Array) -> Array:
    """Newton's corrections of d and chi at the crossings of a closed orbit, (n, 2).

    Where passages lead, less the next crossing, are the gaps: behind the last is the first one.
    """
    n = len(slopes)
    matrix = -np.roll(np.eye(2 * n), 2, axis=1)
    for k, slope in enumerate(slopes):
        rows = slice(2 * k, 2 * k + 2)
        matrix[rows, rows] += slope
    return np.asarray(-np.linalg.solve(matrix, gaps.ravel())).reshape(n, 2)
