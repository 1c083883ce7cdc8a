"""Starts of the orbits of Fig. 4: on separatrix 2, near the lower periodic orbit."""

import functools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers.exact import GUARD_BITS, Exact, context, exact, fraction
from rigidpend.routes.phases import angle, turned
from rigidpend.routes.problem import RouteProblem


class Scales(NamedTuple):
    """Units in which a computation runs: the same orbit with other roundings.

    M is multiplied by `momentum` (and t' divided by it), gamma by `vertical`. Every constant and
    every initial number then has another binary expansion, so that two computations in different
    scales round independently.
    """

    momentum: str = "1"
    vertical: str = "1"

    @property
    def time_unit(self) -> float:
        """The t' of one unit of the computation's time."""
        return float(exact(self.momentum))


class Start(NamedTuple):
    """Initial states as functions of theta2_0: gamma = gamma_cos cos + gamma_sin sin."""

    Qp: Any
    M3: Any
    gamma_cos: Sequence[Any]
    gamma_sin: Sequence[Any]
    coefficients: AlignedCoefficients


@functools.lru_cache(maxsize=32)
def start(problem: RouteProblem, bits: int, scales: Scales) -> Start:
    """The start theta1_0 = alpha0 + beta0, J1_0, J2_0 = sqrt(2 h0/kappa) in `bits` bits.

    All is computed with twice as many guard bits as elsewhere, for sines of angles near pi (thin
    bodies) and of small differences (near the Hess case) take some of them; and rounded once, to
    floats at 53 bits and to Fractions above.
    On separatrix 2 Qm = 0 identically, so that the record leaves it out. The last results are
    remembered, because many calls differ only in their phases.
    """
    guarded, rounded = bits + 2 * GUARD_BITS, _rounding(bits)
    m, p = context(guarded), problem.body.angles(guarded)
    unit, tall = m.mpf(scales.momentum), m.mpf(scales.vertical)
    J, theta1 = (problem.J1_0.at(guarded), problem.J2mJ1_0(guarded), m.mpf(0)), p.alpha0 + p.beta0
    # gamma is linear in cos and sin of theta2: its values at 0 and pi/2 are the coefficients.
    one, other = (
        aligned_from_canonical(
            Canonical(*J, theta1, theta2, m.mpf(0), m.mpf(1)), p.alpha0, p.beta0, m
        )
        for theta2 in (m.mpf(0), m.pi / 2)
    )
    # mu has the unit of M^2 over that of gamma. Scaled so, the orbit is the same in other units.
    scaled = p._replace(mu=p.mu * unit**2 / tall)
    return Start(
        rounded(unit * one.Qp),
        rounded(unit * one.M3),
        tuple(rounded(tall * x) for x in one[3:]),
        tuple(rounded(tall * x) for x in other[3:]),
        AlignedCoefficients(*map(rounded, aligned_coefficients(scaled, m))),
    )


def states_double(begin: Start, theta2: NDArray[np.float64], rest: Any) -> NDArray[np.float64]:
    """States (6, n), doubles, for the phases ``theta2 + rest``, radians, (n,); `rest` is tiny."""
    cos, sin = turned(np.cos(theta2), np.sin(theta2), rest)
    states = np.zeros((6, theta2.size))
    states[0], states[2] = begin.Qp, begin.M3
    states[3:] = np.outer(begin.gamma_cos, cos) + np.outer(begin.gamma_sin, sin)
    return states


def states_exact(begin: Start, theta2: Sequence[Exact], bits: int) -> NDArray[np.object_]:
    """States (6, n) for exact phases, radians: Fractions of `bits` bits."""
    # cos, sin and the sums have guard bits; each component is then rounded once.
    m, rounded = context(bits + GUARD_BITS), _rounding(bits)
    axes = [
        [m.mpf(x.numerator) / x.denominator for x in axis]
        for axis in (begin.gamma_cos, begin.gamma_sin)
    ]
    states = []
    for phase in theta2:
        cos, sin = m.cos_sin(angle(phase, m.prec))
        gamma = [rounded(a * cos + b * sin) for a, b in zip(*axes, strict=True)]
        # Qm is exactly 0 on separatrix 2; a rounding error in its place would be another orbit.
        states.append([begin.Qp, Fraction(0), begin.M3, *gamma])
    return np.array(states, dtype=object).reshape(-1, 6).T


def _rounding(bits: int) -> Callable[[Any], Any]:
    """A function that rounds an mpmath number to `bits` bits: a float at 53, else a Fraction."""
    if bits == 53:
        return float
    return lambda x: fraction(x, bits)
