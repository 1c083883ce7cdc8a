"""Closed orbits by their codes: the periodic orbit that repeats a word for ever.

A word is read from a passage past the upper periodic orbit on, and passages past the upper and the
lower orbit alternate. So a word of even length and the same word read from its second symbol on,
01 and 10 for example, are two orbits: a cyclic shift by an odd number of symbols changes the orbit.
A word of odd length is read twice before the orbit can close, and all its cyclic shifts are one
orbit. If an odd number of the passages change sides, the orbit has then reached its own mirror
image by the symmetry (-M1, -M2, M3, gamma1, gamma2, -gamma3), and closes after as many again.

The reversor exchanges the two periodic orbits, left and right, and past and future: the orbit of a
word, reversed in time, is that of the word read backward with 0 and 1 exchanged. Both have the same
period, action and multiplier.

The action is the integral of p dq over a period. Where M . gamma = 0 the form p dq is M . omega dt
in any coordinates, such as J1 dtheta1 + J2 dtheta2, and on the sphere of gamma it is unique. So the
action is the integral of twice the kinetic energy, 2 (h - mu r . gamma). Along a family of orbits
its derivative in h is their period.

As a check, an orbit is refined and integrated over a period in many bits, and must close to within
rounding.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import aligned, on_section
from rigidpend.numbers import Array, Scalar, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import GUARD_BITS, exact, fraction
from rigidpend.orbits.integrate.states import finest_tolerance, states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.symbolic.address import parsed
from rigidpend.routes.symbolic.chain import (
    MOVED,
    Chain,
    NoOrbit,
    System,
    check_told,
    crossing_states,
    displaced,
    section_points,
    section_states,
    signs_of,
    tangents,
)
from rigidpend.routes.symbolic.levels import ChainLevel, Signs
from rigidpend.routes.symbolic.shortest import APART, alike
from rigidpend.routes.symbolic.stretching import BENDING

MOST_SYMBOLS = 60
"""Largest number of symbols in a word: the equations of its orbit are a dense system."""
MOST_HALF_TURNS = 999_999
"""Largest number of half rotations of a passage, as in addresses."""
CLOSING_BITS = 96
"""Least number of bits of an integration that is to close an orbit."""
GAINED = 3
"""Bits that corrections by integration gain at least, in the mean; 26 bits each are usual.

The less the surfaces are split, the more the derivatives at the map's crossings err. With bodies
whose surfaces are split by 2e-14 to 2e-10, corrections gained 4.5 to 14 bits, and a single one as
little as none; with less splitting some orbits do not come to close.
"""
NOISE = 32
"""Largest gap, in its expected roundings, that is left where corrections no longer make it smaller.

Numbers without bits to spare, of 106 or 212, round up to 11 of them."""
LOST = 12
"""Bits that a passage may lose where it meets the next."""
GROWN = 4.0
"""Number of roundings in a passage, of the finest tolerance, which grow to its end."""
SECTION_BITS = 15
"""Bits that the numbers of the section have beyond those of the integration."""


class ClosedOrbit(NamedTuple):
    """A periodic orbit of P passages, from an upward crossing on."""

    word: tuple[int, ...]
    half_turns: int
    """Half rotations of every passage."""
    mirrored: bool
    """True if the orbit is at its mirror image after P passages, and closes after twice as many."""
    period: float
    """t' of the P passages."""
    trace: float
    """Trace of the derivative of the P passages in (d, chi)."""
    chain: Chain
    """The P passages; its last crossing is the first one of the next period."""

    @property
    def code(self) -> str:
        """The word, written as text."""
        return "".join(map(str, self.word))

    @property
    def multiplier(self) -> complex:
        """The Floquet multiplier of the P passages that lies on or outside the unit circle."""
        half, size = self.trace / 2, abs(self.trace) / 2
        # The determinant is 1, so that both multipliers solve x^2 - trace x + 1 = 0. The sign is
        # that of the larger solution, whose terms do not cancel. A square could overflow.
        if size > 1:
            return half + math.copysign(math.sqrt(size - 1) * math.sqrt(size + 1), half)
        return complex(half, math.sqrt(1 - half * half))

    @property
    def stable(self) -> bool:
        """True if the orbit is elliptic: deviations rotate instead of growing."""
        return abs(self.trace) < 2

    @property
    def exponent(self) -> float:
        """Lyapunov exponent per passage; divided by the mean time of a passage it is in 1/t'."""
        return math.log(abs(self.multiplier)) / len(self.chain.b)

    @property
    def exponent_error(self) -> float:
        """Largest rounding error of the exponent, per passage, by the displacement of crossings."""
        # Each crossing that is displaced changes the growth of its passage in proportion. Near a
        # trace of 2 or -2 the multiplier depends on the trace as a square root does.
        chain, size = self.chain, abs(self.trace)
        bent = BENDING * displaced(chain.level, chain.unknowns, chain.split)
        # No closer to trace^2 = 4 than the trace is known. The root of trace^2 - 4 is taken of its
        # factors, for the square could overflow.
        apart = max(abs(size - 2), len(chain.b) * bent * size / (size + 2))
        return bent * size / (math.sqrt(apart) * math.sqrt(size + 2))

    @property
    def points(self) -> int:
        """Number of upward crossings in a period; a word can be read from each of them on."""
        return len(self.chain.b) // 2


