"""theta2_0 to any number of digits, by integration of the full equations (multiple shooting).

The map in doubles gives all crossings of an orbit to some ten digits. From each crossing the full
equations are integrated to the next one, all such legs at once. Where a leg misses the next
crossing, Newton's method corrects all crossings and theta2_0 until the legs meet: an orbit along
which deviations grow by 1e190 is found without ever being followed for more than a passage. Each
correction doubles the digits, or adds as many as the derivatives of the legs have. The derivatives
are differences of legs that begin beside each other; they are computed anew whenever the legs go on
to wider numbers, in the numbers that the legs leave.

A change of theta2_0 grows from crossing to crossing. Late crossings therefore need fewer digits
than early ones: they drop out as soon as they have them, and each leg is integrated in as many bits
as its end needs.
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
"""Digits behind the point that crossings by the map in doubles are expected to have.

Where surfaces are split by less than some 1e-8 they have fewer: the first correction shows it."""
LEAST_DIGITS = 5
"""Least number of digits from which Newton's method goes on."""
DIGIT = math.log2(10)
"""Bits of a decimal digit."""
ACROSS = 24
"""Bits by which roundings on a leg stay below the error that its end may have.

Across the layer of these orbits, about a thousandth thick, a deviation grows by as much."""
SPARE = 12
"""Further bits, for the roundings that the steps of a leg add up."""
CURVED = 4
"""Digits by which a correction falls short of doubling them, for the legs are curved."""
THIN = 6
"""Digits that a derivative has less than half of those of its legs, for the layer is thin."""
TOLD = 10
"""Least |I|, in units of its error in doubles, from which Newton's method is taken to converge.

With long passages of three bodies it converged from 8.5 on, and mostly not below."""
LITTLE = 3
"""Digits: where a correction gains fewer, derivatives are computed anew, six legs for each."""
ROUNDS = 60
"""Largest number of corrections."""
MARGIN = 3
"""Digits that theta2_0 has beyond those that determine a symbol."""
GUARD = 19
"""Bits beyond those of the digits: 12 were seen to be lost in 113 bits."""
FURTHER = 4
"""Digits to which crossings are computed beyond those of theta2_0."""
SETTLED = 2
"""Digits that a crossing may lack of those that it needs to count as known."""
MIDDLE = 3e-7
"""Distance from the middle of a cell within which a crossing counts as in it, half rotations."""
WHOLE = 32
"""Legs in integers have a multiple of so many bits, so that several share a precision."""
GAMMA = slice(3, 6)
"""The components of gamma in a state."""


class Refined(NamedTuple):
    """A refined phase, and how far its digits determine its orbit; fields as in `FoundOrbit`."""

    theta2_0: Decimal
    fixed: int
    bits: int
    delay: float
    crossing_time: Array


def refined(orbits: Surface, chain: Chain, by_energy: float, digits: int, jobs: int) -> Refined:
    """theta2_0 of a chain at its own energy to `digits` digits behind the point.

    `by_energy` is the derivative of theta2_0 in the energy for a fixed last crossing. NoOrbit is
    raised where integration of the full equations does not follow the chain.
    """
    exponent = _growth(orbits, chain, by_energy)
    # `digits` determine a crossing only if they determine all before it.
    grown = np.maximum.accumulate(exponent)
    begun = float(_begun(orbits, chain, 0.0)[2, 0])
    legs = np.append(begun, chain.time)
    reach = max(0, int((grown <= digits - 1).sum()) - 1)
    fixed = max(0, int((grown <= digits - MARGIN).sum()) - 1)
    bits = max(64, math.ceil(digits * DIGIT) + GUARD)
    # A crossing at which a change of theta2_0 has grown by n digits needs n fewer of them. It needs
    # no fewer than those behind it, so that crossings drop out from the last one on.
    needed = np.maximum.accumulate((digits + FURTHER - exponent)[::-1])[::-1][: reach + 1]
    theta, delay = _Legs(orbits, chain, legs, needed, jobs).run()
    times = begun + np.concatenate(([0.0], np.cumsum(chain.time)))
    return Refined(_decimal(theta, digits), fixed, bits, delay, times)


