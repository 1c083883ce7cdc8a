"""Arcs of the aligned field at given times, in any precision.

`integrate.sample_orbits` serves doubles; here longer numbers are carried in pairs of doubles up to
106 bits, in heyoka's types where it has them, and in integers elsewhere.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Numbers, Scalar
from rigidpend.orbits.integrate import (
    FINEST_TOLERANCE,
    bigint,
    default_engine,
    has_own_type,
)
from rigidpend.orbits.integrate import sample_orbits as in_doubles
from rigidpend.orbits.integrate.kernel.parts import in_parts, split
from rigidpend.orbits.integrate.pair_arrays import PairArray

LARGEST_TYPE = 113
"""Bits of the largest type of NumPy's arrays; numbers of more are mpmath's."""
SPARE_BITS = 8
"""Bits below the precision to which series are cut off in pairs of doubles."""


def arcs(coefficients: AlignedCoefficients, states: Numbers, times: Numbers, bits: int) -> Any:
    """Orbits at given times of either sign.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Numbers of the precision: doubles, long doubles, heyoka's real128 or mpmath's.
    states : (6, n) array of such numbers
        Aligned components at time 0.
    times : (k,) array of such numbers
        t', ascending from 0 or descending from 0, which is not among them.
    bits : int

    Returns
    -------
    (6, k, n) array
    """
    if bits == 53:
        return in_doubles(coefficients, states, np.concatenate(([0.0], times)))[:, 1:]
    if isinstance(states, PairArray):
        return _of_pairs(coefficients, states, times, bits)
    compiled = default_engine() == "taylor"
    if bits <= 106 and compiled:
        return _in_pairs(coefficients, states, times, bits)
    own = compiled and has_own_type("taylor", bits)
    if own and bits <= LARGEST_TYPE:
        return _in_series(coefficients, states, times, bits)
    one = _in_reals if own else _in_integers
    columns = [one(coefficients, state, times, bits) for state in states.T]
    return np.stack(columns, axis=-1)


def _of_pairs(c: AlignedCoefficients, states: PairArray, times: PairArray, bits: int) -> PairArray:
    """Arcs by the kernel: to the doubles nearest to the times, and from there to the times."""
    from rigidpend.orbits.integrate.batch_samples import sample_aligned

    nearest, late = times.parts
    found = sample_aligned(
        AlignedCoefficients(*(x.exactly() for x in c)),
        states.parts,
        np.concatenate(([0.0], nearest)),
        106,
        FINEST_TOLERANCE["taylor"] * 2.0 ** (53 - min(106, bits + SPARE_BITS)),
    )[:, :, 1:]
    # What is left of a time is below an ulp of a double: doubles tell its change to 2^-104.
    rates = np.stack(aligned(found[0], AlignedCoefficients(*map(float, c))))
    return PairArray(found) + late[:, None] * rates


def _in_pairs(c: AlignedCoefficients, states: Numbers, times: Numbers, bits: int) -> Any:
    """Arcs by the kernel: to the doubles nearest to the times, and from there to the times."""
    from rigidpend.orbits.integrate.batch_samples import sample_aligned
    from rigidpend.orbits.integrate.compiled import exactly

    number, of_numpy = type(states.flat[0]), states.dtype != object
    begin = split(states, 2) if of_numpy else in_parts(np.frompyfunc(exactly, 1, 1)(states), 106)
    nearest = np.array([float(t) for t in times])
    late = np.array([t - number(near) for t, near in zip(times, nearest, strict=True)])
    found = sample_aligned(
        AlignedCoefficients(*map(exactly, c)),
        begin,
        np.concatenate(([0.0], nearest)),
        106,
        FINEST_TOLERANCE["taylor"] * 2.0 ** (53 - min(106, bits + SPARE_BITS)),
    )[:, :, 1:]
    made = found.astype(states.dtype) if of_numpy else np.frompyfunc(number, 1, 1)(found)
    high, low = made
    here, h = high + low, late[:, None]
    # The midpoint rule errs by h^3, with h below an ulp of a double.
    middle = here + h / 2 * np.stack(aligned(here, c))
    return here + h * np.stack(aligned(middle, c))


def _in_series(c: AlignedCoefficients, states: Numbers, times: Numbers, bits: int) -> Any:
    from rigidpend.orbits.integrate.compiled import borrowed

    grid = np.concatenate((times[:1] * 0, times))
    with borrowed(_Arc, bits) as arc:
        return np.stack([arc.run(c, state, grid) for state in states.T], axis=-1)


class _Arc:
    """An integrator of one orbit of the aligned field, without events."""

    def __init__(self, bits: int) -> None:
        from rigidpend.orbits.integrate.compiled import aligned_system, heyoka, working_type

        self.type = working_type(bits)
        zero, (field, _) = self.type(0), aligned_system(heyoka())
        self.integrator = heyoka().taylor_adaptive(
            field,
            [zero] * 6,
            time=zero,
            pars=[zero] * 9,
            fp_type=self.type,
            tol=self.type(FINEST_TOLERANCE["taylor"] * 2.0 ** (53 - bits)),
            compact_mode=bits > 64,
        )

    def run(self, c: AlignedCoefficients, state: Numbers, grid: Numbers) -> Any:
        self.integrator.pars[:] = list(c)
        self.integrator.state[:] = state
        self.integrator.time = self.type(0)
        found = self.integrator.propagate_grid(grid)[-1]
        if len(found) != len(grid):
            raise ArithmeticError("an orbit did not reach the last of the times")
        return found[1:].T


def _in_reals(c: AlignedCoefficients, state: Numbers, times: Numbers, bits: int) -> Any:
    """(6, k) mpmath numbers, by heyoka's numbers of any precision."""
    from rigidpend.orbits.integrate.compiled import in_series

    exact = AlignedCoefficients(*map(rational, c))
    begin, grid = [rational(x) for x in state], [rational(t) for t in times]
    found = in_series(exact, begin, grid, bits, FINEST_TOLERANCE["taylor"])
    number = type(state[0]).context.mpf
    made = [[number(x.numerator) / x.denominator for x in row] for row in found]
    return np.array(made, dtype=object).T


