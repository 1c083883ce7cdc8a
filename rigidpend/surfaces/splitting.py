"""Splitting: the distance of S1- and S2+ on J1 = J2/2, from orbits and by Melnikov's integral.

With offset = F(g) on S1- and F(pi - g) on S2+, the distance F(g) - F(pi - g) is

    d1 cos g + d2 sin 2g + d3 cos 3g + d4 sin 4g + ...

Melnikov's formula gives d1 to first order in mu. The change of sign of mu moves g by pi, so d1
is odd in mu and errs by O(mu^3), while the curve errs by d2 = O(mu^2).
"""

from __future__ import annotations

import math
from operator import mul
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import Exact, context
from rigidpend.numbers.generic import Array, Scalar
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.orbits.return_map.precision import Precision
from rigidpend.surfaces import melnikov
from rigidpend.surfaces.surface_orbits import (
    J2_0,
    Points,
    UnstableSurface,
    kind,
    lag,
    meet,
    numbers,
    surface,
)

TOP = 16
"""Number of harmonics that are kept.

With the body of Fig. 4 at mu = 0.1 the eighth is 1e-9 of the first."""
FEWEST, SURE, MOST = 16, 128, 512
"""Numbers of orbits in one computation; a curve that turns back between `SURE` really does."""
WORST = 1e3
"""Factor by which the integration's error may exceed the expected one (`_noise`)."""
SHIFTS = ((0.125, 0), (0.625, 1))
"""Shift of the phases (in steps) and extra depth of the starts, in each of two computations.

Where one harmonic is taken for another, half a step changes the sign of the error."""
CAUTION = 4
"""Factor on the difference of two computations, for both may round alike by chance."""
DEPTH_BITS = 20
"""Depth of the starts beyond the precision, in bits: J1/J2 = 2^-(bits + DEPTH_BITS)."""


class SurfaceSplitting(NamedTuple):
    """Measured splitting of a body at one mu, relative to Melnikov's amplitude."""

    amplitude: float
    """Melnikov's amplitude of the distance in theta1, radians."""
    excess: Array
    """d1/amplitude - 1, d2/amplitude, d3/amplitude, ..., (TOP,); NaN where nothing is known."""
    error: float
    """Uncertainty: the most by which two computations of `excess` differ, times `CAUTION`.

    If the first harmonic that is left out is more, that."""
    allowed: float
    """The error up to which the splitting counts as resolved."""
    bits: int
    """Working precision that decided."""
    n: int
    """Orbits in each of the two computations."""

    @property
    def resolved(self) -> bool:
        return bool(self.error <= self.allowed)


def distance(harmonics: ArrayLike, g: Scalar) -> Any:
    """Fourier series d1 cos g + d2 sin 2g + d3 cos 3g + ... at phases g."""
    return sum(
        d * (np.cos(k * g) if k % 2 else np.sin(k * g))
        for k, d in enumerate(np.asarray(harmonics), 1)
    )


def amplitude(s: UnstableSurface) -> Any:
    """Melnikov's amplitude of the distance in theta1, to first order in mu, radians.

    Melnikov's integral is what the energy H0 of the free body gains, in units of mu kappa J2_0;
    on the section H0 changes with theta1 by -J2^2 sin(alpha0)/4.
    """
    m, p, J2 = numbers(s.bits), s.p, J2_0(s)
    slope = -J2 * J2 * m.sin(p.alpha0) / 4
    return p.mu * p.kappa * J2 * melnikov.amplitude(2, J2, p, m) / slope


