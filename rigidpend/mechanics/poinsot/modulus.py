"""Jacobi's functions over many turns in double precision, by modulus and complement."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.mechanics import jacobi


class Modulus(NamedTuple):
    """An elliptic modulus."""

    k: float
    kc: float
    """Complementary modulus k' = sqrt(1 - k^2), which has the relative precision."""
    K: float
    """Complete integral of the first kind."""


def modulus(kc: float) -> Modulus:
    """Make the modulus with complementary modulus `kc`, 0 < kc <= 1.

    Notes
    -----
    K errs by 2 ulp at most.
    """
    k = math.sqrt((1 - kc) * (1 + kc))
    return Modulus(k, kc, float(jacobi.K(k, kc, math)))


def reduced(u: ArrayLike, modulus: Modulus) -> tuple[Any, Any]:
    """Reduce u to N and v with u = 2 N K + v and |v| <= K."""
    u = np.asarray(u, dtype=float)
    # By half periods, for sn and cn there change only their signs.
    turns = np.rint(u / (2 * modulus.K))
    return turns, np.clip(u - 2 * modulus.K * turns, -modulus.K, modulus.K)


def sncndn(u: ArrayLike, modulus: Modulus) -> NDArray[np.float64]:
    """Compute sn, cn and dn, stacked: (3, ...).

    Notes
    -----
    The relative error is 4 ulp times 1 + |u| at most, which is that of the argument; beside a
    zero of sn (but 0) or cn it is that of the distance. sn^2 + cn^2 = 1 and dn^2 = k'^2 + k^2 cn^2
    hold to rounding.
    """
    turns, v = reduced(u, modulus)
    sn, cn, _ = jacobi.sncndn(v, modulus.k, modulus.kc, np)
    # The transformation errs along the orbit and across it; what is across is known without.
    norm = np.hypot(sn, cn) * (1 - 2 * np.mod(turns, 2))
    sn, cn = sn / norm, cn / norm
    return np.stack((sn, cn, np.hypot(modulus.kc, modulus.k * cn)))