def closed_orbit(
    body: Body, word: str | Sequence[int], *, h: Scalar, half_turns: int | None = None
) -> ClosedOrbit:
    """The periodic orbit that repeats a word, with as many half rotations in every passage.

    Parameters
    ----------
    body : Body
    word : str or sequence of int
        Symbols, read from a passage past the upper periodic orbit on. A text may begin with the
        cell of the first crossing, `a` or `b`; the default is `a`.
    h : number
        Energy (eq. h0_new), physical units, as mu.
    half_turns : int, optional
        Half rotations of every passage; by default the fewest with which all crossings stay within
        0.36 half rotations of the middles of their cells.

    Raises
    ------
    NoOrbit
        There is no such orbit in the range of the return map, or its passages take so long that
        doubles do not tell its crossings; the message gives the reason.
    ParameterError, ExactError
        A value is excluded or is no number; the message says which.
    MapError
        The body's orbits have no return map.
    OverflowError
        Deviations grow in a period by more than doubles hold.
    """
    address = parsed(word)
    if address.half_turns is not None or len(address.symbols) > MOST_SYMBOLS:
        raise ParameterError(
            "code", f"a word is 1 to {MOST_SYMBOLS} symbols, without half rotations"
        )
    if half_turns is not None:
        half_turns = checked.whole("half_turns", half_turns, 1, MOST_HALF_TURNS)
    found = closed(ChainLevel.of(body, exact(h)), address.symbols, half_turns, address.first or 0)
    check_told(found.chain)
    return found


def closed(
    level: ChainLevel, word: tuple[int, ...], half_turns: int | None = None, first: int = 0
) -> ClosedOrbit:
    """:func:`closed_orbit` on a given level; `first` is the parity of the first crossing's cell."""
    # A word of odd length is read twice.
    signs = signs_of(np.array(word * (1 + len(word) % 2)))

    def solved(n: int) -> Chain:
        """The chain that closes on itself, with n half rotations in each passage."""
        cells = first + n * np.arange(len(signs) + 1)
        angles = np.asarray(np.pi * cells, dtype=float)
        system = System(level, None, signs, math.pi * n * len(signs))
        return system.solved(system.guess(angles, 0.0)).in_cells(cells)

    try:
        chain = alike(level, signs, solved) if half_turns is None else solved(half_turns)
    except NoOrbit as error:
        # Passages that are longer than this do not disturb each other.
        apart = level.half_turns(level.narrowest(signs)) + APART
        if half_turns is None or half_turns > apart:
            raise
        raise NoOrbit(f"{error}; allow more half rotations") from None
    # I < 0 is a change to the mirror image; two of them cancel.
    turns, mirrored = chain.cells[1] - chain.cells[0], bool((chain.I < 0).sum() % 2)
    period, trace = float(chain.time.sum()), float(np.trace(_monodromy(chain, signs)))
    return ClosedOrbit(word, int(turns), mirrored, period, trace, chain)


def _monodromy(chain: Chain, signs: Signs) -> Array:
    """The derivative of the return after all passages, in the angles a and b of the last passage.

    Its trace is that of the derivative in (d, chi). Products of the latter lose twice the digits
    where surfaces are split little, for the derivatives of successive passages nearly cancel there.
    Here each crossing contributes the small difference of the surfaces on its two sides directly.
    """
    # At each crossing: behind (da, db of the passage behind) + before (da, db before) = 0.
    before, behind = _sides(chain, signs)
    steps = -np.linalg.solve(behind, before)
    with np.errstate(over="ignore", invalid="ignore"):
        whole = functools.reduce(lambda whole, step: step @ whole, steps, np.eye(2))
    if not np.isfinite(whole).all():
        raise OverflowError(
            f"in a period of {len(steps)} passages deviations grow by more than doubles hold: take"
            " a shorter word, or give passages fewer half rotations"
        )
    return whole


