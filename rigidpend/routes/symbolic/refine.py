"""theta2_0 to any number of digits, by integration of the full equations (multiple shooting).

The map in doubles gives all crossings of an orbit to some ten digits. From each crossing the full
equations are integrated to the next one, and Newton's method corrects all crossings and theta2_0
until these legs meet. Derivatives are the map's, with which a correction gains up to ten digits;
in wide numbers it is mended by differences in smaller ones, and gains more.

A change of theta2_0 grows from crossing to crossing. Late crossings therefore need fewer digits
than early ones: they drop out as soon as they have them, and each leg is integrated in as many bits
as its end needs.
"""

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple, NoReturn

import numpy as np

from rigidpend.machine.workers import note
from rigidpend.numbers import Array
from rigidpend.numbers.exact import context, fraction
from rigidpend.routes.symbolic.chain import (
    MOVED,
    Blurred,
    Chain,
    carried,
    check_split,
    check_told,
    tangents,
)
from rigidpend.routes.symbolic.legs import DIGIT, GUARD, ByEnergy, Legs
from rigidpend.routes.symbolic.levels import STEP, OrbitFamily

FIRST_DIGITS = 9.0
"""Digits behind the point that crossings by the map in doubles are expected to have.

Where surfaces are split by less than some 1e-8 they have fewer: the first correction shows it."""
LEAST_DIGITS = 4
"""Least number of digits from which Newton's method goes on: it was seen to converge from 4.9."""
LEAST_OF_LAST = 0
"""Least number of digits, likewise, of the last crossing that counts: its chi errs by a radian.

Its error is what one passage makes of those before it, and goes with these. At the end it has as
many digits as they need, or the orbit is refused."""
ROUNDS = 60
"""Largest number of corrections."""
MARGIN = 3
"""Digits that theta2_0 has beyond those that determine a symbol."""
FURTHER = 4
"""Digits to which crossings are computed beyond those of theta2_0."""
SETTLED = 2
"""Digits that a crossing may lack of those that it needs to count as known."""


class Refined(NamedTuple):
    """A refined phase, and how far its digits determine its orbit; fields as in `FoundOrbit`."""

    theta2_0: Decimal
    fixed: int
    bits: int
    delay: float
    crossing_time: Array


def refined(
    orbits: OrbitFamily, chain: Chain, by_energy: ByEnergy, digits: int, jobs: int
) -> Refined:
    """theta2_0 of a chain at its own energy to `digits` digits behind the point.

    `by_energy` are derivatives in the energy for a fixed last crossing. NoOrbit is
    raised where integration of the full equations does not follow the chain.
    """
    exponent = _growth(orbits, chain, by_energy)
    # `digits` determine a crossing only if they determine all before it.
    grown = np.maximum.accumulate(exponent)
    begun = float(_begun(orbits, chain, 0.0)[2, 0])
    fixed = max(0, int((grown <= digits - MARGIN).sum()) - 1)
    # The last crossing that counts stays where the map has it, and theta2_0 with it. So this is the
    # first that needs no more digits than the map tells, however many the passage before it takes.
    reach = min(fixed + 1, len(chain.time))
    bits = max(64, math.ceil(digits * DIGIT) + GUARD)
    # A crossing at which a change of theta2_0 has grown by n digits needs n fewer of them. It needs
    # no fewer than those behind it, so that crossings drop out from the last one on; and the last
    # ones need those with which integration finds them at all.
    needed = np.maximum.accumulate((digits + FURTHER - exponent)[::-1])[::-1][: reach + 1]
    needed = needed.clip(LEAST_DIGITS + SETTLED)
    legs = Legs(
        orbits, chain, by_energy, np.append(begun, chain.time)[: reach + 1], float(needed[0]), jobs
    )
    delay = _correct(legs, chain, _Digits(needed))
    theta, times = fraction(legs.theta), begun + np.append(0.0, np.cumsum(chain.time))
    return Refined(_decimal(theta, digits), fixed, bits, delay, times)


def _growth(orbits: OrbitFamily, chain: Chain, by_energy: ByEnergy) -> Array:
    """Growth of a change of theta2_0 along a chain, with the change of energy that it causes.

    The result is log10 of the change of t' at the crossings, per radian of theta2_0, (n + 1,).
    """
    # theta2_0 and the energy depend on each other: this is the total derivative.
    factor = abs(1 - by_energy.theta2_0 * orbits.energy_slope(chain.parameter))
    change = np.diff(_begun(orbits, chain, STEP * np.array([-1.0, 1.0])))[:, 0]
    # chi comes without whole turns, so that the difference may jump by one.
    change[1] = math.remainder(change[1], 2 * math.pi)
    changes, logs = carried(tangents(chain), change / (2 * STEP))
    # The change of t' stands for that of chi too: as the time of a passage is an angle over a rate,
    # both are of one size.
    return np.asarray((logs + np.log(np.abs(changes[:, 2]))) / math.log(10) + math.log10(factor))


