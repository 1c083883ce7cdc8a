"""Chains of passages: all crossings of an orbit with a given address, found at once.

In a passage an orbit keeps the invariant I of a periodic orbit, while its angle grows by
-ln|I|/Lambda(I). So a passage is given by the angles a and b at its ends: I follows from b - a
and the symbol, the crossings from the inverse charts. Where two passages meet, chi and d agree.
These equations tie a passage to its neighbours alone, so that Newton's method on all of them is
a system of five diagonals, and no error grows along the orbit as it does in integration.

Integration of the full equations, in doubles, holds every passage of a chain alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.linalg import solve_banded

from rigidpend.numbers.generic import Array, Numbers, Scalar
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.arithmetic import DEFAULT_ENGINE, FINEST_TOLERANCE
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import Precision, precision
from rigidpend.orbits.return_map.reduced import Coefficients
from rigidpend.routes.cycle import symbols
from rigidpend.routes.symbolic.address import cells_of
from rigidpend.routes.symbolic.levels import Arrival, Level, Mask, PassageEnds, Signs, each_alone

MOST_ITERATIONS = 12
LONGEST_STEP = 0.5
"""Largest change of an angle in one iteration, radians."""
SETTLED = 1e-9
"""Size of the last correction, radians or widths of tables; its square, below rounding, is left."""
ROUGHEST = 1e-6
"""Size below which a correction that is no smaller than the one before is rounding, or more.

Where surfaces are split little, roundings displace crossings by more: `displaced`."""
MOVED = 1e-3
"""Largest displacement of a crossing by roundings with which an orbit is told, radians."""
ANGLES = 8.0
"""Radians of an angle whose own roundings displace a crossing as much as those of the tables."""
EARLY = 1e-3
"""Time t' below which a zero of M3 is the crossing that an orbit starts from."""
ROUNDED = 2.0**-51
"""Rounding of a passage's time, relative: its crossings, too, are rounded to doubles."""
PATIENCE = 4.0
"""Longest wait, in times of the longest passage."""


class NoOrbit(ArithmeticError):
    """No orbit has that address in the range of the map; the message gives the reason."""


Begin: TypeAlias = Callable[[Any], Arrival]


def on_surface(b: Any, I: float = 0.0) -> Arrival:
    """The arrival of an orbit on the unstable surface of the lower periodic orbit, or beside it."""
    return Arrival(I, b, 0.0, 1.0)


class Chain(NamedTuple):
    """An orbit of a level through n passages, with its n + 1 crossings.

    Of N orbits side by side all arrays have a last axis more, and numbers are arrays (N,). The
    angles at the beginning (a) and at the end of each passage (b) are in radians; a closed orbit
    and one that ends on a surface have one a more.
    """

    level: Level
    unknown: Any
    """Value on which :class:`Arrival` depends."""
    a: Array
    b: Array
    I: Array
    """(n,) the invariants."""
    chi: Array
    """(n + 1,) radians, whole turns included."""
    d: Array
    """(n + 1,) dimensionless."""
    time: Array
    """(n,) t' of the passages."""
    residual: Any
    """Largest disagreement where two passages meet: radians, or shares of the tables' width."""

    @property
    def cells(self) -> Signs:
        """(n + 1,) the multiples of pi to which chi is nearest."""
        return cells_of(self.chi)

    @property
    def split(self) -> float:
        """The least that surfaces are split by where it changes sides."""
        return self.level.narrowest(np.sign(self.I))

    @property
    def off(self) -> Array:
        """(n + 1,) distances of the crossings from the middles of their cells, half rotations."""
        return np.abs(self.chi / np.pi - self.cells)

    @property
    def unknowns(self) -> Array:
        """The unknowns of a :class:`System`: a guess for another system."""
        x = np.empty((1 + len(self.a) + len(self.b), *self.a.shape[1:]))
        x[0], x[1::2], x[2::2] = self.unknown, self.a, self.b
        return x

    def within(self, cells: Signs) -> Chain:
        """The same; NoOrbit if a crossing lies in another cell."""
        wrong = np.flatnonzero(self.cells != cells)
        if wrong.size:
            k = int(wrong[0])
            raise NoOrbit(
                f"the orbit found leaves its address: crossing {k + 1} is "
                f"{abs(self.chi[k] / np.pi - cells[k]):.2f} half rotations from where it should be"
            )
        return self