def _growth(orbits: Surface, chain: Chain, by_energy: float) -> Array:
    """Growth of a change of theta2_0 along a chain, with the change of energy that it causes.

    The result is log10 of the change of t' at the crossings, per radian of theta2_0, (n + 1,).
    """
    # theta2_0 and the energy depend on each other: this is the total derivative.
    factor = abs(1 - by_energy * orbits.energy_slope(chain.parameter))
    change = np.diff(_begun(orbits, chain, STEP * np.array([-1.0, 1.0])))[:, 0]
    # chi comes without whole turns, so that the difference may jump by one.
    change[1] = math.remainder(change[1], 2 * math.pi)
    changes, logs = carried(tangents(chain), change / (2 * STEP))
    # The change of t' stands for that of chi too: as the time of a passage is an angle over a rate,
    # both are of one size.
    return np.asarray((logs + np.log(np.abs(changes[:, 2]))) / math.log(10) + math.log10(factor))


def _begun(orbits: Surface, chain: Chain, off: Any) -> Array:
    """d, chi and t', (3, N), of the first crossings of orbits whose phases are `off` a chain's."""
    at = orbits.enter(chain.level.map_level, np.atleast_1d(chain.parameter + off))
    return np.array((at.point.d, at.point.chi, at.time))


def _check_placed(chain: Chain) -> None:
    """Raise NoOrbit, with the reason, where doubles place crossings too far off to begin with."""
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


class _Slopes(NamedTuple):
    """Derivatives of the ends of legs in their beginnings, differences of neighbouring legs."""

    matrices: list[Any]
    """That of the first leg, in theta2_0, is (6, 1); those of the others are (6, 6)."""
    bits: int
    """Precision of the differences: one of the kernel's."""
    digits: float
    """Digits of the derivatives; a correction by them gains no more."""

    @property
    def reach(self) -> float:
        """Largest number of digits of legs that are corrected by them."""
        # Legs use the next wider numbers. Integers, behind the kernel's widest, take ten times as
        # long, so that all digits of the kernel's numbers come first.
        return (2 * self.bits - ACROSS - SPARE) / DIGIT if self.bits < LADDER[-1] else math.inf


