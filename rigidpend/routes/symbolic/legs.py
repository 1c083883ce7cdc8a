"""An orbit cut at its crossings into legs, each of which is integrated alone, in many bits.

Where a leg misses the next crossing, Newton's method corrects all crossings and theta2_0 until the
legs meet (multiple shooting): an orbit along which deviations grow by 1e190 is found without ever
being followed for more than a passage.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, on_section
from rigidpend.numbers import Array, Numbers
from rigidpend.numbers.exact import context, exact, fraction
from rigidpend.orbits.integrate.arithmetic import LADDER, PAIRS, rung
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.precision import precision
from rigidpend.routes.start import Scales, start, states_exact
from rigidpend.routes.symbolic.chain import Chain, crossing_states, tangents
from rigidpend.routes.symbolic.levels import OrbitFamily

DIGIT = math.log2(10)
"""Bits of a decimal digit."""
GUARD = 19
"""Bits beyond those of the digits: 12 were seen to be lost in 113 bits."""
MIDDLE = 3e-7
"""Distance from the middle of a cell within which a crossing counts as in it, half rotations."""
BELOW = 24 + 12
"""Bits by which roundings on a leg stay below the error that its end may have.

By 24 a deviation grows across the layer of these orbits, about a thousandth thick; 12 are for the
roundings that the steps of a leg add up."""
CURVED = 4
"""Digits by which a correction falls short of doubling them, for the legs are curved."""
THIN = 6
"""Digits that a derivative has less than half of those of its legs, for the layer is thin."""


class Slopes(NamedTuple):
    """Derivatives of the ends of legs in their beginnings, and how far they lead."""

    matrices: list[Any]
    """That of the first leg, in theta2_0, is (6, 1); those of the others are (6, 6)."""
    bits: int
    """Precision of the differences: one of the kernel's."""
    digits: float
    """Digits of the derivatives."""

    @property
    def reach(self) -> float:
        """Largest number of digits of legs that are corrected by them."""
        # Legs use the next wider numbers. Integers, behind the kernel's widest, take ten times as
        # long, so that all digits of the kernel's numbers come first.
        return (2 * self.bits - BELOW) / DIGIT if self.bits < LADDER[-1] else math.inf

    def leave(self, digits: float) -> float:
        """Digits that a correction by them makes of `digits`."""
        return min(2 * digits - CURVED, digits + self.digits)


