"""theta2_0 to any number of digits, by integration of the full equations.

The map in doubles tells all crossings of an orbit to some ten digits. From each crossing the full
equations are integrated to the next one, all such legs at once. Where they miss it, Newton's
method corrects all crossings and theta2_0 with them, so that the legs meet: an orbit that grows
apart by 1e190 is found without ever being followed for more than a passage. Each time the digits
double, or grow by as many as the legs' derivatives have; these are differences of legs that begin
beside each other, told anew whenever the legs go on to wider numbers, in those that they leave.

A change of theta2_0 grows from crossing to crossing. So late crossings need fewer digits than early
ones: they drop out as soon as they have them, and each leg is integrated in as many bits as its
end needs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import note
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_along
from rigidpend.numbers.exact import context, exact, fraction
from rigidpend.numbers.generic import Array, Numbers
from rigidpend.orbits.integrate.arithmetic import LADDER, PAIRS, rung
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.precision import precision
from rigidpend.routes.start import Scales, start, states_exact
from rigidpend.routes.symbolic.chain import (
    Chain,
    NoOrbit,
    carried,
    check_split,
    crossing_states,
    displaced,
    tangents,
)
from rigidpend.routes.symbolic.levels import STEP, Surface

FIRST_DIGITS = 9
"""Digits behind the point that the map in doubles is expected to have of its crossings.

Where surfaces are split by less than some 1e-8 it has fewer: the first correction tells."""
LEAST_DIGITS = 5
"""Digits with which Newton's method still goes on."""
DIGIT = math.log2(10)
"""Bits of a digit."""
ACROSS = 24
"""Bits by which roundings on a leg stay below what is asked of its end.

Across the layer of these orbits, some thousandth thick, a deviation grows as much."""
SPARE = 12
"""Bits beyond, of what a leg rounds in its steps."""
CURVED = 4
"""Digits that the curvature of the legs takes of twice those that are known."""
THIN = 6
"""Digits that the thin layer takes of a derivative: half of those in which its legs are told."""
TOLD = 10
"""Errors of I, by doubles, that |I| comes to where Newton's method begins.

Of long passages of three bodies it began at 8.5 and more, and mostly not below."""
LITTLE = 3
"""Digits gained by a correction with fewer of which slopes are told anew, six legs for each leg."""
ROUNDS = 60
MARGIN = 3
"""Digits that theta2_0 has beyond those that tell a symbol."""
GUARD = 19
"""Bits beyond the digits: 12 were seen to be lost in 113 bits."""
FURTHER = 4
"""Digits beyond those of theta2_0 that crossings are told to."""
SETTLED = 2
"""Digits short of those that it needs with which a crossing counts as known."""
MIDDLE = 3e-7
"""Distance from the middle of a cell within which a crossing lies there, half rotations."""
WHOLE = 32
"""Bits in multiples of which legs are integrated in integers, so that several are at once."""
GAMMA = slice(3, 6)
"""The vertical among the components of a state."""


class Refined(NamedTuple):
    """A refined phase, and how far integration has confirmed its orbit, as in `FoundOrbit`."""

    theta2_0: Decimal
    fixed: int
    bits: int
    delay: float
    crossing_time: Array


def refined(orbits: Surface, chain: Chain, by_energy: float, digits: int, jobs: int) -> Refined:
    """theta2_0 of a chain at its own energy to `digits` digits behind the point.

    `by_energy` is the derivative of theta2_0 in the energy, at a given end. NoOrbit is raised where
    integration of the full equations does not follow the chain.
    """
    exponent = _growth(orbits, chain, by_energy)
    grown = np.maximum.accumulate(exponent)
    begun = float(_begun(orbits, chain, 0.0)[2, 0])
    legs = np.append(begun, chain.time)
    reach = max(0, int((grown <= digits - 1).sum()) - 1)
    fixed = max(0, int((grown <= digits - MARGIN).sum()) - 1)
    bits = max(64, math.ceil(digits * DIGIT) + GUARD)
    # A crossing tells theta2_0 to as many digits more as it has grown, and so do those before it.
    needed = np.maximum.accumulate((digits + FURTHER - exponent)[::-1])[::-1][: reach + 1]
    theta, delay = _Legs(orbits, chain, legs, needed, jobs).run()
    times = begun + np.concatenate(([0.0], np.cumsum(chain.time)))
    return Refined(_decimal(theta, digits), fixed, bits, delay, times)


