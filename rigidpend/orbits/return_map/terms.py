"""Tables as sums of their significant terms, over arrays.

A table over (x, phase, energy) holds the product of its orders; but its terms shrink with the
sum of these, so that most lie below rounding. What is left is summed as it stands: some 80 of
640 terms a function with the body of Fig. 4.
"""

from __future__ import annotations

import functools
import operator
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map.charts import ChartTable
from rigidpend.orbits.return_map.expansions import chebyshev_terms, fourier_terms

FUNCTIONS = 3
"""Functions of a chart that codes and times follow from: all but that of theta3."""


class Terms(NamedTuple):
    """Functions of x in [-width, width], of a phase and of an energy e in [-1, 1]."""

    width: Any
    values: Any
    """(energies, n_x, n_phase, functions) coefficients, 0 where a term is left out."""


def significant(table: ChartTable, threshold: float) -> Terms:
    """The terms of a table above `threshold`, relative to the largest of each function."""
    count = len(table.values)
    values = table.values.reshape(count, table.n_x, table.n_phase, -1)[..., :FUNCTIONS]
    return Terms(table.width, np.where(_sizes(values) > threshold, values, 0))


def in_doubles(terms: Terms) -> Terms:
    """The same terms, rounded."""
    return Terms(float(terms.width), terms.values.astype(float))


def nested(terms: Terms) -> list[Any]:
    """For each function a list of (i, [(k, [(l, value)])]): the terms T_i F_k E_l."""
    found = []
    for v in np.moveaxis(terms.values, 3, 0):
        energies = [[_nonzero(v[:, i, k]) for k in range(v.shape[2])] for i in range(v.shape[1])]
        rows = [[(k, row[k]) for k in range(len(row)) if row[k]] for row in energies]
        found.append([(i, row) for i, row in enumerate(rows) if row])
    return found


def evaluated(terms: Terms, lists: list[Any], x: Scalar, phase: Scalar, e: Scalar, m: Any) -> Any:
    """The functions at points, a list of arrays or expressions.

    Parameters
    ----------
    terms : Terms
    lists : list
        The same terms, :func:`nested`.
    x, phase, e : numbers, arrays or expressions
    m : namespace of sin and cos
    """
    count, n_x, n_phase = _sizes_used(terms.values)
    T, F = chebyshev_terms(x / terms.width, n_x), fourier_terms(phase, n_phase, m)
    E = chebyshev_terms(e, count)

    def total(function: Any) -> Any:
        return _sum(
            [(i, _sum([(k, _sum(pairs, E)) for k, pairs in row], F)) for i, row in function], T
        )

    return [total(function) + 0.0 * e for function in lists]


def polynomial(coefficients: Any, x: Scalar, e: Scalar) -> Any:
    """A polynomial in x with coefficients (energies, K) as Chebyshev sums in e, by Horner."""
    E = chebyshev_terms(e, len(coefficients))
    total: Any = 0
    for k in range(coefficients.shape[1] - 1, -1, -1):
        total = total * x + _sum(_nonzero(coefficients[:, k]), E)
    return total


def significant_powers(coefficients: Any, reach: float, threshold: float) -> Any:
    """Such coefficients for |x| <= reach without terms below `threshold` of the largest."""
    sizes = np.abs(coefficients.astype(float)) * reach ** np.arange(coefficients.shape[1])
    kept = sizes > threshold * sizes.max()
    return np.where(kept, coefficients, 0)[:, : 1 + np.flatnonzero(kept.any(axis=0)).max(initial=0)]


def _nonzero(coefficients: Any) -> list[tuple[int, Any]]:
    return [(l, x) for l, x in enumerate(coefficients) if x]


def _sum(pairs: list[tuple[int, Any]], basis: list[Any]) -> Any:
    """The sum of factors times the basis functions of those numbers; basis[0] is 1."""
    products = [x if k == 0 else x * basis[k] for k, x in pairs]
    return functools.reduce(operator.add, products) if products else 0


def _sizes(values: Any) -> Any:
    sizes = np.abs(values.astype(float))
    return sizes / np.maximum(sizes.max(axis=(0, 1, 2)), 1e-300)


def _sizes_used(values: Any) -> tuple[int, int, int]:
    """The sizes that hold all terms, the number of Fourier terms odd."""
    used = values != 0
    count, n_x, n_phase = (
        1 + np.flatnonzero(used.any(axis=tuple(j for j in range(4) if j != k))).max(initial=0)
        for k in range(3)
    )
    return int(count), int(n_x), int(n_phase) | 1
