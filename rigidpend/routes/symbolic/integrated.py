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
from rigidpend.routes.symbolic.chain import Chain, NoOrbit, corrections, tangents
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
    late: Array
    """Its time less the chain's, t'."""
    error: Array
    """Error of the chain's time, t': that difference, and what both may round alike."""


def passages(body: Body, level: Level, chain: Chain) -> Confirmation:
    """Integrate the full equations from each crossing of a chain to the next.

    Parameters
    ----------
    body : Body
    level : Level
    chain : Chain
        That begins with an upward crossing.
    """
    c, rising = doubles(body), np.arange(len(chain.b)) % 2 == 0
    limit = float(chain.time.max()) * PATIENCE
    states = crossing_states(c, level, chain)[:, :-1]
    time, separatrix = _next(c.aligned, states, limit)
    found = symbols(np.stack((np.where(rising, 2, 3), separatrix)))[0]
    right = found == np.where((chain.I > 0) == rising, 1, 0)
    late = time - chain.time
    return Confirmation(right, late, np.abs(late) + ROUNDED * chain.time)


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

    Parameters
    ----------
    body : Body
    level : Level
    chains : sequence of Chain
        Each begins with an upward crossing.

    Returns
    -------
    (len(chains),) array
        Dimensionless, as J1 and J2.
    """
    c = doubles(body)
    begun = [crossing_states(c, level, chain)[:, :-1] for chain in chains]
    states = np.concatenate(begun, axis=1)
    time = np.concatenate([chain.time for chain in chains])
    lifted = states_at(_field(c.aligned), np.vstack((states, 0 * time)), time[None])[6, 0]
    of = np.repeat(np.arange(len(chains)), [len(chain.time) for chain in chains])
    found: Array = np.bincount(of, weights=2 * (level.h * time - lifted)).astype(float)
    return found


def _field(c: AlignedCoefficients) -> Any:
    """The aligned equations with the quadrature of the potential energy."""

    def rates(state: Any, _: Any) -> tuple[Any, ...]:
        return (*aligned(state[:6], c), c.mu_r1 * state[3] + c.mu_r2 * state[4])

    return rates


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
    """Refine a closed orbit by the full equations until it closes.

    Newton's method for (d, chi) at all crossings at once: passages are integrated one by one, and
    the map's derivatives, in doubles, gain some eight digits a time. Then the whole period is
    integrated from the first crossing: it ends there, but for rounding and its growth.

    Parameters
    ----------
    body : Body
    orbit : ClosedOrbit
    level : Level
        On which it was found.
    h : number
        Its energy, exact.
    bits : int, optional
        Precision of the integration, 96 or more.

    Raises
    ------
    NoOrbit
        It does not come to close.
    """
    trip, slopes = _Trip(body, orbit, exact(h), bits), tangents(level, orbit.chain)[:, :2]
    places, times = trip.begin, [Fraction(float(t)) for t in orbit.chain.time]
    for _ in range(ROUNDS):
        off = trip.gaps(places, times)
        size = max(abs(x) for x in off)
        if size < Fraction(1, 2 ** (bits - LOST)):
            break
        step = corrections(slopes, np.array([float(x / size) for x in off]))
        places = [x + Fraction(float(s)) * size for x, s in zip(places, step, strict=True)]
    else:
        raise NoOrbit(f"the orbit of {orbit.word} does not come to close, by {float(size):.2g}")
    moved = max(abs(float(x - y)) for x, y in zip(places, trip.begin, strict=True))
    total = trip.once_round(places[:2], sum(times, Fraction(0)))
    matrix = np.eye(2)
    for slope in slopes:
        matrix = slope @ matrix
    left = float(size) + 2.0**-bits
    expected = len(slopes) * float(np.abs(matrix).max()) * left
    first = places[0], places[1]
    return Closing(total, expected, moved, sum(times, Fraction(0)), first, bits)


class _Trip:
    """Integration from a point of the section through the passages of an orbit."""

    def __init__(self, body: Body, orbit: ClosedOrbit, h: Any, bits: int) -> None:
        self.bits, self.a = bits, precision(bits + GUARD)
        p = body.angles(bits + GUARD + GUARD_BITS)
        self.c: Coefficients = coefficients(p, "1", self.a)
        self.fractions = AlignedCoefficients(*(fraction(x, bits) for x in self.c.aligned))
        self.h = h.in_context(context(bits + GUARD))
        pairs = zip(orbit.chain.d[:-1], orbit.chain.chi[:-1], strict=True)
        self.begin = [Fraction(float(x)) for pair in pairs for x in pair]

    def gaps(self, places: Sequence[Fraction], times: list[Fraction]) -> list[Fraction]:
        """d and chi behind each passage less those of the next crossing; times are corrected."""
        found, next_places = list[Fraction](), [*places[2:], *places[:2]]
        for k, time in enumerate(times):
            here, there = places[2 * k : 2 * k + 2], next_places[2 * k : 2 * k + 2]
            off, late = self._gap(k % 2 == 0, here, there, time)
            times[k] += late
            found += off
        return found

    def once_round(self, place: Sequence[Fraction], period: Fraction) -> float:
        """Distance in d and chi after the whole period."""
        off, _ = self._gap(True, place, place, period)
        return max(abs(float(x)) for x in off)

    def _gap(
        self, rising: bool, here: Sequence[Fraction], there: Sequence[Fraction], time: Fraction
    ) -> tuple[list[Fraction], Fraction]:
        a = self.a
        d, chi = (a.array([x]) for x in here)
        state = section_state(rising, d, chi, a.array([self.h]), self.c, a)
        rounded = np.array([[fraction(x, self.bits)] for x in state[:, 0]])
        reached = states_at(self.fractions, rounded, [time], self.bits)[:, 0, 0]
        rates = aligned(reached, self.fractions)
        late = -reached[2] / rates[2]
        end = a.array([[x + late * rate] for x, rate in zip(reached, rates, strict=True)])
        point = section_points(end, self.c, a)
        off, turned = point.d[0] - a.number(there[0]), point.chi[0] - a.number(there[1])
        turned -= 2 * a.pi * a.number(round(float(turned / (2 * a.pi))))
        return [fraction(off, a.bits), fraction(turned, a.bits)], late
