"""The step inequality (H1 to H3) once more, in plain fractions, for the body of Fig. 4.

Nothing of `rigidpend.certified` is used, nor the aligned field: the equations are Euler's and
Poisson's in principal axes, the roots are bracketed by whole numbers.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

FINE = 400
"""Binary digits of roots."""
PARTS = 32
MU = Fraction(1, 1000)

Series = list[Fraction]
"""Coefficients of T_0, T_1, ..."""


def root(x: Fraction, up: bool = False) -> Fraction:
    """Square root, below the true one by 2^-FINE at most, or above it."""
    found = math.isqrt((x.numerator << 2 * FINE) // x.denominator)
    return Fraction(found + (2 if up else 0), 1 << FINE)


# A = (2, 1, 3/2): s^2 = 1/2, cos^2(alpha0/2) = 1/3, sin^2(alpha0/2) = 2/3.
COS, SIN = root(Fraction(1, 3)), root(Fraction(2, 3))
R = root(Fraction(1, 2))
OF_ROOTS = Fraction(1, 1 << (FINE - 20))
"""Bound on what the roots' errors change in a derivative of numbers up to some 100."""
SIGMA = root(Fraction(4, 9))
"""sin(alpha0)/sqrt(2) = sqrt(2 cos^2 sin^2) = 2/3."""
SADDLE = COS * SIN
"""sin(alpha0)/2."""


def series(w: Sequence[int], bits: int) -> Series:
    scaled = [Fraction(x, 1 << bits) for x in w]
    return [scaled[0] / 2, *scaled[1:]]


def plus(a: Series, b: Series, factor: Fraction = Fraction(1)) -> Series:
    n = max(len(a), len(b))
    a, b = (x + [Fraction(0)] * (n - len(x)) for x in (a, b))
    return [x + factor * y for x, y in zip(a, b, strict=True)]


def times(a: Series, b: Series) -> Series:
    """T_i T_j = (T_{i+j} + T_{|i-j|})/2."""
    found = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            found[i + j] += x * y / 2
            found[abs(i - j)] += x * y / 2
    return found


def slope(a: Series) -> Series:
    """T_j' = 2 j (T_{j-1} + T_{j-3} + ...), with half of T_0."""
    found = [Fraction(0)] * max(1, len(a) - 1)
    for j, x in enumerate(a):
        for k in range(j - 1, -1, -2):
            found[k] += 2 * j * x if k else j * x
    return found


def scaled(a: Series, factor: Fraction) -> Series:
    return [factor * x for x in a]


def field(state: Sequence[Series]) -> list[Series]:
    """Euler-Poisson in principal axes, as derivatives of Qp, Qm, M3, gamma."""
    Qp, Qm, M3, *g = state
    M1, M2 = (
        scaled(plus(Qp, Qm), 1 / (2 * COS)),
        scaled(plus(Qp, Qm, Fraction(-1)), 1 / (2 * SIN)),
    )
    weight = MU * R
    d1 = plus(scaled(times(M2, M3), Fraction(-2, 3)), g[2], -weight)
    d2 = plus(scaled(times(M1, M3), Fraction(-1, 3)), g[2], weight)
    d3 = plus(times(M1, M2), plus(g[0], g[1], Fraction(-1)), weight)
    # omega/s = M'/(s^2 A) with s^2 = 1/2.
    omega = (scaled(M1, Fraction(1)), scaled(M2, Fraction(2)), scaled(M3, Fraction(4, 3)))
    turns = [
        plus(times(g[i], omega[j]), times(g[j], omega[i]), Fraction(-1))
        for i, j in ((1, 2), (2, 0), (0, 1))
    ]
    x, y = scaled(d1, COS), scaled(d2, SIN)
    return [plus(x, y), plus(x, y, Fraction(-1)), d3, *turns]


def value(a: Series, x: Fraction) -> Fraction:
    before, here, total = Fraction(1), x, a[0]
    for c in a[1:]:
        total += c * here
        before, here = here, 2 * x * here - before
    return total


def norm(difference: Sequence[Fraction], w: Fraction) -> Fraction:
    p, q, s, *g = difference
    return root(p * p + q * q + (SIGMA * s) ** 2 + sum(x * x for x in g) / w**2, up=True)


def exponential(x: Fraction) -> Fraction:
    """A number above exp(x), 0 <= x <= 20."""
    total, term = Fraction(1), Fraction(1)
    for k in range(1, 80):
        term *= x / k
        total += term
    return total + term


def bound(
    state: Sequence[Series], tau: Fraction, begin: Fraction, assumed: Fraction, w: Fraction
) -> Fraction:
    """Bound on the distance over a step; it holds if it is less than the assumed radius."""
    rates = field(state)
    sizes = [
        sum(map(abs, plus(slope(P), rate, -tau)), Fraction(0)) + OF_ROOTS
        for P, rate in zip(state, rates, strict=True)
    ]
    leap = norm(sizes, w)
    F = max(root(MU**2, up=True), SIGMA * MU + OF_ROOTS)
    # sqrt(2) omega_2 = sqrt(2) kappa... over the axes: |omega/s| per unit of (p, q, sigma s).
    turning = max(
        root(Fraction(1, 2), up=True) / COS,
        root(Fraction(1, 2), up=True) * 2 / SIN,
        Fraction(4, 3) / SIGMA,
    )
    coupling = w * F + (1 + w * assumed / 2) * (turning + OF_ROOTS) / w
    total = Fraction(0)
    steep = sum(map(abs, slope(state[2])), Fraction(0))
    ends = [value(state[2], Fraction(2 * k - PARTS, PARTS)) for k in range(PARTS + 1)]
    for a, b in itertools.pairwise(ends):
        M3 = (abs(a) + abs(b) + steep * Fraction(2, PARTS)) / 2 + assumed / (2 * SIGMA)
        l = (SADDLE + OF_ROOTS) * M3
        total += (l + root(l * l + coupling**2, up=True)) / 2 * tau * Fraction(2, PARTS)
    return exponential(total) * (begin + 2 * leap)
