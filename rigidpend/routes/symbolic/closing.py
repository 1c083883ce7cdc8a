"""Closed orbits verified: integrated over a period in many bits, they come back to rounding."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import GUARD_BITS, context, exact, fraction
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.symbolic.chain import NoOrbit, tangents
from rigidpend.routes.symbolic.closed import ClosedOrbit
from rigidpend.routes.symbolic.tables import Level

ROUNDS = 12
LOST = 12
"""Bits by which a passage may fail to meet the next."""
GUARD = 15
"""Bits that the numbers of the section have beyond those of the integration."""


class Closing(NamedTuple):
    """A closed orbit, refined and integrated once round."""

    error: float
    """Distance of the end from the beginning in d and chi."""
    expected: float
    """Gap left by passages that meet to LOST bits, enlarged by the period's derivative."""
    moved: float
    """Distance by which refinement moved the crossings: the error of the map in doubles."""
    period: Fraction
    """t' of its P passages."""
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
        step = _solved(slopes, np.array([float(x / size) for x in off]))
        places = [x - Fraction(float(s)) * size for x, s in zip(places, step, strict=True)]
    else:
        raise NoOrbit(f"the orbit of {orbit.word} does not come to close, by {float(size):.2g}")
    moved = max(abs(float(x - y)) for x, y in zip(places, trip.begin, strict=True))
    total = trip.once_round(places[:2], sum(times, Fraction(0)))
    matrix = np.eye(2)
    for slope in slopes:
        matrix = slope @ matrix
    expected = len(slopes) * float(np.abs(matrix).max()) * 2.0 ** (LOST - bits)
    return Closing(total, expected, moved, sum(times, Fraction(0)), bits)


def _solved(slopes: Array, off: Array) -> Array:
    """Newton's step (2 P,) from the derivatives (P, 2, 2) of the passages."""
    P = len(slopes)
    matrix = np.zeros((2 * P, 2 * P))
    for k, slope in enumerate(slopes):
        after = (k + 1) % P
        matrix[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += slope
        matrix[2 * k : 2 * k + 2, 2 * after : 2 * after + 2] -= np.eye(2)
    return np.asarray(np.linalg.solve(matrix, off))


class _Trip:
    """Integration from a point of the section through the passages of an orbit."""

    def __init__(self, body: Body, orbit: ClosedOrbit, h: Any, bits: int) -> None:
        self.m, self.bits = context(bits + GUARD), bits
        self.a = precision(bits + GUARD)
        p = body.angles(bits + GUARD + GUARD_BITS)
        self.c: Coefficients = coefficients(p, "1", self.a)
        self.fractions = AlignedCoefficients(*(fraction(x, bits) for x in self.c.aligned))
        self.h = h.in_context(self.m)
        self.orbit = orbit
        P = len(orbit.chain.b)
        pairs = zip(orbit.chain.d[:P], orbit.chain.chi[:P], strict=True)
        self.begin = [Fraction(float(x)) for pair in pairs for x in pair]

    def gaps(self, places: Sequence[Fraction], times: list[Fraction]) -> list[Fraction]:
        """d and chi behind each passage less those of the next crossing; times are corrected."""
        P, found = len(times), []
        for k in range(P):
            after = (k + 1) % P
            there = places[2 * after : 2 * after + 2]
            mirrored = bool(self.orbit.chain.I[k] < 0)
            off, late = self._gap(k % 2 == 0, places[2 * k : 2 * k + 2], there, times[k], mirrored)
            times[k] += late
            found += off
        return found

    def once_round(self, place: Sequence[Fraction], period: Fraction) -> float:
        """Distance in d and chi after the whole period."""
        off, _ = self._gap(True, place, place, period, self.orbit.mirrored, len(self.begin) // 2)
        return max(abs(float(x)) for x in off)

    def _gap(
        self,
        rising: bool,
        here: Sequence[Fraction],
        there: Sequence[Fraction],
        time: Fraction,
        mirrored: bool,
        passages: int = 1,
    ) -> tuple[list[Fraction], Fraction]:
        m, array = self.m, self.a.array
        d, chi, d_there, chi_there = (m.mpf(x.numerator) / x.denominator for x in (*here, *there))
        state = section_state(rising, array([d]), array([chi]), array([self.h]), self.c, self.a)
        rounded = [fraction(x, self.bits) for x in state[:, 0]]
        [reached] = states_at(self.fractions, rounded, [time], self.bits)
        rates = aligned(reached, self.fractions)
        late = -reached[2] / rates[2]
        end = [x + late * rate for x, rate in zip(reached, rates, strict=True)]
        sign = -1 if mirrored else 1
        Qp, Qm, _, gamma1, gamma2, gamma3 = (m.mpf(x.numerator) / x.denominator for x in end)
        M1, M2 = sign * (Qp + Qm) * self.c.to_M1, sign * (Qp - Qm) * self.c.to_M2
        cos, sin = (gamma2 * M1 - gamma1 * M2) / m.sqrt(M1 * M1 + M2 * M2), -sign * gamma3
        c, s = m.cos(chi_there), m.sin(chi_there)
        turn = m.atan2(sin * c - cos * s, cos * c + sin * s)
        small = sign * (Qm if rising == (passages % 2 == 0) else Qp)
        return [fraction(small - d_there, m.prec), fraction(turn, m.prec)], late
