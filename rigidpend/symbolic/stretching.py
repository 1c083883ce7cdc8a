"""Stretching: how a deviation grows from passage to passage, by the map's derivatives.

A deviation is measured in chi and in d over the tables' width. The mean logarithm of its growth
along an orbit is the Lyapunov exponent per passage; over few passages it is a finite-time
exponent. Another measure changes the sum by a bounded amount alone.
"""

from __future__ import annotations

import math

import numpy as np

from rigidpend.symbolic.chain import Chain, tangents
from rigidpend.symbolic.tables import Array, Level


def stretching(level: Level, chain: Chain) -> Array:
    """ln of the growth of a deviation in each passage of a chain, (n,).

    The deviation begins along chi, and has turned to the growing direction behind the first
    passage, but for a share of 1/growth^2.

    Parameters
    ----------
    level : Level
    chain : Chain
    """
    scale = np.array([level.unit, 1.0])
    change, grown = np.array([0.0, 1.0]), []
    for slope in tangents(level, chain)[:, :2]:
        change = slope @ (change * scale) / scale
        size = math.hypot(*change)
        change = change / size
        grown.append(math.log(size))
    return np.array(grown)
