"""Inertia ellipsoid, which rolls without sliding on a fixed plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.numbers.generic import Numbers


def ellipsoid(x: Numbers, A: Numbers) -> Any:
    """Quadratic form A1 x^2 + A2 y^2 + A3 z^2, which is 1 on the inertia ellipsoid (eq. el).

    Parameters
    ----------
    x : 3 numbers or arrays
        Points in principal axes, in units of 1/sqrt(moment of inertia).
    A : 3 numbers
    """
    return sum(A[i] * x[i] * x[i] for i in range(3))


def pole(omega: ArrayLike, A: Numbers) -> NDArray[np.float64]:
    """Point of contact rho = omega/sqrt(2 h0), on the ellipsoid along omega.

    Parameters
    ----------
    omega : (3, ...) array
        Physical, in principal axes, not zero.
    A : 3 numbers
    """
    omega = np.asarray(omega, dtype=float)
    return omega / np.sqrt(ellipsoid(omega, A))
