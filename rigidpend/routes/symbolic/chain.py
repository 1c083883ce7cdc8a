"""Chains of passages: all crossings of an orbit with a given address, found at once.

In a passage an orbit keeps the invariant I of a periodic orbit, while its angle grows by
-ln|I|/Lambda(I). A passage is therefore given by the angles a and b at its ends: I follows from
b - a and the symbol, and the crossings follow from the inverse charts. Where two passages meet,
their chi and d must agree. These equations couple a passage to its neighbours only, so that a step
of Newton's method for all of them solves a system with five diagonals, and no error grows along the
orbit as it does in integration.

As a check, each passage of a chain is integrated alone, by the full equations in doubles, or in
pairs of them where tables count d from midlines.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import solve_banded

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers import Array, Numbers, Scalar
from rigidpend.numbers.exact import GUARD_BITS, fraction
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Orbits
from rigidpend.orbits.integrate.arithmetic import DEFAULT_ENGINE, FINEST_TOLERANCE, PAIRS
from rigidpend.orbits.precision import Precision, precision
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.orbits.return_map.poincare import section_point, section_state
from rigidpend.orbits.return_map.reduced import Coefficients, coefficients
from rigidpend.routes.symbolic.address import cells_of
from rigidpend.routes.symbolic.levels import (
    Arrival,
    ChainLevel,
    Mask,
    PassageEnds,
    Signs,
    each_alone,
)

MOST_ITERATIONS = 24
"""Largest number of Newton's iterations; 1,100 chains of four bodies took 18 at most."""
SOON, NEAR = 10, 0.1
"""Number of iterations of which one must have a correction of less than `NEAR`, radians.

So it was with all that converged later, and with one in 60 of the others."""
ROUNDS = 2
"""Iterations of a guess, each of which leaves about mu/h0 of the error."""
LONGEST_STEP = 0.5
"""Largest change of an angle in one iteration, radians."""
SETTLED = 1e-9
"""Size of the last correction, radians or widths of tables: the error left is about its square."""
ROUGHEST = 1e-6
"""Size below which a correction that is no smaller than the one before counts as rounding.

Where surfaces are split little, roundings displace crossings by more: :func:`displaced`."""
MOVED = 1e-3
"""Largest displacement of a crossing by roundings with which an orbit counts as found, radians."""
TOLD = 10
"""Least |I|, in units of its error in doubles, from which Newton's method is taken to converge.

With long passages of three bodies it converged from 8.5 on, and mostly not below."""
ANGLES = 8.0
"""Size of an angle, radians, whose rounding displaces a crossing as much as those of the tables."""
EARLY = 1e-3
"""Time t' below which a zero of M3 is the crossing from which the orbit starts."""
ROUNDED = 2.0**-51
"""Relative rounding error of a passage's time, for the crossings at its ends are doubles too."""
LONGEST_WAIT = 4.0
"""Longest wait for a crossing, in times of the longest passage."""


class NoOrbit(ArithmeticError):
    """Error: no orbit has the address in the range of the map; the message gives the reason."""


class Blurred(NoOrbit):
    """Error: roundings of the map's tables displace an orbit by too much."""


def on_surface(b: Any, I: float = 0.0) -> Arrival:
    """The arrival of an orbit on the unstable surface of the lower periodic orbit, or beside it.

    The parameter is the angle b itself, radians; I is 0 on the surface.
    """
    return Arrival(I, b, 0.0, 1.0)


class Chain(NamedTuple):
    """An orbit of a level through n passages, with its n + 1 crossings.

    For N orbits side by side all arrays have a further last axis, and numbers are arrays (N,). The
    angles at the beginning (a) and at the end of each passage (b) are in radians, (n,) each; an
    orbit that ends on a stable surface has one more a.
    """

    level: ChainLevel
    parameter: Any
    """The parameter of the :class:`Arrival`; of no meaning for a closed orbit."""
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
    """Largest gap where two passages meet, in chi (radians) or d (units of the tables' width)."""

    @property
    def cells(self) -> Signs:
        """(n + 1,) the multiples of pi to which chi is nearest."""
        return cells_of(self.chi)

    @property
    def split(self) -> float:
        """The least splitting, as |I|, of the surfaces where the orbit changes sides."""
        return self.level.narrowest(np.sign(self.I))

    @property
    def off_middle(self) -> Array:
        """(n + 1,) distances of the crossings from the middles of their cells, half rotations."""
        return np.abs(self.chi / np.pi - self.cells)

    @property
    def unknowns(self) -> Array:
        """The unknowns of a :class:`System` in their order: a guess for another system."""
        x = np.empty((1 + len(self.a) + len(self.b), *self.a.shape[1:]))
        x[0], x[1::2], x[2::2] = self.parameter, self.a, self.b
        return x

    def in_cells(self, cells: Signs) -> Chain:
        """The chain itself; NoOrbit is raised if a crossing lies in another cell."""
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
    """True and False by turns, n in all, with the axes of `like` so that they broadcast with it.

    True stands for an upward crossing, or for a passage past the upper orbit.
    """
    return (np.arange(n) % 2 == 0).reshape(-1, *[1] * (np.ndim(like) - 1))


