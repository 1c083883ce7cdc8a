"""Splitting: the distance of S1- and S2+ on J1 = J2/2, from orbits and by Melnikov's integral.

With offset = F(g) on S1- and F(pi - g) on S2+, the distance F(g) - F(pi - g) is

    d1 cos g + d2 sin 2g + d3 cos 3g + d4 sin 4g + ...

Melnikov's formula gives d1 to first order in mu. A change of sign of mu moves g by pi, so that d1
is odd in mu and Melnikov's formula for it errs by O(mu^3), while the distance as a function of g
differs from Melnikov's by d2 = O(mu^2).
"""

import math
from operator import mul
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.mechanics.body import Body
from rigidpend.numbers import Array, Scalar
from rigidpend.numbers.exact import Exact, context
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.orbits.precision import Precision
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

MOST_HARMONICS = 16
"""Largest number of harmonics that are found.

With the body of Fig. 4 at mu = 0.1 the eighth is 1e-9 of the first. No error contains those that
are left out: a body's curve erred by 3e-10 of the first at mu = 0.3 h0, and the last harmonics of
others are up to 2e-7 at mu = 0.5 h0."""
FEWEST, SURE, MOST_ORBITS = 16, 128, 512
"""Least number of orbits in a computation, and the largest ones.

If the curve seems to turn back in g with `SURE` orbits it really does, and no more are tried."""
WORST = 1e3
"""Factor by which the integration's error may differ from the expected one (`_noise`)."""
SHIFTS = ((0.125, 0), (0.625, 1))
"""Shift of the phases (in steps) and extra depth of the starts, for each of two computations.

If the phases are too few to tell one harmonic from another, half a step changes the sign of this
error."""
CAUTION = 4
"""Factor on the difference of two computations, because both may round alike by chance."""
SUMMED_BITS = 113
"""Least precision of the sums of a derivative, in which terms of either sign cancel."""
DEPTH_BITS = 20
"""Depth of the starts beyond the precision, in bits: J1/J2 = 2^-(bits + DEPTH_BITS)."""


class SurfaceSplitting(NamedTuple):
    """Measured splitting of a body at one mu, relative to Melnikov's amplitude."""

    amplitude: float
    """Melnikov's amplitude of the distance in theta1, radians."""
    excess: Array
    """d1/amplitude - 1, d2/amplitude, ..., (MOST_HARMONICS,); NaN if nothing is known."""
    error: float
    """Uncertainty of `excess`: its largest difference between two computations, times `CAUTION`.

    If the first harmonic left out is expected to be larger, its size. The rounding of `excess` to
    doubles is added to either."""
    allowed: float
    """Largest error with which the splitting counts as resolved."""
    bits: int
    """Working precision of the result."""
    n: int
    """Number of orbits in each of the two computations."""

    @property
    def resolved(self) -> bool:
        """True if the error is allowed."""
        return bool(self.error <= self.allowed)


def distance(amplitudes: ArrayLike, g: Scalar) -> Any:
    """The distance d1 cos g + d2 sin 2g + d3 cos 3g + ... at phases g, radians."""
    return sum(
        d * (np.cos(k * g) if k % 2 else np.sin(k * g))
        for k, d in enumerate(np.asarray(amplitudes), 1)
    )


def amplitude(s: UnstableSurface) -> Any:
    """Melnikov's amplitude of the distance in theta1, to first order in mu, radians.

    Melnikov's integral is the growth of the energy H0 of the free body, in units of mu kappa J2_0;
    on the section the derivative of H0 in theta1 is -J2^2 sin(alpha0)/4.
    """
    m, p, J2 = numbers(s.bits), s.p, J2_0(s)
    slope = -J2 * J2 * m.sin(p.alpha0) / 4
    return p.mu * p.kappa * J2 * melnikov.amplitude(2, J2, p, m) / slope


