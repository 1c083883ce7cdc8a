"""Sets that passages stretch across each other, and the settings with which a full shift is tried.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.coverings`
decides. On each section the sets lie beside the heteroclinic orbit at chi = 0 or pi, one for each
symbol, on either side of the stable surface of the next periodic orbit. Their distance from it is
such that a passage takes a given number of half rotations. From a line of constant U the passage
ends at one chi; lines of constant V run along the unstable surface. Half rotations and bits follow
from a body and an energy alone. Angles are in radians; M and t' are dimensionless.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.polynomial import polynomial

from rigidpend.mechanics.body import Body
from rigidpend.numbers import Array
from rigidpend.numbers.exact import GUARD_BITS, Exact
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import EnergyLevel, SectionPoint, return_map
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.certified.proof_data import Quad, quad_from
from rigidpend.routes.certified.sections import Numbers

IN_PAIRS = precision(96)
"""Arithmetic of pairs of doubles."""
DEGREE = 4
"""Degree of the curves U = const."""
POINTS = 24
"""Points to which a curve U = const is fitted."""
MOST_ITERATIONS = 60
"""Largest number of iterations of Newton's method."""
SETTLED = 2.0**-32
"""Relative change after which the next iteration would change round-off alone.

Each iteration gains three digits."""
TILT = 0.01
"""Distance in chi at which the angle of the surfaces is taken, radians."""
OVERSHOOT, WIDTH = 1.4, 1.7
"""Reach of an image over the set that it covers, and width of a set over that of images in it."""
IN_TIME, IN_U, IN_V = 40, 5, 11
"""Nodes in time and in both parameters, for coefficients of FEWEST_BITS bits."""
FEWEST_BITS = 60
"""Bits of coefficients at the beginning."""
SENSITIVE = 8.0
"""Change of orbits over the relative change of the energy."""


