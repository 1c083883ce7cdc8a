"""Precession of the angular momentum about the vertical, at J3 = 0."""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.mechanics.body import SAME_WITHIN, Angles, Body
from rigidpend.numbers.exact import context
from rigidpend.numbers.generic import Numbers, Scalar


class Regime(Enum):
    """Order of theta3's increments along the separatrices, largest first.

    A value holds groups of equal increments, a number 1 to 4 standing for its separatrix and 0
    for no increment.
    """

    i = ((1, 2), (0,), (3, 4))
    ii = ((2,), (1,), (0,), (3,), (4,))
    iii = ((2,), (0, 1, 3), (4,))
    iv = ((2,), (3,), (0,), (1,), (4,))
    v = ((2, 3), (0,), (1, 4))

    def __str__(self) -> str:
        return " > ".join(" = ".join(map(str, group)) for group in self.value)


def regime(body: Body) -> Regime:
    """Order of the increments of theta3, by the body's angles (eq. trieq).

    beta0 = pi, beta0 = 0 and alpha0 = beta0 (the Hess case) are recognised as `Body.special_cases`
    tells: to within the rounding of doubles, from angles in 113 bits.

    Returns
    -------
    Regime
        i where beta0 = pi, ii where beta0 > alpha0, iii where they are equal, iv where
        beta0 < alpha0, v where beta0 = 0.
    """
    p, pi = body.angles(113), context(113).pi
    if abs(pi - p.beta0) <= SAME_WITHIN:
        return Regime.i
    if abs(p.beta0) <= SAME_WITHIN:
        return Regime.v
    if "Hess" in body.special_cases:
        return Regime.iii
    return Regime.ii if p.beta0 > p.alpha0 else Regime.iv


def increments(p: Angles, h0: float) -> NDArray[np.float64]:
    """Increments of theta3 along the separatrices, to first order in mu (eq. tri1).

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
    # The second form of (tri1): 2/J2_0^2 = kappa/h0.
    unit = p.mu * np.pi * p.kappa / (h0 * np.sin(p.alpha0))
    first = unit * np.sin((p.beta0 - p.alpha0) / 2)
    second = unit * np.sin((p.beta0 + p.alpha0) / 2)
    # 3 and 4 lie 2 pi further in theta1, where sin(theta1/2) of (th3) has the opposite sign.
    return np.array([first, second, -first, -second])


def plateaus(separatrices: ArrayLike, p: Angles, h0: float) -> NDArray[np.float64]:
    """Plateaus of theta3 near the periodic orbits that a route passes, to first order in mu.

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


def turning_rate(M: Numbers, r: Numbers, mu: Scalar) -> Any:
    """Rate of theta3 in time t, mu r . M/M^2, from physical M.

    It is (th3) in other variables. It has no singularity at J1 = 0 or J1 = J2, where theta1
    has no value.
    """
    return mu * sum(r[i] * M[i] for i in range(3)) / sum(x * x for x in M)
