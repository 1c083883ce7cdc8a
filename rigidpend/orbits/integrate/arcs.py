"""Arcs of the aligned field at given times, in any precision, in the numbers of a precision.

They are the states of `states`; `integrate.sample_orbits` serves doubles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits.integrate import sample_orbits as in_doubles
from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.integrate.states import carried, in_kernel_s_numbers, rational


def arcs(coefficients: AlignedCoefficients, states: Numbers, times: Numbers, bits: int) -> Any:
    """Orbits at given times of either sign.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Numbers of the precision: doubles, pairs of them or mpmath's.
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
        exact = AlignedCoefficients(*(x.exactly() for x in coefficients))
        return PairArray(in_kernel_s_numbers(exact, states.parts, times.parts, bits))
    exactly, number = np.frompyfunc(rational, 1, 1), type(states.flat[0]).context.mpf
    found = carried(
        AlignedCoefficients(*map(rational, coefficients)), exactly(states), exactly(times), bits
    )
    return np.frompyfunc(lambda x: number(x.numerator) / x.denominator, 1, 1)(found)
