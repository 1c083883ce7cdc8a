"""Closed orbits by their codes: the periodic orbit that repeats a word for ever.

A word is read from a passage past the upper periodic orbit on, and the passages past the two
orbits take turns. So a word of even length and the same word read from its second symbol on are
two orbits, 01 and 10 for example, and a word is told apart from its turns by an odd number of
symbols. A word of odd length is read twice before the orbit can close, and its turns are one orbit.
Where an odd number of its passages changes sides, the orbit then is at its own mirror image by
the symmetry (-M1, -M2, M3, gamma1, gamma2, -gamma3), and closes at the second time.

The reversor swaps the two periodic orbits, left and right, before and behind: the orbit of a word
reversed is that of the word read backward with 0 and 1 exchanged. Both have the same period,
action and multiplier.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map import return_map
from rigidpend.routes.symbolic.address import AddressError, parsed
from rigidpend.routes.symbolic.chain import Chain, System, signs_of, tangents
from rigidpend.routes.symbolic.levels import Level
from rigidpend.routes.symbolic.shortest import alike, cells_after

MOST_SYMBOLS = 60
"""Longest word: its equations are a dense system."""


class ClosedOrbit(NamedTuple):
    """A periodic orbit of P passages, from an upward crossing on."""

    word: tuple[int, ...]
    half_turns: int
    """Half rotations of every passage."""
    first: int
    """Parity of the cell of its first crossing, 0 or 1: `a` or `b` of an address."""
    h: float
    """Energy, dimensionless."""
    mirrored: bool
    """True if it is at its mirror image after P passages, and closes after twice as many."""
    period: float
    """t' of the P passages."""
    trace: float
    """Trace of the derivative of the P passages in (d, chi)."""
    chain: Chain
    """The P passages, without their last crossing's place in the next period."""

    @property
    def multiplier(self) -> complex:
        """The Floquet multiplier of the P passages that is not inside of the unit circle."""
        half = self.trace / 2
        if abs(half) > 1:
            return half + math.copysign(math.sqrt(half * half - 1), half)
        return complex(half, math.sqrt(1 - half * half))

    @property
    def stable(self) -> bool:
        """True if it is elliptic: deviations turn instead of growing."""
        return abs(self.trace) < 2

    @property
    def exponent(self) -> float:
        """Lyapunov exponent, per passage; over the mean time of a passage it is that in 1/t'."""
        return math.log(abs(self.multiplier)) / len(self.chain.b)

    @property
    def points(self) -> int:
        """Its upward crossings in a period: points that the second return takes to each other.

        They are as many as words are read along it: one from each of its passages past the
        upper periodic orbit on.
        """
        return len(self.chain.b) // 2


def closed_orbit(
    body: Body, word: str | Sequence[int], *, h: Scalar, half_turns: int | None = None
) -> ClosedOrbit:
    """The periodic orbit that repeats a word, with as many half rotations in every passage.

    Parameters
    ----------
    body : Body
    word : str or sequence of int
        Symbols, read from a passage past the upper periodic orbit on. Before them a text may have
        the first crossing's cell, `a` or `b`; without it that is `a`.
    h : number
        Energy (eq. h0_new), dimensionless.
    half_turns : int, optional
        By default the fewest with which all crossings stay within 0.36 of their cells' middles.

    Raises
    ------
    NoOrbit
        There is none in the range of the return map; the message gives the reason.
    AddressError, ExactError
        A word or number that is none.
    MapError
        The body's orbits have no return map.
    """
    address = parsed(word)
    if address.half_turns is not None or len(address.symbols) > MOST_SYMBOLS:
        raise AddressError(f"a word is 1 to {MOST_SYMBOLS} symbols, without half rotations")
    energy = exact(h)
    level = Level(return_map(body, h=energy), float(energy))
    return closed(level, address.symbols, half_turns, address.first or 0)


def closed(
    level: Level, word: tuple[int, ...], half_turns: int | None = None, first: int = 0
) -> ClosedOrbit:
    """:func:`closed_orbit` on a level that is at hand, from an even (0) or odd (1) cell on."""
    signs = signs_of(np.array(word * (1 + len(word) % 2)))

    def solved(n: int) -> Chain:
        """The chain whose last crossing is its first one, n half rotations a passage."""
        cells = cells_after(first, [n] * len(signs))
        system = System(level, None, signs, math.pi * n * len(signs))
        angles = np.asarray(np.pi * cells, dtype=float)
        return system.solved(system.guess(angles, 0.0)).within(cells)

    chain = alike(level, solved) if half_turns is None else solved(half_turns)
    matrix = np.eye(2)
    for slope in tangents(level, chain):
        matrix = slope[:2] @ matrix
    mirrored = bool((chain.I < 0).sum() % 2)
    period, trace = float(chain.time.sum()), float(np.trace(matrix))
    return ClosedOrbit(word, chain.half_turns[0], first, level.h, mirrored, period, trace, chain)


def words(longest: int) -> Iterator[tuple[int, ...]]:
    """Words of up to so many symbols, one for each closed orbit, by length.

    They are primitive, and the least of those that are read along the orbit. These begin at every
    second symbol, for the passages past the upper orbit are every other one: of an even word they
    are the turns by an even number of symbols, of an odd one all turns.
    """
    for n in range(1, longest + 1):
        for word in itertools.product((0, 1), repeat=n):
            turned = [word[k:] + word[:k] for k in range(1, n)]
            along = turned if n % 2 else turned[1::2]
            if word not in turned and all(word < other for other in along):
                yield word


def lyapunov(orbits: Sequence[ClosedOrbit], length: int) -> float:
    """The mean Lyapunov exponent per passage over all words of `length` symbols, counted alike.

    Each of the 2^length words is read at one upward crossing of the orbit that repeats it. Of an
    even length these crossings are all points of the invariant set that length/2 second returns
    take to themselves; of an odd one, those that also repeat their symbols after `length` of them.
    ValueError is raised where the orbits are not all of those whose words repeat to `length`.
    """
    found = [orbit for orbit in orbits if length % len(orbit.word) == 0]
    points = sum(orbit.points for orbit in found)
    if points != 2**length:
        raise ValueError(f"{points} points of period {length} instead of {2**length}")
    return sum(orbit.points * orbit.exponent for orbit in found) / points
