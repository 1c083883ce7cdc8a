"""Jacobi's elliptic functions and K, given a modulus k together with its complement k'.

Libraries take the parameter k^2 alone, which beside k = 1 has lost what distinguishes orbits:
k' is lost in its rounding. Here kc = k' > 0 is given too, and all sums have positive terms, so
that functions keep their relative precision down to k' = 1e-150. Over generic numbers: `m` is
numpy, math or an mpmath context. In doubles a :class:`Modulus` carries them over many turns.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.numbers.generic import Array, Elementary, Scalar


def sncndn(u: Scalar, k: Scalar, kc: Scalar, m: Elementary) -> tuple[Any, Any, Any]:
    """Compute sn, cn and dn of u.

    Gauss's transformation to smaller moduli, written without differences, so that dn is
    right where it is as small as kc.
    """
    moduli = _moduli(k, kc, m)
    # One rounding of the argument, however many moduli.
    x = u / _stretch(moduli)
    sn, cn, dn = m.sin(x), m.cos(x), 1 + 0 * x
    for lower, rest in reversed(moduli):
        below = 1 + lower * sn * sn
        # 1 - lower sn^2, where rest is 1 - lower. Errors of the lowest steps grow the most,
        # and there this form has hardly any.
        above = rest + lower * cn * cn
        sn, cn, dn = (1 + lower) * sn / below, cn * dn / below, above / below
    return sn, cn, dn


def K(k: Scalar, kc: Scalar, m: Elementary) -> Any:
    """Complete integral K(k), a quarter of the period of sn."""
    return m.pi / 2 * _stretch(_moduli(k, kc, m))


class Modulus(NamedTuple):
    """An elliptic modulus."""

    k: float
    kc: float
    """Complementary modulus k' = sqrt(1 - k^2), which has the relative precision."""
    K: float
    """Complete integral of the first kind."""


def modulus(kc: float) -> Modulus:
    """Make the modulus with complementary modulus `kc`, 0 < kc <= 1; K errs by 2 ulp at most."""
    k = math.sqrt((1 - kc) * (1 + kc))
    return Modulus(k, kc, float(K(k, kc, math)))


def reduced(u: ArrayLike, modulus: Modulus) -> tuple[Any, Any]:
    """Reduce u to N and v with u = 2 N K + v and |v| <= K."""
    u = np.asarray(u, dtype=float)
    # By half periods, for sn and cn there change only their signs.
    turns = np.rint(u / (2 * modulus.K))
    return turns, np.clip(u - 2 * modulus.K * turns, -modulus.K, modulus.K)


def over_turns(u: ArrayLike, modulus: Modulus) -> Array:
    """Compute sn, cn and dn of any u in double precision, stacked: (3, ...).

    The relative error is 4 ulp times 1 + |u| at most, which is that of the argument; beside a zero
    of sn (but 0) or cn it is that of the distance. sn^2 + cn^2 = 1 and dn^2 = k'^2 + k^2 cn^2 hold
    to rounding.
    """
    turns, v = reduced(u, modulus)
    sn, cn, _ = sncndn(v, modulus.k, modulus.kc, np)
    # The transformation errs along the orbit and across it; what is across is known without.
    norm = np.hypot(sn, cn) * (1 - 2 * np.mod(turns, 2))
    sn, cn = sn / norm, cn / norm
    return np.stack((sn, cn, np.hypot(modulus.kc, modulus.k * cn)))


def _moduli(k: Scalar, kc: Scalar, m: Elementary) -> list[tuple[Any, Any]]:
    """Moduli below k, (1 - kc)/(1 + kc) each, until they are rounding; with 1 less each."""
    found = []
    # The moduli fall quadratically, so a few steps do in any precision of `m`.
    while 1 + k * k != 1:
        # Only 1 + lower counts, so a difference does no harm.
        k, rest = (1 - kc) / (1 + kc), 2 * kc / (1 + kc)
        kc = 2 * m.sqrt(kc) / (1 + kc)
        found.append((k, rest))
    return found


def _stretch(moduli: list[tuple[Any, Any]]) -> Any:
    """Complete integral K in units of pi/2."""
    product = 1
    for lower, _ in moduli:
        product = product * (1 + lower)
    return product
