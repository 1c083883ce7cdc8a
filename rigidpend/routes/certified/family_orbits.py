"""Polynomials of families of orbits, and those of the orbits of sets.

They come from integration in pairs of doubles, and nothing is proven of them here. Arrays of
orbits run over the nodes in u, v and w; angles are in radians, times are t', dimensionless.
"""

import functools
import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers import Array
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.expansions import chebyshev_analysis, nodes
from rigidpend.orbits.return_map.poincare import state_of
from rigidpend.routes.certified.horseshoe import IN_PAIRS, ShiftProblem
from rigidpend.routes.certified.models import horner
from rigidpend.routes.certified.proof_data import CLOCK, FamilyStep, Powers, Quad

TOLERANCE = 2.0**-100
"""Tolerance of the integration."""
FAR = 100.0
"""Largest correction of a crossing's time, over the time that the return map tells."""
MOST_GAMMA3 = 0.97
"""Largest |gamma3| in a set."""
LENGTH, TURNS = 2.0, 2.0
"""Largest length of a step times the rate of the unstable direction, and in half rotations."""
NOISE_BITS = 8
"""Bits below a unit at which coefficients count as round-off."""
GROWTH = 1.4
"""Bits by which the bound grows while the unstable direction grows by e, about."""


class FamilyGrid:
    """Nodes in u, v and w, and all triples of them."""

    def __init__(self, *sizes: int) -> None:
        self.sizes = sizes
        """Numbers of nodes in u, v and w."""
        u, v, w = (nodes(n, IN_PAIRS) for n in sizes)
        rows = u[:, None, None], v[None, :, None], w[None, None, :]
        self.at = [(row + IN_PAIRS.zeros(sizes)).reshape(-1) for row in rows]
        """u, v and w of each triple, with w running fastest."""


def pieces(setting: ShiftProblem, quad: Quad, turned: bool | None = None) -> list[FamilyStep]:
    """Polynomials of the orbits of a set up to their next crossing.

    `turned` is True if chi of the set is nearer to pi than to 0; by default as for a full shift.
    """
    if turned is None:
        turned = not quad.rising and setting.half_turns % 2 == 1
    grid = FamilyGrid(*setting.nodes[1:])
    begin = _beginning(quad, grid.at, setting, turned)
    expected = _expected(quad, begin, setting, turned)
    return to_crossing(setting, begin, expected, grid, setting.bits)


def to_crossing(
    setting: ShiftProblem, begin: SumArray, times: Array, grid: FamilyGrid, bits: int
) -> list[FamilyStep]:
    """Polynomials of the orbits of a grid that begin at given states, up to their next crossing.

    `times` are approximate times of the crossings, t'.
    """
    field = setting.coefficients.aligned
    doubles = AlignedCoefficients(*map(float, field))
    farthest = FAR * times.max()
    # Newton's method for M3 = 0. Times may be far off, where a second order, as that of
    # `on_section`, leads astray.
    for _ in range(2):
        ends = states_at(field, begin, SumArray.of(times[None]), 106, tolerance=TOLERANCE)
        states = IN_PAIRS.floats(ends)[:, 0]
        late = states[2] / aligned(states, doubles)[2]
        # Of an orbit that does not cross there it leads anywhere, and takes as long.
        if not np.abs(late).max() < farthest:
            raise ArithmeticError("orbits do not cross next where the return map has them cross")
        times = times - late
    # At both ends, where M3 is near zero, steps are half as long as between. All but the last one
    # have fixed lengths, multiples of 2^-10 in the momentum's own unit of time, that are exact in
    # doubles; the last one goes on to the crossing, and its length is a polynomial.
    longest = min(LENGTH / setting.rate, TURNS * setting.half_turn)
    steps = max(3, math.ceil(float(times.max()) / longest) + 1)
    grains = 2.0 ** (10 + setting.momentum_bits)
    length = math.floor(float(times.min()) / (steps - 1) * grains) / grains
    starts = [0.0, *(length * (k + 0.5) for k in range(steps - 1))]
    rest = SumArray.of((times - starts[-1]) / 2)[None, None]
    halves: list[dict[Powers, int]] = [
        {(0, 0, 0): int((y - x) * 2**CLOCK)} for x, y in itertools.pairwise(starts)
    ]
    halves.append(fitted(rest, CLOCK, grid.sizes)[0])
    return steps_of(setting, begin, halves, grid, (setting.nodes[0], bits))


def steps_of(
    setting: ShiftProblem,
    begin: SumArray,
    halves: Sequence[dict[Powers, int]],
    grid: FamilyGrid,
    fine: tuple[int, int],
) -> list[FamilyStep]:
    """Polynomials of the orbits of a grid over steps of given half-lengths, from states at first.

    `fine` is the number of nodes in time and that of bits of the first step; later ones have fewer.
    """
    in_time, bits = fine
    # Nodes fall from near 1 to near -1, and the integration goes forward in time.
    x = nodes(in_time, IN_PAIRS)[::-1]
    time, times, starts = 0 * grid.at[0], list[Any](), list[float]()
    for half in halves:
        length = values_at(half, grid.at)
        starts.append(float(time.parts[0].min()))
        times.append((time + (1 + x)[:, None] * length[None, :]).parts)
        time = time + 2 * length
    every, field = SumArray(np.concatenate(times, axis=1)), setting.coefficients.aligned
    states = states_at(field, begin, every, 106, tolerance=TOLERANCE)
    found = []
    for i, (half, start) in enumerate(zip(halves, starts, strict=True)):
        here = states[:, i * in_time : (i + 1) * in_time][:, ::-1]
        left = bits - math.floor(GROWTH * setting.rate * start)
        found.append(FamilyStep(left, half, fitted(here, left, grid.sizes)))
    return found


