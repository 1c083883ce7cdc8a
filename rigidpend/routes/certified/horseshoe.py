"""Four sets that passages stretch across each other, and the polynomials of their orbits.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.coverings`
decides. The sets lie beside the heteroclinic orbits at chi = 0 or pi, on either side of the stable
surface of the next periodic orbit, one with each symbol on each section. They are so far from it
that a passage takes so many half rotations. Their lines of constant U are those from which the
passage ends at one chi; their lines of constant V run along the unstable surface.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, hamiltonian_J3_0
from rigidpend.numbers.exact import GUARD_BITS, Exact
from rigidpend.orbits.integrate.batch_samples import sample_aligned
from rigidpend.orbits.integrate.pair_arrays import PairArray
from rigidpend.orbits.return_map import EnergyLevel, SectionPoint, return_map
from rigidpend.orbits.return_map.expansions import chebyshev_analysis, nodes
from rigidpend.orbits.return_map.itinerary import enter
from rigidpend.orbits.return_map.poincare import state_of
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
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
STEADY = 14
"""Iterations of what converges steadily."""
WIDEST = 0.8
"""Largest |gamma3| in a set."""
IN_TIME, IN_U, IN_V = 40, 5, 11
"""Nodes in time and in both parameters, of coefficients of so many bits as BITS is."""
LENGTH = 2.0
"""Length of a step, about, in which what is unstable grows by its exponential."""
SPARE = 8
"""Bits beyond a unit from which on coefficients are rounding."""
BITS, LINE_BITS = 60, 8
"""Bits of coefficients at the beginning, and by how many fewer a line of starts has."""
GROWTH = 1.4
"""Bits by which the bound grows in a time in which what is unstable grows by e, about."""


class ShiftProblem(NamedTuple):
    """A body and an energy, half rotations of a passage, and bits of coefficients."""

    body: Body
    h: Exact
    half_turns: int
    bits: int = BITS
    orders: tuple[int, int] | None = None
    """Nodes in both parameters; None for those of the sets of a full shift."""

    @property
    def coefficients(self) -> Coefficients:
        """The coefficients of the field, in pairs of doubles."""
        return coefficients(self.body.angles(NUMBERS.bits + GUARD_BITS), "1", NUMBERS)

    @property
    def level(self) -> EnergyLevel:
        """The return map at the energy."""
        return return_map(self.body, h=self.h).at(float(self.h))

    @property
    def rate(self) -> float:
        """Rate at which orbits beside the periodic ones part, in 1/t'."""
        level = self.level
        return float(level.exponent[0, 0] / level.rotation[0, 0])

    @property
    def nodes(self) -> tuple[int, int, int]:
        """Nodes in time and in both parameters."""
        further, in_time = self.bits - BITS, math.ceil(IN_TIME * self.bits / BITS)
        return in_time, *(self.orders or (IN_U + further // 12, IN_V + further // 6))


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


def _sections(setting: ShiftProblem) -> list[_Section]:
    return [
        _Section(setting.level, True, 0.0),
        _Section(setting.level, False, math.pi * (setting.half_turns % 2)),
    ]


def angles(setting: ShiftProblem) -> list[float]:
    """Angles of the surfaces in (d, chi) at the heteroclinic points of both sections."""
    ends, found = np.array([-TILT, TILT]), []
    for section in _sections(setting):
        apart = section.surface(ends, mirrored=True) - section.surface(ends)
        found.append(abs(float(apart[1] - apart[0])) / (2 * TILT))
    return found


def quads(setting: ShiftProblem) -> list[Quad]:
    """The four sets: symbols 0 and 1 of upward crossings, then of downward ones."""
    half_turns, level = setting.half_turns, setting.level
    sections, tilts = _sections(setting), angles(setting)
    zero = np.zeros(1)
    # Distances in d: of sets from the stable surface, and of images from the unstable one.
    away, images = [], []
    for section, other in zip(sections, sections[::-1], strict=True):
        begin = section.reaching(zero, half_turns, 0.0, 1)
        away.append(abs(float((begin - section.surface(zero))[0])))
        passed = level.passage(SectionPoint(section.rising, begin, section.chi + zero))
        images.append(abs(float((passed.point.d - other.surface(zero, mirrored=True))[0])))
    found = []
    for at, section in enumerate(sections):
        reach = OVERSHOOT * (away[1 - at] + images[at]) / tilts[1 - at]
        across = WIDTH * images[1 - at]
        widest = (away[at] + across) / tilts[at]
        chi = widest * np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        for right in (False, True):
            side = 1 if right == section.rising else -1
            d, g = section.reaching(chi, half_turns, 0.0, side), -np.sin(section.chi + chi)
            curve = polynomial.polyfit(g / widest, d, DEGREE) / widest ** np.arange(DEGREE + 1)
            edges = [section.reaching(zero, half_turns, end * reach, side)[0] for end in (-1, 1)]
            line = polynomial.polyfit(g, section.surface(chi, mirrored=True) - d, 1)
            if not (a := abs(edges[1] - edges[0]) / 2) > 0:
                said = "the sets are lost in rounding; with fewer half rotations they are larger"
                raise ArithmeticError(said)
            numbers = (a, across, *line)
            found.append(made(section.rising, numbers, curve))
    return found


def pieces(setting: ShiftProblem, quad: Quad, turned: bool | None = None) -> list[FamilyStep]:
    """Polynomials of the orbits of a set up to their next crossing.

    `turned` says that chi of the set is nearer to pi than to 0.
    """
    if turned is None:
        turned = not quad.rising and setting.half_turns % 2 == 1
    _, in_u, in_v = setting.nodes
    u, v = _grid(nodes(in_u, NUMBERS), nodes(in_v, NUMBERS))
    orbits = _Orbits(setting, _beginning(quad, (u, v), setting, turned))
    return _pieces(orbits, _expected(quad, orbits.begin, setting, turned), u, v, setting.bits)


def _pieces(
    orbits: _Orbits, expected: Array, u: PairArray, v: PairArray, bits_at_first: int
) -> list[FamilyStep]:
    times = orbits.crossing(expected)
    rate, in_u = orbits.rate, orbits.in_u
    # Where M3 changes, at both ends, steps are half as long as between.
    steps = max(3, math.ceil(float(times.max()) * rate / LENGTH) + 1)
    length = math.floor(float(times.min()) / (steps - 1) * 2**10) / 2**10
    starts = [0.0, *(length * (k + 0.5) for k in range(steps - 1))]
    last = starts[-1]
    rest = PairArray.of((times - last) / 2)[None, None]
    halves = [{(0, 0, 0): int((y - x) * 2**CLOCK)} for x, y in itertools.pairwise(starts)]
    halves.append(_fitted(rest, CLOCK, in_u)[0])
    found = []
    for start, half in zip(starts, halves, strict=True):
        states = orbits.sampled(start, _values(half, u, v))
        bits = bits_at_first - math.floor(GROWTH * rate * start)
        found.append(FamilyStep(bits, half, _fitted(states, bits, in_u)))
    return found


def _grid(u: PairArray, v: PairArray) -> tuple[PairArray, PairArray]:
    """All pairs of two rows of numbers, v running fastest."""
    zeros = NUMBERS.zeros((len(u), len(v)))
    return (u[:, None] + zeros).reshape(-1), (v[None, :] + zeros).reshape(-1)


def _fitted(values: PairArray, bits: int, in_u: int) -> list[dict[Powers, int]]:
    """Coefficients of powers of x, u and v in units of 2^-bits, from values (n, x, orbits)."""
    n, in_v = len(values), values.shape[2] // in_u
    sizes = (values.shape[1], in_u, in_v)
    found = values.reshape(-1, in_u, in_v)
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
            columns[k][tuple(map(int, at))] = w
    return columns


def _along_each(found: PairArray, sizes: tuple[int, ...], rules: Sequence[PairArray]) -> PairArray:
    """Arrays (n, *sizes) multiplied by a matrix along each of three dimensions."""
    for size, rule in zip(sizes[::-1], rules[::-1], strict=True):
        # The last dimension is multiplied, and comes to the front of the three.
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


def _values(half: dict[Powers, int], u: PairArray, v: PairArray) -> PairArray:
    """Half-lengths of a step of each orbit."""
    a = NUMBERS
    found = a.zeros((len(u),))
    for (_, j, k), x in half.items():
        power = a.number(Fraction(x, 2 << CLOCK)) + a.zeros(u.shape)
        for factor in j * [u] + k * [v]:
            power = power * factor
        found = found + power
    return found


def _beginning(
    quad: Quad, places: tuple[PairArray, PairArray], setting: ShiftProblem, turned: bool
) -> PairArray:
    """States (6, n) of points of a set."""
    a, (u, v) = NUMBERS, places
    g = (a.number(quad.a) * u - a.number(quad.b) * v - a.number(quad.l0)) / a.number(quad.l1)
    if a.largest(g) > WIDEST:
        raise ArithmeticError("the sets are too wide; with more half rotations they are smaller")
    curve = a.zeros(g.shape)
    for x in quad.p[::-1]:
        curve = curve * g + a.number(x)
    d = curve + a.number(quad.a) * u
    cos = a.sqrt(1 - g * g)
    if turned:
        cos = -cos
    c = setting.coefficients
    return state_of(quad.rising, d, cos, -g, a.number(setting.h.at(a.bits + GUARD_BITS)), c, a)


def _expected(quad: Quad, begin: PairArray, setting: ShiftProblem, turned: bool) -> Array:
    """Times of the next crossing by the return map, t'."""
    states = NUMBERS.floats(begin)
    chi = np.arcsin(-states[5])
    if turned:
        chi = np.pi - chi
    point = SectionPoint(quad.rising, states[1 if quad.rising else 0], chi)
    return np.asarray(setting.level.passage(point).time)


class _Orbits:
    """Orbits in pairs of doubles."""

    def __init__(self, setting: ShiftProblem, begin: PairArray) -> None:
        self.begin, c = begin, setting.coefficients
        self.in_time, self.in_u, _ = setting.nodes
        self.rate = setting.rate
        self.field = AlignedCoefficients(*(x.exactly() for x in c.aligned))
        self.doubles = AlignedCoefficients(*map(float, c.aligned))

    def at(self, times: PairArray) -> PairArray:
        """States (6, k, n) at times (k, n), each orbit's ascending."""
        grid = np.concatenate((np.zeros((2, 1, times.shape[1])), times.parts), axis=1)
        return PairArray(sample_aligned(self.field, self.begin.parts, grid, 106, TOLERANCE))[:, 1:]

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
    """LineStarts as in Fig. 4, theta1 = alpha0 + beta0 and a given J1, at one energy."""

    setting: ShiftProblem
    J1: Fraction

    def states(self, theta2: Any, a: Precision) -> Any:
        """Aligned components (6, n) at phases, radians; J2 follows from the energy."""
        p = self.setting.body.angles(a.bits + GUARD_BITS)
        p = Angles(*map(a.number, p))
        h = a.number(self.setting.h.at(a.bits + GUARD_BITS))
        J1, theta1 = a.number(self.J1) + 0 * theta2, p.alpha0 + p.beta0 + 0 * theta2
        J2 = a.sqrt(2 * h / p.kappa) + 0 * theta2
        for _ in range(STEADY):
            off = hamiltonian_J3_0(J1, J2, (theta1, theta2), p, a) - h
            J2 = J2 - off / (p.kappa * J2)
        start = Canonical(J1, J2 - J1, 0 * J1, theta1, theta2, 0 * J1, 1 + 0 * J1)
        return np.stack(aligned_from_canonical(start, p.alpha0, p.beta0, a))

    def entered(self, theta2: Array) -> Any:
        """Their first crossings by the return map."""
        a = precision(53)
        Qp = np.asarray(self.states(theta2, a))[0]
        return enter(self.setting.level, Qp, np.pi / 2 - self.setting.body.beta0 / 2 - theta2)

    def between(self, ends: Array) -> StartLine:
        """The line between two phases, radians."""
        low, high = np.asarray(self.states(ends, precision(53)))[3:5].T
        e = (high - low) / np.hypot(*(high - low))
        numbers = (*e, e @ (low + high) / 2, e @ (high - low) / 2)
        e1, e2, centre, half = (Fraction(float(x)) for x in numbers)
        return StartLine(self.J1, e1, e2, centre, half)


def line(
    setting: ShiftProblem, J1: Fraction, quads: Sequence[Quad]
) -> tuple[StartLine, tuple[float, float]]:
    """A line of starts that crosses both sets of upward crossings, and its ends in theta2."""
    starts, middle = LineStarts(setting, J1), np.zeros(1)
    for _ in range(ITERATIONS):
        # chi grows with theta2, at about the same rate.
        chi = starts.entered(middle).point.chi
        middle = middle - (np.mod(chi + np.pi, 2 * np.pi) - np.pi)
    upward = [quad for quad in quads if quad.rising]
    reach = OVERSHOOT * max(abs(float(quad.l0 / quad.l1)) for quad in upward)
    ends = middle + np.array([-reach, reach])
    return starts.between(ends), (float(ends[0]), float(ends[1]))


def line_pieces(
    setting: ShiftProblem, of: StartLine, theta2: tuple[float, float]
) -> list[FamilyStep]:
    """Polynomials of the orbits of a line of starts up to their first crossing."""
    a, starts = NUMBERS, LineStarts(setting, of.J1)
    u = nodes(setting.nodes[1], a)
    goal = a.number(of.centre) + a.number(of.half) * u
    phase = (theta2[0] + theta2[1]) / 2 + (theta2[1] - theta2[0]) / 2 * u
    for _ in range(STEADY):
        begin = starts.states(phase, a)
        off = a.number(of.e1) * begin[3] + a.number(of.e2) * begin[4] - goal
        # gamma is a unit vector nearly across M, which theta2 turns: e.gamma grows like theta2.
        phase = phase - off
    times = np.asarray(starts.entered(a.floats(phase)).time)
    return _pieces(_Orbits(setting, begin), times, u, 0 * u, setting.bits - LINE_BITS)
