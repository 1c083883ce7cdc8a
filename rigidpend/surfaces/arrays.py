"""Arrays of numbers for many orbits at once: doubles, or mpmath's with guard bits."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from operator import mul
from typing import Any

import numpy as np

from rigidpend.numbers.exact import context

FUNCTIONS = {"sin": 1, "cos": 1, "sqrt": 1, "atan2": 2, "nint": 1}
"""Functions of arrays, with the number of their arguments."""


class Arrays:
    """Arrays of one kind, with their elementary functions.

    Parameters
    ----------
    bits : int
        Precision of the numbers; 0 stands for NumPy's doubles.
    """

    sin: Any
    cos: Any
    sqrt: Any
    atan2: Any
    nint: Any

    def __init__(self, bits: int) -> None:
        self.bits, self.m = bits, context(bits or 53)
        for name, arguments in FUNCTIONS.items():
            of_doubles = np.rint if name == "nint" else getattr(np, name)
            of_any = np.frompyfunc(getattr(self.m, name), arguments, 1)
            setattr(self, name, of_any if bits else of_doubles)
        self.pi = self.number(self.m.pi)

    def number(self, x: Any) -> Any:
        """A number of this kind from an mpmath number, a float or an int."""
        return self.m.mpf(x) if self.bits else float(x)

    def array(self, values: Iterable[Any]) -> Any:
        """An array (n,) of this kind from such numbers."""
        return np.array([self.number(x) for x in values], dtype=object if self.bits else float)

    def derivative(self, values: Any) -> Any:
        """Derivative of the trigonometric interpolant at its n nodes around a circle, n even."""
        n, m = len(values), self.m
        weights = [m.mpf(0), *((-1) ** k / m.tan(m.pi * k / n) / 2 for k in range(1, n))]
        if self.bits:
            return self._around(weights, values)
        # They sum up to zero: the largest, next to the node, come to small differences.
        to_node = self.array(weights)[np.arange(n)[:, None] - np.arange(n)]
        return (to_node * (values - values[:, None])).sum(axis=1)

    def _around(self, weights: list[Any], values: Any) -> Any:
        """The sums over j of ``weights[i - j] values[j]``, indices around the circle.

        They are summed as whole numbers, in units of 2^-P with P the precision: some ten times
        as fast.
        """
        n, m, P = len(values), self.m, self.bits
        # Turned, so that each sum is one of successive weights.
        turned = [weights[-k] for k in range(n)]
        whole, around = ([int(m.ldexp(x, P)) for x in given] for given in (values, turned * 2))
        sums = [sum(map(mul, around[n - i : 2 * n - i], whole)) for i in range(n)]
        return np.array([m.ldexp(total, -2 * P) for total in sums], dtype=object)


@functools.cache
def arrays(bits: int) -> Arrays:
    """The arrays of a kind; they hold no state, so threads may share it."""
    return Arrays(bits)
