"""Sets that passages stretch across each other, and the ways in which a full shift is tried.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.coverings`
decides. The sets lie beside the heteroclinic orbits at chi = 0 or pi, on either side of the stable
surface of the next periodic orbit, with each symbol on each section, so far from it that a passage
takes so many half rotations. Their lines of constant U are those from which the passage ends at one
chi; their lines of constant V run along the unstable surface. Half rotations and bits follow from a
body and an energy alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import GUARD_BITS, Exact
from rigidpend.numbers.generic import Array
from rigidpend.orbits.return_map import EnergyLevel, SectionPoint, return_map
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.certified.pieces import Quad, made

NUMBERS = precision(96)
"""Pairs of doubles."""
DEGREE = 4
"""Degree of the curves U = const."""
POINTS = 24
"""Points through which they are laid."""
ITERATIONS = 60
"""Iterations of Newton's method at most."""
SETTLED = 2.0**-32
"""Relative change after which a further iteration changes roundings: each gains three digits."""
TILT = 0.01
"""Distance in chi at which the angle of the surfaces is taken, radians."""
OVERSHOOT, WIDTH = 1.4, 1.7
"""Reach of images beyond the sets that they cover, and width of a set over that of images in it."""
IN_TIME, IN_U, IN_V = 40, 5, 11
"""Nodes in time and in both parameters, of coefficients of so many bits as BITS is."""
BITS = 60
"""Bits of coefficients at the beginning."""
SENSITIVE = 8.0
"""Change of orbits over the relative change of the energy."""


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
    width: float = WIDTH
    """Width of a set over that of the images in it: images that are bent ask for more."""

    @property
    def described(self) -> str:
        """Words for what is tried, beside the body and its energies."""
        wider = ", in wider sets" if self.width > WIDTH else ""
        return f"{self.half_turns} half rotations{wider}"

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
            off = here / slope
            d = d - off
            if np.abs(off).max() <= SETTLED * np.abs(d).max():
                break
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
            if np.abs(rate * off).max() <= SETTLED:
                break
        if not (passed.inside.all() and np.abs(off).max() < 1e-6):
            said = (
                f"no passages of {half_turns} half rotations begin beside the heteroclinic orbits"
            )
            raise ArithmeticError(f"{said}, as far as the return map tells")
        return surface + side * grown


def energies_of(setting: ShiftProblem) -> Array:
    """Those w at which sets and lines of starts are found, the middle one 0: they move smoothly."""
    return np.linspace(-1, 1, 3 + setting.nodes[3] // 4 * 2) if setting.spread else np.zeros(1)


def moving(ws: Array, found: Sequence[Any]) -> Array:
    """Coefficients of powers of w from values."""
    return np.array(found) if len(ws) == 1 else polynomial.polyfit(ws, found, len(ws) - 1)


def _sections(setting: ShiftProblem, w: float = 0.0) -> list[_Section]:
    level = setting.level_of(w)
    return [_Section(level, True, 0.0), _Section(level, False, math.pi * (setting.half_turns % 2))]


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
        across = setting.width * images[1 - at]
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
    ws, widest, found = energies_of(setting), np.abs(chi).max(), []
    for w in ws:
        section = _sections(setting, w)[at]
        d, g = section.reaching(chi, setting.half_turns, 0.0, side), -np.sin(section.chi + chi)
        found.append(polynomial.polyfit(g / widest, d, DEGREE) / widest ** np.arange(DEGREE + 1))
    return moving(ws, found)


NARROW = 0.12
"""Largest |gamma3| in sets: polynomials of wider ones would have too many terms."""
TRIALS = 4
"""Numbers of half rotations that are tried, in sets of each width."""
WIDER = 2.2
"""Width of sets that are tried where those of `WIDTH` prove nothing."""
MOST_TURNS = 100
"""Half rotations of a passage at most."""
LEAST = 1e-8
"""Angle of the surfaces at least: sets beside a smaller one ask for more than MOST_BITS."""
SPARE, MOST_BITS = 18, 80
"""Bits beyond the square of a set's distance from the stable surface, and bits at most.

Integration in pairs of doubles knows no more; the bound grows as that distance shrinks."""


def trials(of: ShiftProblem, half_turns: int | None = None) -> Iterator[ShiftProblem]:
    """Ways to try a full shift, the fewest half rotations first; one if these are given.

    Where there is none, the text of a MapError or an ArithmeticError says why.
    """
    first = of._replace(half_turns=half_turns or 1)
    if half_turns:
        yield _with_bits(first, quads(first))
        return
    if not (angle := min(angles(first))) > LEAST:
        said = f"the surfaces of the periodic orbits cross at an angle of {angle:.2g}"
        told = f"as far as the return map tells, and of {LEAST:g} or less no sets are tried"
        raise ArithmeticError(f"{said}, {told}")
    least, tried = math.log(1 / angle), 0
    for width in (WIDTH, WIDER):
        for setting in _of_width(first._replace(width=width), least):
            tried += 1
            yield setting
    if not tried:
        raise ArithmeticError(f"with up to {MOST_TURNS} half rotations no sets are small enough")


def _of_width(first: ShiftProblem, least: float) -> Iterator[ShiftProblem]:
    """Ways with sets of one width, whose distance shrinks by e to the power of `least` or more."""
    # A half rotation takes an orbit beside the stable surface so much further from it.
    turn, tried = math.pi * float(first.level.exponent[0, 0]), 0
    n = math.ceil(least / turn)
    while tried < TRIALS and n <= MOST_TURNS:
        setting = first._replace(half_turns=n)
        n += 1
        try:
            sets = quads(setting)
        except ArithmeticError:
            # Too few: such passages begin further from the surface than the map reaches.
            continue
        reach = max(float((abs(quad.l0) + quad.b) / abs(quad.l1)) for quad in sets)
        if reach > NARROW:
            n += int(math.log(reach / NARROW) / turn)
            continue
        tried += 1
        yield _with_bits(setting, sets)


def _with_bits(setting: ShiftProblem, sets: list[Quad]) -> ShiftProblem:
    # Images of sets of few half rotations are as far from a surface as these are from theirs; the
    # others are nearer by a factor for each half rotation.
    further = 2 * (setting.lengths - 1) * math.pi * float(setting.level.exponent[0, 0])
    away = min(float(quad.b) for quad in sets) / setting.width * math.exp(-further)
    return setting._replace(bits=min(MOST_BITS, max(BITS, math.ceil(SPARE - 2 * math.log2(away)))))