def _growth(orbits: Surface, chain: Chain, by_energy: float) -> Array:
    """Growth of a change of theta2_0 along a chain, its change of energy included.

    (n + 1,) log10 of the factor at its crossings, t' per radian.
    """
    factor = abs(1 - by_energy * orbits.energy_slope(chain.unknown))
    change = np.diff(_begun(orbits, chain, STEP * np.array([-1.0, 1.0])))[:, 0]
    # chi is told without whole turns.
    change[1] = math.remainder(change[1], 2 * math.pi)
    changes, logs = carried(tangents(chain), change / (2 * STEP))
    # A crossing moves by chi at a fixed time as much as by the time at a fixed chi.
    return np.asarray((logs + np.log(np.abs(changes[:, 2]))) / math.log(10) + math.log10(factor))


def _begun(orbits: Surface, chain: Chain, off: Any) -> Array:
    """d, chi and t' of the first crossings of orbits at phases beside that of a chain."""
    at = orbits.enter(chain.level.map_level, np.atleast_1d(chain.unknown + off))
    return np.array((at.point.d, at.point.chi, at.time))


def _check_placed(chain: Chain) -> None:
    """Raise NoOrbit, with the reason, where doubles do not place crossings well enough to begin."""
    level, split = chain.level, chain.split
    moved = displaced(level, chain.unknowns, split)
    check_split(level, moved, split, 10.0**-LEAST_DIGITS)
    k, told = int(np.abs(chain.I).argmin()), moved * split
    near = abs(float(chain.I[k]))
    if near < TOLD * told:
        fewer = level.half_turns(TOLD * told)
        raise NoOrbit(
            f"passage {k + 1} takes so long that it passes a surface at |I| = {near:.1g}, which"
            f" doubles tell to {told:.1g}; give it {fewer:.0f} half rotations or fewer"
        )