def signs_of(symbols: Any) -> Signs:
    """The signs of I: positive for symbol 1 past the upper orbit, and for 0 past the lower."""
    given = np.asarray(symbols)
    return np.where((given == 1) == alternating(len(given), given), 1, -1)


def alternating(n: int, like: Any) -> Mask:
    """True, False and so on n times, to be held against arrays that have the axes of another."""
    return (np.arange(n) % 2 == 0).reshape(-1, *[1] * (np.ndim(like) - 1))


class System(NamedTuple):
    """The equations of a chain at one energy, of an open one or of a closed orbit.

    Chains with as many passages may be solved side by side, each in a column of all arrays. The
    unknowns are that of the arrival, then a and b of each passage in turn.
    """

    level: Level
    begin: Begin | None
    """None for a closed orbit: the passage before the first is the last one."""
    signs: Signs
    """(n,) or (n, N)."""
    last: float | None = None
    """chi of the last crossing, radians; None for an orbit that ends on a stable surface.

    Of a closed orbit it is by how much chi grows in all."""
    longer: float = 0.0
    """Radians by which each passage is made longer, so that no crossing disturbs the next."""

    def guess(self, angles: Array, unknown: Any) -> Array:
        """The unknowns of a chain whose crossings lie near chi = `angles`, (n + 1,)."""
        n, upper = len(self.signs), alternating(len(angles), angles)
        before = self.level.crossings(~upper[:n], upper[:n], 0.0, angles[1:])
        after = self.level.crossings(upper, upper, 0.0, angles)
        x = np.empty((1 + 2 * n + (self.last is None), *angles.shape[1:]))
        x[0] = unknown
        x[1::2] = (2 * angles - after.chi)[: len(x[1::2])]
        x[2::2] = 2 * angles[1:] - before.chi
        return x

    def nearer(self, angles: Array, unknown: Any) -> Array:
        """The same for chi = `angles` themselves: with the invariants that these lead to."""
        x, n = self.guess(angles, unknown), len(self.signs)
        upper = alternating(n, angles)
        for _ in range(MOST_ITERATIONS):
            a, b = x[1::2], x[2::2]
            I, _ = self.level.invariants(self.signs, b - a[:n])
            a[:n] += angles[:n] - self.level.crossings(upper, upper, I, a[:n]).chi
            b += angles[1:] - self.level.crossings(~upper, upper, I, b).chi
        return x

    def evaluated(self, x: Array) -> tuple[Array, Array, Chain]:
        """The gaps where passages meet, their derivatives, and the chain.

        At each crossing (2, m, ...) is left, of chi and of d. The derivatives (2, 4, m, ...) are
        those in a and b of the passage before the crossing, then of the passage behind it; before
        the first crossing of an open chain the unknown of its arrival is in the place of b.
        """
        a, b, n, level = x[1::2], x[2::2], len(self.signs), self.level
        I, slope = level.invariants(self.signs, b - a[:n] + self.longer)
        # Of the passage before each crossing: I, b, and their derivatives in a and b, in b.
        before = np.stack((I, b, -slope, slope, np.ones_like(b)))
        if self.begin is None:
            before = np.roll(before, 1, axis=1)
        else:
            I_0, b_0, I_slope, b_slope = self.begin(x[0])
            *first, _ = np.broadcast_arrays(I_0, b_0, 0.0, I_slope, b_slope, x[0])
            before = np.concatenate((np.array(first)[:, None], before), axis=1)
        behind = np.zeros((3, *before.shape[1:]))
        behind[0, :n], behind[1, : len(a)], behind[2, :n] = I, a, slope
        upper = alternating(before.shape[1], a)
        pairs = (np.stack((before[k], behind[k])) for k in (0, 1))
        at = level.crossings(upper, np.stack((~upper, upper)), *pairs)
        left, by = self._left(at, before[2:], behind[2])
        turned, constant = (np.roll(y[0], -1, 0)[:n] - y[1, :n] for y in (at.chi, at.constant))
        time = level.rates(I).rotation * turned - constant
        # Of a closed orbit the first crossing is an end too, but a whole growth of chi later.
        chi, d = (
            np.append(y[1], y[0, :1], axis=0) if self.begin is None else y[0]
            for y in (at.chi, at.d)
        )
        residual = np.abs(left).max(axis=(0, 1))
        return left, by, Chain(level, x[0], a, b, I, chi, d, time, residual)

    def _left(self, at: PassageEnds, before: Array, slope: Array) -> tuple[Array, Array]:
        """The gaps at the ends and beginnings of passages `at`, and their derivatives."""
        units = 1.0, self.level.unit
        left = np.array([(y[0] - y[1]) / unit for y, unit in zip(at[:2], units, strict=True)])
        by = np.empty((2, 4, *slope.shape))
        for part, (I_by, angle_by) in enumerate((at.chi_by, at.d_by)):
            by[part, 0] = I_by[0] * before[0]
            by[part, 1] = I_by[0] * before[1] + angle_by[0] * before[2]
            by[part, 2] = I_by[1] * slope - angle_by[1]
            by[part, 3] = -I_by[1] * slope
        by[1] /= self.level.unit
        if self.begin is None:
            left[0, 0] -= self.last
        elif self.last is not None:
            left[0, -1], left[1, -1] = at.chi[0, -1] - self.last, 0.0
            by[1, :, -1] = 0.0
        return left, by

    def corrections(self, left: Array, by: Array) -> Array:
        """Newton's corrections of the unknowns, from what :meth:`evaluated` gives."""
        m = left.shape[1]
        rows, places = np.concatenate(np.swapaxes(left, 0, 1)), np.ndindex(2, 4)
        if self.begin is None:
            matrix, first = np.zeros((2 * m, 2 * m)), 2 * np.arange(m)
            for part, k in places:
                matrix[first + part, (first + k - 2) % (2 * m)] = by[part, k]
            # The unknown of an arrival has no part in it.
            return np.append(0.0, np.linalg.solve(matrix, rows))
        bands = np.zeros((5, 2 * m + 2, *left.shape[2:]))
        for part, k in places:
            bands[3 + part - k, k : k + 2 * m : 2] = by[part, k]
        right = rows[: 2 * m - (self.last is not None)].T
        # Chains side by side are blocks of one matrix.
        blocks = np.swapaxes(bands[:, 1 : 1 + right.shape[-1]], 1, -1).reshape(5, -1)
        found = solve_banded((2, 2), blocks, right.ravel(), check_finite=False)
        return np.asarray(found.reshape(right.shape).T)

    def solved(self, x: Array) -> Chain:
        """The chain, by Newton's method from a guess.

        NoOrbit is raised where the iteration does not settle, or leaves the tables.
        """
        before, split = math.inf, self.level.narrowest(self.signs)
        for _ in range(MOST_ITERATIONS):
            left, by, _ = self.evaluated(x)
            try:
                step = self.corrections(left, by)
            except np.linalg.LinAlgError:
                # It is singular.
                break
            size = float(np.abs(step).max())
            if not np.isfinite(size):
                break
            x = x - step * min(1.0, LONGEST_STEP / max(size, 1e-300))
            rounding = min(max(ROUGHEST, displaced(self.level, x, split)), MOVED)
            if size < SETTLED or before <= size < rounding:
                made, widest = self.evaluated(x)[2], self.level.widest
                at = np.argwhere(np.abs(made.I) >= widest)
                if at.size:
                    needed = f"passage {at[0, 0] + 1} would need |I| above {widest:.3g}"
                    raise NoOrbit(f"{needed}, the tables' end")
                return made
            before = size
        check_split(self.level, displaced(self.level, x, split), split)
        raise NoOrbit("Newton's method does not settle")


