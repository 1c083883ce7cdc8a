"""Polynomials of the orbits that start on an interval of phases, through some passages.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.intervals`
decides.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from rigidpend.machine.workers import check_stop
from rigidpend.numbers.exact import exact
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.return_map.expansions import nodes
from rigidpend.orbits.return_map.precision import precision
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.family_orbits import GROWTH, LENGTH, LineStarts, grid_of, steps_of
from rigidpend.routes.certified.horseshoe import NUMBERS, ShiftProblem
from rigidpend.routes.certified.intervals import EnclosedStarts, PhaseInterval, symbols
from rigidpend.routes.certified.pieces import CLOCK, FamilyStep, Powers
from rigidpend.routes.codes import codes_of
from rigidpend.routes.problem import RouteProblem

NODES = 20
"""Nodes on an interval."""
IN_TIME, MORE = 16, 4
"""Nodes of a step in time: so many, and one for so many bits."""
LEFT, MOST_BITS = 23, 98
"""Bits of coefficients at the end, and bits at most: pairs of doubles know no more."""
ROUGH = 1e-2
"""Changes of times that are left out, t'."""


class ProvenInterval(NamedTuple):
    """An interval with symbols that all of its starts are proven to have."""

    of: PhaseInterval
    symbols: list[bool]
    pieces: list[FamilyStep]
    """Polynomials that prove them; none where there are no symbols."""


def within(
    of: PhaseInterval, setting: ShiftProblem, J1: Fraction, n_symbols: int, finest: int
) -> list[ProvenInterval]:
    """Intervals that cover one, halved where it does not have all symbols proven.

    The shortest ones have the depth `finest`.
    """
    starts = EnclosedStarts.of(setting.body, setting.h, J1)
    found, left = [], [of]
    while left:
        check_stop()
        here = left.pop()
        times, common = _sampled(here, setting, J1, n_symbols)
        last = here.depth >= finest
        proven = _proven(
            setting, starts, here, times, range(common, 0 if last else n_symbols - 1, -1)
        )
        if proven.symbols or last:
            found.append(proven)
        else:
            left += here.halves[::-1]
    return found


def _sampled(
    of: PhaseInterval, setting: ShiftProblem, J1: Fraction, n_symbols: int
) -> tuple[Array, int]:
    """Times of crossings at nodes, and how many symbols are the same there and at the ends."""
    u = np.concatenate((nodes(NODES, precision(53)), [-1.0, 1.0]))
    problem = RouteProblem(setting.body, setting.h, exact(J1), n_symbols)
    theta2 = 2 * np.pi * (float(of.middle) + u / (2 << of.depth))
    routes = codes_of(problem, theta2, resolve(precisions=(53,)), method="integration")
    same = (routes.codes == routes.codes[:, :1]).all(axis=1) & (routes.codes[:, 0] <= 1)
    common = int(np.argmin(same)) if not same.all() else len(same)
    return routes.crossing_time[:, :NODES], common


def _proven(
    setting: ShiftProblem, starts: EnclosedStarts, of: PhaseInterval, times: Array, counts: range
) -> ProvenInterval:
    """As many symbols of an interval as can be proven, of some numbers of them."""
    for count in counts:
        try:
            found = pieces(setting, starts.J1, of, times[: count + 1])
            return ProvenInterval(of, symbols(starts, of, found), found)
        except Undecided:
            continue
    return ProvenInterval(of, [], [])


def pieces(
    setting: ShiftProblem, J1: Fraction, of: PhaseInterval, times: Array
) -> list[FamilyStep]:
    """Polynomials of the orbits of an interval, from the times of their crossings at nodes."""
    a, sizes, rate = NUMBERS, (times.shape[1], 1, 1), setting.rate
    fine = LEFT + math.ceil(GROWTH * rate * times.max())
    if fine > MOST_BITS:
        raise Undecided(f"{fine} bits are wanted, and {MOST_BITS} are known")
    at = grid_of(*(nodes(n, a) for n in sizes))
    middle = a.number(of.middle) * a.pi * 2
    phase = middle + a.pi * a.number(Fraction(1, 1 << of.depth)) * at[0]
    begin, in_time = LineStarts(setting, J1).states(phase, a), IN_TIME + fine // MORE
    return steps_of(setting, begin, _halves(times, rate), at, sizes, (in_time, fine))


def _halves(times: Array, rate: float) -> list[dict[Powers, int]]:
    """Half-lengths of steps: two steps at each crossing, and as many between as it takes."""
    length, beside = LENGTH / rate, LENGTH / 2 / rate
    found = []
    for k, time in enumerate(times):
        between = time - beside - (times[k - 1] + beside if k else 0.0)
        steps = math.ceil(between.max() / length)
        # None where the first crossing comes at once.
        if steps > 0:
            found += steps * [_polynomial(between / (2 * steps))]
        found += 2 * [_polynomial(0 * time + beside / 2)]
    return found


def _polynomial(values: Array) -> dict[Powers, int]:
    """The polynomial in u near values at the nodes, of few terms, in units of 2^-CLOCK."""
    n = len(values)
    series = chebyshev.chebfit(nodes(n, precision(53)), values, n - 1)
    # Times need not be those of the crossings, but what depends on u must be told by the nodes.
    powers = chebyshev.cheb2poly(np.where(np.abs(series) > ROUGH, series, 0.0))
    found = {(0, k, 0): round(float(c) * 2**CLOCK) for k, c in enumerate(powers)}
    found[0, 0, 0] *= 2
    return {at: c for at, c in found.items() if c}