def _in_integers(c: AlignedCoefficients, state: Numbers, times: Numbers, bits: int) -> Any:
    """(6, k) mpmath numbers, by Taylor series of an error below their rounding."""
    numbers, number = type(state[0]).context, type(state[0])
    exact = [rational(x) for x in state]
    unit = bigint.unit_of(exact)
    scaled, here = bigint.in_units(AlignedCoefficients(*map(rational, c)), exact, unit)
    P = bigint.fractional_bits((*here, *scaled), bits)
    backward = times[0] < 0
    if backward:
        # With t and M3 reversed, and gamma3 with them, the field is the same.
        here = _reversed(here)
    flow = bigint.Flow([bigint.fixed(x, P) for x in scaled], P)
    fixed, time = [bigint.fixed(x, P) for x in here], 0
    found: list[list[Fraction]] = []
    goals = [bigint.fixed(abs(rational(t)) * unit, P) for t in times]
    while len(found) < len(goals):
        series, step = flow.expand(fixed)
        while len(found) < len(goals) and goals[len(found)] <= time + step:
            at = goals[len(found)] - time
            there = [Fraction(bigint.value_at(s, at, P), 1 << P) for s in series]
            there = [*(x * unit for x in there[:3]), *there[3:]]
            found.append(_reversed(there) if backward else there)
        fixed = [bigint.value_at(s, step, P) for s in series]
        time += step
    made = [[numbers.mpf(x.numerator) / x.denominator for x in row] for row in found]
    return np.array(made, dtype=object if number else None).T


def _reversed(state: Numbers) -> list[Any]:
    Qp, Qm, M3, gamma1, gamma2, gamma3 = state
    return [Qp, Qm, -M3, gamma1, gamma2, -gamma3]


def rational(x: Scalar) -> Fraction:
    """The value of an mpmath number."""
    from mpmath.libmp import to_rational

    return Fraction(*map(int, to_rational(x._mpf_)))
