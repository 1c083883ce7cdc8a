"""Sets that passages stretch across each other, and the polynomials of their orbits.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.coverings`
decides. The sets lie beside the heteroclinic orbits at chi = 0 or pi, on either side of the stable
surface of the next periodic orbit, with each symbol on each section, so far from it that a passage
takes so many half rotations. Their lines of constant U are those from which the passage ends at one
chi; their lines of constant V run along the unstable surface.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, hamiltonian_J3_0, height
from rigidpend.numbers.exact import GUARD_BITS, Exact, exact
from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import EnergyLevel, SectionPoint, return_map
from rigidpend.orbits.return_map.expansions import chebyshev_analysis, nodes
from rigidpend.orbits.return_map.poincare import state_of
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.connections import check_middle
from rigidpend.routes.certified.coverings import Numbers
from rigidpend.routes.certified.pieces import CLOCK, FamilyStep, Powers, Quad, StartLine, made

Array = NDArray[np.float64]

NUMBERS = precision(96)
"""Pairs of doubles."""
TOLERANCE = 2.0**-100
"""Tolerance of the integration."""
DEGREE = 4
"""Degree of the curves U = const."""
POINTS = 24
"""Points through which they are laid."""
ITERATIONS = 60
"""Iterations of Newton's method at most."""
TILT = 0.01
"""Distance in chi at which the angle of the surfaces is taken, radians."""
OVERSHOOT, WIDTH = 1.4, 1.7
"""Reach of images beyond the sets that they cover, and width of a set over that of images in it."""
BEYOND = 1.02
"""Energies that are proven over those of a line of starts."""
FURTHER = 1.05
"""Reach of a strip's image over that of sets and their images."""
BESIDE, THIN, IN_ASIDE = 1.5, 0.2, 4
"""Width of a strip over the least, of its image over a set's at most, and nodes across it."""
STEADY = 14
"""Iterations of what converges steadily."""
WIDEST = 0.97
"""Largest |gamma3| in a set."""
IN_TIME, IN_U, IN_V = 40, 5, 11
"""Nodes in time and in both parameters, of coefficients of so many bits as BITS is."""
LENGTH = 2.0
"""Length of a step, about, in which what is unstable grows by its exponential."""
SPARE = 8
"""Bits beyond a unit from which on coefficients are rounding."""
BITS, LINE_BITS = 60, 8
"""Bits of coefficients at the beginning, and by how many fewer a line of starts has."""
SENSITIVE = 8.0
"""Change of orbits over the relative change of the energy."""
GROWTH = 1.4
"""Bits by which the bound grows in a time in which what is unstable grows by e, about."""


