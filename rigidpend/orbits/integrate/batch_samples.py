"""Engine `taylor`, orbits of the aligned field or of any other at given times, by a kernel."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate.kernel import samples, taylor_step
from rigidpend.orbits.integrate.kernel.parts import in_parts
from rigidpend.orbits.integrate.kernel.tape import trace
from rigidpend.orbits.integrate.kernel.writer import FEW, LANES

STEPS = 5_000
"""Steps in a call, which cannot be interrupted: 3 ms."""
TOGETHER = 256
"""Orbits in a call, so that what they leave behind stays small."""

Array = NDArray[np.float64]


def sample_aligned(
    coefficients: AlignedCoefficients, states: Array, times: Array, bits: int, tolerance: float
) -> Array:
    """Orbits of the aligned field in the kernel's numbers.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Floats at 53 bits, else Fractions.
    states : (parts, 6, n) array
        At the first of the times, which is a double.
    times : (parts, k, n) or (parts, k, 1) array
        Of each orbit its own, or for all, all forwards or all backwards.
    bits : int
        One of `engines.LADDER`.
    tolerance : float
        At so many bits.

    Returns
    -------
    (parts, 6, k, n) array
    """
    lanes = _lanes_for(states.shape[-1])
    kernel = samples.function(taylor_step.order_of(tolerance), bits, lanes=lanes)
    run = _Run(kernel, in_parts(coefficients, bits), lanes)
    return _in_portions(run, states, times)


def sample_field(
    field: Callable[[Any, Any], Any], states: Array, times: Array, tol: float
) -> Array:
    """Orbits (d, n) of any field at times (k, n), each in order, or (k, 1), one order for all.

    Returns
    -------
    (d, k, n) array
    """
    run = _traced(field, len(states), taylor_step.order_of(tol), _lanes_for(states.shape[1]))
    return _in_portions(run, states[None], times[None])[0]


def ends_of_field(
    field: Callable[[Any, Any], Any], states: Array, times: Array, tolerance: float
) -> Array:
    """Orbits of any field, each at a time of its own (see `rigidpend.orbits.integrate.ends`)."""
    found = states.copy()
    for sense in (-1, 1):
        # The lanes of a call go one way.
        going = np.sign(times) == sense
        if going.any():
            grid = np.stack((np.zeros(going.sum()), times[going]))
            found[:, going] = sample_field(field, states[:, going], grid, tolerance)[:, -1]
    return found


class _Run(NamedTuple):
    """A kernel with its parameters."""

    kernel: Any
    parameters: Array
    lanes: int
    """Number of lanes of a vector."""


def _lanes_for(orbits: int) -> int:
    """Lanes of the vectors that carry so many orbits."""
    return FEW if orbits <= FEW else LANES


@functools.lru_cache(maxsize=32)
def _traced(field: Callable[[Any, Any], Any], size: int, order: int, lanes: int) -> _Run:
    """The kernel of a field; one that is integrated again is not taken down again."""
    traced, parameters = trace(field, size)
    kernel = samples.function(order, 53, traced, lanes)
    return _Run(kernel, np.array([parameters], dtype=float), lanes)


def _in_portions(run: _Run, states: Array, times: Array) -> Array:
    """Samples (parts, d, k, n) of states (parts, d, n)."""
    parts, size, n = states.shape
    found = np.empty((parts, size, times.shape[1], n))
    for first in range(0, n, TOGETHER):
        columns = slice(first, first + TOGETHER)
        grid = times if times.shape[2] == 1 else times[..., columns]
        found[..., columns] = _lanes(run, states[..., columns], grid)
    return found


def _lanes(run: _Run, states: Array, times: Array) -> Array:
    """Samples of some orbits; lanes without an orbit repeat the first."""
    (parts, size, n), count = states.shape, times.shape[1]
    groups = -(-n // run.lanes)
    width = groups * run.lanes
    idle = np.zeros(width - n, dtype=np.int64)
    lanes = np.concatenate((np.arange(n), idle))
    state = np.ascontiguousarray(states.reshape(parts * size, n)[:, lanes])
    own = times.shape[2] > 1
    grid = times.transpose(0, 2, 1)
    grid = np.ascontiguousarray(grid[:, lanes] if own else grid)
    time = np.zeros((2, width))
    time[0] = grid[0, :, 0]
    passed, found = np.zeros(width, dtype=np.int64), np.empty((count, parts * size, width))
    sense = float(np.sign(grid[0, 0, -1] - grid[0, 0, 0]))
    given = [x.ctypes.data for x in (time, run.parameters, grid)]
    left = width
    while left:
        check_stop()
        left = run.kernel(
            state.ctypes.data,
            width,
            *given,
            grid[0].size,
            count if own else 0,
            count,
            passed.ctypes.data,
            sense,
            groups,
            -(-STEPS // groups),
            found.ctypes.data,
        )
        if left and not np.isfinite(state[:, passed < count]).all():
            raise ArithmeticError("the integration ended early: an orbit did not reach its time")
    return found[..., :n].reshape(count, parts, size, n).transpose(1, 2, 0, 3)
