"""Chains of small sets along one orbit: a passage stretches each of them across the next.

Nothing here is proven, as in :mod:`rigidpend.routes.certified.horseshoe`. The orbit is found in
doubles by the return map. A set is a parallelogram about a crossing: two sides lie along the
direction that the passages before have stretched, two along the one that the passages to come
shrink. It is so small that passages, which depend on the logarithm of the distance from the stable
surface, have short polynomials. Angles are in radians; times are t', dimensionless.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.numbers import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.certified.coverings import prove_cones, prove_link, relation
from rigidpend.routes.certified.family_orbits import pieces
from rigidpend.routes.certified.horseshoe import OVERSHOOT, ShiftProblem
from rigidpend.routes.certified.passages import arrival
from rigidpend.routes.certified.proof_data import (
    FamilyStep,
    Followed,
    Quad,
    Source,
    StartLine,
    Undecided,
    quad_from,
)
from rigidpend.routes.certified.start_lines import SPREAD_FACTOR, LineStarts, line_pieces
from rigidpend.routes.symbolic.levels import each_alone

SHARE, WIDE = 1 / 2000, 1e-4
"""Largest half-width of a set, over its distance from the stable surface, and in gamma3."""
OVER, WIDTH, REACH = 3.0, 2.0, 1.5
"""Three ratios that sets are made by.

The least length of an image over that of the set it crosses, the width of a set over that of the
image in it, and the length of the line's image over that of the first set."""
STEP = 1e-5
"""Step of a difference in theta2_0, radians."""
SPARE_BITS, OF_LINE, GROWTH, MOST_BITS = 11, 4, 1.9, 100
"""Numbers that bits of coefficients follow from.

Bits beyond those of the next set's size, further ones of a line, bits by which a bound grows while
the unstable direction grows by e, and the most bits."""
MORE_BITS = 0, 6, 14
"""Bits beyond the expected ones with which polynomials are tried, one after the other."""


class OrbitCrossings(NamedTuple):
    """The crossings of an orbit by the return map, and its initial phase, radians."""

    theta2: float
    d: Array
    chi: Array


class Link(NamedTuple):
    """A set along an orbit, or the line of starts before the sets, and how its orbits are found."""

    start: Source
    setting: ShiftProblem
    turned: bool = False
    """True if chi of a set is nearer to pi than to 0."""
    theta2: tuple[float, float] = (0.0, 0.0)
    """The ends of a line in theta2, radians."""

    def pieces(self, more: int = 0) -> list[FamilyStep]:
        """Polynomials of the link's orbits, with `more` bits than expected."""
        setting = self.setting._replace(bits=self.setting.bits + more)
        if isinstance(self.start, StartLine):
            return line_pieces(setting, self.start, self.theta2)
        return pieces(setting, self.start, self.turned)


class _Frame(NamedTuple):
    """Coordinates about the crossings of an orbit: distances in d from two lines through each.

    Crossing k is upward if k is even.
    """

    d: Array
    chi: Array
    along: Array
    """Slopes dd/dg, g = gamma3, of the direction that is stretched up to a crossing."""
    shrunk: Array
    """Slopes dd/dg of the direction that shrinks from a crossing on."""

    @property
    def g(self) -> Array:
        """The component gamma3 of each crossing."""
        return -np.sin(self.chi)

    def off(self, k: int, point: SectionPoint) -> tuple[Array, Array]:
        """Distances x and y in d of points from the shrinking line and from the stretched one."""
        apart = -np.sin(point.chi) - self.g[k]
        x, y = (point.d - self.d[k] - slope[k] * apart for slope in (self.shrunk, self.along))
        return x, y

    def turned(self, k: int) -> bool:
        """True if chi of a crossing is nearer to pi than to 0."""
        return math.cos(self.chi[k]) < 0

    def points(self, k: int, x: Array, y: Array) -> SectionPoint:
        """The points with distances x and y from the two lines, the inverse of :meth:`off`."""
        # Subtracted, the two equations of `off` leave gamma3, which tells chi but for its branch.
        away = (x - y) / (self.along[k] - self.shrunk[k])
        chi = np.arcsin(-self.g[k] - away)
        d = self.d[k] + self.shrunk[k] * away + x
        return SectionPoint(k % 2 == 0, d, np.pi - chi if self.turned(k) else chi)

    def stretch(self, k: int, by_g: Array, slope: Array) -> float:
        """The factor by which a passage multiplies the distance from the line that shrinks.

        `by_g` are dchi/dg at both crossings, `slope` the derivatives of the passage in d and chi.
        """
        # A unit of that distance along the stretched line: the passage takes it to (d, chi).
        g = 1 / (self.along[k] - self.shrunk[k])
        d, chi = slope @ np.array([1 + self.shrunk[k] * g, by_g[0] * g])
        return abs(float(d - self.shrunk[k + 1] * chi / by_g[1]))

    def quad(self, k: int, a: float, b: float) -> Quad:
        """The set about crossing k with |x| <= a and |y| <= b."""
        lean = self.along[k] - self.shrunk[k]
        curve = self.d[k] - self.shrunk[k] * self.g[k], self.shrunk[k]
        return quad_from(k % 2 == 0, (a, b, -lean * self.g[k], lean), [curve])

    def wide(self, k: int) -> float:
        """The distance of the two lines where gamma3 has changed by all that is left up to 1."""
        return abs(self.along[k] - self.shrunk[k]) * (1 - abs(self.g[k]))