class Legs:
    """The legs of an orbit, as they are before or after a correction.

    `theta` is theta2_0, `states`, (6, n), are the crossings at the ends of legs, and `times`, (n,),
    t' of the legs, the first from the start. Crossings that are not beside separatrix 2 or 3 are
    replaced by their mirror images, as in a chain.
    """

    def __init__(
        self, orbits: OrbitFamily, chain: Chain, times: Array, digits: float, jobs: int
    ) -> None:
        """Legs of a chain, as many as `times` by the map; the end of the first needs `digits`.

        `jobs` is the number of threads, or of processes where integers serve.
        """
        n = len(times)
        # The second derivative of a leg is about the square of the growth of deviations across the
        # layer. A difference over the step 2^(-kind/2) is a derivative only if the step times this
        # is small: the less the surfaces are split, the wider the numbers that it takes.
        grown = np.abs(tangents(chain)[: n - 1, 1, 0]).max(initial=1.0)
        self.kinds = [kind for kind in LADDER[1:] if 2.0 ** (kind / 2) > grown**2]
        # In a correction, terms that have grown along the orbit cancel. So there are digits for
        # the growth and as many for the result; and for the steps of all differences.
        self.bits = max(math.ceil((2 * digits + 20) * DIGIT) + GUARD, self.kinds[0])
        self.m, a = context(self.bits), precision(self.bits)
        self.begin = start(orbits.problem, self.bits, Scales())
        self.c = AlignedCoefficients(*map(a.number, self.begin.coefficients))
        self.jobs = jobs
        self.theta, self.times = a.number(chain.parameter), a.array(times)
        self.states = a.array(crossing_states(chain)[:, :n])
        # Behind a passage with I < 0 the orbit crosses beside separatrix 4 or 1.
        self.mirrored = np.append(False, chain.I[: n - 1] < 0)
        if chain.off_middle[-1] < MIDDLE and n == len(chain.chi):
            # The orbit returns from the middle of a cell, gamma3 = 0, and corrections keep gamma3
            # of the last crossing.
            self.states[5, -1] = self.m.mpf(0)

    def slopes(self, bits: int, last: int, digits: float) -> Slopes:
        """Slopes of the legs up to `last` from differences in `bits` bits, one of `kinds`.

        `digits` are those of the crossings.
        """
        # The best step of a one-sided difference: half of the digits are those of the derivative.
        step = self.m.ldexp(1, -bits // 2)
        begun = [self._start(self.theta), self._start(self.theta + step)]
        # A crossing has M3 = 0: five components may change, and M3 gets a column of zeros.
        beside = step * np.delete(np.eye(6, dtype=object), 2, axis=1)
        for here in self.states.T[:last]:
            begun += [here, *(here + off for off in beside.T)]
        legs = np.append([0, 0], np.repeat(np.arange(1, last + 1), 6))
        ends, _ = self._ends(legs, np.array(begun).T, [bits] * len(legs))
        # Of each leg itself, and of the five beside it, (last, 6, 6).
        each = ends[:, 2:].reshape(6, last, 6).swapaxes(0, 1)
        matrices = np.insert((each[:, :, 1:] - each[:, :, :1]) / step, 2, 0, axis=2)
        found = [(ends[:, 1:2] - ends[:, :1]) / step, *matrices]
        return Slopes(found, bits, min(digits, bits / 2 / DIGIT - THIN))

    def _start(self, theta: Any) -> Any:
        """The initial state (6,) of a phase, in numbers of the legs."""
        states = states_exact(self.begin, [exact(fraction(theta))], self.bits)
        return precision(self.bits).array(states[:, 0])

    def correct(self, slopes: Sequence[Any], bits: Sequence[int]) -> list[float]:
        """Correct theta2_0 and the first crossings, by legs that are integrated in `bits` bits.

        The result are the digits, behind the point of gamma, that these crossings had before.
        """
        n = len(bits)
        here = self.states[:, :n]
        begun = np.column_stack((self._start(self.theta), here[:, :-1]))
        ends, late = self._ends(np.arange(n), begun, bits)
        # The linear equations of the legs, solved from the first one on: the correction of each
        # crossing is a fixed part plus a multiple of the one unknown, the correction of theta2_0.
        gaps = (ends - here).T
        fixed, by_theta = gaps[0], slopes[0][:, 0]
        changes = [(fixed, by_theta)]
        for slope, gap in zip(slopes[1:n], gaps[1:], strict=True):
            fixed, by_theta = slope @ fixed + gap, slope @ by_theta
            changes.append((fixed, by_theta))
        # The last equation: gamma3 of the last crossing that counts stays as it is.
        step = -fixed[5] / by_theta[5]
        self.theta += step
        found = [fixed + by_theta * step for fixed, by_theta in changes]
        # `here` is a view: this changes self.states.
        here += np.array(found).T
        self.times[:n] += late
        # What is not corrected at all has the digits of the numbers.
        least = self.m.ldexp(1, -self.bits)
        return [-float(self.m.log10(max(*map(abs, x[3:]), least))) for x in found]

    def _ends(self, legs: Numbers, begun: Numbers, bits: Sequence[int]) -> tuple[Any, Any]:
        """Ends (6, N) of legs, on M3 = 0, and their delays t' behind the times of these legs.

        `begun` are where they begin, (6, N), and `bits` the precision of each.
        """
        # All legs in one kind of numbers are integrated at once; rungs of integers are few, too.
        kinds = np.array([rung(max(x, PAIRS)) for x in bits])
        reached, times = np.empty_like(begun), self.times[legs]
        for kind in np.unique(kinds).tolist():
            here = kinds == kind
            given = begun[:, here], times[None, here], kind, self.jobs
            reached[:, here] = states_at(self.c, *given)[:, 0]
        ends, late = on_section(reached, self.c)
        # The mirror image by the symmetry (-M1, -M2, M3, gamma1, gamma2, -gamma3).
        for component in (0, 1, 5):
            ends[component][self.mirrored[legs]] *= -1
        return np.array(ends), late
