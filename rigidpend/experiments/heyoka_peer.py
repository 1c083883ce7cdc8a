"""heyoka: a peer in speed and an independent truth, for the benchmark and the stress trials.

Nothing that computes a result uses it; it comes with the extra `bench`.
"""

from __future__ import annotations

import functools
import importlib.util
from typing import Any

import numpy as np

from rigidpend.numbers.generic import Scalar


def installed() -> bool:
    """True if heyoka is installed."""
    return importlib.util.find_spec("heyoka") is not None


@functools.cache
def heyoka() -> Any:
    """heyoka, quiet, and without its cache on disk, which believes whatever it reads."""
    import heyoka as imported

    imported.set_logger_level_error()
    imported.llvm_state.set_diskcache_enabled(False)
    return imported


def offers(bits: int) -> bool:
    """True if it has a type of so many bits here: 53, or 64 or 113 on some machines."""
    if bits == 64:
        return np.finfo(np.longdouble).nmant == 63
    return bits == 53 or (bits == 113 and hasattr(heyoka(), "real128"))


def working_type(bits: int) -> Any:
    """Its type of numbers of 53, 64 or 113 bits."""
    return {53: float, 64: np.longdouble, 113: getattr(heyoka(), "real128", None)}[bits]


def typed(x: Scalar, kind: Any) -> Any:
    """A number of a type, from a float, a Fraction or an mpmath number: a sum of doubles."""
    total, rest = kind(0), x
    while head := float(rest):
        total, rest = total + kind(head), rest - type(x)(head)
    return total