class System(NamedTuple):
    """The equations of a chain at one energy, open or closed.

    Chains with equally many passages may be solved side by side, each in a column of all arrays.
    The unknowns are that of the arrival, then a and b of each passage in turn.
    """

    level: ChainLevel
    begin: Callable[[Any], Arrival] | None
    """The passage before the first; None for a closed orbit, where it is the last one."""
    signs: Signs
    """(n,) or (n, N), the signs of I."""
    last_chi: float | None = None
    """chi of the last crossing, radians; None for an orbit that ends on a stable surface.

    For a closed orbit it is the growth of chi over the whole orbit."""
    longer: float = 0.0
    """Radians by which the angle grows further in each passage, which makes |I| smaller.

    Passages that are long enough do not disturb each other."""

    def guess(self, angles: Array, parameter: Any) -> Array:
        """The unknowns of a chain whose crossings lie at chi = `angles`, radians, (n + 1,).

        Only their d has gaps; that of the arrival is given. NoOrbit is raised where a passage is so
        long that its |I| is below all doubles.
        """
        n = len(self.signs)
        half_turns = float(np.diff(angles, axis=0).max(initial=0.0)) / math.pi
        if self.level.invariant(half_turns) < np.finfo(float).tiny:
            raise NoOrbit(
                f"|I| of a passage with {half_turns:.0f} half rotations is below all doubles: take"
                " fewer"
            )
        x = np.empty((1 + 2 * n + (self.last_chi is None), *angles.shape[1:]))
        a, b = x[1::2], x[2::2]
        rising, upper = alternating(len(a), angles), alternating(n, angles)
        x[0], a[:], b[:] = parameter, angles[: len(a)], angles[1:]
        I = np.zeros_like(a)
        # A crossing's chi is its angle plus a small function of the angle and I.
        for _ in range(ROUNDS):
            I[:n], _ = self.level.invariants(self.signs, b - a[:n])
            a += angles[: len(a)] - self.level.crossings(rising, rising, I, a).chi
            b += angles[1:] - self.level.crossings(~upper, upper, I[:n], b).chi
        return x

    def evaluated(self, x: Array) -> tuple[Array, Array, Chain]:
        """The gaps where passages meet, their derivatives, and the chain.

        The gaps (2, m, ...) are those of chi and of d at each of the m crossings. The derivatives
        (2, 4, m, ...) are those in a and b of the passage before the crossing, then of the passage
        behind it; before the first crossing of an open chain, the arrival's parameter takes the
        place of b.
        """
        a, b, n, level = x[1::2], x[2::2], len(self.signs), self.level
        I, slope = level.invariants(self.signs, b - a[:n] + self.longer)
        # The passage before each crossing, in rows: I, b, dI/da, dI/db, db/db.
        before = np.stack((I, b, -slope, slope, np.ones_like(b)))
        if self.begin is None:
            before = np.roll(before, 1, axis=1)
        else:
            # The arrival depends on one parameter alone, which takes the place of b.
            I_0, b_0, I_slope, b_slope = self.begin(x[0])
            *first, _ = np.broadcast_arrays(I_0, b_0, 0.0, I_slope, b_slope, x[0])
            before = np.concatenate((np.array(first)[:, None], before), axis=1)
        # The passage behind each crossing: I, a, dI/db. Behind the last crossing of an open chain I
        # is 0: the orbit ends there, or lies on a stable surface.
        behind = np.zeros((3, *before.shape[1:]))
        behind[0, :n], behind[1, : len(a)], behind[2, :n] = I, a, slope
        upper = alternating(before.shape[1], a)
        pairs = (np.stack((before[k], behind[k])) for k in (0, 1))
        # Each crossing twice: at[0] from the passage before, at[1] from the passage behind.
        at = level.crossings(upper, np.stack((~upper, upper)), *pairs)
        left, by = self._left(at, before[2:], behind[2])
        turned, constant = (np.roll(y[0], -1, 0)[:n] - y[1, :n] for y in (at.chi, at.constant))
        time = level.rates(I).rotation * turned - constant
        # The first crossing of a closed orbit is also the end of its last passage, where chi is
        # larger by all of its growth.
        chi, d = (
            np.append(y[1], y[0, :1], axis=0) if self.begin is None else y[0]
            for y in (at.chi, at.d)
        )
        residual = np.abs(left).max(axis=(0, 1))
        return left, by, Chain(level, x[0], a, b, I, chi, d, time, residual)

    def _left(self, at: PassageEnds, before: Array, slope: Array) -> tuple[Array, Array]:
        """The gaps (2, m, ...) between the two sides of each crossing, and their derivatives."""
        # d is measured in the tables' width, so that both gaps are of the order of one.
        units = 1.0, self.level.widest_d
        left = np.array([(y[0] - y[1]) / unit for y, unit in zip(at[:2], units, strict=True)])
        by = np.empty((2, 4, *slope.shape))
        # Chain rule: I depends on b - a, so that dI/da = -dI/db; the second side is subtracted.
        for part, (I_by, angle_by) in enumerate((at.chi_by, at.d_by)):
            by[part, 0] = I_by[0] * before[0]
            by[part, 1] = I_by[0] * before[1] + angle_by[0] * before[2]
            by[part, 2] = I_by[1] * slope - angle_by[1]
            by[part, 3] = -I_by[1] * slope
        by[1] /= self.level.widest_d
        if self.begin is None:
            left[0, 0] -= self.last_chi
        elif self.last_chi is not None:
            # The last crossing has one equation only, its chi: d is free.
            left[0, -1], left[1, -1] = at.chi[0, -1] - self.last_chi, 0.0
            by[1, :, -1] = 0.0
        return left, by

    def corrections(self, left: Array, by: Array) -> Array:
        """Newton's corrections of the unknowns, from the gaps and derivatives of :meth:`evaluated`.

        LinAlgError is raised where the system is singular.
        """
        m = left.shape[1]
        # Two rows for each crossing, chi and d; four columns, in the order of the unknowns.
        rows, places = np.concatenate(np.swapaxes(left, 0, 1)), np.ndindex(2, 4)
        if self.begin is None:
            # The last passage is also the one before the first: columns wrap around, and the system
            # has no band. Words are short, so that a dense one serves.
            matrix, first = np.zeros((2 * m, 2 * m)), 2 * np.arange(m)
            for part, k in places:
                matrix[first + part, (first + k - 2) % (2 * m)] = by[part, k]
            # A closed orbit has no arrival, whose parameter stays as it is.
            return np.append(0.0, np.linalg.solve(matrix, rows))
        # LAPACK's banded storage: the entry of row i and column j is at [2 + i - j, j]. Crossing c
        # has the rows 2c and 2c + 1, and the unknowns from 2c - 1 to 2c + 2. A further column in
        # front belongs to the unknown -1, which does not exist; its entries are dropped.
        bands = np.zeros((5, 2 * m + 2, *left.shape[2:]))
        for part, k in places:
            bands[3 + part - k, k : k + 2 * m : 2] = by[part, k]
        right = rows[: 2 * m - (self.last_chi is not None)].T
        # Chains side by side are blocks of one matrix: entries that would leave a block are 0.
        blocks = np.swapaxes(bands[:, 1 : 1 + right.shape[-1]], 1, -1).reshape(5, -1)
        found = solve_banded((2, 2), blocks, right.ravel(), check_finite=False)
        return np.asarray(found.reshape(right.shape).T)

    def along_surfaces(self, x: Array, moved: Array, off: Numbers) -> tuple[Any, Numbers]:
        """Corrections by which the passages of a chain come to meet, in numbers of any precision.

        `x` are the unknowns of the chain; `moved`, (m,), are changes of chi since at its crossings
        and `off`, (m, 2), the gaps in d and chi that integration finds at them. The results are
        to be added: a correction of the parameter, and those of d and chi, (n, 2), where passages
        begin.
        """
        n, size = len(self.signs), np.abs(off).max()
        units = np.array([self.level.widest_d, 1.0])

        def derivatives(begun: Array, ended: Array) -> Array:
            """Those of the gaps, where passages begin and end elsewhere by so much, (m,)."""
            at = x.copy()
            at[0] += ended[0]
            at[1::2] += begun[:n]
            at[2::2] += np.roll(ended, -1)[:n]
            return self.evaluated(at)[1]

        # Scaled to the size of one: gaps far below a double's range keep their digits. Gaps and
        # corrections lie along the surfaces, whose curvature may bend them apart by more than what
        # splits the surfaces. So derivatives are those in the middle of either.
        by = derivatives(moved, moved + (off[:, 1] / 2).astype(float))
        first, *others = self.corrections(((off / size).astype(float) / units).T[::-1], by)
        angles = np.reshape(others, (n, 2))
        halfway = moved.copy()
        halfway[:n] -= (angles[:, 0] * size / 2).astype(float)
        by = derivatives(halfway, halfway)[::-1, 2:, :n]
        return -first * size, np.einsum("ijn,nj->ni", by, angles) * units * size

    def solved(self, x: Array) -> Chain:
        """The chain, by Newton's method from a guess.

        NoOrbit is raised where the iteration does not settle, or leaves the tables.
        """
        before, least, split = math.inf, math.inf, self.level.narrowest(self.signs)
        for k in range(MOST_ITERATIONS):
            left, by, _ = self.evaluated(x)
            try:
                step = self.corrections(left, by)
            except np.linalg.LinAlgError:
                # Singular, as at a fold: this is reported like an iteration that does not settle.
                break
            size = float(np.abs(step).max())
            least = min(least, size)
            if not np.isfinite(size) or (k + 1 == SOON and least > NEAR):
                break
            # Long steps are shortened: derivatives hold only near the angles where they were taken.
            x = x - step * min(1.0, LONGEST_STEP / max(size, 1e-300))
            # Converged: either the last step was tiny, or steps have stopped to shrink at a size
            # that roundings explain.
            rounding = min(max(ROUGHEST, displaced(self.level, x, split)), MOVED)
            if size < SETTLED or before <= size < rounding:
                made, widest = self.evaluated(x)[2], self.level.widest_I
                # `invariants` cuts I off at the tables' end, and the solution would be a wrong one.
                at = np.argwhere(np.abs(made.I) >= widest)
                if at.size:
                    needed = f"passage {at[0, 0] + 1} would need |I| above {widest:.3g}"
                    raise NoOrbit(f"{needed}, where the tables of the return map end")
                return made
            before = size
        check_split(self.level, split, x)
        raise NoOrbit("Newton's method does not converge")