def fitted(values: SumArray, bits: int, at: Sequence[int]) -> list[dict[Powers, int]]:
    """Coefficients of T_j(x) u^k v^l w^m in units of 2^-bits, from values (n, nodes, orbits).

    Those of T_0 are doubled. `at` are the numbers of nodes in u, v and w.
    """
    n, sizes = len(values), (values.shape[1], *at)
    found = values.reshape(-1, *at)
    found = _along_each(found, sizes, [chebyshev_analysis(size, IN_PAIRS) for size in sizes])
    # Smaller ones are noise, which the large coefficients of high T_k would multiply.
    found = SumArray(
        np.where(np.abs(found.parts[:1]) < 2.0 ** -(bits + NOISE_BITS), 0.0, found.parts)
    )
    # In x the series stays one in Chebyshev polynomials, of which T_0 counts half in a family; in
    # u, v and w it becomes one of powers.
    doubled = np.diag([2.0] + [1.0] * (sizes[0] - 1))
    to_powers = [IN_PAIRS.array(doubled), *map(_powers_of, sizes[1:])]
    units = (_along_each(found, sizes, to_powers).parts * 2.0**bits).reshape(2, n, *sizes)
    columns: list[dict[Powers, int]] = [{} for _ in range(n)]
    counted = np.argwhere(large := np.abs(units[0]) > 0.25).tolist()
    high, low = units[:, large]
    # A high part is whole if it exceeds 2^53; else its fraction is rounded with the low part.
    whole = np.trunc(high)
    rest = np.rint(high - whole + low)
    for (k, *at), w, more in zip(counted, whole.tolist(), rest.tolist(), strict=True):
        if w := int(w) + int(more):
            # The exponent of w is left out where the energy does not vary.
            columns[k][tuple(at[: 3 + (sizes[3] > 1)])] = w
    return columns


def _along_each(found: SumArray, sizes: tuple[int, ...], rules: Sequence[SumArray]) -> SumArray:
    """Arrays (n, *sizes) multiplied by a matrix along each of the dimensions `sizes`."""
    for size, rule in zip(sizes[::-1], rules[::-1], strict=True):
        # The last dimension is multiplied and comes to the front of the others: after all of them
        # the order is the first one again.
        found = (found.reshape(-1, size) @ rule.T).reshape(-1, math.prod(sizes) // size, size)
        found = found.transpose(0, 2, 1)
    return found


@functools.cache
def _powers_of(n: int) -> SumArray:
    """The matrix (n, n) from coefficients of T_0 .. T_{n-1} to those of powers."""
    series = np.zeros((n, n))
    for k, row in enumerate(np.eye(n)):
        found = chebyshev.cheb2poly(row)
        series[: len(found), k] = found
    return IN_PAIRS.array(series)


def values_at(half: dict[Powers, int], at: Sequence[SumArray]) -> SumArray:
    """The half-length of a step for each orbit, t'; stored coefficients are twice theirs."""
    a = IN_PAIRS
    found = a.zeros(at[0].shape)
    for (_, *powers), x in half.items():
        power = a.number(Fraction(x, 2 << CLOCK)) + found * 0
        for n, factor in zip(powers, at, strict=False):
            for _ in range(n):
                power = power * factor
        found = found + power
    return found


def _beginning(
    quad: Quad, places: Sequence[SumArray], setting: ShiftProblem, turned: bool
) -> SumArray:
    """States (6, n) of the points of a set at some u, v and w."""
    a, (u, v, w) = IN_PAIRS, places
    g = (a.number(quad.a) * u - a.number(quad.b) * v - a.number(quad.l0)) / a.number(quad.l1)
    if a.largest(g) > MOST_GAMMA3:
        raise ArithmeticError("the sets are too wide; with more half rotations they are smaller")
    curves = [horner(list(map(a.number, p)), g) for p in quad.p]
    d = horner(curves, w) + a.number(quad.a) * u
    cos = a.sqrt(1 - g * g)
    if turned:
        cos = -cos
    c = setting.coefficients
    energies = a.number(setting.h.at(a.bits + GUARD_BITS)) + a.number(setting.spread) * w
    return state_of(quad.rising, d, cos, -g, energies, c, a)


def _expected(quad: Quad, begin: SumArray, setting: ShiftProblem, turned: bool) -> Array:
    """Times of the next crossings by the return map, t'."""
    states = IN_PAIRS.floats(begin)
    chi = np.arcsin(-states[5])
    if turned:
        chi = np.pi - chi
    d, in_w = states[1 if quad.rising else 0], setting.nodes[3]
    times = np.zeros(len(chi))
    # Each energy has a map of its own; w runs fastest.
    for k, w in enumerate(nodes(in_w, precision(53))):
        point = SectionPoint(quad.rising, d[k::in_w], chi[k::in_w])
        times[k::in_w] = setting.level_of(w).passage(point).time
    return times
