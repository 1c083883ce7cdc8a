"""Chains held against integration of the full equations, and places of the section.

Every passage of a chain is integrated alone, in doubles, from crossing to crossing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.numbers.generic import Array, Numbers, Scalar
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.reduced import Coefficients
from rigidpend.routes.cycle import symbols
from rigidpend.routes.symbolic.chain import Chain, alternating
from rigidpend.routes.symbolic.levels import Mask

EARLY = 1e-3
"""Time t' below which a zero of M3 is the crossing that an orbit starts from."""
ROUNDED = 2.0**-51
"""Rounding of a passage's time, relative: its crossings, too, are rounded to doubles."""
PATIENCE = 4.0
"""Longest wait, in times of the longest passage."""


def passages(chain: Chain) -> tuple[Mask, Array]:
    """Integrate each passage of a chain alone, in doubles: (n,) each.

    True where it has the chain's symbol, and the error of the chain's time, t': their difference,
    and what both may round alike.
    """
    rising, engine = alternating(len(chain.b), chain.b), integrate.default_engine()
    states, limit = crossing_states(chain)[:, :-1], float(chain.time.max()) * PATIENCE
    found = integrate.crossings(
        Orbits(chain.level.c.aligned, states, 2, limit),
        engine=engine,
        bits=53,
        tolerance=integrate.FINEST_TOLERANCE[engine],
        jobs=1,
    )
    behind = np.where(found.time[0] > EARLY, 0, 1), np.arange(len(rising))
    pair = np.stack((np.where(rising, 2, 3), found.separatrix[behind]))
    right = symbols(pair)[0] == ((chain.I > 0) == rising)
    return right, np.abs(found.time[behind] - chain.time) + ROUNDED * chain.time


def crossing_states(chain: Chain) -> Array:
    """The aligned components (6, n + 1) at a chain's crossings, in doubles."""
    level = chain.level
    return np.asarray(section_states(chain.d, chain.chi, level.h, level.c, precision(53)))


def section_states(d: Any, chi: Any, h: Scalar, c: Coefficients, a: Precision) -> Any:
    """The aligned components (6, n) at crossings that are upward and downward by turns.

    They are those on separatrix 2 or 3, the orbit's own or their mirror images.
    """
    states = np.empty((6, len(d)), dtype=a.dtype)
    for rising in (True, False):
        here = slice(0 if rising else 1, None, 2)
        states[:, here] = section_state(rising, d[here], chi[here], h, c, a)
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