def displaced(level: ChainLevel, x: Any, split: float) -> float:
    """Largest displacement of crossings by roundings of the tables and of the angles `x`, radians.

    `split` is the least splitting, as |I|, of the surfaces where the orbits change sides.
    """
    return level.displaced(53, split) * (1 + float(np.abs(x).max()) / ANGLES)


def check_split(level: ChainLevel, split: float, x: Any = 0.0, allowed: float = MOVED) -> None:
    """Raise Blurred where roundings displace orbits by more than `allowed`: see `displaced`."""
    moved = displaced(level, x, split)
    if moved > allowed:
        body, other, where = "nearly symmetric", "a less symmetric body", f"{level.splitting:.1g}"
        # `moved` is inversely proportional to `split`. If the splitting of upward crossings is
        # enough, the downward ones are to blame: they are split little near the Hess case.
        if moved * split <= allowed * level.splitting:
            body, other = "at the Hess case or near it", "a body farther from it"
            where = f"{split:.1g} at downward crossings, where this orbit changes sides"
        raise Blurred(
            f"the body is {body}: its asymptotic surfaces lie so close together (|I| between them"
            f" is at most {where}) that the crossings of an orbit are known only to"
            f" {moved:.1g} rad in double precision, and {allowed:.1g} rad is needed; take {other}"
        )


