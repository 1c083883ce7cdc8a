"""Lines of starts as in Fig. 4 that cross sets, and polynomials of their orbits.

Nothing is proven of them here. Angles are in radians, times are t', dimensionless.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import hamiltonian_J3_0, height
from rigidpend.numbers import Array
from rigidpend.numbers.exact import GUARD_BITS, Exact, exact
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.precision import Precision, precision
from rigidpend.orbits.return_map.expansions import nodes
from rigidpend.routes.certified.connections import check_middle
from rigidpend.routes.certified.family_orbits import FamilyGrid, to_crossing
from rigidpend.routes.certified.horseshoe import (
    IN_PAIRS,
    MOST_ITERATIONS,
    OVERSHOOT,
    SETTLED,
    ShiftProblem,
    energies_of,
    moving,
    quads,
)
from rigidpend.routes.certified.models import horner
from rigidpend.routes.certified.proof_data import FamilyStep, Quad, StartLine, Undecided

SPREAD_FACTOR = 1.02
"""Spread of the energies that are proven, over that of a line of starts."""
FURTHER = 1.05
"""Reach of a strip's image over that of sets and their images."""
BESIDE, THIN = 1.5, 0.2
"""Width of a strip about a line over the least one, and largest width of its image over a set's."""
STEADY = 14
"""Iterations of maps that converge linearly."""


class LineStarts(NamedTuple):
    """Starts as in Fig. 4, theta1 = alpha0 + beta0 and a given J1, at one energy or of one J2."""

    setting: ShiftProblem
    J1: Fraction
    w: Any = 0.0
    """The energy h + spread w, one number or one for each start."""

    def states(self, theta2: Any, a: Precision) -> Any:
        """Aligned components (6, n) at phases, radians."""
        J1, J2, theta1, p = self._actions(theta2, a)
        start = Canonical(J1, J2 - J1, 0 * J1, theta1, theta2, 0 * J1, 1 + 0 * J1)
        return np.stack(aligned_from_canonical(start, p.alpha0, p.beta0, a))

    def energies(self, theta2: Array) -> Array:
        """The energies of starts of one J2 less h0, physical units: those of the weight."""
        a = precision(53)
        J1, J2, theta1, p = self._actions(theta2, a)
        return np.asarray(p.mu * height(J1, J2, (theta1, theta2), a))

    def _actions(self, theta2: Any, a: Precision) -> tuple[Any, Any, Any, Angles]:
        """The actions J1 and J2, theta1, and the body's angles; J2 is that of h0 or the energy."""
        setting = self.setting
        p = Angles(*map(a.number, setting.body.angles(a.bits + GUARD_BITS)))
        h = a.number((setting.h0 or setting.h).at(a.bits + GUARD_BITS))
        h = h + a.number(setting.spread) * self.w
        J1, theta1 = a.number(self.J1) + 0 * theta2, p.alpha0 + p.beta0 + 0 * theta2
        J2 = a.sqrt(2 * h / p.kappa) + 0 * theta2
        # The energy is kappa J2^2/2 and small terms, those of J1 and of the weight.
        for _ in range(STEADY if setting.h0 is None else 0):
            off = hamiltonian_J3_0(J1, J2, (theta1, theta2), p, a) - h
            J2 = J2 - off / (p.kappa * J2)
        return J1, J2, theta1, p

    def entered(self, theta2: Array) -> Any:
        """The first crossings of starts at some phases, by the return map."""
        a = precision(53)
        Qp = np.asarray(self.states(theta2, a))[0]
        phase = np.pi / 2 - self.setting.body.beta0 / 2 - theta2
        return self.setting.level_of(self.w).enter(Qp, phase)

    def off(self, theta2: Array) -> Array:
        """chi of the first crossings of starts at some phases, from -pi to pi."""
        return np.mod(self.entered(theta2).point.chi + np.pi, 2 * np.pi) - np.pi

    def between(self, ends: Array) -> tuple[StartLine, Array]:
        """The line of starts between two phases, radians, and its direction (e1, e2)."""
        low, high = np.asarray(self.states(ends, precision(53)))[3:5].T
        e = (high - low) / np.hypot(*(high - low))
        numbers = (*e, e @ (low + high) / 2, e @ (high - low) / 2)
        e1, e2, centre, half = (Fraction(float(x)) for x in numbers)
        return StartLine(self.J1, e1, e2, (centre,), half), e


