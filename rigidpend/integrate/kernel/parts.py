"""Exact numbers as the doubles that the kernel computes with."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.integrate.kernel.lane_numbers import KINDS


def in_parts(values: Any, bits: int) -> NDArray[np.float64]:
    """Fractions, or doubles of 53 bits, as the parts that make them up, shape (parts, ...)."""
    if KINDS[bits].parts == 1:
        return np.array([values], dtype=float)
    return split(np.asarray(values, dtype=object), KINDS[bits].parts)


def split(values: Any, parts: int) -> NDArray[np.float64]:
    """Fractions or long doubles as sums of so many doubles, shape (parts, ...)."""
    found, rest = [], np.asarray(values)
    for _ in range(parts):
        found.append(rest.astype(float))
        fractions = rest.dtype == object
        rest = rest - (np.frompyfunc(Fraction, 1, 1)(found[-1]) if fractions else found[-1])
    return np.stack(found)
