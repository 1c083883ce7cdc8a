"""Ladder: all computations of an orbit, in ascending precision, and what each is compared with.

An orbit climbs from rung to rung until all its symbols are certain. Computations on one rung, in
one precision, share no rounding: integrations differ in their units, maps in their design. With the
precisions that are asked for by default they are these:

==== ============ ====================== ======================
bits integration  maps of 64 and 75 bits maps of 82 and 90 bits
==== ============ ====================== ======================
53   two or three two or three maps      two or three maps
64   one          first map
75                second map
76   one
82                                       first map
88   one
90                                       second map, first map
106  up to three  one                    one
109                                      one, without 106
120  one          one                    one
131  one          one                    one
160  up to three  up to three            up to three
==== ============ ====================== ======================

In doubles the second map computes alone where two would decide few orbits. Beyond maps an
integration begins an orbit, and a map goes on (`handover`). Maps are left out that are too near to
what is asked for (`CLOSEST`), and integrations that are less sharp than what is known.

Symbols are certain where computations agree to a limit (`certainty` has the measurements):

================ ==========================================================================
limit, radians   computations
================ ==========================================================================
LIMIT_OF_TWO     two on one rung
LIMIT_OF_THREE   three on one rung
LIMIT_OF_UNEQUAL the first on a rung and the last one below it; halved for each bit less
                 than 11 by which it is the sharper, its `Rung.more`
LIMIT_OF_COARSE  two on one rung and, if these are `COARSE_BITS` sharper, the last one below
LIMIT_OF_SHARPER the first integration and two maps below it, unless it is `MUCH_SHARPER`
================ ==========================================================================

How much sharper is the difference of the bits that computations count for. An integration counts
for its bits, but in pairs of doubles for 97 at most (`KEPT_IN_PAIRS`); beside a sharper one for all
of them there too, unless passages are very deep. A map counts for its bits beside a map. Beside an
integration it counts for as many more as tables of a thin layer hold (`problem.narrower`), and one
beyond doubles for `SHARPER_BY` more, unless the other map computes on its rung too.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.checked import GAP_BITS
from rigidpend.orbits.integrate import Crossings
from rigidpend.orbits.integrate.arithmetic import PAIRS, in_kernel

RUNGS = 64, 76, 88, 109, 120, 131
"""Bits of the rungs: one integration in each, between two precisions, is all that most orbits need.

Their series are shorter: with three random bodies a rung up to 88 bits took 0.36, 0.49 and 0.69 of
the time of an integration in 106 bits, others 0.45 and 0.58 of one in 160. From one rung to the
next there are at least four more orders of the series, by which the truncation error falls by e^8.
"""
CLOSEST = 8
"""Least difference, in bits, of two precisions with one computation each that decide together."""
COARSE_BITS = 7
"""Least number of bits by which one of three computations may differ from the others."""
MUCH_SHARPER = GAP_BITS + 6
"""Least number of bits between two maps and an integration for which one of the maps suffices.

Maps' tables have six bits more than they count for. Of 1,000 orbits of each of three bodies with
narrower tables, integrations that counted as 11, 12 and 14 bits sharper and were handed over were
so by 5.5, 6.9 and 10.7 in the median, and erred by more than R times the difference from the last
map in a share of 0.02/R, 0.009/R and 0.0012/R: by a radian, at `certainty.LIMIT_OF_UNEQUAL`, once
in 5,000, 11,000 and 80,000. They erred by more than R times that from either map in 0.005, 0.004
and none, for R of 0.1, and in a share that fell as the square of R, which leaves less than one in a
million."""
KEPT_IN_PAIRS = 97
"""Bits for which an integration in pairs of doubles counts, whatever tolerance it has.

Where integrations of 88 bits erred by up to 0.3 radians, those of 98, 102 and 106 bits were alike,
sharper by 2^5 to 2^7 in the median of 96 orbits of each of five bodies, and those of 109 bits, in
sums of three doubles, by 2^17 to 2^19. Those of 106 bits erred by more than R times the difference
from one of 88 bits in a share of 0.005/R to 0.009/R of 330 orbits, so that this number leaves the
chance of about one in 70,000, as in `certainty`. But where passages take 7 and 9 rotations, those
of 106 bits were sharper by 2^17 than those of 88, and 2^5 and 2^9 less sharp than those of 109:
beside a sharper computation they count as 106, but where passages are very deep
(`costs.VERY_DEEP`)."""
SHARPER_BY = 8
"""Bits by which a map beyond doubles is sharper than an integration in as many.

Its tables have six more (`build.SPARE_BITS`). With eight bodies at 4 to 9 rotations a passage some
2,000 orbits of 45 symbols were integrated in 8, 11, 13, 15 and 17 bits more than a map of 75 has.
The integration erred by more than R times its difference from the map in 0.33/R, 0.11/R, 0.04/R,
0.008/R and 0.001/R of them, for R of 0.3 to 10; beside maps of 64 and 72 bits it was the same. A
limit for all the bits between them would leave one in 700 to 20,000 of those that err by a radian
wrong; that for eight bits less leaves one in 110,000 to 680,000, and one in 56,000 with the worst
of the bodies. Beside maps of 82 bits, of deep passages, it leaves one in 70,000 at most."""

Columns: TypeAlias = NDArray[np.intp]
"""Indices of some of the orbits."""
Third: TypeAlias = Callable[[Columns], Crossings]
"""Another computation of some columns, whose precision and scales are settled."""


class Rung(NamedTuple):
    """One precision of a ladder."""

    bits: int
    most: int = 3
    """Largest number of computations, 1 to 3; a single one on the lowest rung decides nothing."""
    more: int = 0
    """Bits by which they count as sharper than the last one below them."""
    beside: Third | None = None
    """Computation as sharp as that one, which has to confirm the first of these too."""


def kept_bits(bits: int, in_pairs: int = KEPT_IN_PAIRS) -> int:
    """Bits for which an integration counts: in pairs of doubles for `in_pairs` at most."""
    return min(bits, in_pairs) if bits <= PAIRS else bits


def fits(bits: int, others: Sequence[int]) -> bool:
    """True if one computation in `bits` bits pays: between the others, and not close to any."""
    return min(others) < bits < max(others) and all(abs(bits - x) >= CLOSEST for x in others)


def rungs(
    precisions: Iterable[int], known: int = 0, in_pairs: int = PAIRS, most: Mapping[int, int] = {}
) -> list[Rung]:
    """Rungs above a computation that counts for `known` bits.

    `in_pairs` are the bits that pairs of doubles count for beside sharper numbers, and `most` the
    largest number of computations where this is not three.
    """
    found = []
    for bits in precisions:
        found.append(Rung(bits, most.get(bits, 3), kept_bits(bits) - known))
        known = kept_bits(bits, in_pairs)
    return found


def integrations(
    engine: str, asked: Iterable[int], known: int, in_pairs: int = PAIRS, apart: int = 0
) -> list[Rung]:
    """Rungs in the precisions that are asked for, and one integration in each of `RUNGS` between.

    All count for as many bits as what is `known`, and `apart` more; `in_pairs` is as in `rungs`.
    """
    # What is asked for and less sharp would settle nothing, and keeps no rung away.
    asked = [x for x in asked if kept_bits(x) >= known + apart]
    others = known, *(kept_bits(x, in_pairs) for x in asked)
    single = [x for x in RUNGS if in_kernel(engine, x) and fits(x, others)]
    return rungs(sorted((*asked, *single)), known, in_pairs, dict.fromkeys(single, 1))
