"""Units of M in which the numbers of an orbit, and steps in its time, are near one."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients

WEIGHTS = ("force_p", "force_m", "mu_r1", "mu_r2")
"""The coefficients that are proportional to mu."""
WIDEST = 212
"""Bits up to which the series are short enough for any energy, without a unit of M."""
NEAR = 16
"""Factor by which |M| may differ from one, without a unit, in more bits."""


def unit_of(state: Any) -> Fraction:
    """A power of two, half of that next to |M|: so numbers, and steps in its time, are near one."""
    largest = max(abs(x) for x in np.ravel(state[:3]))
    return Fraction(2) ** (largest.numerator.bit_length() - largest.denominator.bit_length() - 1)


def in_units(unit: Fraction, c: AlignedCoefficients, state: Any) -> tuple[AlignedCoefficients, Any]:
    """Coefficients and a state, or states (6, n), with M in such units and time in the inverse."""
    weights = {x: getattr(c, x) / unit**2 for x in WEIGHTS}
    return c._replace(**weights), [*(x / unit for x in state[:3]), *state[3:]]


def unit_for(bits: int, states: Any) -> Fraction:
    """A unit of M in which numbers of so many bits hold the terms of a series of such states.

    Terms are powers of |M|, and those of 110 orders and more leave the range of doubles, or slow
    them down where they are denormal.
    """
    unit = unit_of(states) if bits > WIDEST else Fraction(1)
    return Fraction(1) if 1 / NEAR < unit < NEAR else unit