class _Legs:
    """An orbit cut at its crossings into legs, each of which is integrated alone, many at once.

    Crossings that are not beside separatrix 2 or 3 are replaced by their mirror images, as in a
    chain. `times` are t' of the legs by the map, the first from the start. `needed`, (n,),
    descending, are the digits that the ends of the first n legs need; further legs do not count.
    `jobs` is the number of threads, or of processes where integers serve.
    """

    def __init__(
        self, orbits: Surface, chain: Chain, times: Array, needed: Array, jobs: int
    ) -> None:
        n = len(needed)
        # In a correction, terms that have grown along the orbit cancel. So there are digits for
        # the growth and as many for the result.
        self.bits = math.ceil((2 * float(needed[0]) + 20) * DIGIT) + GUARD
        self.m, a = context(self.bits), precision(self.bits)
        self.least = self.m.ldexp(1, -self.bits)
        self.begin = start(orbits.problem, self.bits, Scales())
        self.c = AlignedCoefficients(*map(a.number, self.begin.coefficients))
        self.jobs, self.needed, self.most = jobs, needed, float(needed[0])
        self.chain = chain
        self.theta, self.times = a.number(chain.parameter), a.array(times[:n])
        self.states = a.array(crossing_states(chain)[:, :n])
        # Behind a passage with I < 0 the orbit crosses beside separatrix 4 or 1.
        self.mirrored = np.append(False, chain.I[: n - 1] < 0)
        # The second derivative of a leg is about the square of the growth of deviations across the
        # layer. A difference over the step 2^(-kind/2) is a derivative only if the step times this
        # is small: the less the surfaces are split, the wider the numbers that it takes.
        grown = np.abs(tangents(chain)[: n - 1, 1, 0]).max(initial=1.0)
        self.kinds = [kind for kind in LADDER[1:] if 2.0 ** (kind / 2) > grown**2]
        if chain.off_middle[-1] < MIDDLE and n == len(chain.chi):
            # The orbit returns from the middle of a cell, gamma3 = 0, and corrections keep gamma3
            # of the last crossing.
            self.states[5, -1] = self.m.mpf(0)

    def run(self) -> tuple[Fraction, float]:
        """The phase theta2_0, and the largest delay t' of a crossing behind that of the map."""
        told, kinds = self.times.copy(), iter(self.kinds)
        # Digits of the crossings as they are: expected after the last correction, and as it has
        # measured them before it was made; those that it lost at most, and those that it gained.
        expected = measured = float(FIRST_DIGITS)
        lost, gain = 0.0, math.inf
        slopes = self._slopes(next(kinds), expected, self._last(measured))
        for k in range(ROUNDS):
            last = self._last(measured)
            wider = expected > slopes.reach - LEAST_DIGITS and self.most > slopes.reach
            # Where surfaces are split little, derivatives at the map's crossings gain few digits,
            # and are computed anew at the corrected crossings. So are those for more legs than
            # before: the first correction may show fewer digits than were expected.
            if wider or gain < LITTLE or last >= len(slopes.matrices):
                bits = next(kinds) if wider else slopes.bits
                slopes = self._slopes(bits, expected, last)
            aim = min(2 * expected - CURVED, expected + slopes.digits, self.most, slopes.reach)
            note(lambda: f"theta2_0 to {expected:.0f} of {self.most:.0f} digits")  # noqa: B023
            here = self._corrected(slopes.matrices, aim, last)
            # The first correction measures the error of the map. Further ones measure that of the
            # derivatives, and legs that graze a surface are curved more than was expected.
            if k:
                lost, gain = max(lost, expected - here), here - measured
            measured = here
            least = min(aim, measured + slopes.digits - lost, 2 * measured - CURVED - lost)
            expected = max(measured, least)
            # With fewer digits the next correction would gain none.
            if measured < LEAST_DIGITS:
                _check_placed(self.chain)
                raise NoOrbit("integration does not find the crossings where the map has them")
            if expected >= self.most:
                late = np.cumsum(self.times - told)
                return fraction(self.theta), float(max(abs(x) for x in late))
        raise NoOrbit(f"integration follows the map to {expected:.0f} digits only")

    def _last(self, measured: float) -> int:
        """The last leg that counts: those whose ends have their digits, as measured, drop out."""
        return min(len(self.needed) - 1, int((self.needed > measured).sum()))

    def _slopes(self, bits: int, digits: float, last: int) -> _Slopes:
        """The derivatives of the legs up to `last`, in `bits` bits; crossings have `digits`."""
        # The best step of a one-sided difference: half of the digits are those of the derivative.
        step = self.m.ldexp(1, -bits // 2)
        begun = [self._start(self.theta), self._start(self.theta + step)]
        # A crossing has M3 = 0: five components may change, and M3 gets a column of zeros.
        beside = step * np.delete(np.eye(6, dtype=object), 2, axis=1)
        for here in self.states.T[:last]:
            begun += [here, *(here + off for off in beside.T)]
        legs = np.append([0, 0], np.repeat(np.arange(1, last + 1), 6))
        ends, _ = self._ends(legs, np.array(begun).T, [bits] * len(legs))
        found = [(ends[:, 1:2] - ends[:, :1]) / step]
        for first in range(2, len(legs), 6):
            matrix = (ends[:, first + 1 : first + 6] - ends[:, first : first + 1]) / step
            found.append(np.insert(matrix, 2, 0, axis=1))
        return _Slopes(found, bits, min(digits, bits / 2 / DIGIT - THIN))

    def _start(self, theta: Any) -> Any:
        """The initial state (6,) of a phase, in numbers of the legs."""
        states = states_exact(self.begin, [exact(fraction(theta))], self.bits)
        return precision(self.bits).array(states[:, 0])

    def _corrected(self, slopes: list[Any], aim: float, last: int) -> float:
        """Correct theta2_0 and the first crossings, up to `last`, with legs of `aim` digits.

        The result is the least number of digits, before the correction, of a crossing that has not
        all that it needs.
        """
        bits = [
            math.ceil(min(aim, need) * DIGIT) + ACROSS + SPARE for need in self.needed[: last + 1]
        ]
        here = self.states[:, : last + 1]
        begun = np.column_stack((self._start(self.theta), here[:, :-1]))
        ends, late = self._ends(np.arange(last + 1), begun, bits)
        # The linear equations of the legs, solved from the first one on: the correction of each
        # crossing is a fixed part plus a multiple of the one unknown, the correction of theta2_0.
        fixed: Any = 0
        by_theta, changes = slopes[0][:, 0], []
        for k, gap in enumerate((ends - here).T):
            if k:
                fixed, by_theta = slopes[k] @ fixed, slopes[k] @ by_theta
            fixed = fixed + gap
            changes.append((fixed, by_theta))
        # The last equation: gamma3 of the last crossing that counts stays as it is.
        step = -fixed[5] / by_theta[5]
        self.theta += step
        found = [fixed + by_theta * step for fixed, by_theta in changes]
        # `here` is a view: this changes self.states.
        here += np.array(found).T
        self.times[: last + 1] += late
        sizes = [float(self.m.log10(max(*map(abs, x[GAMMA]), self.least))) for x in found]
        lacking = [-x for x, need in zip(sizes, self.needed, strict=False) if -x < need - SETTLED]
        return min([self.most, *lacking])

    def _ends(self, legs: Numbers, begun: Numbers, bits: Sequence[int]) -> tuple[Any, Any]:
        """Ends (6, N) of legs, on M3 = 0, and their delays t' behind the times of these legs.

        `begun` are where they begin, (6, N), and `bits` the precision of each.
        """
        # All legs in one kind of numbers are integrated at once.
        kinds = np.array(
            [rung(max(x, PAIRS)) if x <= LADDER[-1] else WHOLE * math.ceil(x / WHOLE) for x in bits]
        )
        reached, times = np.empty_like(begun), self.times[legs]
        for kind in np.unique(kinds).tolist():
            here = kinds == kind
            given = begun[:, here], times[None, here], kind, self.jobs
            reached[:, here] = states_at(self.c, *given)[:, 0]
        ends, late = self._on_section(reached)
        # The mirror image by the symmetry (-M1, -M2, M3, gamma1, gamma2, -gamma3).
        for component in (0, 1, 5):
            ends[component, self.mirrored[legs]] *= -1
        return ends, late

    def _on_section(self, state: Any) -> tuple[Any, Any]:
        """Crossings of M3 = 0 near states, and their delays t', to second order in the delay."""
        # Taylor's series of the orbit to second order; `bend` is half of the second derivative.
        rates = np.array(aligned(state, self.c))
        bend = np.array(aligned_along(state, rates, self.c)) / 2
        late = -state[2] / rates[2]
        late = late - bend[2] * late**2 / rates[2]
        end = state + late * (rates + late * bend)
        # M3 vanishes but for the third order.
        end[2] *= 0
        return end, late


def _decimal(theta: Fraction, digits: int) -> Decimal:
    """The phase in [0, 2 pi), rounded to `digits` digits behind the point."""
    m = context(math.ceil((digits + 10) * DIGIT))
    rest = theta % fraction(2 * m.pi, m.prec)
    return Decimal(f"{round(rest * 10**digits)}e-{digits}")