def links(
    setting: ShiftProblem, J1: Fraction, orbit: OrbitCrossings, ahead: Sequence[Quad] = ()
) -> list[Link]:
    """A line of starts, and a set about each crossing of an orbit but the last.

    The image of the last set reaches across the sets `ahead` of its section, if there are any: the
    orbit's end lies between them.
    """
    level, starts, n = setting.level, LineStarts(setting, J1), len(orbit.d) - 1
    passed = each_alone(level, orbit.d[:n], orbit.chi[:n])
    # Derivatives of (d, chi) after each passage in those before; times of passages, t'.
    slopes, time = passed.slopes[:, :2], passed.time
    # The direction of the line's image at the first crossing, by a difference.
    beside = starts.entered(orbit.theta2 + STEP * np.array([-1.0, 1.0])).point
    begun = np.array([np.diff(beside.d)[0], math.remainder(np.diff(beside.chi)[0], 2 * math.pi)])
    # dchi/dg, as g = -sin(chi).
    by_g = -1 / np.cos(orbit.chi[:n])
    frame = _Frame(orbit.d, orbit.chi, *(by_g * each for each in _directions(slopes, begun)))
    # chi' depends on the logarithm of the distance from the stable surface: dchi'/dd is
    # 1/(exponent * distance).
    away = 1 / (float(level.exponent[0, 0]) * np.abs(slopes[:, 1, 0]))
    most = [min(SHARE * float(away[k]), WIDE * frame.wide(k)) for k in range(n)]
    end = LOOSE * setting.momentum
    if ahead := [quad for quad in ahead if quad.rising == (n % 2 == 0)]:
        reach = max(float((abs(quad.l0) + quad.a + quad.b) / abs(quad.l1)) for quad in ahead)
        # dchi'/dd of the last passage turns the reach at its end into a width at its beginning;
        # sets before it need be no larger than that they cover the next ones.
        most[-1] = OVERSHOOT * reach / abs(float(slopes[-1, 1, 0]))
        for k in range(n - 2, -1, -1):
            most[k] = OVER * most[k + 1] / frame.stretch(k, by_g[k : k + 2], slopes[k])
        end = min(float(quad.b) for quad in ahead)
    # The line is so long that its image crosses the first set, which is as wide as that image.
    rate = abs(begun[0] - frame.shrunk[0] * begun[1] / by_g[0]) / (2 * STEP)
    ends = orbit.theta2 + REACH * most[0] / rate * np.array([-1.0, 1.0])
    on = np.linspace(ends[0], ends[1], 5)
    reached, off = starts.entered(on), starts.energies(on) - float(setting.shift)
    setting = setting._replace(spread=Fraction(SPREAD_FACTOR * float(np.abs(off).max())))
    starts = starts._replace(setting=setting)
    # Each set is so short, a, that the image of the one before crosses it, and so wide, b, that
    # the image lies within: both follow from corners and edges of the one before.
    a, (_, y) = most[0], frame.off(0, reached.point)
    b = max(WIDTH * float(np.abs(y).max()), a)
    fine = _fine(setting, b / 2**OF_LINE, float(reached.time.max()), (SHARE, 0.0), SHARE)
    found = [Link(starts.between(ends)[0], fine, theta2=(float(ends[0]), float(ends[1])))]
    u, v = (each.ravel() for each in np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]))
    for k in range(n):
        quad, wide, least = frame.quad(k, a, b), (a / frame.wide(k), b / frame.wide(k)), end
        share = max(SHARE, a / float(away[k]))
        if k < n - 1:
            x, y = frame.off(k + 1, level.passage(frame.points(k, a * u, b * v)).point)
            a = min(most[k + 1], float(np.abs(x[u != 0]).min()) / OVER)
            b = max(WIDTH * float(np.abs(y).max()), a)
            least = a
        found.append(Link(quad, _fine(setting, least, time[k], wide, share), frame.turned(k)))
    return found


