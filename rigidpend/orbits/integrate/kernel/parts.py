"""Exact numbers as the doubles that the kernel computes with."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, as_doubles


def in_parts(values: Any, bits: int) -> NDArray[np.float64]:
    """Fractions, or doubles of 53 bits, as the parts that make them up, shape (parts, ...)."""
    parts = KINDS[bits].parts
    if parts == 1:
        return np.array([values], dtype=float)
    exact = np.asarray(values, dtype=object)
    columns = list(zip(*(as_doubles(x, parts) for x in exact.flat), strict=True))
    return np.array(columns, dtype=float).reshape(parts, *exact.shape)


def split(values: Any, parts: int) -> NDArray[np.float64]:
    """Doubles or long doubles as sums of so many doubles, shape (parts, ...)."""
    found = [np.asarray(values).astype(float)]
    rest = values
    for _ in range(parts - 1):
        rest = rest - found[-1]
        found.append(rest.astype(float))
    return np.stack(found)
