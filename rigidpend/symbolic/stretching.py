"""Stretching: how a deviation grows from passage to passage, by the map's derivatives.

A deviation is measured in chi and in d over the tables' width. The mean logarithm of its growth
along an orbit is the Lyapunov exponent per passage; over few passages it is a finite-time
exponent. Another measure changes the sum by a bounded amount alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from rigidpend.numbers.doubles import Array
from rigidpend.symbolic.chain import Chain, tangents
from rigidpend.symbolic.tables import Level


def stretching(level: Level, chain: Chain) -> Array:
    """ln of the growth of a deviation in each passage of a chain, (n,).

    The deviation begins along chi, and has turned to the growing direction behind the first
    passage, but for a share of 1/growth^2.
    """
    scale = np.array([level.unit, 1.0])
    change, grown = np.array([0.0, 1.0]), []
    for slope in tangents(level, chain)[:, :2]:
        change = slope @ (change * scale) / scale
        size = math.hypot(*change)
        change = change / size
        grown.append(math.log(size))
    return np.array(grown)


def most_stretched(slopes: Iterable[Array], unit: float) -> Array:
    """ln of the growth of the deviation that grows most, through 1 to n passages, (n, ...).

    Over the number of passages it is the finite-time exponent of whatever comes first.

    Parameters
    ----------
    slopes : iterable of (2, 2, ...) arrays
        Derivatives of d and chi behind each passage in d and chi before it.
    unit : float
        Measure of d, dimensionless.
    """
    whole: Any = ((1.0, 0.0), (0.0, 1.0))
    found = []
    for slope in slopes:
        (a, b), (c, d) = slope
        here = ((a, b / unit), (c * unit, d))
        whole = tuple(
            tuple(sum(x * column[k] for x, column in zip(row, whole, strict=True)) for k in (0, 1))
            for row in here
        )
        found.append(np.log(largest_singular(*whole)))
    return np.array(found)


def largest_singular(first: Any, second: Any) -> Any:
    """The larger singular value of matrices with two rows of two numbers or arrays."""
    (a, b), (c, d) = first, second
    return (np.hypot(a + d, b - c) + np.hypot(a - d, b + c)) / 2
