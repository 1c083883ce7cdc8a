"""Exact numbers as the doubles that the kernel computes with, and back."""

from __future__ import annotations

from fractions import Fraction
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


def exactly(parts: Any) -> Any:
    """The sums of parts, shape (parts, ...), as Fractions, shape (...)."""
    total, *rest = np.vectorize(Fraction, otypes=[object])(parts)
    for one in rest:
        total = total + one
    return total
