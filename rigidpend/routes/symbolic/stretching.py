"""Stretching: how a deviation grows from passage to passage, by the map's derivatives.

A deviation is one of the place on the section M3 = 0, between orbits of one energy. Its size is
the Euclidean norm of the change of (M', gamma), both dimensionless: six numbers that everybody
has who integrates the equations of motion. The logarithm of its growth through some passages, a
passage, is a finite-time exponent, and tends to the Lyapunov exponent of the return map. Another
norm changes the logarithm by a bounded amount, however many passages there are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigidpend.numbers.doubles import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.poincare import section_tangents
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients
from rigidpend.routes.symbolic.chain import Chain, tangents
from rigidpend.routes.symbolic.tables import Level


def stretching(level: Level, chain: Chain) -> Array:
    """ln of the growth of a deviation in each passage of a chain, (n,), by its part in chi.

    The deviation begins along chi, and has turned to the growing direction behind the first
    passage, but for a share of 1/growth^2. There d changes by a share of chi of the order of mu.
    """
    change, grown = np.array([0.0, 1.0]), []
    for slope in tangents(level, chain)[:, :2]:
        change = slope @ change
        grown.append(np.log(np.abs(change[1])))
        change = change / change[1]
    return np.array(grown)


def most_stretched(slopes: Sequence[Array], frames: Sequence[Array]) -> Array:
    """ln of the growth of the deviation that grows most, through 1 to n passages, (n, ...).

    Over the number of passages it is the finite-time exponent of whatever comes first.

    Parameters
    ----------
    slopes : n (2, 2, ...) arrays
        Derivatives of d and chi behind each passage in d and chi before it.
    frames : n + 1 (2, 2, ...) arrays
        `frame` at the first crossing, and behind each passage.
    """
    begun = np.moveaxis(frames[0], (0, 1), (-2, -1))
    whole = np.asarray(np.moveaxis(np.linalg.inv(begun), (-2, -1), (0, 1)), dtype=float)
    found = []
    for slope, behind in zip(slopes, frames[1:], strict=True):
        whole = product(slope, whole)
        found.append(np.log(largest_singular(product(behind, whole))))
    return np.array(found)


def frame(point: SectionPoint, h: Any, c: Coefficients) -> Array:
    """The matrices (2, 2, N) that make of changes of d and chi a vector as long as of (M', gamma).

    Parameters
    ----------
    point : SectionPoint
    h : (N,) array
        Energies, dimensionless.
    c : Coefficients
        In doubles, with M' in its own unit.
    """
    moved = euclidean(section_tangents(*point, h, c, precision(53)), c)
    one, other = moved[:, 0], moved[:, 1]
    length = np.sqrt((one * one).sum(axis=0))
    along = (one * other).sum(axis=0) / length
    across = other - along * one / length
    rows = (length, along), (0 * length, np.sqrt((across * across).sum(axis=0)))
    return np.array(rows)


def euclidean(deviations: Array, c: Coefficients) -> Array:
    """Changes of (M', gamma) in principal axes from those of the aligned components, (6, ...)."""
    Qp, Qm, *others = deviations
    return np.stack(((Qp + Qm) * c.to_M1, (Qp - Qm) * c.to_M2, *others))


def product(one: Array, other: Array) -> Array:
    """Products (2, 2, ...) of matrices (2, 2, ...)."""
    return np.asarray(np.einsum("ij...,jk...->ik...", one, other))


def largest_singular(matrix: Any) -> Any:
    """The larger singular value of matrices with two rows of two numbers or arrays."""
    (a, b), (c, d) = matrix
    return (np.hypot(a + d, b - c) + np.hypot(a - d, b + c)) / 2
