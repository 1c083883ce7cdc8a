"""Precession of the angular momentum about the vertical, at J3 = 0."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.body import Angles
from rigidpend.equations import Numbers


def increments(p: Angles, h0: float) -> NDArray[np.float64]:
    """What theta3 gains along each of the separatrices, to first order in mu (eq. tri1).

    Parameters
    ----------
    p : Angles
        Of the body, floats.
    h0 : float
        Energy constant, kappa J2_0^2/2.

    Returns
    -------
    (4,) array
        Radians, for the separatrices 1, 2, 3, 4.

    Notes
    -----
    The separatrices 1 and 3 lie at theta1 = beta0 - alpha0 (+ 2 pi), as in (sol_1) and
    (sol_12). The initial values alpha0 - beta0 (+ 2 pi) printed beside their increments are a
    slip; the increments are right.
    """
    unit = p.mu * np.pi * p.kappa / (h0 * np.sin(p.alpha0))
    first = unit * np.sin((p.beta0 - p.alpha0) / 2)
    second = unit * np.sin((p.beta0 + p.alpha0) / 2)
    return np.array([first, second, -first, -second])


def plateaus(separatrices: ArrayLike, p: Angles, h0: float) -> NDArray[np.float64]:
    """theta3 near the periodic orbits that a route passes, to first order in mu.

    Parameters
    ----------
    separatrices : k ints
        1..4, in the order of the route, which starts near a periodic orbit at theta3 = 0.
    p, h0 : as in :func:`increments`

    Returns
    -------
    (k + 1,) array
        Radians, before the first separatrix and after each.
    """
    gained = increments(p, h0)[np.asarray(separatrices, dtype=int) - 1]
    return np.concatenate(([0.0], np.cumsum(gained)))


def turning_rate(M: Numbers, r: Numbers, mu: Any) -> Any:
    """Rate of theta3 in time t, mu r . M/M^2, from physical M.

    It is (th3) in other variables. It has no singularity at J1 = 0 or J1 = J2, where theta1
    has no value.
    """
    return mu * sum(r[i] * M[i] for i in range(3)) / sum(x * x for x in M)
