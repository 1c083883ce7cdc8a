"""Finite-time exponents of many orbits of Fig. 4's kind, one for each theta2_0 and J1_0.

The orbits are followed by the return map in doubles, with its derivatives. Some of them are
held against the variational equations, integrated from their first crossing to their last.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend import integrate
from rigidpend.body import Body
from rigidpend.equations import AlignedCoefficients, aligned
from rigidpend.numbers.doubles import Array
from rigidpend.return_map import SectionPoint
from rigidpend.return_map.passage import EnergyLevel
from rigidpend.return_map.poincare import section_state
from rigidpend.return_map.precision import precision
from rigidpend.symbolic.confirm import doubles
from rigidpend.symbolic.follow import section_points
from rigidpend.symbolic.stretching import largest_singular, most_stretched
from rigidpend.symbolic.surface import Surface
from rigidpend.symbolic.tables import Mask, widest_d

STEP = 1e-6
"""Step of differences on the section: its square, 1e-12, is left."""
FLOOR = 1e-8
"""Allowed error of ln of a growth by differences: STEP^2 times third derivatives, 1e4 at most."""
ERROR_PER_GROWTH = 1e-11
"""Allowed error for each growth of a crossing's place.

The map errs by some hundred roundings, 1e-14, and ln of a growth by what the distance to the
next surface, which a growth is the inverse of, changes. Fifty times less was seen on 100,000."""


class Stretched(NamedTuple):
    """Orbits through n passages with the growth of a deviation, one in each column."""

    level: EnergyLevel
    """The map at the energy of each orbit."""
    begin: SectionPoint
    """The first crossings, (N,)."""
    time: Array
    """(N,) t' from the first crossing to the last."""
    symbols: NDArray[np.uint8]
    """(n, N) 0 left, 1 right."""
    growth: Array
    """(n, N) ln of the growth of the deviation that grows most, through 1 to n passages."""
    inside: Mask
    """(N,) True where the tables reach so far; elsewhere the rest is void."""


def stretched(orbits: Surface, theta2_0: Array, J1_0: Array, n: int) -> Stretched:
    """Follow orbits of one body and h0 through n passages.

    Parameters
    ----------
    orbits : Surface
    theta2_0, J1_0 : (N,) arrays
        Initial phases, radians, and actions, dimensionless.
    n : int
    """
    level, begin = orbits.first_crossings(theta2_0, J1_0)
    point, inside, time = begin.point, begin.inside, np.zeros(theta2_0.size)
    slopes, symbols = [], []
    for _ in range(n):
        passed = level.passage(point, slopes=True)
        point, inside, time = passed.point, inside & passed.inside, time + passed.time
        slopes.append(passed.slopes[:2])
        symbols.append(passed.symbol)
    growth = most_stretched(slopes, widest_d(level))
    return Stretched(level, begin.point, time, np.array(symbols, dtype=np.uint8), growth, inside)


def rounding(growth: Array) -> Array:
    """Allowed error of ln of a growth (n, ...) through all passages, from that through each."""
    return FLOOR + ERROR_PER_GROWTH * np.exp(growth).sum(axis=0)


def integrated(body: Body, found: Stretched) -> Array:
    """ln of the growth through all passages, by the variational equations, (N,)."""
    c, unit = doubles(body), widest_d(found.level)
    begun, changes = _section(body, found, 0.0, 0.0), []
    for by in ((STEP * unit, 0.0), (0.0, STEP)):
        ahead, back = (_section(body, found, side * by[0], side * by[1]) for side in (1, -1))
        off = (ahead - back) / (2 * STEP)
        ended = integrate.ends(
            variational_equations(c.aligned), np.concatenate((begun, off)), found.time
        )
        changes.append(_on_section(body, ended, c.aligned, unit))
    rows = np.moveaxis(np.array(changes), 0, 1)
    return np.asarray(np.log(largest_singular(*rows)))


def _section(body: Body, found: Stretched, d: float, chi: float) -> Array:
    """States beside the first crossings, at the energy of each."""
    at = found.begin
    made = section_state(True, at.d + d, at.chi + chi, found.level.h, doubles(body), precision(53))
    return np.asarray(made)


def _on_section(body: Body, ended: Array, c: AlignedCoefficients, unit: float) -> Array:
    """Deviations (2, N) in d over its unit and chi, from states with deviations (12, N)."""
    state, off = ended[:6], ended[6:]
    flow = np.array(aligned(state, c))
    # Back to the section along the orbit.
    moved = off - flow * (off[2] / flow[2])
    size = np.abs(moved).max(axis=0)
    ahead, back = (section_points(body, state + side * STEP * moved / size) for side in (1, -1))
    turn = np.mod(ahead.chi - back.chi + np.pi, 2 * np.pi) - np.pi
    return np.stack(((ahead.d - back.d) / unit, turn)) * size / (2 * STEP)


def variational_equations(c: AlignedCoefficients) -> Any:
    """The field of the aligned components with a deviation from them, 12 numbers, per t'."""

    def rates(state: Any, _: Any) -> tuple[Any, ...]:
        here, off = state[:6], state[6:]
        # Of a quadratic field half of this difference is the derivative, exactly.
        ahead, back = (
            aligned([x + side * y for x, y in zip(here, off, strict=True)], c) for side in (1, -1)
        )
        return (*aligned(here, c), *((x - y) / 2 for x, y in zip(ahead, back, strict=True)))

    return rates