def line(
    setting: ShiftProblem, J1: Fraction, quads: Sequence[Quad]
) -> tuple[StartLine, tuple[float, float]]:
    """A line of starts that crosses all sets of upward crossings, and its ends in theta2."""
    ws = energies_of(setting) if setting.h0 is None else np.zeros(1)
    every = [LineStarts(setting, J1, w) for w in ws]
    middles = [_middle(starts) for starts in every]
    sizes = [[abs(float(x / q.l1)) for x in (q.l0, q.a, q.b)] for q in quads if q.rising]
    reach = OVERSHOOT * max(size[0] for size in sizes)
    if setting.h0 is None:
        # As far as all sets and images.
        reach = FURTHER * max(max(sum(x), OVERSHOOT * (x[0] + x[2] / setting.width)) for x in sizes)
    ends, half = [middle + np.array([-reach, reach]) for middle in middles], len(ws) // 2
    found, e = every[half].between(ends[half])
    at = [starts.states(x, precision(53)) for starts, x in zip(every, ends, strict=True)]
    # The line moves with the energy in its own direction: only the centre depends on w.
    centre = moving(ws, [e @ np.asarray(x)[3:5].mean(axis=1) for x in at])
    first, last = ends[half]
    found = found._replace(
        centre=tuple(Fraction(float(x)) for x in centre),
        wide=_wide(setting, found, float(at[half][0].max()), quads),
    )
    return found, (float(first), float(last))


def _wide(setting: ShiftProblem, of: StartLine, momentum: float, quads: Sequence[Quad]) -> Fraction:
    """The half-width of a strip about a line in which the unstable surface is a curve (C9).

    It is 0 if no such strip has an image that is thin beside the sets, and for starts of several
    energies. `momentum` is Qp of the starts.
    """
    if setting.h0 is not None:
        return Fraction(0)
    try:
        middle = check_middle(setting.numbers, arb(0))
        steep = float(middle.slant_at(arb(momentum))) / float(middle.growth.weight)
    except Undecided:
        return Fraction(0)
    found = BESIDE * steep * float(of.half)
    # Beside the periodic orbit the product of Qp and Qm hardly changes, and Qp grows to the whole.
    aside = found * momentum / setting.momentum
    thin = aside < THIN * min(float(quad.b) for quad in quads if quad.rising)
    return Fraction(found) if thin else Fraction(0)


def _middle(starts: LineStarts) -> Array:
    """The phase theta2 of the start that first crosses at chi = 0, radians, (1,)."""
    found = np.zeros(1)
    for _ in range(MOST_ITERATIONS):
        # chi grows with theta2 at about the same rate, so its distance from 0 is the correction.
        off = starts.off(found)
        found = found - off
        if abs(off[0]) <= SETTLED:
            break
    return found


def with_bits(
    setting: ShiftProblem, J1: Fraction, theta2: tuple[float, float], quads: Sequence[Quad]
) -> ShiftProblem:
    """The setting with bits enough for a line whose image lies in sets.

    `theta2` are the ends of the line, radians.
    """
    # The nearer the line is to the periodic orbit, the longer the bound on a distance grows.
    time = float(LineStarts(setting, J1).entered(np.array(theta2)).time.max())
    least = min(float(quad.b) for quad in quads if quad.rising)
    return setting.with_bits(least, (setting.rate + setting.faster) * time)


