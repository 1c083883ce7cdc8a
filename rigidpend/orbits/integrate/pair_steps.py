"""Engine `taylor`, one orbit step by step in pairs of doubles, by the kernel `notes`."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate.kernel import notes, taylor_step
from rigidpend.orbits.integrate.kernel.aligned_field import COMPONENTS, Products
from rigidpend.orbits.integrate.kernel.parts import in_parts
from rigidpend.orbits.integrate.kernel.writer import LANES

BITS = 106


def advance(
    coefficients: AlignedCoefficients, state: Sequence[Fraction], count: int, tolerance: float
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit some steps of natural length: times since the start, and states.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions, as the six components of `state`.
    count : int
        Number of steps.
    tolerance : float
        Of the Taylor series in 53 bits.
    """
    order = taylor_step.order_of(tolerance * 2.0 ** (53 - BITS))
    kernel, size = notes.function(order, BITS), len(COMPONENTS)
    parameters = in_parts(Products.of(coefficients), BITS)
    begin = in_parts(np.array(state, dtype=object), BITS).reshape(2 * size, 1)
    # All lanes carry the orbit; what is noted of its crossings is not looked at.
    lanes, time = np.repeat(begin, LANES, axis=1), np.zeros((2, LANES))
    room = np.empty((LANES, notes.width_of_note(order, BITS)))
    found = []
    for _ in range(count):
        check_stop()
        kernel(
            lanes.ctypes.data,
            LANES,
            time.ctypes.data,
            parameters.ctypes.data,
            0.0,
            1,
            1,
            room.ctypes.data,
        )
        high, low = lanes[:size, 0].tolist(), lanes[size:, 0].tolist()
        here = tuple(Fraction(x) + Fraction(y) for x, y in zip(high, low, strict=True))
        found.append((Fraction(time[0, 0]) + Fraction(time[1, 0]), here))
    return found
