"""An orbit cut at its crossings into legs, each of which is integrated alone, in many bits.

Where a leg misses the next crossing, Newton's method corrects all crossings and theta2_0 until the
legs meet (multiple shooting): an orbit along which deviations grow by 1e190 is found without ever
being followed for more than a passage. The derivatives are those of the map, in doubles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.equations import hamiltonian_J3_0, on_section
from rigidpend.numbers import Array
from rigidpend.numbers.exact import GUARD_BITS, context, exact, fraction
from rigidpend.orbits.integrate.arithmetic import LADDER, PAIRS, rung
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.start import Scales, start, states_exact
from rigidpend.routes.symbolic.chain import Chain, System, section_points, section_states, tangents
from rigidpend.routes.symbolic.levels import OrbitFamily

DIGIT = math.log2(10)
"""Bits of a decimal digit."""
GUARD = 19
"""Bits beyond those of the digits: 12 were seen to be lost in 113 bits."""
MIDDLE = 3e-7
"""Distance from the middle of a cell within which a crossing counts as in it, half rotations."""
GAINED = 10
"""Digits that a correction gains, at most, for so many have the map's derivatives in doubles."""
ROUNDED = 12
"""Bits for the roundings that the steps of a leg add up."""


class ByEnergy(NamedTuple):
    """Derivatives in the energy of an orbit whose last crossing stays in its place."""

    theta2_0: float
    places: Array
    """Those of d and chi at the crossings, (n + 1, 2)."""

    @staticmethod
    def between(one: Chain, other: Chain) -> ByEnergy:
        """Differences of an orbit at two energies; zeros where these are too close."""
        step = other.level.h - one.level.h
        each = ((x.parameter, np.stack((x.d, x.chi), axis=1)) for x in (one, other))
        # Shorter steps would make the difference one of roundings.
        far = abs(step) > 1e-9 * other.level.h
        return ByEnergy(*((y - x) / step if far else 0 * y for x, y in zip(*each, strict=True)))


