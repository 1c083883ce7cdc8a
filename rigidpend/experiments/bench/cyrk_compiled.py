"""CyRK: its compiled integrators, called in a compiled loop over the orbits, without Python.

CyRK's events call Python, so crossings are searched in its dense output, as users of numba do.
"""

import functools

import numpy as np
from CyRK import nb_diffeq_addr, nbsolve2_ivp
from numba import njit

from rigidpend.experiments.bench.methods import SMALLER
from rigidpend.experiments.bench.problems import flat
from rigidpend.mechanics.body import Body

PIECES = 8
"""Number of pieces of the time; each is searched for crossings until there are enough."""
FALSE_POSITIONS = 40
"""Most steps of false position to a crossing within a step; about eight are enough."""


# Without what would make Python objects of its results: a quarter less to compile.
solve = njit(nogil=True, no_cpython_wrapper=True)(nbsolve2_ivp.py_func)


@functools.cache
def field_pointer(body: Body) -> int:
    """The place in memory of the compiled field."""
    found: int = nb_diffeq_addr(flat(body))
    return found


@njit(nogil=True, no_cpython_wrapper=True)  # type: ignore[misc, unused-ignore]
def _zero(found, a, b, fa, fb):  # type: ignore[no-untyped-def]
    """The zero of M3 between two times, by false position in the Illinois variant."""
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
def crossings(address, orbits, wanted, end, method, tolerance):  # type: ignore[no-untyped-def]
    """Time, M1 and M2 at the crossings, (n, wanted, 3)."""
    at, piece = np.full((orbits.shape[0], wanted, 3), np.nan), end / PIECES
    for column in range(orbits.shape[0]):
        state, start, count = orbits[column].copy(), 0.0, 0
        for _ in range(PIECES):
            found = solve(
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
