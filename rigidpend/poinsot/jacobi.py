"""Jacobi's functions and the complete integral K from the complementary modulus.

Libraries take the parameter m = k^2, which beside k = 1 has lost what distinguishes orbits:
with k' = 1e-5 it leaves six digits of m' = 1 - m. Here k' is given, and all sums have positive
terms, so that sn, cn and dn keep their relative precision down to k' = 1e-150.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

NEGLIGIBLE = 1e-9
"""The step after a modulus this small changes functions by less than its square."""


class Modulus(NamedTuple):
    """An elliptic modulus with its descending Landen chain."""

    kc: float
    """The complementary modulus k' = sqrt(1 - k^2)."""
    chain: tuple[tuple[float, float], ...]
    """The moduli k1 = (1 - k')/(1 + k') of the chain, each with 1 - k1."""
    K: float
    """The complete integral of the first kind."""


def modulus(kc: float) -> Modulus:
    """The modulus with complementary modulus `kc`, 0 < kc <= 1.

    Notes
    -----
    K errs by 2 ulp at most.
    """
    chain: list[tuple[float, float]] = []
    K, c = np.pi / 2, kc
    while not chain or chain[-1][0] > NEGLIGIBLE:
        k1 = (1 - c) / (1 + c)
        chain.append((k1, 2 * c / (1 + c)))
        K *= 1 + k1
        c = 2 * np.sqrt(c) / (1 + c)
    return Modulus(kc, tuple(chain), float(K))


def reduced(u: ArrayLike, modulus: Modulus) -> tuple[Any, Any]:
    """N and v with u = 2 N K + v and |v| <= K."""
    u = np.asarray(u, dtype=float)
    turns = np.rint(u / (2 * modulus.K))
    return turns, np.clip(u - 2 * modulus.K * turns, -modulus.K, modulus.K)


def sncndn(u: ArrayLike, modulus: Modulus) -> NDArray[np.float64]:
    """sn, cn and dn, stacked: (3, ...).

    Notes
    -----
    The relative error is 4 ulp times 1 + |u| at most, which is that of the argument; beside a
    zero of sn (but 0) or cn it is that of the distance. sn^2 + cn^2 = 1 and dn^2 = k'^2 + k^2 cn^2
    hold to rounding.
    """
    turns, v = reduced(u, modulus)
    v = v * (np.pi / 2 / modulus.K)
    sn, cn, dn = np.sin(v), np.cos(v), np.ones_like(v)
    for k1, k1c in reversed(modulus.chain):
        scale = 1 + k1 * sn**2
        sn, cn, dn = (1 + k1) * sn / scale, cn * dn / scale, (k1c + k1 * cn**2) / scale
    # The chain errs along the orbit and across it; what is across is known without it.
    norm = np.hypot(sn, cn) * (1 - 2 * np.mod(turns, 2))
    sn, cn = sn / norm, cn / norm
    return np.stack(
        (sn, cn, np.hypot(modulus.kc, np.sqrt((1 - modulus.kc) * (1 + modulus.kc)) * cn))
    )
