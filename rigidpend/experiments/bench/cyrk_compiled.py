"""CyRK: its compiled integrators, called in a compiled loop over the orbits, without Python.

Its events need Python, so crossings are looked up in its dense output, as numba's users do.
"""

from __future__ import annotations

import functools
from functools import partial

import numpy as np
from CyRK import nb_diffeq_addr, nbsolve2_ivp
from numba import njit

from rigidpend.experiments.bench.problems import Task
from rigidpend.experiments.bench.solvers import SMALLER, Solver, crossed, flat
from rigidpend.mechanics.body import Body
from rigidpend.numbers.generic import Array

PIECES = 8
"""Pieces of the horizon; crossings are looked up in each, until there are enough."""
FALSE_POSITIONS = 40
"""At most so many steps from the ends of a step to a crossing in it; about eight are enough."""


def answered(task: Task, tolerance: float, method: str) -> Solver:
    """The answer to any task."""
    orbits = np.ascontiguousarray(task.states.T)
    address = _address(task.body, len(task.states))
    if task.kind == "routes":
        wanted, piece = task.problem.n_symbols + 1, float(task.times.max()) / PIECES
        given = address, orbits, wanted, piece, method, tolerance
        return Solver(lambda: _crossings(*given).T, partial(crossed, body=task.body))

    def solve() -> Array:
        ended: Array = _ends(address, orbits, task.times, method, tolerance)
        if not np.isfinite(ended).all():
            raise ArithmeticError("an orbit did not reach its time")
        return ended.T

    return Solver(solve)


@functools.cache
def _address(body: Body, size: int) -> int:
    """The address of the compiled field."""
    address: int = nb_diffeq_addr(flat(body, size))
    return address


@njit(nogil=True)  # type: ignore[misc, unused-ignore]
def _ends(address, states, times, method, tolerance):  # type: ignore[no-untyped-def]
    ended = np.full_like(states, np.nan)
    for k in range(states.shape[0]):
        span, begun = (0.0, times[k]), states[k].copy()
        found = nbsolve2_ivp(address, span, begun, method, rtol=tolerance, atol=SMALLER * tolerance)
        if found.success:
            ended[k] = found.y[:, -1]
        found.free()
    return ended


@njit(nogil=True)  # type: ignore[misc, unused-ignore]
def _zero(found, a, b, fa, fb):  # type: ignore[no-untyped-def]
    """The zero of M3 between two times, by false positions after Illinois."""
    for _ in range(FALSE_POSITIONS):
        c = b - fb * (b - a) / (fb - fa)
        fc = found.call(c)[2, 0]
        if (fc < 0) != (fb < 0):
            a, fa = b, fb
        else:
            fa *= 0.5
        near = abs(c - b) <= 4e-16 * abs(c)
        b, fb = c, fc
        if near or fc == 0.0:
            break
    return b


@njit(nogil=True)  # type: ignore[misc, unused-ignore]
def _crossings(address, orbits, wanted, piece, method, tolerance):  # type: ignore[no-untyped-def]
    """Time, M1 and M2 at the crossings, (n, wanted, 3)."""
    at = np.full((orbits.shape[0], wanted, 3), np.nan)
    for column in range(orbits.shape[0]):
        state, start, count = orbits[column].copy(), 0.0, 0
        for _ in range(PIECES):
            found = nbsolve2_ivp(
                address, (start, start + piece), state, method, dense_output=True,
                rtol=tolerance, atol=SMALLER * tolerance,
            )  # fmt: skip
            t, y = found.t, found.y
            for k in range(t.size - 1):
                if count < wanted and (y[2, k] < 0) != (y[2, k + 1] < 0):
                    high = _zero(found, t[k], t[k + 1], y[2, k], y[2, k + 1])
                    there = found.call(high)
                    at[column, count, 0] = high
                    at[column, count, 1], at[column, count, 2] = there[0, 0], there[1, 0]
                    count += 1
            state, start = y[:, -1].copy(), start + piece
            ok = found.success
            found.free()
            if count == wanted or not ok:
                break
    return at
