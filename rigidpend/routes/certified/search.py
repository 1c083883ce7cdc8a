"""Half rotations and bits with which a full shift is tried, from a body and an energy alone.

Nothing here is proven, as in :mod:`rigidpend.routes.certified.horseshoe`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from rigidpend.routes.certified.horseshoe import BITS, WIDTH, ShiftProblem, angles, quads
from rigidpend.routes.certified.pieces import Quad

NARROW = 0.12
"""Largest |gamma3| in sets: polynomials of wider ones would have too many terms."""
TRIALS = 4
"""Numbers of half rotations that are tried, in sets of each width."""
WIDER = 2.2
"""Width of sets that are tried where those of `WIDTH` prove nothing."""
MOST_TURNS = 100
"""Half rotations of a passage at most."""
LEAST = 1e-8
"""Angle of the surfaces at least: sets beside a smaller one ask for more than MOST_BITS."""
SPARE, MOST_BITS = 18, 80
"""Bits beyond the square of a set's distance from the stable surface, and bits at most.

Integration in pairs of doubles knows no more; the bound grows as that distance shrinks."""


def trials(of: ShiftProblem, half_turns: int | None = None) -> Iterator[ShiftProblem]:
    """Ways to try a full shift, the fewest half rotations first; one if these are given.

    Raises
    ------
    MapError, ArithmeticError
        There is none; the text says why.
    """
    first = of._replace(half_turns=half_turns or 1)
    if half_turns:
        yield _with_bits(first, quads(first))
        return
    if not (angle := min(angles(first))) > LEAST:
        said = f"the surfaces of the periodic orbits cross at an angle of {angle:.2g}"
        told = f"as far as the return map tells, and of {LEAST:g} or less no sets are tried"
        raise ArithmeticError(f"{said}, {told}")
    least, tried = math.log(1 / angle), 0
    for width in (WIDTH, WIDER):
        for setting in _of_width(first._replace(width=width), least):
            tried += 1
            yield setting
    if not tried:
        raise ArithmeticError(f"with up to {MOST_TURNS} half rotations no sets are small enough")


def _of_width(first: ShiftProblem, least: float) -> Iterator[ShiftProblem]:
    """Ways with sets of one width, whose distance shrinks by e to the power of `least` or more."""
    # A half rotation takes an orbit beside the stable surface so much further from it.
    turn, tried = math.pi * float(first.level.exponent[0, 0]), 0
    n = math.ceil(least / turn)
    while tried < TRIALS and n <= MOST_TURNS:
        setting = first._replace(half_turns=n)
        n += 1
        try:
            sets = quads(setting)
        except ArithmeticError:
            # Too few: such passages begin further from the surface than the map reaches.
            continue
        reach = max(float((abs(quad.l0) + quad.b) / abs(quad.l1)) for quad in sets)
        if reach > NARROW:
            n += int(math.log(reach / NARROW) / turn)
            continue
        tried += 1
        yield _with_bits(setting, sets)


def _with_bits(setting: ShiftProblem, sets: list[Quad]) -> ShiftProblem:
    # Images of sets of few half rotations are as far from a surface as these are from theirs; the
    # others are nearer by a factor for each half rotation.
    further = 2 * (setting.lengths - 1) * math.pi * float(setting.level.exponent[0, 0])
    away = min(float(quad.b) for quad in sets) / setting.width * math.exp(-further)
    return setting._replace(bits=min(MOST_BITS, max(BITS, math.ceil(SPARE - 2 * math.log2(away)))))