def check_told(chain: Chain) -> None:
    """Raise Blurred where doubles do not tell a crossing from the surface beside which it lies."""
    level, split = chain.level, chain.split
    k, told = int(np.abs(chain.I).argmin()), displaced(level, chain.unknowns, split) * split
    near = abs(float(chain.I[k]))
    if near < TOLD * told:
        fewer = math.floor(level.half_turns(TOLD * told))
        raise Blurred(
            f"passage {k + 1} takes so long that it passes a surface at |I| = {near:.1g}, which"
            f" doubles tell to {told:.1g}; with {fewer} half rotations or fewer they surely do"
        )


def tangents(chain: Chain) -> Array:
    """Derivatives (n, 3, 2) of d, chi and t' behind each passage in d and chi before it."""
    n = len(chain.b)
    return each_alone(chain.level.map_level, chain.d[:n], chain.chi[:n]).slopes[:, :3]


def carried(slopes: Array, change: Array) -> tuple[Array, Array]:
    """A change (3,) of d, chi and t' at the first crossing, carried on to all others.

    The result is its directions there, (n + 1, 3), and the natural logarithms of the factors by
    which these are to be multiplied, (n + 1,).
    """
    changes, logs = [change], [0.0]
    for slope in slopes:
        # Changes of t' add up. Scaled at every passage, for the product would overflow.
        change = slope @ change[:2] + [0.0, 0.0, change[2]]
        size = np.abs(change).max()
        change = change / size
        changes.append(change)
        logs.append(logs[-1] + math.log(size))
    return np.array(changes), np.array(logs)


