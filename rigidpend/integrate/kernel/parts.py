"""Exact numbers as the doubles that the kernel computes with."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.integrate.kernel.lane_numbers import KINDS


def in_parts(values: Any, bits: int) -> NDArray[np.float64]:
    """Numbers as the parts that make them up, shape (parts, ...)."""
    if KINDS[bits].parts == 1:
        return np.array([values], dtype=float)
    exact = np.asarray(values, dtype=object)
    parts = []
    for _ in range(KINDS[bits].parts):
        parts.append(exact.astype(float))
        exact = exact - np.frompyfunc(Fraction, 1, 1)(parts[-1])
    return np.stack(parts)
