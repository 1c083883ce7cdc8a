"""Jacobi's elliptic functions and K, given a modulus k together with its complement k'.

Libraries take the parameter k^2 alone, which beside k = 1 has lost what distinguishes orbits:
k' is lost in its rounding. Here kc = k' > 0 is given too, and all sums have positive terms, so
that functions keep their relative precision down to k' = 1e-150. Over generic numbers: `m` is
numpy, math or an mpmath context.
"""

from __future__ import annotations

from typing import Any

from rigidpend.numbers.generic import Elementary, Scalar


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
