"""Rates of the normal form as polynomials in I, which tell how deep an orbit goes into it."""

from __future__ import annotations

import functools
import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision


class Rates(NamedTuple):
    """Rates where |W| is of the order of `scale`; a depth is ln|W|/Lambda less whole turns."""

    coefficients: tuple[Any, Any, Any]
    """Coefficients (energies, K) in I: of 1/Lambda, ln(scale)/Lambda less the turns, dt'/dpsi."""
    turns: float
    scale: float
    """W is divided by it."""

    def joined(self, side: int, width: Any) -> Any:
        """The coefficients of the three polynomials as those of one in I/width.

        They are (energies, K, 3), all times `side`.
        """
        most = max(x.shape[1] for x in self.coefficients)
        first = self.coefficients[0]
        found = np.zeros_like(first, shape=(len(first), most, len(self.coefficients)))
        for j, x in enumerate(self.coefficients):
            found[:, : x.shape[1], j] = side * x
        power = width
        for k in range(1, most):
            found[:, k] = found[:, k] * power
            power = power * width
        return found


def rates_at(nf: NormalForm, size: float, reach: float, threshold: float, a: Precision) -> Rates:
    """The rates where |W| is of the order of `size`, for |I| <= reach.

    Terms below `threshold`, relative to the largest, are left out.
    """
    scale = 2.0 ** round(math.log2(size))
    at_nodes = nf.energies.basis(nf.energies.nodes(a), a)
    exponent = at_nodes @ nf.exponent
    reciprocal = _reciprocal(exponent)
    deep = a.log(a.number(scale)) * reciprocal
    turns = float(np.round(float(deep[0, 0]) / (2 * math.pi)))
    for part in radians(turns):
        deep[:, 0] = deep[:, 0] - part
    back = nf.energies.analysis(a)
    kept = functools.partial(_significant, reach=reach, threshold=threshold)
    found = kept(back @ reciprocal), kept(back @ deep), kept(nf.rotation)
    return Rates(found, turns, scale)


def radians(turns: float) -> tuple[float, float]:
    """Whole turns in radians, as a sum of two doubles."""
    exactly = fraction(2 * context(160).pi * int(turns), 160)
    return float(exactly), float(exactly - Fraction(float(exactly)))


def _significant(coefficients: Any, reach: float, threshold: float) -> Any:
    """Coefficients of powers of x, |x| <= reach, without terms below `threshold` of the largest."""
    sizes = np.abs(coefficients.astype(float)) * reach ** np.arange(coefficients.shape[1])
    kept = sizes > threshold * sizes.max()
    return np.where(kept, coefficients, 0)[:, : 1 + np.flatnonzero(kept.any(axis=0)).max(initial=0)]


def _reciprocal(series: Any) -> Any:
    """Coefficients (nodes, K) of one over a power series."""
    found = np.zeros_like(series)
    found[:, 0] = 1 / series[:, 0]
    for k in range(1, series.shape[1]):
        known = sum(series[:, j] * found[:, k - j] for j in range(1, k + 1))
        found[:, k] = -known * found[:, 0]
    return found