def _begun(orbits: OrbitFamily, chain: Chain, off: Any) -> Array:
    """d, chi and t', (3, N), of the first crossings of orbits whose phases are `off` a chain's."""
    at = orbits.enter(chain.level.map_level, np.atleast_1d(chain.parameter + off))
    return np.array((at.point.d, at.point.chi, at.time))


class _Digits:
    """Digits of an orbit's crossings, correction by correction.

    How many a correction leaves is known only from the next one, which measures what is left to
    correct; until then rules say what to expect. `needed`, (n,), descending, are the digits that
    the ends of the first n legs need; no others count.
    """

    def __init__(self, needed: Array) -> None:
        self.needed, self.most = needed, float(needed[0])
        # Of the crossings as they are; and before the last correction, as it has measured them.
        self.expected = self.measured = FIRST_DIGITS
        # Share of the digits that corrections gained of those that they gain at most.
        self.share, self.gained, self.first = 1.0, math.inf, True

    @property
    def last(self) -> int:
        """The last leg that counts: those whose ends have their digits, as measured, drop out."""
        return min(len(self.needed) - 1, int((self.needed > self.measured).sum()))

    def aim(self, gained: float) -> float:
        """Digits to which the next correction is to lead, which gains so many at most."""
        return min(self.expected + gained, self.most)

    def judge(self, found: list[float], gained: float) -> None:
        """Take what a correction has measured, and expect what it leaves."""
        aim, both = self.aim(gained), zip(found, self.needed, strict=False)
        here = min([self.most, *(x for x, need in both if x <= need - SETTLED)])
        # The first correction measures the error of the map. Further ones measure that of the
        # derivatives, by which each digit that is to be gained falls short in proportion.
        if not self.first:
            self.share = min(self.share, max(0.0, here - self.measured) / self.gained)
        self.measured, self.first, self.gained = here, False, gained
        self.expected = max(here, min(aim, here + gained * self.share))


def _correct(legs: Legs, chain: Chain, digits: _Digits) -> float:
    """Correct legs until they have their digits.

    The result is the largest delay t' of a crossing of theirs behind that of the map.
    """
    told, n = legs.times.copy(), 0
    for _ in range(ROUNDS):
        note(lambda: f"theta2_0 to {digits.expected:.0f} of {digits.most:.0f} digits")
        gained = legs.gained(digits.expected)
        aim = digits.aim(gained)
        aims = np.minimum(aim, digits.needed[: digits.last + 1])
        bits = [math.ceil(x * DIGIT) + legs.below for x in aims]
        n = max(n, len(bits))
        *found, last = legs.correct(bits, aim - digits.expected)
        # A long passage alone may grow a rounding of its beginning to much of the last crossing.
        digits.judge([*found, max(last, LEAST_DIGITS)], gained)
        # From fewer digits corrections might lead to another orbit.
        if digits.measured < LEAST_DIGITS or last < LEAST_OF_LAST:
            _refuse(chain)
        if digits.expected >= digits.most:
            # A correction meets times as they are before it: those of the orbit are met by none.
            late = legs.times[:n] - told[:n] + legs.late(n)
            delay = float(max(abs(x) for x in np.cumsum(late)))
            # An orbit with other times is another one.
            if delay > MOVED:
                _refuse(chain)
            return delay
    raise Blurred(f"integration follows the map to {digits.expected:.0f} digits only")


def _refuse(chain: Chain) -> NoReturn:
    """Raise Blurred, with the reason why crossings are placed too far off to begin with."""
    check_split(chain.level, chain.split, chain.unknowns, 10.0**-LEAST_DIGITS)
    check_told(chain)
    raise Blurred(
        "integration does not find the crossings where the map has them; take a body whose surfaces"
        " lie farther apart"
    )


def _decimal(theta: Fraction, digits: int) -> Decimal:
    """The phase in [0, 2 pi), rounded to `digits` digits behind the point."""
    m = context(math.ceil((digits + 10) * DIGIT))
    rest = theta % fraction(2 * m.pi, m.prec)
    return Decimal(f"{round(rest * 10**digits)}e-{digits}")
