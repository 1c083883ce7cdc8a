"""Polynomials of the orbits of a set, from integration in pairs of doubles; nothing is proven."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.polynomial import chebyshev

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.expansions import chebyshev_analysis, nodes
from rigidpend.orbits.return_map.poincare import state_of
from rigidpend.orbits.return_map.precision import precision
from rigidpend.routes.certified.horseshoe import NUMBERS, Array, ShiftProblem
from rigidpend.routes.certified.pieces import CLOCK, FamilyStep, Powers, Quad

TOLERANCE = 2.0**-100
"""Tolerance of the integration."""
WIDEST = 0.97
"""Largest |gamma3| in a set."""
LENGTH = 2.0
"""Length of a step, about, in which what is unstable grows by its exponential."""
SPARE = 8
"""Bits beyond a unit from which on coefficients are rounding."""
GROWTH = 1.4
"""Bits by which the bound grows in a time in which what is unstable grows by e, about."""


def pieces(setting: ShiftProblem, quad: Quad, turned: bool | None = None) -> list[FamilyStep]:
    """Polynomials of the orbits of a set up to their next crossing.

    `turned` says that chi of the set is nearer to pi than to 0.
    """
    if turned is None:
        turned = not quad.rising and setting.half_turns % 2 == 1
    sizes = setting.nodes[1:]
    at = grid_of(*(nodes(n, NUMBERS) for n in sizes))
    orbits = FamilyOrbits(setting, _beginning(quad, at, setting, turned))
    expected = _expected(quad, orbits.begin, setting, turned)
    return family_pieces(orbits, expected, at, sizes, setting.bits)


def family_pieces(
    orbits: FamilyOrbits,
    expected: Array,
    at: Sequence[PairArray],
    sizes: Sequence[int],
    bits_at_first: int,
) -> list[FamilyStep]:
    """Polynomials of orbits at `sizes` nodes in u, v and w, of which those `at` are."""
    times = orbits.crossing(expected)
    rate = orbits.rate
    # Where M3 changes, at both ends, steps are half as long as between.
    steps = max(3, math.ceil(float(times.max()) * rate / LENGTH) + 1)
    length = math.floor(float(times.min()) / (steps - 1) * 2**10) / 2**10
    starts = [0.0, *(length * (k + 0.5) for k in range(steps - 1))]
    last = starts[-1]
    rest = PairArray.of((times - last) / 2)[None, None]
    halves: list[dict[Powers, int]] = [
        {(0, 0, 0): int((y - x) * 2**CLOCK)} for x, y in itertools.pairwise(starts)
    ]
    halves.append(fitted(rest, CLOCK, sizes)[0])
    found = []
    for start, half in zip(starts, halves, strict=True):
        states = orbits.sampled(start, values_at(half, at))
        bits = bits_at_first - math.floor(GROWTH * rate * start)
        found.append(FamilyStep(bits, half, fitted(states, bits, sizes)))
    return found


def grid_of(u: PairArray, v: PairArray, w: PairArray) -> list[PairArray]:
    """All triples of three rows of numbers, w running fastest."""
    zeros = NUMBERS.zeros((len(u), len(v), len(w)))
    rows = u[:, None, None], v[None, :, None], w[None, None, :]
    return [(row + zeros).reshape(-1) for row in rows]


def fitted(values: PairArray, bits: int, at: Sequence[int]) -> list[dict[Powers, int]]:
    """Coefficients of powers of x and others in units of 2^-bits, from values (n, x, orbits)."""
    n, sizes = len(values), (values.shape[1], *at)
    found = values.reshape(-1, *at)
    found = _along_each(found, sizes, [chebyshev_analysis(size, NUMBERS) for size in sizes])
    # What is less would be noise, which the large coefficients of high T_k make much of.
    found = PairArray(np.where(np.abs(found.parts[:1]) < 2.0 ** -(bits + SPARE), 0.0, found.parts))
    # Chebyshev series in x, of which T_0 counts half in a family, and powers of u and v.
    doubled = np.diag([2.0] + [1.0] * (sizes[0] - 1))
    to_powers = [NUMBERS.array(doubled), *map(_powers_of, sizes[1:])]
    units = (_along_each(found, sizes, to_powers).parts * 2.0**bits).reshape(2, n, *sizes)
    columns: list[dict[Powers, int]] = [{} for _ in range(n)]
    for k, *at in np.argwhere(np.abs(units[0]) > 0.25):
        high, low = units[(slice(None), k, *at)]
        # What is more than 2^53 is whole.
        if w := int(high) + round(float(high - int(high) + low)):
            # Where the energy does not vary its power is left out.
            columns[k][tuple(map(int, at[: 3 + (sizes[3] > 1)]))] = w
    return columns


def _along_each(found: PairArray, sizes: tuple[int, ...], rules: Sequence[PairArray]) -> PairArray:
    """Arrays (n, *sizes) multiplied by a matrix along each of their dimensions."""
    for size, rule in zip(sizes[::-1], rules[::-1], strict=True):
        # The last dimension is multiplied, and comes to the front of the others.
        found = (found.reshape(-1, size) @ rule.T).reshape(-1, math.prod(sizes) // size, size)
        found = found.transpose(0, 2, 1)
    return found


def _powers_of(n: int) -> PairArray:
    """The matrix of T_0 .. T_{n-1} as powers."""
    series = np.zeros((n, n))
    for k, row in enumerate(np.eye(n)):
        found = chebyshev.cheb2poly(row)
        series[: len(found), k] = found
    return NUMBERS.array(series)


def values_at(half: dict[Powers, int], at: Sequence[PairArray]) -> PairArray:
    """Half-lengths of a step of each orbit."""
    a = NUMBERS
    found = a.zeros(at[0].shape)
    for (_, *powers), x in half.items():
        power = a.number(Fraction(x, 2 << CLOCK)) + found * 0
        for n, factor in zip(powers, at, strict=False):
            for _ in range(n):
                power = power * factor
        found = found + power
    return found


def _beginning(
    quad: Quad, places: Sequence[PairArray], setting: ShiftProblem, turned: bool
) -> PairArray:
    """States (6, n) of points of a set."""
    a, (u, v, w) = NUMBERS, places
    g = (a.number(quad.a) * u - a.number(quad.b) * v - a.number(quad.l0)) / a.number(quad.l1)
    if a.largest(g) > WIDEST:
        raise ArithmeticError("the sets are too wide; with more half rotations they are smaller")
    d = a.zeros(g.shape)
    for p in (quad.p, *quad.moves)[::-1]:
        curve = a.zeros(g.shape)
        for x in p[::-1]:
            curve = curve * g + a.number(x)
        d = d * w + curve
    d = d + a.number(quad.a) * u
    cos = a.sqrt(1 - g * g)
    if turned:
        cos = -cos
    c = setting.coefficients
    energies = a.number(setting.h.at(a.bits + GUARD_BITS)) + a.number(setting.spread) * w
    return state_of(quad.rising, d, cos, -g, energies, c, a)


def _expected(quad: Quad, begin: PairArray, setting: ShiftProblem, turned: bool) -> Array:
    """Times of the next crossing by the return map, t'."""
    states = NUMBERS.floats(begin)
    chi = np.arcsin(-states[5])
    if turned:
        chi = np.pi - chi
    d, in_w = states[1 if quad.rising else 0], setting.nodes[3]
    times = np.zeros(len(chi))
    for k, w in enumerate(nodes(in_w, precision(53))):
        point = SectionPoint(quad.rising, d[k::in_w], chi[k::in_w])
        times[k::in_w] = setting.level_of(w).passage(point).time
    return times


class FamilyOrbits:
    """Orbits in pairs of doubles."""

    def __init__(self, setting: ShiftProblem, begin: PairArray) -> None:
        self.begin, c = begin, setting.coefficients
        self.in_time = setting.nodes[0]
        self.rate = setting.rate
        self.field = c.aligned
        self.doubles = AlignedCoefficients(*map(float, c.aligned))

    def at(self, times: PairArray) -> PairArray:
        """States (6, k, n) at times (k, n), each orbit's ascending."""
        found: PairArray = states_at(self.field, self.begin, times, 106, tolerance=TOLERANCE)
        return found

    def crossing(self, times: Array) -> Array:
        """Times of M3 = 0, from some near them."""
        for _ in range(2):
            states = NUMBERS.floats(self.at(PairArray.of(times[None])))[:, 0]
            times = times - states[2] / aligned(states, self.doubles)[2]
        return times

    def sampled(self, start: float, halves: PairArray) -> PairArray:
        """States (6, nodes, n) at the nodes of a step."""
        x = nodes(self.in_time, NUMBERS)[::-1]
        found = self.at(start + (1 + x)[:, None] * halves[None, :])
        return found[:, ::-1]