LOOSE = 2.0**-12
"""Share of the momentum to which the last passage's end is known: only its symbol is to be told."""


def linked(part: Sequence[Link | None]) -> list[list[FamilyStep]]:
    """Polynomials of the orbits of all links but the last one, proven to cover the next ones.

    None behind the links lets the one before it go anywhere. Undecided where none of the tried
    numbers of bits is enough.
    """
    found = list[list[FamilyStep]]()
    after = (last.start, last.pieces()) if (last := part[-1]) else None
    # From the last one on, as the proof of a link takes the polynomials of the next (C6).
    for link in part[-2::-1]:
        assert link is not None
        found.insert(0, _proven(link, after))
        after = link.start, found[0]
    return found


def across(link: Link, quads: Sequence[Quad]) -> tuple[Link, list[FamilyStep]]:
    """A line of starts, with its strip if that stretches across all upward sets, and polynomials.

    Only Theorem 8 needs the strip; the line alone still proves Theorems 2 and 3.
    """
    if not isinstance(link.start, StartLine) or not link.start.wide:
        return link, link.pieces()
    try:
        found = link.pieces()
        end = arrival(link.setting.numbers, link.start, found)
        prove_cones(relation(end, quad, end.box, k) for k, quad in enumerate(quads) if quad.rising)
    except ArithmeticError:
        # Beside starts of a small J1 the strip has orbits that never cross.
        link = link._replace(start=link.start._replace(wide=Fraction(0)))
        return link, link.pieces()
    return link, found


def _proven(link: Link, after: Followed | None) -> list[FamilyStep]:
    """Polynomials that prove that a link covers the next; Undecided where MORE_BITS do not help."""
    for more in MORE_BITS:
        check_stop()
        found = link.pieces(more)
        try:
            prove_link(link.setting.numbers, (link.start, found), after)
            return found
        except Undecided as doubt:
            reason = doubt
    raise reason


def _fine(
    setting: ShiftProblem, least: float, time: float, wide: tuple[float, float], share: float
) -> ShiftProblem:
    """The setting with bits such that a bound stays below `least`, and nodes in u and v.

    The bound grows for a time, t'. In u and v functions change by the shares `wide` of their scale
    at the beginning, and in u by `share` at the end. Undecided where these series do not converge.
    """
    if not all(x < 1 for x in (*wide, share)):
        raise Undecided("a set along the orbit is too large: the surfaces are split too little")
    # Beside gamma, which is 1 in any units, a large momentum counts as 1.
    end = SPARE_BITS - math.log2(least / max(1.0, setting.momentum))
    bits = min(MOST_BITS, math.ceil(end + GROWTH * setting.rate * time))
    # Each further power in u or v gains as many bits as the share is below 1.
    in_u, in_v = (math.ceil(bits / -math.log2(x)) if x else 1 for x in wide)
    return setting._replace(bits=bits, in_uv=(max(in_u, math.ceil(end / -math.log2(share))), in_v))


def _directions(slopes: Array, begun: Array) -> list[Array]:
    """Slopes dd/dchi of the direction stretched up to each crossing, and of that which shrinks."""
    # Forward, any direction turns to the stretched one; backward, the inverse of each matrix, up to
    # a factor, turns any to the one that shrinks. Directions are scaled, lest they overflow.
    along, shrunk = [begun], [np.array([slopes[-1, 1, 1], -slopes[-1, 1, 0]])]
    for slope in slopes[:-1]:
        along.append(slope @ along[-1] / np.abs(slope @ along[-1]).max())
    for (p, q), (r, s) in slopes[-2::-1]:
        back = np.array([[s, -q], [-r, p]]) @ shrunk[-1]
        shrunk.append(back / np.abs(back).max())
    return [np.array([x / y for x, y in each]) for each in (along, shrunk[::-1])]