def measure(
    body: Body, h0: Exact, allowed: float, arithmetic: Arithmetic, jobs: int = 1
) -> SurfaceSplitting:
    """Measure the splitting in the first precision, with the fewest orbits, that resolve it.

    Two computations that share neither starts nor phases tell it. `allowed` is the largest error of
    `excess` that counts as resolved; mu > 0, and all orbits have the energy h0 > mu.
    """
    n = FEWEST
    for bits in arithmetic.precisions:
        # Where rounding stopped the search, half as many orbits were seen to be too few, or that
        # was not known: longer numbers need not begin anew.
        s, n = surface(body, h0, bits), max(FEWEST, n // 2)
        found = _twice(s, n, arithmetic, allowed, jobs)
        while not found.resolved and n < _most(found) and found.error > _noise(s, arithmetic):
            n *= 2
            coarse, found = found, _twice(s, n, arithmetic, allowed, jobs)
            if coarse.error / 2 < found.error < WORST * _noise(s, arithmetic):
                break
        if found.resolved or n >= _most(found):
            break
    return found


def _most(found: SurfaceSplitting) -> int:
    """Largest useful number of orbits: fewer where the curve seems to turn back."""
    return MOST if math.isfinite(found.error) else SURE


def _noise(s: UnstableSurface, arithmetic: Arithmetic) -> float:
    """Expected error of the integration itself, which more orbits cannot lessen."""
    return arithmetic.tolerance * 2.0 ** (53 - s.bits) * float(s.p.mu / s.h0 / amplitude(s))


def _twice(
    s: UnstableSurface, n: int, arithmetic: Arithmetic, allowed: float, jobs: int
) -> SurfaceSplitting:
    """Mean of two computations, with an error from their difference."""
    m, a, first = numbers(s.bits), kind(s, arithmetic), amplitude(s)
    depth = (s.bits + DEPTH_BITS) * m.log(2)
    found = []
    for shift, deeper in SHIFTS:
        behind = lag(s, depth + deeper)
        phases = [2 * m.pi * (k + m.mpf(shift)) / n - behind for k in range(n)]
        points = meet(s, phases, depth + deeper, arithmetic, jobs)
        measured = None if points is None else harmonics(points, a)
        if measured is None:
            unknown = np.full(TOP, np.nan)
            return SurfaceSplitting(float(first), unknown, math.inf, allowed, s.bits, n)
        found.append(measured)
    mean, error = np.zeros(TOP), max(abs(float(beyond / first)) for _, beyond in found)
    for k, (a, b) in enumerate(zip(*(known for known, _ in found), strict=True)):
        mean[k] = float((a + b) / 2 / first - (k == 0))
        # Near 1 they round by as much at least.
        error = max(error, CAUTION * (abs(float((a - b) / first)) + 2.0**-s.bits))
    return SurfaceSplitting(float(first), mean, error, allowed, s.bits, n)


def harmonics(points: Points, a: Precision) -> tuple[list[Any], Any] | None:
    """Harmonics d1, d2, ... from an even number n of orbits, their phases evenly around the circle.

    They are min(TOP, n/2 - 1), radians, with the size that is expected of the next one, or 0 where
    `TOP` are known; None where the curve turns back in g: it has no distance at a phase
    then. The Fourier integral over g is taken over theta2_0, where the trapezoid rule and the
    derivative of g through all points converge exponentially.

    The curve's own harmonics shrink evenly, those of the distance by turns. So what is left out is
    expected by the last two of the curve, whose ratio is that of the next one to the last.
    """
    n = len(points.phase)
    slope = 1 + derivative(points.advance, a)
    if min(slope) <= 0:
        return None
    cos, sin = a.cos(points.phase), a.sin(points.phase)
    even, odd = points.offset * slope / n, 0 * points.offset
    found, sizes = [], []
    for k in range(1, min(TOP, n // 2 - 1) + 1):
        # The terms times cos kg and sin kg.
        even, odd = even * cos - odd * sin, even * sin + odd * cos
        of_cos, of_sin = 4 * even.sum(), 4 * odd.sum()
        found.append(of_cos if k % 2 else of_sin)
        sizes.append((of_cos * of_cos + of_sin * of_sin) ** 0.5)
    return found, sizes[-1] ** 2 / sizes[-2] if len(found) < TOP else 0.0


def derivative(values: Any, a: Precision) -> Any:
    """Derivative of the trigonometric interpolant at its n nodes around a circle, n even."""
    n, m, P = len(values), context(a.bits), a.bits
    weights = [m.mpf(0), *((-1) ** k / m.tan(m.pi * k / n) / 2 for k in range(1, n))]
    if a.bits == 53:
        # They sum up to zero: the largest, next to the node, come to small differences.
        to_node = a.array(weights)[np.arange(n)[:, None] - np.arange(n)]
        return (to_node * (values - values[:, None])).sum(axis=1)
    # Sums as of whole numbers, in units of 2^-P: some ten times as fast. The weights are turned,
    # so that each sum is one of successive ones.
    turned = [weights[-k] for k in range(n)]
    whole, around = ([int(m.ldexp(x, P)) for x in given] for given in (values, turned * 2))
    sums = [sum(map(mul, around[n - i : 2 * n - i], whole)) for i in range(n)]
    return np.array([m.ldexp(total, -2 * P) for total in sums], dtype=object)