def passages(chain: Chain) -> tuple[Mask, Array]:
    """Integrate each passage of a chain alone, from the chain's crossing.

    The results, (n,) each, are True where the passage has the chain's symbol, and the error of the
    chain's time, t': the difference of both times, and the rounding that they may share.
    """
    rising = alternating(len(chain.b), chain.b)
    # States in doubles do not tell what tables that count d from midlines do.
    bits = PAIRS if chain.level.made.design.narrower else 53
    c, states = crossing_states(chain, bits)
    limit = float(chain.time.max()) * LONGEST_WAIT
    found = integrate.crossings(
        Orbits(c, states[:, :-1], 2, limit),
        engine=DEFAULT_ENGINE,
        bits=bits,
        tolerance=FINEST_TOLERANCE[DEFAULT_ENGINE],
        jobs=1,
    )
    # The start lies on M3 = 0 to rounding, and may be found as a crossing itself: so two are asked
    # for.
    behind = np.where(found.time[0] > EARLY, 0, 1), np.arange(len(rising))
    # States are those beside separatrix 2 or 3. I > 0 is symbol 1 past the upper orbit, which
    # follows an upward crossing, and symbol 0 past the lower one.
    pair = np.stack((np.where(rising, 2, 3), found.separatrix[behind]))
    right = symbols(pair)[0] == ((chain.I > 0) == rising)
    return right, np.abs(found.time[behind] - chain.time) + ROUNDED * chain.time


def crossing_states(chain: Chain, bits: int = 53) -> tuple[AlignedCoefficients, Any]:
    """Coefficients, and the aligned components (6, n + 1) at a chain's crossings.

    They are doubles, or Fractions of more than 53 bits.
    """
    level, a = chain.level, precision(bits)
    c = coefficients(level.body.angles(bits + GUARD_BITS), "1", a)
    d, chi = map(a.array, (chain.d, chain.chi))
    states = section_states(level, d, chi, a.number(level.energy), c, a)
    if bits == 53:
        return c.aligned, states
    return AlignedCoefficients(*map(fraction, c.aligned)), np.frompyfunc(fraction, 1, 1)(states)


def section_states(
    level: ChainLevel, d: Any, chi: Any, h: Scalar, c: Coefficients, a: Precision
) -> Any:
    """The aligned components (6, n) at crossings that are upward and downward by turns.

    They lie beside separatrix 2 or 3: the orbit's own crossings, or the mirror images of these. d
    counts as in the tables of the level.
    """
    states = np.empty((6, len(d)), dtype=a.dtype)
    d = d + level.midlines(alternating(len(d), d), chi, h, a)
    for rising in (True, False):
        here = slice(0 if rising else 1, None, 2)
        states[:, here] = section_state(rising, d[here], chi[here], h, c, a)
    return states


def section_points(
    level: ChainLevel, states: Numbers, h: Scalar, c: Coefficients, a: Precision
) -> SectionPoint:
    """Points of the section from aligned components (6, N): the inverse of section_states.

    `rising` is an array (N,) too, and chi lies in (-pi, pi].
    """
    # Of Qp and Qm the larger one is Qp beside separatrices 2 and 4, where orbits rise.
    rising = np.abs(states[0]) > np.abs(states[1])
    d, chi, _ = section_point(rising, states, c, a)
    return SectionPoint(rising, d - level.midlines(rising, chi, h, a), chi)