def _sides(chain: Chain, signs: Signs) -> Array:
    """Derivatives of chi and d at n crossings in a and b of the passage before and behind.

    The result is (2, n, 2, 2); d is in widths of the tables.
    """
    _, by, _ = System(chain.level, None, signs, 0.0).evaluated(chain.unknowns)
    return np.moveaxis(np.array((by[:, :2], by[:, 2:])), -1, 1)


def words(longest: int) -> Iterator[tuple[int, ...]]:
    """Words of up to `longest` symbols, one for each closed orbit, by length.

    They are primitive, no repetitions of a shorter word, and the least of the words that are read
    along their orbit. Reading may begin at every second symbol, at the passages past the upper
    orbit: for an even length this gives the cyclic shifts by an even number of symbols, for an odd
    length all cyclic shifts.
    """
    for n in range(1, longest + 1):
        for word in itertools.product((0, 1), repeat=n):
            turned = [word[k:] + word[:k] for k in range(1, n)]
            along = turned if n % 2 else turned[1::2]
            if word not in turned and all(word < other for other in along):
                yield word


def lyapunov(orbits: Sequence[ClosedOrbit], length: int) -> float:
    """The mean Lyapunov exponent per passage over all words of `length` symbols, equally weighted.

    Each of the 2^length words is read at one upward crossing of the orbit that repeats it. For an
    even length these crossings are the points of the invariant set that return to themselves after
    length/2 second returns; for an odd length they are those that return after `length` second
    returns and whose symbols repeat already after `length` symbols. ValueError is raised unless the
    orbits contain all those whose words, repeated, have `length` symbols.
    """
    found = [orbit for orbit in orbits if length % len(orbit.word) == 0]
    points = sum(orbit.points for orbit in found)
    if points != 2**length:
        raise ValueError(f"{points} points of period {length} instead of {2**length}")
    return sum(orbit.points * orbit.exponent for orbit in found) / points


def actions(chains: Sequence[Chain]) -> Array:
    """The dimensionless actions of N chains of one level, (N,), by integration in doubles.

    Each chain begins with an upward crossing.
    """
    # Passages are integrated alone, so that errors of one do not grow in the next.
    level = chains[0].level
    c = level.c.aligned
    states = np.concatenate([crossing_states(chain)[1][:, :-1] for chain in chains], axis=1)
    time = np.concatenate([chain.time for chain in chains])

    def rates(state: Any) -> tuple[Any, ...]:
        """The aligned equations, and the potential energy as the rate of a seventh component."""
        return (*aligned(state[:6], c), c.mu_r1 * state[3] + c.mu_r2 * state[4])

    lifted = states_at(rates, np.vstack((states, 0 * time)), time[None])[6, 0]
    # The chain to which each passage belongs; sums over the passages of each.
    of = np.repeat(np.arange(len(chains)), [len(chain.time) for chain in chains])
    return np.bincount(of, weights=2 * (level.h * time - lifted)).astype(float)


class Closing(NamedTuple):
    """A closed orbit, refined by integration and integrated once over its period."""

    error: float
    """Distance of the end from the beginning, the larger of those in d and in chi."""
    expected: float
    """Expected error: gaps where passages meet, and roundings, grown by the passages behind."""
    moved: float
    """Largest displacement of a crossing by the refinement: the error of the map in doubles."""
    period: Fraction
    """t'."""
    place: tuple[Fraction, Fraction]
    """d and chi of the first crossing."""


def roundings(orbit: ClosedOrbit, bits: int = 113) -> tuple[float, Array, Array]:
    """Roundings of an orbit's integration, by its map; NoOrbit where :func:`closing` tells nothing.

    The first is that of a passage, at most, and then come those of d and chi that a period grows,
    (2,). Last are the derivatives at its end in d and chi at each crossing, (n + 1, 2, 2).
    """
    check_told(orbit.chain)
    chain, rounding = orbit.chain, GROWN * finest_tolerance(bits)
    # A passage rounds as if it began with roundings, d of its own size. Where it ends, they are
    # those of a state, of size 1.
    begin, end = np.stack((np.abs(chain.d), np.ones(len(chain.d))), axis=1), np.ones((1, 2))
    passed = np.einsum("nij,nj->ni", np.abs(tangents(chain)[:, :2]), begin[:-1]) + end
    errors, growth = begin + end, _growth(chain)
    errors[0], errors[-1:] = begin[0], end
    grown = np.einsum("nij,nj->i", np.abs(growth), rounding * errors)
    _told(orbit, bits, grown)
    return rounding * float(passed.max()), grown, growth


