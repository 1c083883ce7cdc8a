"""Costs of routes: seconds of a core by integration and by return maps, and which is less.

One model serves all who ask: `route_codes` when it chooses, a run's estimate, and the warning of
orbits that take long. It follows from the body alone, so that no result hangs on a machine or on
what is kept. A wrong guess costs time and no symbol.
"""

from __future__ import annotations

import functools
import itertools
import math
import warnings
from collections.abc import Sequence

from rigidpend.machine.wording import seconds
from rigidpend.numbers.checked import GAP
from rigidpend.numbers.exact import PRECISIONS
from rigidpend.orbits.integrate.arithmetic import PAIRS, rung
from rigidpend.routes.problem import (
    RouteProblem,
    closeness,
    narrowness,
    passage_rotations,
    whisker_growth,
)

SYMBOL, ROTATION, MAPPED = 3e-6, 1e-6, 0.5e-6
"""Seconds of a core a symbol takes: by integration, beside what each rotation takes; by maps.

Measured on 17 bodies drawn by lot, twice in doubles, at 1.4 to 151 rotations a passage, on a busy
machine: integration took some 0.8 to 1.4 times as long."""
FACTORS = {53: 1.0, PAIRS: 11.0, 212: 110.0}
"""Factor by which deciding an orbit takes longer in more bits.

In pairs of doubles it was 8.5 to 12.6 with 6 bodies, and in quadruples ten times that."""
BEYOND = 4_000.0
"""The same in more bits: integers of 160 bits were measured."""
SHARPER, SHARPEST = 64, 82
"""Bits of the first map that decides what those in doubles leave open, in pairs of doubles.

It has the larger number where passages are deep."""
CLOSEST = 8
"""Bits by which two precisions differ at least, where one computation by each is to decide."""
FINER = {SHARPER: (GAP, CLOSEST), SHARPEST: (CLOSEST,)}
"""Bits by which the second map is sharper than the first, the most that pay.

So they differ by what the first errs by, and one computation by each settles nearly as much as do
those of two precisions: of 17 bodies drawn by lot maps of 64 and 75 bits left 0 to 4 of 20,000
orbits open, where those of 64 and 72 left up to 17. Of 82 and 90 bits they left 0 to 9 of twelve
bodies, and 35 to 110 of four whose passages take 20 to 28 rotations. Of 64 bits and of
doubles they left 1, 12 and 140 open of three bodies whose tables converge slowly, where those of 72
bits would take longer than they may."""
RUNGS = 64, 76, 88, 117, 128
"""Bits of integrations between two precisions, one in each: most orbits need no more.

Their series end sooner: with three bodies drawn by lot those up to 88 bits took 0.36, 0.49 and 0.69
of the time of one in 106, the others 0.45 and 0.58 of one in 160. From one to the next there are
four orders of the series at least, by which what is left out falls by e^8.
"""
CLIMBING = 0.6
"""Share of a precision's time that orbits take which rungs below it decide.

With three bodies drawn by lot it was 0.48, 0.58 and 0.78."""
DEEP = 9.5
"""Rotations in a passage from which on it is.

Of 35 bodies drawn by lot maps of 64 bits left 0.2 to 7 % of the orbits open at 9 to 14 rotations,
and 0 to 0.5 % below, where sharper tables, which cost twice as much, would not pay."""
SPREAD = 10.0
"""Standard deviation of the logarithm of what an orbit's error grows by, natural.

With 14 bodies drawn by lot, where errors grow by 2^20 to 2^80 in the mean, 2 to 97 % of 256 orbits
stayed open in doubles; this has each within a factor of 1.7."""
HANDED_OVER = 0.35
"""Share of the time of an integration in pairs that orbits take which are handed over to a map.

Of eight bodies drawn by lot, whose passages take 20 to 53 rotations and of whose orbits maps left
0.2 to 7 % open, it was 0.27 to 0.48, those in more bits than pairs have among them."""
STAKE = 2
"""Time that tables may take over that which they are expected to save.

They are kept: the next calls with the same body have them for nothing."""
LEAST = 1.0
"""Seconds of integration from which on it is asked whether maps pay.

The question takes some 0.05 s with a new body. With that of Fig. 4 5,000 orbits of 15 symbols are
at stake: on one core they take 0.12 ms each by integration and 0.004 ms by maps, whose tables
take 0.6 s where they are not kept yet."""
SLOW, LONG = 100e-6 / 15, 1.0
"""Seconds a symbol, and in all, from which on it is said that orbits are integrated."""