def line_pieces(
    setting: ShiftProblem, of: StartLine, theta2: tuple[float, float]
) -> list[FamilyStep]:
    """Polynomials of the orbits of a line of starts up to their first crossing.

    `theta2` are the ends of the line, radians.
    """
    a, in_w = IN_PAIRS, setting.nodes[3] if setting.h0 is None else 1
    # Each further node gains as many bits as half of the half-length, or half-width, is below 1.
    in_u, in_v = (
        math.ceil(setting.bits / -math.log2(x / 2)) if x else 1 for x in (of.half, of.wide)
    )
    grid = FamilyGrid(max(in_u, setting.nodes[1]), in_v, in_w)
    u, v, w = grid.at
    starts = LineStarts(setting, of.J1, w)
    goal = horner([a.number(x) for x in of.centre], w) + a.number(of.half) * u
    phase = (theta2[0] + theta2[1]) / 2 + (theta2[1] - theta2[0]) / 2 * u
    for _ in range(STEADY):
        begin = starts.states(phase, a)
        off = a.number(of.e1) * begin[3] + a.number(of.e2) * begin[4] - goal
        # theta2 turns gamma, a unit vector, about M; along e it moves as far as the phase grows.
        phase = phase - off
    if of.wide:
        begin = _beside(setting, of, begin, goal, a.number(of.wide) * v, w)
    times = np.zeros(len(phase))
    for k, one in enumerate(nodes(in_w, precision(53))):
        entered = LineStarts(setting, of.J1, one).entered(a.floats(phase)[k::in_w])
        times[k::in_w] = entered.time
    return to_crossing(setting, begin, times, grid, setting.bits)


def _beside(
    setting: ShiftProblem, of: StartLine, begin: Any, place: Any, Qm: Any, w: Any
) -> SumArray:
    """States (6, n) of the points of a strip beside starts with the same place on the line.

    Qm is given; the other components follow as C1 says.
    """
    a, (c, to_M1, to_M2) = IN_PAIRS, setting.coefficients
    h = a.number(setting.h.at(a.bits + GUARD_BITS)) + a.number(setting.spread) * w
    J1, e1, e2 = map(a.number, (of.J1, of.e1, of.e2))
    Qp, _, M3, g1, g2, g3 = begin
    # The side of the direction (e1, e2) on which gamma lies. Only in doubles it is a unit vector.
    side = 1 if float(a.floats(e1 * g2 - e2 * g1)[0]) > 0 else -1
    square = e1 * e1 + e2 * e2
    for _ in range(STEADY):
        M1, M2 = (Qp + Qm) * to_M1, (Qp - Qm) * to_M2
        # M3 from the energy, Qp from M3, gamma3 from M . gamma = 0, the rest from |gamma| = 1.
        left = h - c.mu_r1 * g1 - c.mu_r2 * g2 + Qp * Qm / 2
        M3 = -a.sqrt(2 * left / c.kappa - M1 * M1 - M2 * M2)
        Qp = a.sqrt(4 * J1 * (J1 - M3) / (to_M1 * to_M1 + to_M2 * to_M2))
        g3 = -(M1 * g1 + M2 * g2) / M3
        across = side * a.sqrt(square * (1 - g3 * g3) - place * place)
        g1, g2 = (e1 * place - e2 * across) / square, (e2 * place + e1 * across) / square
    found: Any = np.stack([Qp, Qm, M3, g1, g2, g3])
    return found


def of_one_J2(body: Body, h0: Exact, J1: Fraction) -> ShiftProblem:
    """The problem at the energy of the start of J2_0 = sqrt(2 h0/kappa) that crosses at chi = 0."""
    # The energy depends on the phase, and the phase on the map of the energy: both in turn.
    theta2, setting = np.zeros(1), ShiftProblem(body, h0, 1, h0=h0)
    for _ in range(MOST_ITERATIONS):
        off = LineStarts(setting, J1).off(theta2)
        theta2 = theta2 - off
        setting = of_start(body, h0, J1, float(theta2[0]))
        if abs(off[0]) <= SETTLED:
            break
    return setting


def of_start(body: Body, h0: Exact, J1: Fraction, theta2: float) -> ShiftProblem:
    """The problem at the energy of the start of J2_0 = sqrt(2 h0/kappa) with a phase theta2."""
    setting = ShiftProblem(body, h0, 1, h0=h0)
    [shift] = LineStarts(setting, J1).energies(np.array([theta2]))
    return setting._replace(h=h0 + exact(float(shift)))


def widened(setting: ShiftProblem, J1: Fraction) -> ShiftProblem:
    """The same problem with the energies of all starts of a line that crosses the sets."""
    _, ends = line(setting, J1, quads(setting))
    starts = LineStarts(setting, J1)
    energies = starts.energies(np.linspace(*ends, 9))
    off = energies - starts.energies(np.array([sum(ends) / 2]))
    return setting._replace(spread=Fraction(SPREAD_FACTOR * float(np.abs(off).max())))
