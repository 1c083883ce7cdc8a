"""Steps of an approximate orbit, the data of a proof; nothing that computes is imported."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

CLOCK = 32
"""Binary digits behind the point of a step's length in time."""
MOST_BITS = 4096
"""Bits of a coefficient at most."""
MOST_TERMS = 4096
"""Coefficients of a component in a step at most."""
STEPS = 20_000
"""Steps of an orbit at most."""


class Step(NamedTuple):
    """Piece of an approximate orbit: six Chebyshev series over x in [-1, 1]."""

    half_length: int
    """Half of its length in time, of the orbit's unit, in units of 2^-CLOCK."""
    bits: int
    series: Sequence[Sequence[int]]
    """Coefficients w of w_0/2 + sum_j w_j T_j of each component, in units of 2^-bits."""