class ShiftProblem(NamedTuple):
    """A body and its energies, half rotations of a passage, and bits of coefficients."""

    body: Body
    h: Exact
    half_turns: int
    bits: int = BITS
    orders: tuple[int, int] | None = None
    """Nodes in both parameters; None for those of the sets of a full shift."""
    spread: Fraction = Fraction(0)
    """The energies are h + spread w, |w| <= 1."""
    h0: Exact | None = None
    """Starts have J2_0 = sqrt(2 h0/kappa); if None, they have the energy h."""
    lengths: int = 1
    """Sets of each symbol on a section: of half_turns, and of ever 2 more."""

    @property
    def shift(self) -> Fraction:
        """Difference of h and h0."""
        return (self.h - (self.h0 or self.h)).fraction or Fraction(0)

    @property
    def coefficients(self) -> Coefficients:
        """The coefficients of the field, in pairs of doubles."""
        return coefficients(self.body.angles(NUMBERS.bits + GUARD_BITS), "1", NUMBERS)

    @property
    def level(self) -> EnergyLevel:
        """The return map at the energy h."""
        return self.level_of(0.0)

    def level_of(self, w: float) -> EnergyLevel:
        """The return map at one of the energies."""
        ends = self.h, self.h
        if self.h0 is not None:
            ends = self.h0 - self.body.mu, self.h0 + self.body.mu
        elif self.spread:
            ends = self.h - self.spread, self.h + self.spread
        return return_map(self.body, h=ends).at(float(self.h) + w * float(self.spread))

    @property
    def rate(self) -> float:
        """Rate at which orbits beside the periodic ones part, in 1/t'."""
        level = self.level
        return float(level.exponent[0, 0] / level.rotation[0, 0])

    @property
    def nodes(self) -> tuple[int, int, int, int]:
        """Nodes in time, in both parameters of a set and in the energy."""
        further, in_w = self.bits - BITS, 1
        if self.spread:
            by = -math.log2(SENSITIVE * float(self.spread) / float(self.h))
            in_w = max(2, math.ceil(self.bits / by))
        in_time = math.ceil(IN_TIME * self.bits / BITS)
        return in_time, *(self.orders or (IN_U + further // 12, IN_V + further // 6)), in_w


class _Section(NamedTuple):
    """A section beside its heteroclinic point."""

    level: EnergyLevel
    rising: bool
    chi: float
    """Phase of that point, radians."""

    def unstable(self, d: Array, chi: Array, *, mirrored: bool = False) -> Array:
        """U of the passage to come or, mirrored, of the one before."""
        which, turn = (0, 1.0) if self.rising else (1, -1.0)
        side = -turn if mirrored else turn
        phase = side * (self.chi + chi)
        seen = self.level.charts[self.rising].forward.look_up(d, phase, self.level.a)
        return np.asarray(seen[which], dtype=float)

    def surface(self, chi: Array, *, mirrored: bool = False) -> Array:
        """d of the stable or unstable surface."""
        d, step = 0 * chi, 1e-3 * float(self.level.charts[self.rising].forward.width)
        for _ in range(ITERATIONS):
            here = self.unstable(d, chi, mirrored=mirrored)
            slope = (self.unstable(d + step, chi, mirrored=mirrored) - here) / step
            d = d - here / slope
        return d

    def reaching(self, chi: Array, half_turns: int, beyond: float, side: int) -> Array:
        """d on a side of the stable surface from which so many half rotations end at `beyond`."""
        surface, grown = self.surface(chi), np.full(len(chi), 1e-6)
        rate = float(self.level.exponent[0, 0])
        for _ in range(ITERATIONS):
            passed = self.level.passage(
                SectionPoint(self.rising, surface + side * grown, self.chi + chi)
            )
            off = chi + passed.turned - math.pi * half_turns - beyond
            # chi' falls by 1/Lambda with the logarithm of the distance.
            grown = grown * np.exp(np.clip(rate * off, -2.0, 2.0))
        if not (passed.inside.all() and np.abs(off).max() < 1e-6):
            said = (
                f"no passages of {half_turns} half rotations begin beside the heteroclinic orbits"
            )
            raise ArithmeticError(f"{said}, as far as the return map tells")
        return surface + side * grown


def _energies(setting: ShiftProblem) -> Array:
    """Those w at which sets and lines of starts are found, the middle one 0: they move smoothly."""
    return np.linspace(-1, 1, 3 + setting.nodes[3] // 4 * 2) if setting.spread else np.zeros(1)


def _moving(ws: Array, found: Sequence[Any]) -> Array:
    """Coefficients of powers of w from values."""
    return np.array(found) if len(ws) == 1 else polynomial.polyfit(ws, found, len(ws) - 1)


def _sections(setting: ShiftProblem, w: float = 0.0) -> list[_Section]:
    level = setting.level_of(w)
    return [
        _Section(level, True, 0.0),
        _Section(level, False, math.pi * (setting.half_turns % 2)),
    ]


def angles(setting: ShiftProblem) -> list[float]:
    """Angles of the surfaces in (d, chi) at the heteroclinic points of both sections."""
    ends, found = np.array([-TILT, TILT]), []
    for section in _sections(setting):
        apart = section.surface(ends, mirrored=True) - section.surface(ends)
        found.append(abs(float(apart[1] - apart[0])) / (2 * TILT))
    return found


def quads(setting: ShiftProblem) -> list[Quad]:
    """The sets: of symbols 0 and 1 of upward crossings, then of downward ones."""
    level = setting.level
    sections, tilts = _sections(setting), angles(setting)
    zero = np.zeros(1)
    # Distances in d: of sets from the stable surface, and of images from the unstable one. Those
    # of more half rotations are nearer.
    away, images = [], []
    for section, other in zip(sections, sections[::-1], strict=True):
        begin = section.reaching(zero, setting.half_turns, 0.0, 1)
        away.append(abs(float((begin - section.surface(zero))[0])))
        passed = level.passage(SectionPoint(section.rising, begin, section.chi + zero))
        images.append(abs(float((passed.point.d - other.surface(zero, mirrored=True))[0])))
    found = []
    turns = [setting.half_turns + 2 * k for k in range(setting.lengths)]
    for at, section in enumerate(sections):
        reach = OVERSHOOT * (away[1 - at] + images[at]) / tilts[1 - at]
        across = WIDTH * images[1 - at]
        widest = (away[at] + across) / tilts[at]
        chi = widest * np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        for right, half_turns in itertools.product((False, True), turns):
            side = 1 if right == section.rising else -1
            d, g = section.reaching(chi, half_turns, 0.0, side), -np.sin(section.chi + chi)
            curve, *moves = _curves(setting._replace(half_turns=half_turns), at, side, chi)
            edges = [section.reaching(zero, half_turns, end * reach, side)[0] for end in (-1, 1)]
            line = polynomial.polyfit(g, section.surface(chi, mirrored=True) - d, 1)
            if not (a := abs(edges[1] - edges[0]) / 2) > 0:
                said = "the sets are lost in rounding; with fewer half rotations they are larger"
                raise ArithmeticError(said)
            numbers = (a, across, *line)
            moving = tuple(tuple(map(Fraction, map(float, each))) for each in moves)
            found.append(made(section.rising, numbers, curve)._replace(moves=moving))
    return found


def _curves(setting: ShiftProblem, at: int, side: int, chi: Array) -> Array:
    """Coefficients of the curve U = 0 of a set, in powers of w and of gamma3."""
    ws, widest, found = _energies(setting), np.abs(chi).max(), []
    for w in ws:
        section = _sections(setting, w)[at]
        d, g = section.reaching(chi, setting.half_turns, 0.0, side), -np.sin(section.chi + chi)
        found.append(polynomial.polyfit(g / widest, d, DEGREE) / widest ** np.arange(DEGREE + 1))
    return _moving(ws, found)


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
    return _pieces(orbits, expected, at, sizes, setting.bits)


def _pieces(
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


class LineStarts(NamedTuple):
    """Starts as in Fig. 4, theta1 = alpha0 + beta0 and a given J1, at one energy or of one J2."""

    setting: ShiftProblem
    J1: Fraction
    w: Any = 0.0
    """That of their energy, or one for each."""

    def states(self, theta2: Any, a: Precision) -> Any:
        """Aligned components (6, n) at phases, radians."""
        J1, J2, theta1, p = self._actions(theta2, a)
        start = Canonical(J1, J2 - J1, 0 * J1, theta1, theta2, 0 * J1, 1 + 0 * J1)
        return np.stack(aligned_from_canonical(start, p.alpha0, p.beta0, a))

    def energies(self, theta2: Array) -> Array:
        """The energies of starts of one J2, less h0."""
        a = precision(53)
        J1, J2, theta1, p = self._actions(theta2, a)
        return np.asarray(p.mu * height(J1, J2, (theta1, theta2), a))

    def _actions(self, theta2: Any, a: Precision) -> tuple[Any, Any, Any, Angles]:
        """J1, J2 and theta1; J2 follows from h0 or from the energy."""
        setting = self.setting
        p = Angles(*map(a.number, setting.body.angles(a.bits + GUARD_BITS)))
        h = a.number((setting.h0 or setting.h).at(a.bits + GUARD_BITS))
        h = h + a.number(setting.spread) * self.w
        J1, theta1 = a.number(self.J1) + 0 * theta2, p.alpha0 + p.beta0 + 0 * theta2
        J2 = a.sqrt(2 * h / p.kappa) + 0 * theta2
        for _ in range(STEADY if setting.h0 is None else 0):
            off = hamiltonian_J3_0(J1, J2, (theta1, theta2), p, a) - h
            J2 = J2 - off / (p.kappa * J2)
        return J1, J2, theta1, p

    def entered(self, theta2: Array) -> Any:
        """Their first crossings by the return map."""
        a = precision(53)
        Qp = np.asarray(self.states(theta2, a))[0]
        phase = np.pi / 2 - self.setting.body.beta0 / 2 - theta2
        return self.setting.level_of(self.w).enter(Qp, phase)

    def between(self, ends: Array) -> tuple[StartLine, Array]:
        """The line between two phases, radians, and its direction."""
        low, high = np.asarray(self.states(ends, precision(53)))[3:5].T
        e = (high - low) / np.hypot(*(high - low))
        numbers = (*e, e @ (low + high) / 2, e @ (high - low) / 2)
        e1, e2, centre, half = (Fraction(float(x)) for x in numbers)
        return StartLine(self.J1, e1, e2, centre, half), e


def line(
    setting: ShiftProblem, J1: Fraction, quads: Sequence[Quad]
) -> tuple[StartLine, tuple[float, float]]:
    """A line of starts that crosses both sets of upward crossings, and its ends in theta2."""
    ws = _energies(setting) if setting.h0 is None else np.zeros(1)
    every = [LineStarts(setting, J1, w) for w in ws]
    middles = [_middle(starts) for starts in every]
    sizes = [[abs(float(x / q.l1)) for x in (q.l0, q.a, q.b)] for q in quads if q.rising]
    reach = OVERSHOOT * max(size[0] for size in sizes)
    if setting.h0 is None:
        # As far as all sets and images.
        reach = FURTHER * max(max(sum(x), OVERSHOOT * (x[0] + x[2] / WIDTH)) for x in sizes)
    ends, half = [middle + np.array([-reach, reach]) for middle in middles], len(ws) // 2
    found, e = every[half].between(ends[half])
    at = [starts.states(x, precision(53)) for starts, x in zip(every, ends, strict=True)]
    moving = _moving(ws, [e @ np.asarray(x)[3:5].mean(axis=1) for x in at])
    centre, *moves = (Fraction(float(x)) for x in moving)
    first, last = ends[half]
    found = found._replace(
        centre=centre,
        moves=tuple(moves),
        wide=_wide(setting, found, float(at[half][0].max()), quads),
    )
    return found, (float(first), float(last))


def _wide(setting: ShiftProblem, of: StartLine, momentum: float, quads: Sequence[Quad]) -> Fraction:
    """Half-width of the strip about a line in which the unstable surface is a curve.

    It is 0 where there is none whose image is thin beside the sets, and of several energies.
    """
    if setting.h0 is not None:
        return Fraction(0)
    try:
        middle = check_middle(Numbers.of(setting.body, setting.h, setting.spread), arb(0))
        steep = float(middle.slant_at(arb(momentum))) / float(middle.growth.weight)
    except Undecided:
        return Fraction(0)
    found = BESIDE * steep * float(of.half)
    # Qm falls as Qp grows, to about 1.
    thin = found * momentum < THIN * min(float(quad.b) for quad in quads if quad.rising)
    return Fraction(found) if thin else Fraction(0)


def _middle(starts: LineStarts) -> Array:
    """theta2 of the start that first crosses at chi = 0."""
    found = np.zeros(1)
    for _ in range(ITERATIONS):
        # chi grows with theta2, at about the same rate.
        off = np.mod(starts.entered(found).point.chi + np.pi, 2 * np.pi) - np.pi
        found = found - off
    return found


def line_pieces(
    setting: ShiftProblem, of: StartLine, theta2: tuple[float, float]
) -> list[FamilyStep]:
    """Polynomials of the orbits of a line of starts up to their first crossing."""
    a, in_w = NUMBERS, setting.nodes[3] if setting.h0 is None else 1
    sizes = setting.nodes[1], IN_ASIDE if of.wide else 1, in_w
    u, v, w = at = grid_of(*(nodes(n, a) for n in sizes))
    starts, goal = LineStarts(setting, of.J1, w), 0 * u
    for x in (of.centre, *of.moves)[::-1]:
        goal = goal * w + a.number(x)
    goal = goal + a.number(of.half) * u
    phase = (theta2[0] + theta2[1]) / 2 + (theta2[1] - theta2[0]) / 2 * u
    for _ in range(STEADY):
        begin = starts.states(phase, a)
        off = a.number(of.e1) * begin[3] + a.number(of.e2) * begin[4] - goal
        # gamma is a unit vector nearly across M, which theta2 turns: e.gamma grows like theta2.
        phase = phase - off
    if of.wide:
        begin = _beside(setting, of, begin, goal, a.number(of.wide) * v, w)
    times = np.zeros(len(phase))
    for k, one in enumerate(nodes(in_w, precision(53))):
        entered = LineStarts(setting, of.J1, one).entered(a.floats(phase)[k::in_w])
        times[k::in_w] = entered.time
    return _pieces(FamilyOrbits(setting, begin), times, at, sizes, setting.bits - LINE_BITS)


def _beside(
    setting: ShiftProblem, of: StartLine, begin: Any, place: Any, Qm: Any, w: Any
) -> PairArray:
    """Points of a strip beside starts of one energy, whose place on the line they share."""
    a, (c, to_M1, to_M2) = NUMBERS, setting.coefficients
    h = a.number(setting.h.at(a.bits + GUARD_BITS)) + a.number(setting.spread) * w
    J1, e1, e2 = map(a.number, (of.J1, of.e1, of.e2))
    Qp, _, M3, g1, g2, g3 = begin
    side = 1 if float(a.floats(e1 * g2 - e2 * g1)[0]) > 0 else -1
    for _ in range(STEADY):
        M1, M2 = (Qp + Qm) * to_M1, (Qp - Qm) * to_M2
        left = h - c.mu_r1 * g1 - c.mu_r2 * g2 + Qp * Qm / 2
        M3 = -a.sqrt(2 * left / c.kappa - M1 * M1 - M2 * M2)
        Qp = a.sqrt(4 * J1 * (J1 - M3) / (to_M1 * to_M1 + to_M2 * to_M2))
        g3 = -(M1 * g1 + M2 * g2) / M3
        across = side * a.sqrt(1 - place * place - g3 * g3)
        g1, g2 = e1 * place - e2 * across, e2 * place + e1 * across
    found: Any = np.stack([Qp, Qm, M3, g1, g2, g3])
    return found


def of_one_J2(body: Body, h0: Exact, J1: Fraction) -> ShiftProblem:
    """The problem at the energy of the start of J2_0 = sqrt(2 h0/kappa) that crosses at chi = 0."""
    theta2, setting = np.zeros(1), ShiftProblem(body, h0, 1, h0=h0)
    for _ in range(ITERATIONS):
        chi = LineStarts(setting, J1).entered(theta2).point.chi
        theta2 = theta2 - (np.mod(chi + np.pi, 2 * np.pi) - np.pi)
        setting = of_start(body, h0, J1, float(theta2[0]))
    return setting


def of_start(body: Body, h0: Exact, J1: Fraction, theta2: float) -> ShiftProblem:
    """The problem at the energy of the start of J2_0 = sqrt(2 h0/kappa) with a phase, radians."""
    setting = ShiftProblem(body, h0, 1, h0=h0)
    [shift] = LineStarts(setting, J1).energies(np.array([theta2]))
    return setting._replace(h=h0 + exact(float(shift)))


def widened(setting: ShiftProblem, J1: Fraction) -> ShiftProblem:
    """The same with all energies of a line of starts that crosses the sets."""
    _, ends = line(setting, J1, quads(setting))
    starts = LineStarts(setting, J1)
    energies = starts.energies(np.linspace(*ends, 9))
    off = energies - starts.energies(np.array([sum(ends) / 2]))
    return setting._replace(spread=Fraction(BEYOND * float(np.abs(off).max())))