def displaced(level: Level, x: Array, split: float) -> float:
    """Radians by which roundings of tables and of angles `x` displace crossings, at most.

    `split` is the least that surfaces are split by where the orbits change sides.
    """
    return level.displaced(53, split) * (1 + float(np.abs(x).max()) / ANGLES)


def check_split(level: Level, moved: float, split: float, most: float = MOVED) -> None:
    """Raise NoOrbit where roundings displace the orbits of a level by more than `most`, radians."""
    if moved > most:
        body, where = "nearly symmetric", f"{level.splitting:.1g} only"
        other = "a less symmetric body"
        # Upward crossings alone would place it.
        if moved * split <= most * level.splitting:
            body, other = "at the Hess case or near it", "a body farther from it"
            where = f"{split:.1g} at most at downward crossings, where this orbit changes sides"
        raise NoOrbit(
            f"the body is {body}: its surfaces are split by {where}, and doubles place an orbit"
            f" on them within {moved:.1g} rad; take {other}"
        )


def tangents(chain: Chain) -> Array:
    """(n, 3, 2) the derivatives of d, chi and t' behind each passage in d and chi before it."""
    n = len(chain.b)
    return each_alone(chain.level.map_level, chain.d[:n], chain.chi[:n]).slopes[:, :3]


def carried(slopes: Array, change: Array) -> tuple[Array, Array]:
    """A change (3,) of d, chi and t' at the first crossing, carried on to all others.

    Its directions there, (n + 1, 3), and the logarithms of their factors, (n + 1,).
    """
    changes, logs = [change], [0.0]
    for slope in slopes:
        change = slope @ change[:2] + [0.0, 0.0, change[2]]
        size = np.abs(change).max()
        change = change / size
        changes.append(change)
        logs.append(logs[-1] + math.log(size))
    return np.array(changes), np.array(logs)