class _Legs:
    """An orbit cut at its crossings into legs that are integrated each for itself, many at once.

    Mirror images take the place of crossings that are not beside separatrix 2 or 3, as in a chain.
    `times` are t' of the legs by the map, the first from the start; `needed` (n,) the digits to
    which the ends of those that count are to be told, descending. Jobs are threads, or processes
    where integers serve.
    """

    def __init__(
        self, orbits: Surface, chain: Chain, times: Array, needed: Array, jobs: int
    ) -> None:
        n = len(needed)
        # What grows on the way cancels in a correction: digits for both.
        self.bits = math.ceil((2 * float(needed[0]) + 20) * DIGIT) + GUARD
        self.m, a = context(self.bits), precision(self.bits)
        self.least = self.m.ldexp(1, -self.bits)
        self.begin = start(orbits.problem, self.bits, Scales())
        self.c = AlignedCoefficients(*map(a.number, self.begin.coefficients))
        self.jobs, self.needed, self.most = jobs, needed, float(needed[0])
        self.chain = chain
        self.theta, self.times = a.number(chain.unknown), a.array(times[:n])
        self.states = a.array(crossing_states(chain)[:, :n])
        self.mirrored = np.append(False, chain.I[: n - 1] < 0)
        # A leg bends as the square of what deviations across the layer grow to; along the surface
        # they hardly do. So where surfaces are split little only the closest neighbours tell how.
        grown = np.abs(tangents(chain)[: n - 1, 1, 0]).max(initial=1.0)
        self.kinds = [kind for kind in LADDER[1:] if 2.0 ** (kind / 2) > grown**2]
        if chain.off[-1] < MIDDLE and n == len(chain.chi):
            # It returns from the middle of its cell: gamma3 there stays as it is.
            self.states[5, -1] = self.m.mpf(0)

    def run(self) -> tuple[Fraction, float]:
        """The phase, and the largest delay of a crossing against the map."""
        known = before = float(FIRST_DIGITS)
        told, kinds, lost = self.times.copy(), iter(self.kinds), 0.0
        # Slopes, the digits that they have, and those that legs may have with them.
        slopes: list[Any] = []
        gained = reach = 0.0
        kind = 0
        # Digits that the last correction had more than the one before it.
        more = math.inf
        for k in range(ROUNDS):
            # What the last correction has shown, and not what it is expected to have left.
            last = min(len(self.needed) - 1, int((self.needed > before).sum()))
            further = not slopes or (known > reach - LEAST_DIGITS and self.most > reach)
            # Where surfaces are split little slopes told at the map's crossings gain little.
            if further or more < LITTLE:
                kind = next(kinds) if further else kind
                gained, slopes = min(known, kind / 2 / DIGIT - THIN), self._differences(kind, last)
                # Integers take ten times as long: all that the kernel's numbers tell comes first.
                reach = (2 * kind - ACROSS - SPARE) / DIGIT if kind < LADDER[-1] else math.inf
            aim = min(2 * known - CURVED, known + gained, self.most, reach)
            note(lambda: f"theta2_0 to {known:.0f} of {self.most:.0f} digits")  # noqa: B023
            here = self._corrected(slopes, aim, last)
            # The first correction is of what the map errs, further ones of what the slopes do; and
            # where a passage grazes a surface legs are bent more than was expected.
            if k:
                lost, more = max(lost, known - here), here - before
            before = here
            known = max(before, min(aim, before + gained - lost, 2 * before - CURVED - lost))
            # With so few the next correction has no more.
            if before < LEAST_DIGITS:
                _check_placed(self.chain)
                raise NoOrbit("integration does not find the crossings where the map has them")
            if known >= self.most:
                late = np.cumsum(self.times - told)
                return fraction(self.theta), float(max(abs(x) for x in late))
        raise NoOrbit(f"integration follows the map to {known:.0f} digits only")

    def _differences(self, bits: int, last: int) -> list[Any]:
        """Derivatives of where legs end in where they begin, by legs that begin beside each other.

        That of the first leg is in theta2_0, (6, 1), those of further ones are (6, 6).
        """
        step = self.m.ldexp(1, -bits // 2)
        begun = [self._start(self.theta), self._start(self.theta + step)]
        # A crossing has M3 = 0: five components may change.
        beside = step * np.delete(np.eye(6, dtype=object), 2, axis=1)
        for here in self.states.T[:last]:
            begun += [here, *(here + off for off in beside.T)]
        legs = np.append([0, 0], np.repeat(np.arange(1, last + 1), 6))
        ends, _ = self._ends(legs, np.array(begun).T, [bits] * len(legs))
        found = [(ends[:, 1:2] - ends[:, :1]) / step]
        for first in range(2, len(legs), 6):
            matrix = (ends[:, first + 1 : first + 6] - ends[:, first : first + 1]) / step
            found.append(np.insert(matrix, 2, 0, axis=1))
        return found

    def _start(self, theta: Any) -> Any:
        states = states_exact(self.begin, [exact(fraction(theta))], self.bits)
        return precision(self.bits).array(states[:, 0])

    def _corrected(self, slopes: list[Any], aim: float, last: int) -> float:
        """Correct theta2_0 and the crossings; the digits that those had which lack some."""
        bits = [
            math.ceil(min(aim, need) * DIGIT) + ACROSS + SPARE for need in self.needed[: last + 1]
        ]
        here = self.states[:, : last + 1]
        begun = np.column_stack((self._start(self.theta), here[:, :-1]))
        ends, late = self._ends(np.arange(last + 1), begun, bits)
        fixed: Any = 0
        by_theta, changes = slopes[0][:, 0], []
        for k, gap in enumerate((ends - here).T):
            if k:
                fixed, by_theta = slopes[k] @ fixed, slopes[k] @ by_theta
            fixed = fixed + gap
            changes.append((fixed, by_theta))
        # gamma3 of the last crossing that counts stays.
        step = -fixed[5] / by_theta[5]
        self.theta += step
        found = [fixed + by_theta * step for fixed, by_theta in changes]
        here += np.array(found).T
        self.times[: last + 1] += late
        sizes = [float(self.m.log10(max(*map(abs, x[GAMMA]), self.least))) for x in found]
        lacking = [-x for x, need in zip(sizes, self.needed, strict=False) if -x < need - SETTLED]
        return min([self.most, *lacking])

    def _ends(self, legs: Numbers, begun: Numbers, bits: Sequence[int]) -> tuple[Any, Any]:
        """Ends (6, N) of legs, on M3 = 0, and by how much later they are than their times say."""
        kinds = np.array(
            [rung(max(x, PAIRS)) if x <= LADDER[-1] else WHOLE * math.ceil(x / WHOLE) for x in bits]
        )
        reached, times = np.empty_like(begun), self.times[legs]
        for kind in np.unique(kinds).tolist():
            here = kinds == kind
            given = begun[:, here], times[None, here], kind, self.jobs
            reached[:, here] = states_at(self.c, *given)[:, 0]
        ends, late = self._on_section(reached)
        for component in (0, 1, 5):
            ends[component, self.mirrored[legs]] *= -1
        return ends, late

    def _on_section(self, state: Any) -> tuple[Any, Any]:
        """Crossings beside states, and by how much later they are, to the square of that time."""
        rates = np.array(aligned(state, self.c))
        bend = np.array(aligned_along(state, rates, self.c)) / 2
        late = -state[2] / rates[2]
        late = late - bend[2] * late**2 / rates[2]
        end = state + late * (rates + late * bend)
        end[2] *= 0
        return end, late


def _decimal(theta: Fraction, digits: int) -> Decimal:
    """The phase in [0, 2 pi), rounded."""
    m = context(math.ceil((digits + 10) * DIGIT))
    rest = theta % fraction(2 * m.pi, m.prec)
    return Decimal(f"{round(rest * 10**digits)}e-{digits}")