def _growth(chain: Chain) -> Array:
    """Derivatives of d and chi at the last of n + 1 crossings in those at each, (n + 1, 2, 2).

    By way of the angles of passages, as in `_monodromy`: most errors go along the surfaces, and
    products of derivatives in d and chi would take some of that for what leads away from them.
    """
    sides = _sides(chain, np.sign(chain.I).astype(int))
    # Rows are d and chi, both as they are.
    before, behind = sides[..., ::-1, :] * np.array([[chain.level.widest_d], [1.0]])
    found, end = [np.eye(2)], before[0]
    with np.errstate(over="ignore", invalid="ignore"):
        for left, right in zip(before[::-1], behind[::-1], strict=True):
            # The derivatives behind are those of what is subtracted.
            found.append(end @ -np.linalg.inv(right))
            end = found[-1] @ left
    return np.array(found[::-1])


def _told(orbit: ClosedOrbit, bits: int, grown: Array) -> float:
    """Size of the errors of d and chi that a period grows, (2,); NoOrbit where it tells nothing."""
    size = float(grown.max())
    # It is no number where growths are beyond doubles.
    if not size <= MOVED:
        raise NoOrbit(
            f"a period of {orbit.code} with {orbit.half_turns} half rotations in each passage grows"
            f" roundings of {bits} bits to {size:.1g} rad, which verifies nothing:"
            " verify shorter words, or give passages fewer half rotations"
        )
    return size


def closing(orbit: ClosedOrbit, bits: int = 113) -> Closing:
    """Refine a closed orbit by the full equations until it closes, in 96 bits or more.

    Newton's method corrects (d, chi) at all crossings at once: each passage is integrated alone,
    and the derivatives are the map's, in doubles, with which a correction gains some eight digits.
    Then the whole period is integrated from the first crossing: it ends there, but for roundings
    and their growth. NoOrbit is raised where the passages do not come to meet, are too long for
    doubles to begin with, or grow roundings so much that the end tells nothing.
    """
    bits = checked.whole("bits", bits, CLOSING_BITS)
    passed, rounded, growth = roundings(orbit, bits)
    met = max(2.0 ** (LOST - bits), passed)
    chain, level, a = orbit.chain, orbit.chain.level, precision(bits + SECTION_BITS)
    c = coefficients(level.body.angles(a.bits + GUARD_BITS), "1", a)
    h, turn = a.number(level.energy.at(a.bits)), 2 * a.pi

    def gaps(places: Any, ends: Any, times: Any) -> tuple[Any, Any]:
        """Gaps (n, 2) in (d, chi) of passages from `places` to `ends`, and delays t', (n,)."""
        d, chi = places.T
        states = section_states(level, d, chi, h, c, a)
        crossed, late = on_section(states_at(c.aligned, states, times[None], bits)[:, 0], c.aligned)
        point = section_points(level, crossed, h, c, a)
        off = np.stack((point.d, point.chi), axis=1) - ends
        # chi is known but for whole turns.
        off[:, 1] -= turn * a.array(np.rint(a.floats(off[:, 1] / turn)))
        return off, late

    system = System(level, None, np.sign(chain.I), 0.0)
    # Corrections are those of the chain, in the angles of its passages: of I they lose nothing,
    # which a crossing in doubles tells the less the longer the passage is.
    begin = places = a.array(np.stack((chain.d, chain.chi), axis=1)[:-1])
    times, before = a.array(chain.time), math.inf
    for _ in range(bits // GAINED):
        off, late = gaps(places, np.roll(places, -1, axis=0), times)
        times, size = times + late, np.abs(off).max()
        if size < met or before <= size < NOISE * met:
            break
        before = size
        # A gap is the end of a passage less the next crossing.
        at = a.floats((places - begin)[:, 1])
        step = system.along_surfaces(chain.unknowns, at, np.roll(off, 1, axis=0))[1]
        moved = a.largest(step)
        if moved > MOVED:
            raise NoOrbit(
                f"the orbit of {orbit.code} does not come to close: a correction is {moved:.1g}"
                f" rad; its surfaces are split by {level.splitting:.1g}"
            )
        places = places + step
    else:
        raise NoOrbit(f"the orbit of {orbit.code} does not come to close, by {float(size):.2g}")
    period, first = times.sum(), places[:1]
    error = a.largest(gaps(first, first, np.array([period]))[0])
    # Integrated as a whole, the passages round otherwise than alone: both kinds count. Gaps count
    # twice, for the derivatives are those of the map in doubles.
    left = np.abs(np.einsum("nij,nj->ni", growth[1:], off.astype(float))).sum(axis=0)
    expected = _told(orbit, bits, rounded + 2 * left)
    d, chi = map(fraction, first[0])
    return Closing(error, expected, a.largest(places - begin), fraction(period), (d, chi))
