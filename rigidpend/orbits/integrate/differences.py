"""Differences of orbits of the aligned field, without cancellation.

The field is quadratic, f(x) = L x + B(x, x) with B symmetric. So the difference d = x - X of an
orbit x from a reference orbit X obeys

    d' = L d + B(d, 2 X + d),

where nothing cancels however small d is: it keeps its relative precision, and the reference
needs no more digits than d has. L and B are read off :func:`rigidpend.mechanics.equations.aligned`
itself.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits.integrate.kernel.lane_numbers import in_parts

SIZE = 6
"""Number of aligned components."""
KINDS: dict[int, Any] = {53: np.float64}
"""NumPy's types of so many bits: of 64, where a long double has as many."""
if np.finfo(np.longdouble).nmant == 63:
    KINDS[64] = np.longdouble

MORE_TERMS = 4
"""Terms of a difference's series beyond those that the reference's own would need."""


def array(values: Any, bits: int) -> Any:
    """An array in so many bits from a nested list of Fractions or floats."""
    if bits == 53:
        return np.array(values, dtype=float)
    exact = np.vectorize(Fraction, otypes=[object])(values)
    return in_parts(exact, 106).astype(KINDS[bits]).sum(axis=0)


class DifferenceField:
    """The field of a reference orbit and of differences from it, in one precision.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Floats or Fractions.
    bits : int
        One of `KINDS`.
    """

    def __init__(self, coefficients: AlignedCoefficients, bits: int) -> None:
        linear, products = polarised(coefficients)
        self.kind, self.linear = KINDS[bits], array(linear, bits)
        # B(d, s) holds d_i s_j and d_j s_i alike.
        pairs = [(i, j, products[i, j]) for i, j in products]
        pairs += [(j, i, products[i, j]) for i, j in products if i != j]
        self.left, self.right = (np.array([pair[k] for pair in pairs]) for k in (0, 1))
        halves = [[x / (2 if i != j else 1) for x in weight] for i, j, weight in pairs]
        self.weights = array(halves, bits).T

    def series(self, reference: Numbers, differences: Numbers, order: int) -> Any:
        """Taylor series of the reference orbit and of orbits beside it.

        Parameters
        ----------
        reference : (6,) array
            The state of the reference orbit.
        differences : (6, n) array
            Those of the other orbits less that.
        order : int

        Returns
        -------
        (order + 1, 6, 1 + n) array
            The coefficients of powers of t': in column 0 of the reference, then of differences.
        """
        n = 1 + differences.shape[1]
        terms = np.empty((order + 1, SIZE, n), dtype=self.kind)
        terms[0, :, 0], terms[0, :, 1:] = reference, differences
        left, right = np.empty((2, order, len(self.left), n), dtype=self.kind)
        for k in range(order):
            now = terms[k]
            total = now + 2 * now[:, :1]
            # The reference itself is a difference from the orbit that stays at zero.
            total[:, 0] = now[:, 0]
            now.take(self.left, axis=0, out=left[k], mode="clip")
            total.take(self.right, axis=0, out=right[k], mode="clip")
            products = np.einsum("kpn,kpn->pn", left[: k + 1], right[k::-1])
            terms[k + 1] = (self.linear @ now + self.weights @ products) / (k + 1)
        return terms


def series_order(bits: int, tolerance: float) -> int:
    """The order of a difference's Taylor series on the steps of a reference orbit.

    These are the radius of convergence over e^2, in any precision, so that each order gains two
    nats.
    """
    return math.ceil(((bits - 53) * math.log(2) - math.log(tolerance)) / 2) + MORE_TERMS


def scaled(series: Numbers, step: float) -> Any:
    """Series (order + 1, 6, n) with the step as the unit of time."""
    return series * (series.dtype.type(step) ** np.arange(len(series)))[:, None, None]


def summed(series: Numbers) -> Any:
    """The values (6, n) of scaled series at the end of the step, small terms first."""
    return series[::-1].sum(axis=0)


def polarised(coefficients: AlignedCoefficients) -> tuple[Any, dict[tuple[int, int], Any]]:
    """The aligned field's linear part, and the weights of its products x_i x_j, exactly.

    Returns
    -------
    linear : (6, 6) array of Fractions
        Its matrix.
    products : dict
        ``products[i, j]``, i <= j: what x_i x_j adds to each of the six components; products
        that add nothing are left out.
    """
    exactly = AlignedCoefficients(*map(Fraction, coefficients))

    def field(state: Any) -> Any:
        return np.array(aligned(state, exactly), dtype=object)

    ones = np.eye(SIZE, dtype=int) * Fraction(1)
    plus, minus = (np.array([field(one) for one in each]) for each in (ones, -ones))
    products = {}
    for i, j in combinations_with_replacement(range(SIZE), 2):
        both = (plus[i] + minus[i]) / 2 if i == j else field(ones[i] + ones[j]) - plus[i] - plus[j]
        if both.any():
            products[i, j] = both
    return (plus - minus).T / 2, products
