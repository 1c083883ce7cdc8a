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

The action is the integral of p dq over a period: where M . gamma = 0 the form p dq is M . omega dt
in any coordinates, J1 dtheta1 + J2 dtheta2 or others, and on the sphere of gamma it has no
ambiguity. So the action is twice the kinetic energy, 2 (h - mu r . gamma), integrated. Along a
family of orbits its derivative in h is their period. Orbits are integrated over a period in many
bits, and come back to rounding.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.exact import GUARD_BITS, context, exact, fraction
from rigidpend.numbers.generic import Array, Scalar
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.symbolic.address import AddressError, parsed
from rigidpend.routes.symbolic.chain import (
    MOVED,
    Chain,
    NoOrbit,
    System,
    crossing_states,
    displaced,
    section_points,
    section_states,
    signs_of,
    tangents,
)
from rigidpend.routes.symbolic.levels import Level, Signs
from rigidpend.routes.symbolic.shortest import alike
from rigidpend.routes.symbolic.stretching import BENDING

MOST_SYMBOLS = 60
"""Longest word: its equations are a dense system."""
ROUNDS = 12
LOST = 12
"""Bits by which a passage may fail to meet the next."""
GROWN = 4.0
"""Roundings of the last bit in a passage: what they have grown to is its error, if that is more."""
GUARD = 15
"""Bits that the numbers of the section have beyond those of the integration."""


class ClosedOrbit(NamedTuple):
    """A periodic orbit of P passages, from an upward crossing on."""

    word: tuple[int, ...]
    half_turns: int
    """Half rotations of every passage."""
    mirrored: bool
    """True if it is at its mirror image after P passages, and closes after twice as many."""
    period: float
    """t' of the P passages."""
    trace: float
    """Trace of the derivative of the P passages in (d, chi)."""
    chain: Chain
    """The P passages; its last crossing is the first one of the next period."""

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
    def exponent_error(self) -> float:
        """The exponent's rounding at most, per passage: each crossing, displaced, bends a growth.

        Near a trace of 2 or -2 the multiplier changes with it as a square root does.
        """
        chain, size = self.chain, abs(self.trace)
        bent = BENDING * displaced(chain.level, chain.unknowns, chain.split)
        # Nearer than the trace is known it is as at 2 itself.
        apart = max(abs(size * size - 4), len(chain.b) * bent * size)
        return bent * size / math.sqrt(apart)

    @property
    def points(self) -> int:
        """Its upward crossings in a period, from each of which on a word is read along it."""
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
    return closed(Level.of(body, exact(h)), address.symbols, half_turns, address.first or 0)


def closed(
    level: Level, word: tuple[int, ...], half_turns: int | None = None, first: int = 0
) -> ClosedOrbit:
    """:func:`closed_orbit` on a level that is at hand, from an even (0) or odd (1) cell on."""
    signs = signs_of(np.array(word * (1 + len(word) % 2)))

    def solved(n: int) -> Chain:
        """The chain whose last crossing is its first one, n half rotations a passage."""
        cells = first + n * np.arange(len(signs) + 1)
        angles = np.asarray(np.pi * cells, dtype=float)
        system = System(level, None, signs, math.pi * n * len(signs))
        return system.solved(system.guess(angles, 0.0)).within(cells)

    chain = alike(level, signs, solved) if half_turns is None else solved(half_turns)
    turns, mirrored = chain.cells[1] - chain.cells[0], bool((chain.I < 0).sum() % 2)
    period, trace = float(chain.time.sum()), float(np.trace(_monodromy(chain, signs)))
    return ClosedOrbit(word, int(turns), mirrored, period, trace, chain)


def _monodromy(chain: Chain, signs: Signs) -> Array:
    """The derivative of all passages in the angles a and b of the last one.

    Its trace is that in (d, chi), where surfaces split by little cost twice the digits: there two
    passages are multiplied whose derivatives nearly cancel. Here each crossing alone has what the
    surfaces on its sides differ by.
    """
    _, by, _ = System(chain.level, None, signs, 0.0).evaluated(chain.unknowns)
    before, behind = np.moveaxis(by[:, :2], -1, 0), np.moveaxis(by[:, 2:], -1, 0)
    steps = -np.linalg.solve(behind, before)
    return functools.reduce(lambda whole, step: step @ whole, steps, np.eye(2))


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