class ShiftProblem(NamedTuple):
    """A body and its energies, half rotations of a passage, and bits of coefficients."""

    body: Body
    h: Exact
    """Energy of w = 0, physical units, as mu."""
    half_turns: int
    bits: int = FEWEST_BITS
    in_uv: tuple[int, int] | None = None
    """Nodes in both parameters; None for those of the sets of a full shift."""
    spread: Fraction = Fraction(0)
    """The energies are h + spread w, |w| <= 1."""
    h0: Exact | None = None
    """If given, starts have J2_0 = sqrt(2 h0/kappa); else they have the energies h + spread w."""
    lengths: int = 1
    """Number of sets of each symbol on a section: of half_turns, 2 more, 4 more and so on."""
    width: float = WIDTH
    """Width of a set over that of the images in it, larger where images are bent."""
    more: int = 0
    """Bits beyond the expected ones."""

    @property
    def described(self) -> str:
        """Words for the setting, without the body and its energies."""
        wider = ", in wider sets" if self.width > WIDTH else ""
        finer = f", with {self.more} more bits" if self.more else ""
        return f"{self.half_turns} half rotations{wider}{finer}"

    @property
    def shift(self) -> Fraction:
        """The difference h - h0, 0 without an h0."""
        return (self.h - (self.h0 or self.h)).fraction or Fraction(0)

    @property
    def momentum(self) -> float:
        """J2/sqrt(2) of the energy: momenta grow with it in other units, while gamma stays 1."""
        return math.sqrt(float(self.h) / self.body.kappa)

    @property
    def momentum_bits(self) -> int:
        """Binary digits of the momentum before the point, less one: it is about 2^this."""
        return math.floor(math.log2(self.momentum))

    @property
    def numbers(self) -> Numbers:
        """The numbers with which a checker proves, balls."""
        return Numbers.of(self.body, self.h, self.spread, self.h0)

    @property
    def coefficients(self) -> Coefficients:
        """The coefficients of the field, in pairs of doubles."""
        return coefficients(self.body.angles(IN_PAIRS.bits + GUARD_BITS), "1", IN_PAIRS)

    @property
    def level(self) -> EnergyLevel:
        """The return map at the energy h."""
        return self.level_of(0.0)

    def level_of(self, w: float) -> EnergyLevel:
        """The return map at the energy h + spread w."""
        # One map is made for a whole range of energies, so that all of them share its tables.
        ends = self.h, self.h
        if self.h0 is not None:
            ends = self.h0 - self.body.mu, self.h0 + self.body.mu
        elif self.spread:
            ends = self.h - self.spread, self.h + self.spread
        return return_map(self.body, h=ends).at(float(self.h) + w * float(self.spread))

    @property
    def rate(self) -> float:
        """The rate at which orbits beside the periodic ones part, in 1/t'."""
        level = self.level
        return float(level.exponent[0, 0] / level.rotation[0, 0])

    @property
    def half_turn(self) -> float:
        """The time of a half rotation beside the periodic orbits, t'."""
        return math.pi * float(self.level.rotation[0, 0])

    @property
    def faster(self) -> float:
        """The rate at which a bound on a distance grows, less that of the distance, in 1/t'."""
        growth = self.numbers.growth
        return float(growth.rate(arb(self.rate) / growth.saddle, arb(0))) - self.rate

    def with_bits(self, least: float, growth: float) -> ShiftProblem:
        """The setting with bits enough that a bound stays below a distance, physical units.

        `growth` is the logarithm of the factor by which the bound grows.
        """
        # Beside gamma, which is 1 in any units, a distance counts as a share of the momentum.
        bits = SPARE_BITS + (growth - math.log(least / self.momentum)) / math.log(2)
        # Coefficients of momenta below 1 need units that are as much smaller.
        fine = max(0, -self.momentum_bits)
        bits = fine + self.more + min(MOST_BITS, max(FEWEST_BITS, math.ceil(bits)))
        return self._replace(bits=bits)

    @property
    def nodes(self) -> tuple[int, int, int, int]:
        """Numbers of nodes in time, in both parameters of a set, and in the energy."""
        further, in_w = self.bits - FEWEST_BITS, 1
        if self.spread:
            # Bits that each further power of w gains.
            by = -math.log2(SENSITIVE * float(self.spread) / float(self.h))
            in_w = max(2, math.ceil(self.bits / by))
        in_time = math.ceil(IN_TIME * self.bits / FEWEST_BITS)
        return in_time, *(self.in_uv or (IN_U + further // 12, IN_V + further // 6)), in_w


class _Section(NamedTuple):
    """A section beside its heteroclinic point."""

    level: EnergyLevel
    rising: bool
    chi: float
    """The phase chi of that point, radians."""

    def unstable(self, d: Array, chi: Array, *, mirrored: bool = False) -> Array:
        """The unstable coordinate of the passage to come or, mirrored, of the one before.

        `chi` counts from the section's own; it is zero on the stable, or unstable, surface.
        """
        which, turn = (0, 1.0) if self.rising else (1, -1.0)
        side = -turn if mirrored else turn
        phase = side * (self.chi + chi)
        seen = self.level.charts[self.rising].forward.look_up(d, phase, self.level.a)
        return np.asarray(seen[which], dtype=float)

    def surface(self, chi: Array, *, mirrored: bool = False) -> Array:
        """The d of the stable surface or, mirrored, of the unstable one, at each chi."""
        # Newton's method with a difference in place of the derivative.
        d, step = 0 * chi, 1e-3 * float(self.level.charts[self.rising].forward.width)
        for _ in range(MOST_ITERATIONS):
            here = self.unstable(d, chi, mirrored=mirrored)
            slope = (self.unstable(d + step, chi, mirrored=mirrored) - here) / step
            off = here / slope
            d = d - off
            if np.abs(off).max() <= SETTLED * np.abs(d).max():
                break
        return d

    def reaching(self, chi: Array, half_turns: int, beyond: float, side: int) -> Array:
        """The d, on a side of the stable surface, whose passage ends at the phase `beyond`.

        The passage takes `half_turns` half rotations; ArithmeticError where there is none.
        """
        surface, begun = self.surface(chi), 1e-6
        grown = np.full(len(chi), begun)
        rate = float(self.level.exponent[0, 0])
        for _ in range(MOST_ITERATIONS):
            passed = self.level.passage(
                SectionPoint(self.rising, surface + side * grown, self.chi + chi)
            )
            off = chi + passed.turned - math.pi * half_turns - beyond
            # The phase at the end falls by 1/rate as the logarithm of the distance grows by 1.
            # Newton's method in that logarithm; the step is bounded where it begins far away.
            grown = grown * np.exp(np.clip(rate * off, -2.0, 2.0))
            if np.abs(rate * off).max() <= SETTLED:
                break
        if not (passed.inside.all() and np.abs(off).max() < 1e-6):
            said = (
                f"no passages of {half_turns} half rotations begin beside the heteroclinic orbits"
            )
            # It ends where starts are no longer beside the surface, or too near for doubles.
            helps = "more" if grown.max() > begun else "fewer"
            raise ArithmeticError(f"{said}, as far as the return map tells: try {helps}")
        return surface + side * grown


def energies_of(setting: ShiftProblem) -> Array:
    """The values of w at which sets and lines of starts are found, with 0 in the middle."""
    return np.linspace(-1, 1, 3 + setting.nodes[3] // 4 * 2) if setting.spread else np.zeros(1)


def moving(ws: Array, found: Sequence[Any]) -> Array:
    """Coefficients of powers of w, from what is found at some w."""
    return np.array(found) if len(ws) == 1 else polynomial.polyfit(ws, found, len(ws) - 1)


def _sections(setting: ShiftProblem, w: float = 0.0) -> list[_Section]:
    """The sections of upward and of downward crossings at one of the energies."""
    level = setting.level_of(w)
    # After an odd number of half rotations a passage ends at chi = pi.
    return [_Section(level, True, 0.0), _Section(level, False, math.pi * (setting.half_turns % 2))]


def crossing_angles(setting: ShiftProblem) -> list[float]:
    """The angle of the surfaces in (d, chi) at the heteroclinic point of either section."""
    ends, found = np.array([-TILT, TILT]), []
    for section in _sections(setting):
        apart = section.surface(ends, mirrored=True) - section.surface(ends)
        found.append(abs(float(apart[1] - apart[0])) / (2 * TILT))
    return found


def angle_of(setting: ShiftProblem) -> float:
    """The smaller one of both angles, in (d/momentum, chi): it is the same in any units."""
    return min(crossing_angles(setting)) / setting.momentum


def quads(setting: ShiftProblem) -> list[Quad]:
    """The sets: of symbols 0 and 1 of upward crossings, then of downward ones."""
    level = setting.level
    sections, tilts = _sections(setting), crossing_angles(setting)
    zero = np.zeros(1)
    # Distances in d: of sets from the stable surface, and of images from the unstable one. Sets of
    # more half rotations are nearer, so these are the largest ones.
    away, images = [], []
    for section, other in zip(sections, sections[::-1], strict=True):
        begin = section.reaching(zero, setting.half_turns, 0.0, 1)
        away.append(abs(float((begin - section.surface(zero))[0])))
        passed = level.passage(SectionPoint(section.rising, begin, section.chi + zero))
        images.append(abs(float((passed.point.d - other.surface(zero, mirrored=True))[0])))
    found = []
    turns = [setting.half_turns + 2 * k for k in range(setting.lengths)]
    for at, section in enumerate(sections):
        # The image of a set has to reach beyond both sets of the other section. A set has to be
        # wider than the images in it, and long enough to be crossed at the surfaces' angle.
        reach = OVERSHOOT * (away[1 - at] + images[at]) / tilts[1 - at]
        across = setting.width * images[1 - at]
        widest = (away[at] + across) / tilts[at]
        chi = widest * np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        for right, half_turns in itertools.product((False, True), turns):
            side = 1 if right == section.rising else -1
            d, g = section.reaching(chi, half_turns, 0.0, side), -np.sin(section.chi + chi)
            curves = _curves(setting._replace(half_turns=half_turns), at, side, chi)
            edges = [section.reaching(zero, half_turns, end * reach, side)[0] for end in (-1, 1)]
            # V = 0 lies along the unstable surface: the line is the difference of both.
            line = polynomial.polyfit(g, section.surface(chi, mirrored=True) - d, 1)
            if not (a := abs(edges[1] - edges[0]) / 2) > 0:
                said = "the sets are lost in rounding; with fewer half rotations they are larger"
                raise ArithmeticError(said)
            found.append(quad_from(section.rising, (a, across, *line), curves))
    return found


def _curves(setting: ShiftProblem, at: int, side: int, chi: Array) -> Array:
    """Coefficients of the curve U = 0 of a set: a row for each power of w, in powers of gamma3."""
    ws, widest, found = energies_of(setting), np.abs(chi).max(), []
    for w in ws:
        section = _sections(setting, w)[at]
        d, g = section.reaching(chi, setting.half_turns, 0.0, side), -np.sin(section.chi + chi)
        # Fitted in gamma3 over its largest value, where powers are of one size.
        found.append(polynomial.polyfit(g / widest, d, DEGREE) / widest ** np.arange(DEGREE + 1))
    return moving(ws, found)


NARROW = 0.12
"""Largest |gamma3| in sets: polynomials of wider ones would have too many terms."""
WILDEST = 10.0
"""Largest such number that is believed: with far too few half rotations any other may come out."""
TRIALS = 4
"""Numbers of half rotations that are tried, in sets of either width."""
WIDER = 2.2
"""Width of the sets that are tried where those of `WIDTH` prove nothing."""
MORE_BITS = 6
"""Bits beyond the expected ones, with which sets are tried last: a bound may grow faster."""
MOST_TURNS = 100
"""Largest number of half rotations of a passage."""
LEAST_ANGLE = 1e-8
"""Smallest angle of the surfaces: sets beside a smaller one would need more than MOST_BITS."""
SPARE_BITS, MOST_BITS = 18, 80
"""Bits beyond those of a bound's growth and of the distance below which it has to stay, and most.

The latter without further ones. Integration in pairs of doubles knows hardly more; the bound grows
as that distance shrinks."""


def trials(of: ShiftProblem, half_turns: int | None = None) -> Iterator[ShiftProblem]:
    """The settings with which a full shift is tried, fewest half rotations first; one if given.

    MapError or ArithmeticError where there is none; the text says why.
    """
    first = of._replace(half_turns=half_turns or 1)
    if half_turns:
        yield _with_bits(first, quads(first))
        return
    if not (angle := angle_of(first)) > LEAST_ANGLE:
        said = f"the surfaces of the periodic orbits cross at an angle of {angle:.2g}"
        told = f"as far as the return map tells, and of {LEAST_ANGLE:g} or less no sets are tried"
        raise ArithmeticError(f"{said}, {told}")
    least, tried = math.log(1 / angle), 0
    for width, more in ((WIDTH, 0), (WIDER, 0), (WIDTH, MORE_BITS)):
        for setting in _of_width(first._replace(width=width, more=more), least):
            tried += 1
            yield setting
    if not tried:
        raise ArithmeticError(f"with up to {MOST_TURNS} half rotations no sets are small enough")


def _of_width(first: ShiftProblem, least: float) -> Iterator[ShiftProblem]:
    """Settings with sets of one width.

    Over a passage the logarithm of the distance from a surface changes by `least` or more.
    """
    # The logarithm of the distance from the stable surface grows by this in a half rotation.
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
        # The largest |gamma3| in a set; each further half rotation makes it smaller by a factor.
        reach = min(WILDEST, max(float((abs(quad.l0) + quad.b) / abs(quad.l1)) for quad in sets))
        if reach > NARROW:
            n += int(math.log(reach / NARROW) / turn)
            continue
        tried += 1
        yield _with_bits(setting, sets)


def _with_bits(setting: ShiftProblem, sets: list[Quad]) -> ShiftProblem:
    """The setting with bits enough for given sets."""
    # Images of the sets of fewest half rotations are about as far from the unstable surface as
    # these sets are from the stable one; others are nearer by a factor for each half rotation.
    further = 2 * (setting.lengths - 1) * setting.half_turn
    away = min(float(quad.b) for quad in sets) / setting.width * math.exp(-further * setting.rate)
    # Over a passage orbits part by the factor 1/away, the bound on their distance by more.
    growth = setting.faster * (setting.half_turns * setting.half_turn + further)
    return setting.with_bits(away, growth - math.log(away / setting.momentum))
