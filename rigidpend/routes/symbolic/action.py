"""The action of closed orbits: the integral of p dq over a period.

Where M . gamma = 0 the form p dq is M . omega dt in any coordinates, J1 dtheta1 + J2 dtheta2
or others, and on the sphere of gamma it has no ambiguity. So the action is twice the kinetic
energy, 2 (h - mu r . gamma), integrated. Along a family of orbits its derivative in h is their
period.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.doubles import Array
from rigidpend.orbits import integrate
from rigidpend.routes.symbolic.chain import Chain
from rigidpend.routes.symbolic.confirm import crossing_states, doubles
from rigidpend.routes.symbolic.tables import Level


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
    states = np.concatenate([crossing_states(c, level, chain) for chain in chains], axis=1)
    time = np.concatenate([chain.time for chain in chains])
    lifted = integrate.ends(_field(c.aligned), np.vstack((states, 0 * time)), time)[6]
    of = np.repeat(np.arange(len(chains)), [len(chain.time) for chain in chains])
    found: Array = np.bincount(of, weights=2 * (level.h * time - lifted)).astype(float)
    return found


def _field(c: AlignedCoefficients) -> Any:
    """The aligned equations with the quadrature of the potential energy."""

    def rates(state: Any, _: Any) -> tuple[Any, ...]:
        return (*aligned(state[:6], c), c.mu_r1 * state[3] + c.mu_r2 * state[4])

    return rates
