"""Jacobi's elliptic functions and K, given the complement k' = sqrt(1 - k^2) of a modulus k.

Libraries take only the parameter k^2. Near k = 1 its rounding loses k', which distinguishes the
orbits. Here kc = k' > 0 is given, and all sums have positive terms, so that the functions keep
their relative precision down to k' = 1e-150. Numbers are generic: `m` is numpy, math or an mpmath
context.
"""

from typing import Any

from rigidpend.numbers import Elementary, Scalar


def sncndn(u: Scalar, kc: Scalar, m: Elementary) -> tuple[Any, Any, Any]:
    """Compute sn, cn and dn of u.

    The method is Gauss's transformation to smaller moduli, written without differences, so that dn
    keeps its relative precision where it is as small as kc.
    """
    moduli = _moduli(kc, m)
    # One division, so that the argument is rounded once however many moduli there are.
    x = u / _stretch(moduli)
    # At a modulus of 0 the functions are sine, cosine and 1.
    sn, cn, dn = m.sin(x), m.cos(x), 1 + 0 * x
    for lower, rest in reversed(moduli):
        below = 1 + lower * sn * sn
        # 1 - lower sn^2 as a sum, where rest is 1 - lower. Errors of the first steps, which are at
        # the smallest moduli, grow most, and there this form has hardly any.
        above = rest + lower * cn * cn
        sn, cn, dn = (1 + lower) * sn / below, cn * dn / below, above / below
    return sn, cn, dn


def K(kc: Scalar, m: Elementary) -> Any:
    """Complete elliptic integral K(k) of the first kind, a quarter of the period of sn."""
    return m.pi / 2 * _stretch(_moduli(kc, m))


def _moduli(kc: Scalar, m: Elementary) -> list[tuple[Any, Any]]:
    """The descending moduli (1 - kc)/(1 + kc), with one minus each, down to round-off."""
    found, k = [], 1
    # The moduli fall quadratically, so a few steps do in any precision of `m`.
    while 1 + k * k != 1:
        # The difference may cancel where kc is near 1; but only 1 + lower counts then.
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
