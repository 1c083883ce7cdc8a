"""Rates of the normal form as polynomials in I, and how deep an orbit goes into it."""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map.normal_form import NormalForm
from rigidpend.orbits.return_map.precision import Precision
from rigidpend.orbits.return_map.program import radians
from rigidpend.orbits.return_map.terms import Terms, polynomial, significant_powers


class Rates(NamedTuple):
    """Coefficients (energies, K) in I; a depth is ln(W^2)/(2 Lambda) less whole turns."""

    reciprocal: Any
    """Coefficients of 1/Lambda."""
    rest: Any
    """Coefficients of ln(scale)/Lambda less 2 pi `turns`."""
    rotation: Any
    """Coefficients of the mean dt'/dpsi."""
    turns: float
    scale: float
    """W is divided by it."""


def chart_rates(
    nf: NormalForm, chart: Terms, which: int, reach: float, threshold: float, a: Precision
) -> Rates:
    """The rates for a chart's U (`which` 0) or V (1)."""
    size = float(np.abs(chart.values[..., which]).max())
    return rates_at(nf, size, reach, threshold, a)


def rates_at(nf: NormalForm, size: float, reach: float, threshold: float, a: Precision) -> Rates:
    """The rates where |W| is of the order of `size`."""
    scale = 2.0 ** round(math.log2(size))
    at_nodes = nf.energies.basis(nf.energies.nodes(a), a)
    exponent = at_nodes @ nf.exponent
    reciprocal = _reciprocal(exponent)
    deep = a.log(a.number(scale)) * reciprocal
    turns = float(np.round(float(deep[0, 0]) / (2 * math.pi)))
    for part in radians(turns):
        deep[:, 0] = deep[:, 0] - part
    back = nf.energies.analysis(a)
    kept = functools.partial(significant_powers, reach=reach, threshold=threshold)
    return Rates(kept(back @ reciprocal), kept(back @ deep), kept(nf.rotation), turns, scale)


def _reciprocal(series: Any) -> Any:
    """Coefficients (nodes, K) of one over a power series."""
    found = np.zeros_like(series)
    found[:, 0] = 1 / series[:, 0]
    for k in range(1, series.shape[1]):
        known = sum(series[:, j] * found[:, k - j] for j in range(1, k + 1))
        found[:, k] = -known * found[:, 0]
    return found


def depth_of(W: Scalar, I: Scalar, e: Scalar, rates: Rates) -> Any:
    """ln|W|/Lambda(I) less the whole turns."""
    near = np.log(np.abs(W / rates.scale)) * polynomial(rates.reciprocal, I, e)
    return near + polynomial(rates.rest, I, e)
