"""Chains with given half rotations, and the fewest that an orbit with given symbols can take."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidpend.symbolic.chain import Arrival, Begin, Chain, NoOrbit, System
from rigidpend.symbolic.tables import Array, Level, Signs

APART = 4
"""Half rotations beyond the splitting's from which no crossing disturbs the next."""
SHORTEST_STEP = 0.02
"""Least step of that length, radians; a chain that ends between two such steps ends in a fold."""
WINDOW = 8
"""Number of passages on each side that feel it when one is shortened: less by a third for each."""
INSIDE = 0.36
"""Distance from the middle of a cell, half rotations, within which free crossings stay.

Nearer to the border, 0.5, orbits end in folds. Measured on random words: at 0.45 some of 200
symbols could not be put together from their windows, at 0.36 none of 1,000."""
LESSENED = 100
"""Number of symbols up to which half rotations are lessened one by one, a tenth of a second each."""
MORE = 24
"""Largest number of half rotations above the tables' least that are tried alike for all."""


class Path(NamedTuple):
    """A chain with the cells j of its crossings."""

    chain: Chain
    cells: Signs
    """(N + 1,) chi is nearest to j pi."""

    @property
    def half_turns(self) -> tuple[int, ...]:
        """Half rotations of each passage."""
        return tuple(int(n) for n in np.diff(self.cells))


def path(
    level: Level,
    begin: Begin,
    signs: Signs,
    cells: Signs,
    unknown: float,
    patient: bool = True,
) -> Path:
    """The chain whose crossings lie in given cells, and whose last one is on gamma3 = 0.

    Where Newton's method does not find it from the middles of the cells, and one is `patient`,
    passages are made longer, until no crossing disturbs the next, and then shorter by steps.

    Raises
    ------
    NoOrbit
        There is none in the range of the map; the message says which passage is too short.
    """
    angles = np.pi * cells
    system = System(level, begin, signs, float(angles[-1]))
    x = system.guess(angles, unknown)
    try:
        return _in_cells(system.solved(x), cells)
    except NoOrbit:
        if not patient:
            raise
        return _in_cells(_continued(system, x, cells), cells)


def _continued(system: System, x: Array, cells: Signs) -> Chain:
    apart = system.level.half_turns(system.level.splitting) + APART
    longer = max(APART, apart - float(np.diff(cells).min())) * math.pi
    step, made = longer / 4, None
    while True:
        try:
            made = system._replace(longer=longer).solved(x)
        except NoOrbit:
            if made is None or step < SHORTEST_STEP:
                raise NoOrbit(_reason(system, made, longer)) from None
            longer, step = longer + step / 2, step / 2
            continue
        if longer == 0:
            return made
        x = system.unknowns(made)
        longer = max(0.0, longer - step)


def _reason(system: System, made: Chain | None, longer: float) -> str:
    if made is None:
        return "Newton's method does not settle even for long passages"
    level, growth = system.level, made.b - made.a[: len(made.b)]
    k = int(np.argmin(growth))
    splitting = float(np.abs(np.diff(made.I, prepend=0)).max())
    return (
        f"none exists with so few half rotations: made longer, the orbit exists until all passages "
        f"are {longer / math.pi:.2f} of a half rotation longer, and ends there in a fold with "
        f"another orbit. Passage {k + 1} is the shortest: it would need |I| = "
        f"{math.exp(-growth[k] * level.exponent):.3g}, and a crossing changes I by "
        f"{splitting:.3g} there"
    )


def _in_cells(chain: Chain, cells: Signs) -> Path:
    off = np.flatnonzero(np.rint(chain.chi / np.pi).astype(int) != cells)
    if off.size:
        k = int(off[0])
        raise NoOrbit(
            f"the orbit found leaves its address: crossing {k + 1} is "
            f"{abs(chain.chi[k] / np.pi - cells[k]):.2f} half rotations from where it should be"
        )
    return Path(chain, cells)


def shortest(
    level: Level,
    begin: Begin,
    signs: Signs,
    first: int,
    unknown: float,
    given: tuple[int, ...] = (),
) -> Path:
    """The chain of a code with few half rotations, the first of which may be given.

    Begun alike for all passages, with the fewest that allow an orbit, they are lessened one
    by one from the first passage on, as far as an orbit exists whose crossings stay `INSIDE`.
    Words of more than `LESSENED` symbols keep them alike.

    Raises
    ------
    NoOrbit
        None was found.
    """
    n, free = len(signs), len(signs) - len(given)
    least = max(1, math.floor(level.half_turns(2 * level.splitting)))
    reason = None
    for each in range(least, least + MORE):
        turns = np.array([*given, *[each] * free])
        try:
            made = path(level, begin, signs, _cells(first, turns), unknown, patient=not free)
            if not free or _spread(made) <= INSIDE:
                break
        except NoOrbit as error:
            reason = error
            if not free:
                raise
    else:
        raise NoOrbit(f"from {least} to {least + MORE - 1} half rotations a passage: {reason}")
    alike = made
    for k in range(len(given), n if n <= LESSENED else 0):
        made = _lessened(level, begin, signs, made, k)
    if made is alike:
        return made
    try:
        return path(level, begin, signs, made.cells, made.chain.unknown, patient=False)
    except NoOrbit:
        return alike


def _spread(made: Path) -> float:
    """The largest distance of a crossing from the middle of its cell, half rotations."""
    return float(np.abs(made.chain.chi / np.pi - made.cells).max())


def _cells(first: int, turns: Signs) -> Signs:
    return first + np.concatenate(([0], np.cumsum(turns)))


def _lessened(level: Level, begin: Begin, signs: Signs, made: Path, k: int) -> Path:
    """The path with as few half rotations in passage k as its neighbours allow."""
    low, high = max(0, k - WINDOW), min(len(signs), k + 1 + WINDOW)
    here, unknown = begin, made.chain.unknown
    if low:
        I, shift = float(made.chain.I[low - 1]), made.chain.b[low - 1] - made.chain.chi[low]
        here, unknown = lambda angle: Arrival(I, angle, 0.0, 1.0), shift + np.pi * made.cells[low]
    while True:
        cells = made.cells.copy()
        cells[k + 1 :] -= 1
        try:
            part = path(level, here, signs[low:high], cells[low : high + 1], unknown, False)
        except NoOrbit:
            return made
        if _spread(part) > INSIDE:
            return made
        made = made._replace(cells=cells)
