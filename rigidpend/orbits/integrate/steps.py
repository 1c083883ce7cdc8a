"""Engine `taylor`, one orbit step by step, by the kernel `notes`."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate.engines import kernel_bits
from rigidpend.orbits.integrate.kernel import notes, taylor_step
from rigidpend.orbits.integrate.kernel.aligned_field import COMPONENTS, Products
from rigidpend.orbits.integrate.kernel.parts import exactly, in_parts
from rigidpend.orbits.integrate.kernel.writer import LANES


def advance(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    count: int,
    bits: int,
    tolerance: float,
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit some steps of natural length: times since the start, and states.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions, as the six components of `state`.
    count : int
        Number of steps.
    bits : int
        Those of `engines.LADDER` that have as many serve.
    tolerance : float
        Of the Taylor series in 53 bits.
    """
    kind, size = kernel_bits(bits), len(COMPONENTS)
    order = taylor_step.order_of(tolerance * 2.0 ** (53 - kind))
    kernel, parameters = notes.function(order, kind), in_parts(Products.of(coefficients), kind)
    begin = in_parts(np.array(state, dtype=object), kind).reshape(-1, 1)
    # All lanes carry the orbit; what is noted of its crossings is not looked at.
    lanes, time = np.repeat(begin, LANES, axis=1), np.zeros((2, LANES))
    room = np.empty((LANES, notes.width_of_note(order, kind)))
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
        here = tuple(exactly(lanes[:, 0].reshape(-1, size)))
        found.append((exactly(time[:, :1])[0], here))
    return found
