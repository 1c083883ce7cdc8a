"""Confirmation of a chain by integration: every passage of it alone, from crossing to crossing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend import integrate
from rigidpend.body import Body
from rigidpend.equations import AlignedCoefficients
from rigidpend.integrate.records import Orbits
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.return_map.poincare import section_state
from rigidpend.return_map.precision import precision
from rigidpend.return_map.reduced import coefficients
from rigidpend.routes.cycle import symbols
from rigidpend.symbolic.chain import Chain
from rigidpend.symbolic.tables import Array, Level, Mask

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
    a, n = precision(53), len(chain.b)
    c = coefficients(body.angles(53 + GUARD_BITS), "1", a)
    right, late = np.zeros(n, dtype=bool), np.full(n, np.inf)
    for rising in (True, False):
        here = np.arange(0 if rising else 1, n, 2)
        if not here.size:
            continue
        states = section_state(rising, chain.d[here], chain.chi[here], level.h, c, a)
        time, separatrix = _next(c.aligned, states, float(chain.time.max()) * PATIENCE)
        begun = np.full(here.size, 2 if rising else 3)
        found = symbols(np.stack((begun, separatrix)))[0]
        upper = rising
        right[here] = found == np.where((chain.I[here] > 0) == upper, 1, 0)
        late[here] = time - chain.time[here]
    return Confirmation(right, late)


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