def actions(chains: Sequence[Chain]) -> Array:
    """The actions of chains of one level, each passage integrated alone in doubles; dimensionless.

    Each chain begins with an upward crossing.
    """
    level = chains[0].level
    c = level.c.aligned
    states = np.concatenate([crossing_states(chain)[:, :-1] for chain in chains], axis=1)
    time = np.concatenate([chain.time for chain in chains])

    def rates(state: Any) -> tuple[Any, ...]:
        """The aligned equations with the quadrature of the potential energy."""
        return (*aligned(state[:6], c), c.mu_r1 * state[3] + c.mu_r2 * state[4])

    lifted = states_at(rates, np.vstack((states, 0 * time)), time[None])[6, 0]
    of = np.repeat(np.arange(len(chains)), [len(chain.time) for chain in chains])
    return np.bincount(of, weights=2 * (level.h * time - lifted)).astype(float)


class Closing(NamedTuple):
    """A closed orbit, refined and integrated once round, its period t' and its first crossing.

    The error is the distance of the end from the beginning in d and chi. What is expected is the
    gap left where passages meet, and by roundings, enlarged by the period's derivative. By `moved`
    refinement moved the crossings: the error of the map in doubles.
    """

    error: float
    expected: float
    moved: float
    period: Fraction
    place: tuple[Fraction, Fraction]


def closing(orbit: ClosedOrbit, bits: int = 113) -> Closing:
    """Refine a closed orbit by the full equations until it closes, in 96 bits or more.

    Newton's method for (d, chi) at all crossings at once: each passage is integrated alone, and the
    map's derivatives, in doubles, gain some eight digits a time. Then the whole period is
    integrated from the first crossing: it ends there, but for rounding and its growth. NoOrbit is
    raised where it does not come to close.
    """
    chain, level, a = orbit.chain, orbit.chain.level, precision(bits + GUARD)
    c = coefficients(level.body.angles(a.bits + GUARD_BITS), "1", a)
    fractions = AlignedCoefficients(*(fraction(x, bits) for x in c.aligned))
    h, turn = a.number(level.energy.in_context(context(a.bits))), 2 * a.pi
    rounded, exactly = (np.frompyfunc(lambda x, n=n: fraction(x, n), 1, 1) for n in (bits, a.bits))

    def gaps(places: Any, ends: Any, times: Any) -> tuple[Any, Any]:
        """The lack of (d, chi) behind passages of their ends (n, 2), and how late these cross."""
        d, chi = a.array(places.T)
        states = rounded(section_states(d, chi, h, c, a))
        reached = states_at(fractions, states, times[None], bits)[:, 0]
        rates = np.array(aligned(reached, fractions))
        late = -reached[2] / rates[2]
        point = section_points(a.array(reached + late * rates), c, a)
        off = np.stack((point.d, point.chi), axis=1) - a.array(ends)
        off[:, 1] -= turn * a.array(np.rint(a.floats(off[:, 1] / turn)))
        return exactly(off), late

    slopes, n = tangents(chain)[:, :2], len(chain.b)
    # Within a passage a rounding of d, relative, or of chi grows to so much of chi.
    grown = float(np.abs(slopes[:, 1] * np.stack((chain.d[:-1], np.ones(n)), axis=1)).max())
    met = Fraction(max(2.0**LOST, GROWN * grown)) / 2**bits
    # Where passages lead, less the next crossing, are the gaps: behind the last is the first one.
    matrix = -np.roll(np.eye(2 * n), 2, axis=1)
    for k, slope in enumerate(slopes):
        matrix[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += slope
    begin = places = exact_of(np.stack((chain.d, chain.chi), axis=1)[:-1])
    times = exact_of(chain.time)
    for _ in range(ROUNDS):
        off, late = gaps(places, np.roll(places, -1, axis=0), times)
        times, size = times + late, np.abs(off).max()
        if size < met:
            break
        step = -np.linalg.solve(matrix, (off / size).astype(float).ravel())
        moved = float(np.abs(step).max() * size)
        if moved > MOVED:
            raise NoOrbit(
                f"the orbit of {orbit.word} does not come to close: a correction is {moved:.1g}"
                f" rad; its surfaces are split by {level.splitting:.1g}"
            )
        places = places + exact_of(step.reshape(n, 2)) * size
    else:
        raise NoOrbit(f"the orbit of {orbit.word} does not come to close, by {float(size):.2g}")
    period, first = times.sum(), places[:1]
    error = float(np.abs(gaps(first, first, np.array([period]))[0]).max())
    whole = functools.reduce(lambda before, slope: slope @ before, slopes)
    growth = n * float(np.abs(whole).max())
    moved = float(np.abs(places - begin).max())
    # Roundings in the passages of the whole are others than those that the gap is of.
    expected = growth * (float(size) + (1 + GROWN * grown) * 2.0**-bits)
    return Closing(error, expected, moved, period, tuple(first[0]))


exact_of = np.frompyfunc(lambda x: Fraction(float(x)), 1, 1)
"""Fractions from doubles."""