def passages(chain: Chain) -> tuple[Mask, Array]:
    """Integrate each passage of a chain alone, in doubles: (n,) each.

    True where it has the chain's symbol, and the error of the chain's time, t': their difference,
    and what both may round alike.
    """
    rising = alternating(len(chain.b), chain.b)
    states, limit = crossing_states(chain)[:, :-1], float(chain.time.max()) * PATIENCE
    found = integrate.crossings(
        Orbits(chain.level.c.aligned, states, 2, limit),
        engine=DEFAULT_ENGINE,
        bits=53,
        tolerance=FINEST_TOLERANCE[DEFAULT_ENGINE],
        jobs=1,
    )
    behind = np.where(found.time[0] > EARLY, 0, 1), np.arange(len(rising))
    pair = np.stack((np.where(rising, 2, 3), found.separatrix[behind]))
    right = symbols(pair)[0] == ((chain.I > 0) == rising)
    return right, np.abs(found.time[behind] - chain.time) + ROUNDED * chain.time


def crossing_states(chain: Chain) -> Array:
    """The aligned components (6, n + 1) at a chain's crossings, in doubles."""
    level = chain.level
    return np.asarray(section_states(chain.d, chain.chi, level.h, level.c, precision(53)))


def section_states(d: Any, chi: Any, h: Scalar, c: Coefficients, a: Precision) -> Any:
    """The aligned components (6, n) at crossings that are upward and downward by turns.

    They are those on separatrix 2 or 3, the orbit's own or their mirror images.
    """
    states = np.empty((6, len(d)), dtype=a.dtype)
    for rising in (True, False):
        here = slice(0 if rising else 1, None, 2)
        states[:, here] = section_state(rising, d[here], chi[here], h, c, a)
    return states


def section_points(states: Numbers, c: Coefficients, a: Precision) -> SectionPoint:
    """Points of the section from aligned components (6, N): the inverse of section_state.

    `rising` is an array as well, and chi lies in (-pi, pi].
    """
    rising = np.abs(states[0]) > np.abs(states[1])
    large, small = (np.where(rising, states[k], states[1 - k]) for k in (0, 1))
    # What lies beside separatrix 4 or 1 is described by its mirror image.
    sign = np.where(large < 0, -1, 1)
    M1 = sign * (states[0] + states[1]) * c.to_M1
    M2 = sign * (states[0] - states[1]) * c.to_M2
    cos = (states[4] * M1 - states[3] * M2) / a.sqrt(M1 * M1 + M2 * M2)
    return SectionPoint(rising, sign * small, a.atan2(-sign * states[5], cos))
