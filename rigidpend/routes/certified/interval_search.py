"""Search for intervals of phases, with polynomials of their orbits that prove symbols.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.intervals`
decides. Times are t', dimensionless.
"""

import math
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb
from numpy.polynomial import chebyshev

from rigidpend.machine.workers import check_stop
from rigidpend.numbers import Array
from rigidpend.numbers.exact import context, exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map.expansions import nodes
from rigidpend.routes.certified.balls import LogarithmicNorm
from rigidpend.routes.certified.family_orbits import LENGTH, FamilyGrid, steps_of
from rigidpend.routes.certified.horseshoe import IN_PAIRS, ShiftProblem
from rigidpend.routes.certified.intervals import EnclosedStarts, PhaseInterval, symbols
from rigidpend.routes.certified.proof_data import CLOCK, FamilyStep, Powers, Undecided
from rigidpend.routes.certified.sections import Numbers
from rigidpend.routes.certified.start_lines import LineStarts
from rigidpend.routes.codes import codes_of
from rigidpend.routes.problem import RouteProblem, passage_rotations

NODES = 20
"""Nodes in u on an interval."""
IN_TIME, BITS_PER_NODE = 16, 4
"""Nodes of a step in time: IN_TIME, and one more for each BITS_PER_NODE bits of coefficients."""
SHORTEST = 0.8
"""Least time to a symbol over that of typical orbits, by which a refusal is cautious.

With three bodies it was 0.96 or more on every interval that was looked at."""
TURNED = 5.7
"""Largest angle by which the fast phase turns in a step, radians: so many nodes follow no more.

A step of `LENGTH` turns by about 4 nu/pi radians, more than this from nu = 4.5 on."""
LEFT, MOST_BITS = 23, 98
"""Bits of coefficients at the end, and bits at most: pairs of doubles know no more."""
STEP_OF_60_BITS, TRIES = 0.015, 1.3
"""Seconds of a core for a step with 60 bits, as the square of the bits; attempts at an interval.

Measured with the bodies of Fig. 4 and Fig. 5 and one of Table 1. On a crowded machine whole runs of
three bodies took 1.1 to 1.8 times as long as they are estimated so."""
ROUGH = 1e-2
"""Coefficients in u of half-lengths that are left out where they are smaller, in 1/momentum."""


class ProvenInterval(NamedTuple):
    """An interval with the symbols that all of its orbits are proven to have."""

    interval: PhaseInterval
    symbols: list[bool]
    """True for 1; empty where none is proven."""
    pieces: list[FamilyStep]
    """Polynomials that prove the symbols; empty where there are none."""


def proven_intervals(
    of: PhaseInterval, setting: ShiftProblem, J1: Fraction, n_symbols: int, finest: int
) -> list[ProvenInterval]:
    """Intervals that make up a given one, halved where not all symbols are proven.

    The shortest ones have the depth `finest`; of these as many symbols as can be are proven.
    """
    starts = EnclosedStarts.of(setting.body, setting.h, J1)
    found, left = [], [of]
    while left:
        check_stop()
        here = left.pop()
        times, common = _sampled(here, setting, J1, n_symbols)
        # Only the shortest intervals are content with fewer symbols than are asked for.
        last = here.depth >= finest
        proven = ProvenInterval(here, [], [])
        for count in range(common, 0 if last else n_symbols - 1, -1):
            with suppress(Undecided):
                steps = pieces(setting, starts, here, times[: count + 1])
                proven = ProvenInterval(here, symbols(starts, here, steps), steps)
                break
        if proven.symbols or last:
            found.append(proven)
        else:
            # In the order of phases: the last one is taken next.
            left += here.halves[::-1]
    return found


def _sampled(
    of: PhaseInterval, setting: ShiftProblem, J1: Fraction, n_symbols: int
) -> tuple[Array, int]:
    """Times of crossings at the nodes, t', (crossings, NODES), and the number of common symbols.

    Common are the first symbols that orbits at all nodes and at both ends share, by doubles.
    """
    u = np.concatenate((nodes(NODES, precision(53)), [-1.0, 1.0]))
    problem = RouteProblem(setting.body, setting.h, exact(J1), n_symbols)
    theta2 = 2 * np.pi * (float(of.middle) + u / (2 << of.depth))
    routes = codes_of(problem, theta2, resolve(precisions=(53,)), method="integration")
    same = (routes.codes == routes.codes[:, :1]).all(axis=1) & (routes.codes[:, 0] <= 1)
    common = int(np.argmin(same)) if not same.all() else len(same)
    return routes.crossing_time[:, :NODES], common


