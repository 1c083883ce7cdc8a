"""Engine `taylor`, orbits of the aligned field at given times, by the kernel `samples`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.equations import AlignedCoefficients
from rigidpend.integrate.kernel import samples, taylor_step
from rigidpend.integrate.kernel.parts import in_parts
from rigidpend.integrate.kernel.writer import LANES
from rigidpend.run.workers import check_stop

STEPS = 20_000
"""Steps in a call, which cannot be interrupted: 12 ms."""
TOGETHER = 256
"""Orbits in a call, so that what they leave behind stays small."""


def sample_batch(
    coefficients: AlignedCoefficients,
    states: NDArray[np.float64],
    times: NDArray[np.float64],
    tolerance: float,
) -> NDArray[np.float64]:
    """Orbits of the aligned field (see `rigidpend.integrate.sample_orbits`)."""
    n, count, times = states.shape[1], times.size, np.ascontiguousarray(times)
    kernel = samples.function(taylor_step.order_of(tolerance), 53)
    parameters = in_parts(taylor_step.Products.of(coefficients), 53)
    found = np.empty((6, count, n))
    for first in range(0, n, TOGETHER):
        columns = slice(first, first + TOGETHER)
        found[..., columns] = _lanes(kernel, parameters, states[:, columns], times)
    return found


def _lanes(
    kernel: Any, parameters: Any, states: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Samples (6, k, n) of some orbits; lanes without an orbit repeat the first."""
    n = states.shape[1]
    groups = -(-n // LANES)
    width = groups * LANES
    state = np.concatenate((states, np.repeat(states[:, :1], width - n, axis=1)), axis=1)
    time = np.zeros((2, width))
    time[0] = times[0]
    passed, found = np.zeros(width, dtype=np.int64), np.empty((times.size, 6, width))
    sense = math.copysign(1.0, times[-1] - times[0])
    given = [x.ctypes.data for x in (time, parameters, times)]
    left = width
    while left:
        check_stop()
        left = kernel(
            state.ctypes.data,
            width,
            *given,
            times.size,
            passed.ctypes.data,
            sense,
            groups,
            -(-STEPS // groups),
            found.ctypes.data,
        )
        if left and not np.isfinite(state).all():
            raise ArithmeticError("an orbit did not reach the last of the times")
    return found[..., :n].transpose(1, 0, 2)
