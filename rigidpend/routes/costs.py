"""Costs of routes: seconds of a core by integration and by return maps, and which is less.

One model serves the choice that `route_codes` makes, a run's estimate, and the warning of orbits
that take long. It follows from the body and the numbers alone, so that no result depends on a
machine or on cached maps. A wrong estimate costs time but changes no symbol.
"""

import functools
import itertools
import math
import warnings
from collections.abc import Sequence

from rigidpend.machine.wording import seconds
from rigidpend.numbers.checked import GAP_BITS
from rigidpend.numbers.exact import PRECISIONS, context
from rigidpend.orbits.integrate.arithmetic import PAIRS, bits_of_numbers
from rigidpend.routes.certainty import LIMIT_OF_THREE, LIMIT_OF_TWO
from rigidpend.routes.ladder import CLOSEST, RUNGS, fits, kept_bits
from rigidpend.routes.problem import (
    RouteProblem,
    closeness,
    narrowness,
    passage_rotations,
    whisker_growth,
)

SYMBOL, ROTATION = 3e-6, 1e-6
"""Seconds of a core for a symbol by integration, and for each rotation too.

Measured on 17 random bodies, twice in doubles, at 1.4 to 151 rotations a passage, on a busy
machine: integration took some 0.8 to 1.4 times as long."""
FACTORS = {53: 1.0, PAIRS: 11.0, 159: 50.0, 212: 140.0, 424: 2_400.0}
"""Factor by which deciding an orbit takes longer in the kernel's numbers than in doubles.

By the bits of the numbers. With five bodies, whose passages take 1.6 to 53 rotations, it was 9.7 to
13.4 in pairs, 37 to 62 in three, 110 to 178 in four and 1,850 to 3,070 in eight doubles."""
IN_INTEGERS = 0.65
"""The same in integers, over the square of their bits: 0.66 to 0.58 at 448 to 600 bits."""
SHARPER, SHARPEST = 64, 82
"""Bits of the first map that decides the orbits that doubles leave open, in pairs of doubles.

The larger number is used where passages are deep (see `DEEP`)."""
FINER = {SHARPER: (GAP_BITS, CLOSEST), SHARPEST: (CLOSEST,)}
"""Bits by which the second map is sharper than the first; the largest number that pays is taken.

The two then differ by the error of the first, and one computation by each settles nearly as much as
two computations in each of two precisions. Of 20,000 orbits of each of 17 random bodies, maps of 64
and 75 bits left 0 to 4 open, where maps of 64 and 72 left up to 17; maps of 82 and 90 bits left 0
to 9 open of twelve bodies, and 35 to 110 of four whose passages take 20 to 28 rotations."""
CLIMBING = 0.7
"""Time of orbits that a lower rung already decides, as a share of that in the full precision.

With three random bodies it was 0.48, 0.58 and 0.78, with four others 0.69 to 0.81."""
STAYING_OPEN = 2.5
"""Time of orbits that a precision leaves open, on all rungs below it too, as such a share.

Of orbits of 120 and 200 symbols it was 1.5 up to 106 bits, and 1.7 to 1.8 from there to 160; of
those of 300 symbols 3.4 and 2.8, for a third computation is made of nearly all."""
MAPPED = {53: 0.1e-6, SHARPER: 0.3e-6, SHARPEST: 0.8e-6}
"""Seconds of a core for a symbol by kept maps, by the bits of the first one beyond doubles.

With four random bodies it was 0.20 to 0.29, and 0.55 to 1.3 with seven whose passages are deep."""
DEEP = 9.5
"""Least number of rotations in a passage that counts as deep.

Of 35 random bodies maps of 64 bits left 0.2 to 7 % of the orbits open at 9 to 14 rotations, and 0
to 0.5 % below, where sharper tables, which cost twice as much, would not pay."""
VERY_DEEP = 20.0
"""Least number of rotations in a passage that counts as very deep: pairs keep 97 bits at most.

Of 2,900 orbits of eight bodies at 23 to 53 rotations, which maps of 82 and 90 bits left open, none
in 109 bits erred by as much as its difference from 106 bits. Of 250 each at 9.7 to 17.5 rotations
those that erred by more than R times this were 0.016/R to 0.0016/R."""
SPREAD = 10.0
"""Standard deviation of the natural logarithm of the factor by which an orbit's error grows.

With 14 random bodies, where errors grow by 2^20 to 2^80 in the mean, 2 to 97 % of 256 orbits stayed
open in doubles; this value gives each share within a factor of 1.7."""
REGULAR, EVEN = 0.015, 1.3
"""Coupling of passages to phases below which motions are regular, and `SPREAD` of regular errors.

With 40 nearly symmetric bodies, where 0 to 100 % of 96 orbits stayed open in doubles, these values
give 38 of the shares within 0.12, and two within 0.21."""
HANDED_OVER = 0.2
"""Time of an orbit that is handed over to a map, as a share of that of an integration in its bits.

Of five random bodies, whose passages take 36 to 53 rotations, it was 0.18 to 0.23 in 106 and in 109
bits, and 0.27 to 0.40 in 120; of ten orbits or fewer, which do not fill a vector, up to 1.4."""
DECIDED = 0.2
"""Least share of orbits, decided by two maps in doubles, for which the second one pays.

A map in doubles takes some 0.2 of the time of one in pairs, which then need not follow. Of twenty
random bodies with deep passages two maps in doubles decided 0 to 0.52 of the orbits, 0.1 more to
0.14 less than is estimated; but none of one body's, whose J1_0 is large, where it says all."""
NONE_OPEN = 1e-9
"""Share of orbits that doubles leave open, below which no sharper maps are made.

Only regular motions reach it: those of two of sixty random bodies, whose starts are farther from
the surfaces than these are split."""
STAKE = 2
"""Largest ratio of the time for tables to the time that they are expected to save in this call.

Tables are kept, so that further calls with the same body have them at no cost."""
LEAST_SECONDS = 1.0
"""Least time of integration, seconds, for which the costs of maps are estimated at all.

The estimate takes some 0.05 s with a new body. With that of Fig. 4 5,000 orbits of 15 symbols take
so long: on one core 0.12 ms each by integration and 0.004 ms by maps, whose tables take 0.6 s where
they are not kept yet."""
SLOW, LONG = 100e-6 / 15, 1.0
"""Seconds for each symbol of all orbits, and seconds in all, above which integration is warned of.

Both must be exceeded."""
FOLLOWED = 200_000
"""Number of rotations without a crossing after which engine `taylor` gives an orbit up.

It does so after 2,000,000 steps, of which a rotation takes some ten. Of a nearly symmetric body
orbits were followed through 207,000 rotations, and their codes were found."""
NEVER = 5 * FOLLOWED
"""Number of rotations through which no orbit is followed."""