def measure(
    body: Body, h0: Exact, allowed: float, arithmetic: Arithmetic, jobs: int = 1
) -> SurfaceSplitting:
    """Measure the splitting in the lowest precision and with the fewest orbits that resolve it.

    Two computations that share neither starts nor phases are compared. `allowed` is the largest
    error of `excess` that counts as resolved; mu > 0, and all orbits have the energy h0 > mu.
    """
    n = FEWEST
    for k, bits in enumerate(arithmetic.precisions):
        # Rounding in this precision is far too large: the first has told how many orbits suffice.
        if k and _noise(surface(body, h0, bits), arithmetic) > WORST * allowed:
            continue
        # If rounding stopped the search with n orbits, n/2 of them were too few or not yet known to
        # suffice: a higher precision begins with these, and not with the fewest.
        s, n = surface(body, h0, bits), max(FEWEST, n // 2)
        found = _twice(s, n, arithmetic, allowed, jobs)
        while not found.resolved and n < _most(found) and found.error > _noise(s, arithmetic):
            n *= 2
            coarse, found = found, _twice(s, n, arithmetic, allowed, jobs)
            # Twice as many orbits did not halve the error, and it is near that of the integration.
            if coarse.error / 2 < found.error < WORST * _noise(s, arithmetic):
                break
        if found.resolved or n >= _most(found):
            break
    return found


def _most(found: SurfaceSplitting) -> int:
    """The largest useful number of orbits, which is smaller if the curve seems to turn back."""
    return MOST_ORBITS if math.isfinite(found.error) else SURE


def _noise(s: UnstableSurface, arithmetic: Arithmetic) -> float:
    """Expected error of the integration itself in `excess`, which more orbits cannot reduce."""
    return arithmetic.tolerance * 2.0 ** (53 - s.bits) * float(s.p.mu / s.h0 / amplitude(s))


def _twice(
    s: UnstableSurface, n: int, arithmetic: Arithmetic, allowed: float, jobs: int
) -> SurfaceSplitting:
    """The splitting as the mean of two computations, with an error from their difference."""
    m, a, first = numbers(s.bits), kind(s, arithmetic), amplitude(s)
    depth = (s.bits + DEPTH_BITS) * m.log(2)
    found = []
    for shift, deeper in SHIFTS:
        behind = lag(s, depth + deeper)
        phases = [2 * m.pi * (k + m.mpf(shift)) / n - behind for k in range(n)]
        points = meet(s, phases, depth + deeper, arithmetic, jobs)
        measured = None if points is None else harmonics(points, a)
        if measured is None:
            unknown = np.full(MOST_HARMONICS, np.nan)
            return SurfaceSplitting(float(first), unknown, math.inf, allowed, s.bits, n)
        found.append(measured)
    mean, error = np.zeros(MOST_HARMONICS), max(abs(float(beyond / first)) for _, beyond in found)
    for k, (one, other) in enumerate(zip(*(known for known, _ in found), strict=True)):
        mean[k] = float((one + other) / 2 / first - (k == 0))
        # `excess` is a difference from 1, which is rounded by this at least.
        error = max(error, CAUTION * (abs(float((one - other) / first)) + 2.0**-s.bits))
    if math.isinf(error):
        # An amplitude far below all rounding leaves nothing known in its units.
        mean = np.full(MOST_HARMONICS, np.nan)
    else:
        # The rounding of `excess` to doubles comes on top, and in more bits may be larger.
        error += math.ldexp(float(np.abs(mean).max()), -53)
    return SurfaceSplitting(float(first), mean, error, allowed, s.bits, n)


def harmonics(points: Points, a: Precision) -> tuple[list[Any], Any] | None:
    """Harmonics d1, d2, ... from an even number n of orbits, evenly spaced in theta2_0, radians.

    Their number is min(MOST_HARMONICS, n/2 - 1). They come with the expected size of the next one,
    or with 0 if there are so many. None if the curve turns back in g, for then it has no distance
    at a phase. The Fourier integral over g becomes one over theta2_0, over which the trapezoid rule
    and the derivative of g, of an interpolant through all points, converge exponentially.

    The harmonics of the curve itself shrink evenly, those of the distance by turns. So the next
    harmonic is expected from the last two of the curve, at the same ratio.
    """
    n = len(points.phase)
    # dg/dtheta2_0: the unperturbed phase grows by 1 with theta2_0.
    slope = 1 + derivative(points.advance, a)
    if min(slope) <= 0:
        return None
    cos, sin = a.cos(points.phase), a.sin(points.phase)
    even, odd = points.offset * slope / n, 0 * points.offset
    found, sizes = [], []
    for k in range(1, min(MOST_HARMONICS, n // 2 - 1) + 1):
        # The terms times cos kg and sin kg. F(g) - F(pi - g) has twice the cosines of odd and the
        # sines of even harmonics of F, and none of the others: hence 4/n in the place of 2/n.
        even, odd = even * cos - odd * sin, even * sin + odd * cos
        of_cos, of_sin = 4 * even.sum(), 4 * odd.sum()
        found.append(of_cos if k % 2 else of_sin)
        sizes.append((of_cos * of_cos + of_sin * of_sin) ** 0.5)
    return found, sizes[-1] ** 2 / sizes[-2] if len(found) < MOST_HARMONICS else 0.0


def derivative(values: Any, a: Precision) -> Any:
    """The derivative of the trigonometric interpolant at its n evenly spaced nodes, n even."""
    n, P = len(values), max(a.bits, SUMMED_BITS)
    m = context(P)
    weights = [m.mpf(0), *((-1) ** k / m.tan(m.pi * k / n) / 2 for k in range(1, n))]
    # Sums over integers, in units of 2^-P, take a tenth of the time of those over mpmath's numbers.
    # The weights are reversed and repeated, so that each sum takes successive ones of them.
    turned = [weights[-k] for k in range(n)]
    whole, around = ([int(m.ldexp(x, P)) for x in given] for given in (values, turned * 2))
    sums = [sum(map(mul, around[n - i : 2 * n - i], whole)) for i in range(n)]
    return a.array([m.ldexp(total, -2 * P) for total in sums])