class SlowRoutesWarning(UserWarning):
    """Warning of many orbits that are integrated, with the reason."""


def integration(problem: RouteProblem, precisions: Sequence[int] = PRECISIONS) -> float:
    """Seconds of a core that an orbit takes by integration, up the given precisions (bits)."""
    further = _further(problem, precisions, share_open(problem, precisions[0]))
    return _once(problem) * (_factor(precisions[0]) + further)


def by_maps(problem: RouteProblem, precisions: Sequence[int] = PRECISIONS) -> float:
    """Seconds of a core that an orbit takes by maps that are made, and beyond their bits."""
    most, _ = wanted(problem)[0]
    ladder = [most, *(bits for bits in precisions if bits > most)]
    # In a map all is told in units of the splitting.
    open_ = share_open(problem, most, displaced=False)
    further = _further(problem, ladder, open_, HANDED_OVER)
    return MAPPED * problem.n_symbols + _once(problem) * further


def _once(problem: RouteProblem) -> float:
    """Seconds of a core that an orbit takes twice in doubles."""
    rotations = passage_rotations(problem)
    # Without weight it crosses once, and never again.
    return problem.n_symbols * (SYMBOL + ROTATION * (rotations if rotations < math.inf else 1.0))


def _further(
    problem: RouteProblem, precisions: Sequence[int], open_: float, whole: float = 1.0
) -> float:
    """Further computations in doubles that those take which the first precision leaves open.

    Those that are decided are followed for a part of the `whole` time.
    """
    found = 0.0
    for known, bits in itertools.pairwise(precisions):
        share = whole * (CLIMBING if any(fits(x, (known, bits)) for x in RUNGS) else 1.0)
        left = share_open(problem, bits)
        found, open_ = found + (left + share * (open_ - left)) * _factor(bits), left
    return found


def _factor(bits: int) -> float:
    return FACTORS.get(rung(bits), BEYOND)


@functools.lru_cache(maxsize=256)
def share_open(problem: RouteProblem, bits: int, *, displaced: bool = True) -> float:
    """Estimate of the share of orbits that so many bits do not decide to their ends.

    An error grows by a factor a passage; and at first, where orbits are `displaced`, it is one of
    what both surfaces are displaced by, which is more than what they are split by. Where starts
    are farther off than that, phases are not made anew: errors add up, and turn them ever more.
    """
    nu, n, close = problem.body.angles().nu, problem.n_symbols, closeness(problem)
    grown = n * math.log(whisker_growth(nu * math.exp(close - narrowness(nu))))
    if close < narrowness(nu):
        grown = max(grown, 2 * math.log(n * whisker_growth(nu)))
    nats = displaced * close + grown
    return math.erfc((bits * math.log(2) - nats) / (math.sqrt(2) * SPREAD)) / 2


def beyond_maps(problem: RouteProblem) -> float:
    """Seconds of a core that an orbit takes whose symbols ask for more bits than maps have."""
    return HANDED_OVER * integration(problem, (PAIRS,))


def at_stake(problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS) -> bool:
    """True if orbits in doubles and beyond take so long that it is asked whether maps pay."""
    return precisions[0] == 53 and orbits * integration(problem, precisions) >= LEAST


def fits(bits: int, precisions: Sequence[int]) -> bool:
    """True if one computation in so many bits pays between precisions, and is far from all."""
    far = all(abs(p - bits) >= CLOSEST for p in precisions)
    return far and precisions[0] < bits < max(precisions)


def wanted(problem: RouteProblem) -> tuple[tuple[int, int], ...]:
    """Bits of the first map and of the second; fewer where these do not settle or pay."""
    least = (SHARPEST, SHARPER) if passage_rotations(problem) >= DEEP else (SHARPER,)
    further = {bits: (*(bits + more for more in FINER[bits]), 53) for bits in least}
    return *((bits, second) for bits in least for second in further[bits]), (53, 53)


def budget(problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS) -> float:
    """Seconds of a core that the tables of all designs may take, if they are to pay."""
    return STAKE * orbits * (integration(problem, precisions) - by_maps(problem, precisions))


def warned(problem: RouteProblem, orbits: int, of: int, each: float, reason: str) -> None:
    """Warn if some of all orbits, of so many seconds each, make all of them slow."""
    if orbits * each > max(LONG, SLOW * problem.n_symbols * of):
        warnings.warn(
            f"{orbits} of {of} orbits are integrated, {seconds(each)} each on a core,"
            f" some {seconds(orbits * each)} in all: {reason}",
            SlowRoutesWarning,
            stacklevel=2,
        )