class SlowRoutesWarning(UserWarning):
    """Warning that orbits are integrated and take long, or are given up, with the reason."""


def integration(problem: RouteProblem, precisions: Sequence[int] = PRECISIONS) -> float:
    """Seconds of a core that an orbit takes by integration, in the given precisions (bits)."""
    if to_section(problem) > NEVER:
        # It is given up before its first symbol, and not computed in more bits.
        return ROTATION * FOLLOWED * _factor(precisions[0])
    further = _further(problem, precisions, share_open(problem, precisions[0]))
    return _once(problem) * (_factor(precisions[0]) + further)


def by_maps(problem: RouteProblem, precisions: Sequence[int] = PRECISIONS) -> float:
    """Seconds of a core that an orbit takes by kept maps, and by integration beyond their bits."""
    (first, _), (open_, each) = wanted(problem)[0], beyond_maps(problem, precisions)
    return MAPPED[first] * problem.n_symbols + open_ * each


def beyond_maps(
    problem: RouteProblem, precisions: Sequence[int] = PRECISIONS
) -> tuple[float, float]:
    """Share of orbits that maps leave open, and seconds of a core that each of them takes then."""
    # Computations by both maps decide about as many as one would of the bits between.
    most = sum(wanted(problem)[0]) // 2
    ladder = [most, *(bits for bits in precisions if bits > most)]
    # It is above zero: 2e-275 at least, for one symbol of an orbit whose errors do not grow.
    open_ = share_open(problem, most, displaced=False)
    return open_, _once(problem) * _further(problem, ladder, open_, HANDED_OVER) / open_


def _once(problem: RouteProblem) -> float:
    """Seconds of a core that two computations of an orbit in doubles take."""
    rotations = passage_rotations(problem)
    # Without weight (mu = 0) an orbit crosses once and never again: rotations are infinite.
    rotations = min(rotations, FOLLOWED) if rotations < math.inf else 1.0
    return problem.n_symbols * (SYMBOL + ROTATION * rotations)


def _further(
    problem: RouteProblem, precisions: Sequence[int], open_: float, whole: float = 1.0
) -> float:
    """Cost of the orbits that the first precision leaves open, in units of deciding one in doubles.

    `open_` is their share of all orbits, and `whole` the part of an integration that each takes: of
    those that the last precision leaves open, all of it. Where `whole` is below one, orbits are
    handed over to maps. Their coordinates are relative to the splitting, so that the displacement
    costs no digits.
    """
    found, handed = 0.0, whole < 1
    for known, bits in itertools.pairwise(precisions):
        # Orbits that this precision decides take a part of its time where rungs lie below it, and
        # of a rung's where that decides them; those that stay open take all of it, and the rungs'.
        rungs = [x for x in RUNGS if fits(x, (known, bits))]
        decided, staying = (CLIMBING, STAYING_OPEN) if rungs else (1.0, 1.0)
        share, most = whole * decided, staying * (1.0 if bits == precisions[-1] else whole)
        for rung in (*rungs, bits):
            left = share_open(problem, kept_bits(rung) if handed else rung, displaced=not handed)
            found, open_ = found + share * (open_ - left) * _factor(rung), left
        found += most * open_ * _factor(bits)
    return found


def _factor(bits: int) -> float:
    """Factor by which deciding an orbit takes longer in the numbers that hold so many bits."""
    return FACTORS.get(bits_of_numbers(bits), IN_INTEGERS * bits**2)