def pieces(
    setting: ShiftProblem, starts: EnclosedStarts, of: PhaseInterval, times: Array
) -> list[FamilyStep]:
    """Polynomials of the orbits of an interval, from the times of their crossings at the nodes.

    Undecided where pairs of doubles do not know them well enough.
    """
    a, J2 = IN_PAIRS, math.sqrt(2 * float(setting.h) / float(setting.body.angles().kappa))
    fine = _bits(starts.numbers.growth, J2, float(times.max()))
    if fine > MOST_BITS:
        raise Undecided(f"{fine} bits are wanted, and {MOST_BITS} are known")
    # Coefficients of momenta below 1 need units that are as much smaller.
    fine += max(0, -setting.momentum_bits)
    grid = FamilyGrid(times.shape[1], 1, 1)
    middle = a.number(of.middle) * a.pi * 2
    phase = middle + a.pi * a.number(Fraction(1, 1 << of.depth)) * grid.at[0]
    begin = LineStarts(setting, starts.J1).states(phase, a)
    # In 1/t' the fast phase turns by 1/rotation radians.
    length = min(LENGTH / setting.rate, TURNED * float(setting.level.rotation[0, 0]))
    in_time = IN_TIME + fine // BITS_PER_NODE
    halves = _halves(times, length, ROUGH / setting.momentum)
    return steps_of(setting, begin, halves, grid, (in_time, fine))


def expected_seconds(problem: RouteProblem) -> float:
    """Estimate of the seconds of a core that an interval takes, without its return map."""
    parted, bits = _expected(problem)
    # The fast phase turns by 2 nu/pi radians while orbits part by e.
    steps = parted / min(LENGTH, TURNED * math.pi / (2 * problem.body.nu))
    return TRIES * STEP_OF_60_BITS * steps * (min(bits, MOST_BITS) / 60) ** 2


def check_provable(problem: RouteProblem) -> None:
    """Raise ArithmeticError where pairs of doubles know too little to prove a single symbol."""
    _, bits = _expected(replace(problem, n_symbols=1))
    if LEFT + SHORTEST * (bits - LEFT) > MOST_BITS:
        raise ArithmeticError(
            f"undecided: to prove one symbol of this body takes some {bits} bits, and {MOST_BITS}"
            " are known in pairs of doubles: passages are long, or the weight is large"
        )


def _expected(problem: RouteProblem) -> tuple[float, int]:
    """The logarithm of how far typical orbits part over all symbols, and the bits for them."""
    J2, m = float(problem.J2_0(53)), context(53)
    growth = Numbers.of(problem.body, problem.h0).growth
    # From the start to the first crossing, and in each passage.
    passage = passage_rotations(problem) * math.pi**2 / problem.body.nu
    first = float(m.log(J2 / problem.J1_0.at(53))) / 2
    parted = first + problem.n_symbols * passage
    return parted, _bits(growth, J2, parted / (float(growth.saddle) * J2))


def _bits(growth: LogarithmicNorm, J2: float, time: float) -> int:
    """Bits at first, for orbits over a time t': the growth of the bound leaves `LEFT` of them.

    The bound grows the faster the heavier the body.
    """
    return LEFT + math.ceil(float(growth.rate(arb(J2), arb(0))) * time / math.log(2))


def _halves(times: Array, length: float, rough: float) -> list[dict[Powers, int]]:
    """Half-lengths of steps in units of 2^-CLOCK: two steps at each crossing, others between.

    `length` is that of the longest step, t'; smaller coefficients than `rough` are left out.
    """
    beside = length / 2
    found = []
    for k, time in enumerate(times):
        between = time - beside - (times[k - 1] + beside if k else 0.0)
        steps = math.ceil(between.max() / length)
        # There are none before a first crossing that comes at once.
        if steps > 0:
            found += steps * [_polynomial(between / (2 * steps), rough)]
        found += 2 * [_polynomial(0 * time + beside / 2, rough)]
    return found


def _polynomial(values: Array, rough: float) -> dict[Powers, int]:
    """A polynomial in u of few terms near values at the nodes, in units of 2^-CLOCK."""
    n = len(values)
    series = chebyshev.chebfit(nodes(n, precision(53)), values, n - 1)
    # Steps need not end at the crossings exactly: small coefficients are left out, for short terms.
    powers = chebyshev.cheb2poly(np.where(np.abs(series) > rough, series, 0.0))
    # All are coefficients of T_0(x), which are stored as twice what they stand for.
    found = {(0, k, 0): 2 * round(float(c) * 2**CLOCK) for k, c in enumerate(powers)}
    return {at: c for at, c in found.items() if c}
