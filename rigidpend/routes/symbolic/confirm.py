"""Confirmation of a chain by integration: every passage of it alone, from crossing to crossing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate.records import Orbits
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.cycle import symbols
from rigidpend.routes.symbolic.chain import Chain
from rigidpend.routes.symbolic.tables import Level, Mask

EARLY = 1e-3
"""Time t' below which a zero of M3 is the crossing that an orbit starts from."""
PATIENCE = 4.0
"""Longest wait, in times of the longest passage."""


class Confirmation(NamedTuple):
    """Passages of a chain, each integrated alone in doubles, (n,) each."""

    right: Mask
    """True where it has the chain's symbol."""
    late: Array
    """Its time less the chain's, t'."""


def passages(body: Body, level: Level, chain: Chain) -> Confirmation:
    """Integrate the full equations from each crossing of a chain to the next.

    Parameters
    ----------
    body : Body
    level : Level
    chain : Chain
        That begins with an upward crossing.
    """
    c, rising = doubles(body), upward(len(chain.b))
    limit = float(chain.time.max()) * PATIENCE
    time, separatrix = _next(c.aligned, crossing_states(c, level, chain), limit)
    found = symbols(np.stack((np.where(rising, 2, 3), separatrix)))[0]
    right = found == np.where((chain.I > 0) == rising, 1, 0)
    return Confirmation(right, time - chain.time)


def doubles(body: Body) -> Coefficients:
    """The coefficients of a body in doubles."""
    return coefficients(body.angles(53 + GUARD_BITS), "1", precision(53))


def upward(n: int) -> Mask:
    """The first n crossings of an orbit: whether they are upward, as the very first is."""
    return np.arange(n) % 2 == 0


def crossing_states(c: Coefficients, level: Level, chain: Chain) -> Array:
    """The aligned components (6, n) at the crossings from which a chain's passages begin.

    They are those on separatrix 2 or 3, the orbit's own or their mirror images.
    """
    n, a = len(chain.b), precision(53)
    rising, states = upward(n), np.empty((6, n))
    for side in (True, False):
        here = rising == side
        if here.any():
            d, chi = chain.d[:n][here], chain.chi[:n][here]
            states[:, here] = section_state(side, d, chi, level.h, c, a)
    return states


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