@functools.lru_cache(maxsize=256)
def share_open(problem: RouteProblem, bits: int, *, displaced: bool = True) -> float:
    """Estimate of the share of orbits that so many bits do not decide to their ends.

    The logarithm of the growth of an error is taken as normal with the deviation `SPREAD`; an orbit
    is open where the error reaches one. An error grows by a factor in each passage. Where orbits
    are `displaced`, the first error is a rounding of the displacement of both surfaces, which is
    larger than the distance at which orbits pass, by exp of :func:`closeness`. Where starts are
    farther off the surfaces than these are split, phases do not become random in each passage:
    errors add up, and shear the phases ever more. Where they are so far off that motions are
    regular, all errors are alike, but for the deviation `EVEN`, and an orbit is open where its
    error reaches `LIMIT_OF_THREE`.
    """
    nu, n, close = problem.body.angles().nu, problem.n_symbols, closeness(problem)
    # exp(close - narrowness) is the splitting over the distance of the start, one at most: the
    # smaller it is, the less a passage depends on the phase.
    coupled = nu * math.exp(close - narrowness(nu))
    grown, spread = n * math.log(whisker_growth(coupled)), SPREAD
    if close < narrowness(nu):
        # Such errors grow as the square of n, which is the larger where the factor is close to one.
        grown = max(grown, 2 * math.log(n * whisker_growth(nu)))
    if coupled < REGULAR:
        # The sum of 1 to n is half of the square of n.
        grown, spread = grown - math.log(2 * LIMIT_OF_THREE), EVEN
    nats = displaced * close + grown
    return math.erfc((bits * math.log(2) - nats) / (math.sqrt(2) * spread)) / 2


def doubles_decide(problem: RouteProblem) -> bool:
    """True if two maps in doubles are expected to decide so many orbits that the second one pays.

    Their errors must not exceed `LIMIT_OF_TWO`.
    """
    bits = 53 + round(math.log2(LIMIT_OF_TWO))
    return 1 - share_open(problem, bits, displaced=False) >= DECIDED


def very_deep(problem: RouteProblem) -> bool:
    """True if passages are so deep that pairs of doubles keep no more bits than they count for."""
    return passage_rotations(problem) >= VERY_DEEP


def at_stake(problem: RouteProblem, orbits: int, precisions: Sequence[int]) -> bool:
    """True if integration begins in doubles and would take so long that maps may pay."""
    return precisions[0] == 53 and orbits * integration(problem, precisions) >= LEAST_SECONDS


def wanted(problem: RouteProblem) -> tuple[tuple[int, int], ...]:
    """Bits of the first and the second map, best first; the next serve where these do not pay."""
    if share_open(problem, 53, displaced=False) < NONE_OPEN:
        return ((53, 53),)
    least = (SHARPEST, SHARPER) if passage_rotations(problem) >= DEEP else (SHARPER,)
    # Two maps beyond doubles settle more than a single, sharper one: of a body with 13 rotations a
    # passage those of 64 and 75 bits left 0.7 % of the orbits open, that of 82 bits 26 %.
    pairs = [(bits, bits + more) for bits in least for more in FINER[bits]]
    return *pairs, *((bits, 53) for bits in least), (53, 53)


def budget(problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS) -> float:
    """Longest time, seconds of a core, that the tables of all designs may take so as to pay."""
    return STAKE * orbits * (integration(problem, precisions) - by_maps(problem, precisions))


def to_section(problem: RouteProblem) -> float:
    """Least number of rotations from the start to J1 = J2/2.

    J1 grows by exp(2 pi^2/nu) in each, and by gravity too: that of nearly symmetric bodies by
    exp(0.17 (mu/h0)^2) to exp(0.25 (mu/h0)^2), as measured.
    """
    smaller = min(problem.J1_0.at(53), problem.J2mJ1_0(53))
    depth = float(context(53).log(problem.J2_0(53) / smaller))
    weight = float(problem.body.mu.at(53) / problem.h0.at(53))
    return depth / (2 * math.pi**2 / float(problem.body.angles().nu) + weight**2 / 2)


def warned_of_none(problem: RouteProblem) -> None:
    """Warn if integration gives orbits up before their first symbols."""
    if (rotations := to_section(problem)) > NEVER:
        warnings.warn(
            f"all symbols stay uncertain: an orbit rotates {rotations:.2g} times or more before its"
            f" first one, and is followed through some {FOLLOWED:,}",
            SlowRoutesWarning,
            stacklevel=2,
        )


def warned(problem: RouteProblem, orbits: int, out_of: int, each: float, reason: str) -> None:
    """Warn if `orbits` of `out_of`, which take `each` seconds of a core, make the whole slow."""
    if orbits * each > max(LONG, SLOW * problem.n_symbols * out_of):
        warnings.warn(
            f"{orbits} of {out_of} orbits are integrated numerically, which takes {seconds(each)}"
            f" each on a core, some {seconds(orbits * each)} in all, because {reason}",
            SlowRoutesWarning,
            stacklevel=2,
        )