class Legs:
    """The legs of an orbit, as they are before or after a correction.

    `theta` is theta2_0, `places`, (n, 2), are d and chi at the ends of legs, and `times`, (n,), t'
    of the legs, the first from the start. Crossings that are not beside separatrix 2 or 3 are
    described by their mirror images, as in a chain.
    """

    def __init__(
        self,
        orbits: OrbitFamily,
        chain: Chain,
        by_energy: ByEnergy,
        times: Array,
        digits: float,
        jobs: int,
    ) -> None:
        """Legs of a chain, as many as `times` by the map; the end of the first needs `digits`.

        `jobs` is the number of threads, or of processes where integers serve.
        """
        n = len(times)
        self.orbits, self.chain, self.jobs = orbits, chain, jobs
        # The energy changes with theta2_0, and the crossings with it.
        slope = orbits.energy_slope(chain.parameter)
        self.by_theta = slope * by_energy.places
        self.factor = 1 / (1 - slope * by_energy.theta2_0)
        # By so much a deviation grows across the layer of these orbits.
        grown = np.abs(tangents(chain)[: n - 1, 1, 0]).max(initial=1.0)
        self.below = math.ceil(math.log2(grown)) + ROUNDED
        """Bits by which roundings on a leg stay below the error that its end may have."""
        self.bits = max(PAIRS, math.ceil(digits * DIGIT) + self.below + GUARD)
        a = self.a = precision(self.bits)
        self.begin = start(orbits.problem, self.bits, Scales())
        self.c = coefficients(orbits.problem.body.angles(self.bits + GUARD_BITS), "1", a)
        self.theta, self.times = a.number(chain.parameter), a.array(times)
        self.begun = a.array(np.stack((chain.d, chain.chi), axis=1)[:n])
        if chain.off_middle[-1] < MIDDLE and n == len(chain.chi):
            # The orbit returns from the middle of a cell, and corrections keep the last chi.
            self.begun[-1, 1] = a.pi * int(chain.cells[-1])
        self.places = self.begun.copy()

    def gained(self, digits: float) -> float:
        """Digits that a correction adds to those that crossings have, at most."""
        kind = _kind((digits + GAINED) * DIGIT + self.below)
        # A difference in the next smaller numbers, over its best step, has half of their digits.
        again = max(0, int((_smaller(kind) / 2 - self.below) / DIGIT / GAINED))
        reach = (kind - self.below) / DIGIT - digits if kind <= LADDER[-1] else math.inf
        return min(GAINED * (1 + again), reach)

    def correct(self, bits: Sequence[int], gained: float) -> list[float]:
        """Correct theta2_0 and the first crossings, by legs that are integrated in `bits` bits.

        The correction is to add `gained` digits. The result are the digits, behind the point of
        chi, that these crossings had before.
        """
        n, a = len(bits), self.a
        here = self.places[:n]
        off, late = self._gaps(self.theta, here, bits)
        turned, step = self._along(off)
        # A rounding of the digits is no reason for differences, which have no place in few bits.
        again = math.ceil(gained / GAINED - 0.1) - 1
        if again > 0:
            # Wide numbers take long. Differences in smaller ones tell what a correction leaves.
            few = [_smaller(_kind(max(bits)))] * n
            unit = context(self.bits).ldexp(1, -few[0] // 2) / np.abs(step).max()
            before, _ = self._gaps(self.theta, here, few)
        for _ in range(again):
            behind, _ = self._gaps(self.theta + unit * turned, here + unit * step, few)
            more = self._along(off + (behind - before) / unit)
            turned, step = turned + more[0], step + more[1]
        self.theta += turned
        here += step
        self.times[:n] += late
        # What is not corrected at all has the digits of the numbers. The last crossing that counts
        # has those to which its leg leads there.
        left, least = [turned, *step[1:-1, 1], off[-1, 1]], 2.0**-self.bits
        return [-float(a.log(max(abs(x), least)) / math.log(10)) for x in left]

    def late(self, n: int) -> Any:
        """Delays t' of the first n legs, as they are now, behind their times, in few bits."""
        return self._gaps(self.theta, self.places[:n], [PAIRS] * n)[1]

    def _along(self, off: Any) -> tuple[Any, Any]:
        """Corrections of theta2_0 and of d and chi, (n, 2), by the gaps `off` at n crossings."""
        n, level, x = len(off), self.chain.level, self.chain.unknowns
        # The last crossing that counts keeps its place.
        signs, last = np.sign(self.chain.I)[: n - 1], float(self.chain.chi[n - 1])
        system = System(level, self.orbits.begin(level), signs, last)
        moved = self.a.floats((self.places - self.begun)[:n, 1])
        # Legs that end anywhere lead anywhere: their digits show it.
        with np.errstate(all="ignore"):
            turned, step = system.along_surfaces(x[: 2 * n - 1], moved, off)
        turned *= self.factor
        return turned, np.append(step + self.by_theta[: n - 1] * turned, [[0, 0]], axis=0)

    def _gaps(self, theta2_0: Any, places: Any, bits: Sequence[int]) -> tuple[Any, Any]:
        """Gaps (n, 2) in d and chi where legs end, and their delays t' behind their times.

        `bits` are the precisions of the legs.
        """
        n, a, problem, wide = len(places), self.a, self.orbits.problem, self.bits + GUARD_BITS
        p, m = problem.body.angles(wide), context(wide)
        angles, J = (p.alpha0 + p.beta0, theta2_0), (problem.J1_0.at(wide), problem.J2_0(wide))
        h = a.number(hamiltonian_J3_0(*J, angles, p, m))
        level, (d, chi) = self.chain.level, places[:-1].T
        states = section_states(level, d, chi, h, self.c, a)
        begun = states_exact(self.begin, [exact(fraction(theta2_0))], self.bits)
        states = np.column_stack((a.array(begun), states))
        # All legs in one kind of numbers are integrated at once; rungs of integers are few, too.
        kinds = np.array([_kind(x) for x in bits])
        reached, times = np.empty_like(states), self.times[:n]
        for kind in np.unique(kinds).tolist():
            here = kinds == kind
            given = states[:, here], times[None, here], kind, self.jobs
            reached[:, here] = states_at(self.c.aligned, *given)[:, 0]
        ends, late = on_section(reached, self.c.aligned)
        found = section_points(level, np.array(ends), h, self.c, a)
        off = np.stack((found.d, found.chi), axis=1) - places
        # chi is known but for whole turns.
        off[:, 1] -= 2 * a.pi * a.array(np.rint(a.floats(off[:, 1] / (2 * a.pi))))
        return off, late


def _kind(bits: float) -> int:
    """Bits of the numbers in which a leg is integrated that takes so many."""
    return rung(max(bits, PAIRS))


def _smaller(kind: int) -> int:
    """Bits of the next smaller numbers of the kernel; 0 if there are none."""
    return max((x for x in LADDER[1:] if x < kind), default=0)
