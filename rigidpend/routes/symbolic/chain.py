"""Chains of passages: all crossings of an orbit with a given address, found at once.

In a passage an orbit keeps the invariant I of a periodic orbit, while its angle grows by
-ln|I|/Lambda(I). So a passage is given by the angles a and b at its ends: I follows from b - a
and the symbol, the crossings from the inverse charts. Where two passages meet, chi and d agree.
These equations tie a passage to its neighbours alone, so that Newton's method on all of them is
a sparse system, and no error grows along the orbit as it does in integration.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from rigidpend.numbers.generic import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.levels import Arrival, Level, Mask, PassageEnds, Signs, rows_of

MOST_ITERATIONS = 12
LONGEST_STEP = 0.5
"""Largest change of an angle in one iteration, radians."""
SETTLED = 1e-9
"""Size of the last correction, radians or widths of tables; its square, below rounding, is left."""


class NoOrbit(ArithmeticError):
    """No orbit has that address in the range of the map; the message gives the reason."""


Begin: TypeAlias = Callable[[Any], Arrival]
Places: TypeAlias = Signs | int


def on_surface(b: Any) -> Arrival:
    """The arrival of an orbit on the unstable surface of the lower periodic orbit."""
    return Arrival(0.0, b, 0.0, 1.0)


class Chain(NamedTuple):
    """An orbit through n passages, with its n + 1 crossings.

    Of N orbits side by side all arrays have a last axis more, and numbers are arrays (N,).
    """

    unknown: Any
    """Value on which :class:`Arrival` depends."""
    a: Array
    """(n,) radians, or one more: the angle at the beginning of each passage."""
    b: Array
    """(n,) radians: the angle at its end."""
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


def signs_of(symbols: Any) -> Signs:
    """The signs of I: positive for symbol 1 past the upper orbit, and for 0 past the lower."""
    given = np.asarray(symbols)
    return np.where((given == 1) == alternating(len(given), given), 1, -1)


def alternating(n: int, like: Any) -> Mask:
    """True, False and so on n times, to be held against arrays that have the axes of another."""
    return (np.arange(n) % 2 == 0).reshape(-1, *[1] * (np.ndim(like) - 1))


class System(NamedTuple):
    """The equations of a chain at one energy, of an open one or of a closed orbit.

    Chains with as many passages may be solved side by side, each in a column of all arrays.
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
        n, upper, zero = len(self.signs), alternating(len(angles), angles), np.zeros(1)
        before = self.level.crossings(~upper[:n], upper[:n], zero, angles[1:])
        after = self.level.crossings(upper, upper, zero, angles)
        a, b = 2 * angles - after.chi, 2 * angles[1:] - before.chi
        x = np.empty((1 + 2 * n + (self.last is None), *angles.shape[1:]))
        x[0] = unknown
        x[1::2] = a[: len(x[1::2])]
        x[2::2] = b
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

    def unknowns(self, made: Chain) -> Array:
        """The unknowns of a chain that was found: a guess for another system."""
        x = np.empty((1 + len(made.a) + len(made.b), *made.a.shape[1:]))
        x[0], x[1::2], x[2::2] = made.unknown, made.a, made.b
        return x

    def evaluated(self, x: Array) -> tuple[Array, Any, Chain]:
        """Residuals, the Jacobian as a sparse array, and the chain.

        The last row of a closed orbit's leaves the first unknown alone, which has no part in it.
        """
        a, b, n, level = x[1::2], x[2::2], len(self.signs), self.level
        arrival = self.begin(x[0]) if self.begin else None
        I, slope = level.invariants(self.signs, b - a[:n] + self.longer)
        starts, ends = self._crossings(arrival, a, b, I)
        turned = ends.chi[1:] - starts.chi[:n]
        time = starts.constant[:n] - ends.constant[1:] + level.rates(I).rotation * turned
        rows, matrix = self._equations(arrival, slope, starts, ends)
        # Of a closed orbit the first crossing is an end too, but a whole growth of chi later.
        at = ends if arrival else starts
        chi, d = (np.append(x[:n], y[n:], axis=0) for x, y in ((at.chi, ends.chi), (at.d, ends.d)))
        residual = np.abs(rows).max(axis=0, initial=0.0)
        return rows, matrix, Chain(x[0], a, b, I, chi, d, time, residual)

    def _crossings(
        self, arrival: Arrival | None, a: Array, b: Array, I: Array
    ) -> tuple[PassageEnds, PassageEnds]:
        """The crossings where passages begin, and those where they end, from the arrival on."""
        n, upper = len(I), alternating(len(I) + 1, a)
        if arrival is None:
            ends = self.level.crossings(~upper[:n], upper[:n], I, b)
            starts = self.level.crossings(upper[:n], upper[:n], I, a)
            return starts, rows_of(ends, np.arange(-1, n))
        before = np.broadcast_to(arrival.I, (1, *a.shape[1:]))
        first = np.broadcast_to(arrival.b, (1, *a.shape[1:]))
        both = self.level.crossings(
            np.concatenate((upper, upper[: len(a)])),
            np.concatenate((~upper, upper[: len(a)])),
            np.concatenate((before, I, I, np.zeros_like(a[n:]))),
            np.concatenate((first, b, a)),
        )
        return rows_of(both, slice(n + 1, None)), rows_of(both, slice(0, n + 1))

    def _equations(
        self, arrival: Arrival | None, slope: Array, starts: PassageEnds, ends: PassageEnds
    ) -> tuple[Array, Any]:
        n, m, closed = len(slope), len(starts.chi), arrival is None
        lanes = starts.chi[0].size
        size, entries = 1 + n + m, list[Array]()
        rows = np.zeros((size, *starts.chi.shape[1:]))

        def put(row: Places, column: Places, value: Array) -> None:
            here, there = (np.atleast_1d(x)[:, None] * lanes for x in (row, column))
            given = value if value.ndim > 1 else value[:, None]
            lane = np.arange(lanes)
            each = np.broadcast_arrays(here + lane, there + lane, given)
            entries.append(np.array(each, dtype=float).reshape(3, -1))

        k, slopes = np.arange(m), np.append(slope, np.zeros((m - n, *slope.shape[1:])), axis=0)
        # Crossings behind a passage, and behind which: of a closed orbit the first has the last.
        reached = k if closed else k[1:]
        behind = (reached - 1) % max(n, 1)
        parts = ((ends.chi, ends.chi_by, starts.chi, starts.chi_by, 1.0),
                 (ends.d, ends.d_by, starts.d, starts.d_by, self.level.unit))  # fmt: skip
        for part, (end, (end_I, end_b), start, (start_I, start_a), unit) in enumerate(parts):
            row = 2 * k + part
            rows[row] = (end[:m] - start) / unit
            put(row, 2 * k + 1, (start_I * slopes - start_a) / unit)
            in_a = -end_I[1:] * slope
            in_b = end_b[1:] - in_a
            put(row[:n], 2 * k[:n] + 2, (-start_I * slopes)[:n] / unit)
            put(row[reached], 2 * behind + 1, in_a[behind] / unit)
            put(row[reached], 2 * behind + 2, in_b[behind] / unit)
            if arrival:
                first = end_I[:1] * arrival.I_slope + end_b[:1] * arrival.b_slope
                put(row[0], 0, first / unit)
            if part == 0 and m == n and not closed:
                rows[-1] = end[-1] - self.last
                put(2 * n, 2 * n - 1, in_a[-1:])
                put(2 * n, 2 * n, in_b[-1:])
        if closed:
            rows[0] -= self.last
            put(2 * n, 0, np.ones(1))
        row, column, value = np.concatenate(entries, axis=1)
        at, whole = (row.astype(np.intp), column.astype(np.intp)), (size * lanes,) * 2
        return rows, coo_array((value, at), shape=whole).tocsc()

    def solved(self, x: Array) -> Chain:
        """The chain, by Newton's method from a guess.

        Raises
        ------
        NoOrbit
            The iteration does not settle, or leaves the tables.
        """
        for _ in range(MOST_ITERATIONS):
            rows, matrix, _ = self.evaluated(x)
            try:
                step = splu(matrix).solve(rows.ravel()).reshape(x.shape)
            except RuntimeError:
                # It is singular.
                break
            size = float(np.abs(step).max())
            if not np.isfinite(size):
                break
            x = x - step * min(1.0, LONGEST_STEP / max(size, 1e-300))
            if size < SETTLED:
                return self._checked(self.evaluated(x)[2])
        raise NoOrbit("Newton's method does not settle")

    def _checked(self, made: Chain) -> Chain:
        widest = self.level.widest
        at = np.argwhere(np.abs(made.I) >= widest)
        if at.size:
            k = int(at[0, 0])
            raise NoOrbit(f"passage {k + 1} would need |I| above {widest:.3g}, the tables' end")
        return made


def tangents(level: Level, chain: Chain) -> Array:
    """(n, 3, 2) the derivatives of d, chi and t' behind each passage in d and chi before it."""
    n = len(chain.b)
    found = np.empty((n, 3, 2))
    for rising in (True, False):
        here = slice(0 if rising else 1, n, 2)
        point = SectionPoint(rising, chain.d[:n][here], chain.chi[:n][here])
        if len(point.d):
            passed = level.map_level.passage(point, slopes=True)
            found[here] = np.moveaxis(passed.slopes[:3], -1, 0)
    return found


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


def corrections(slopes: Array, gaps: Array) -> Array:
    """Newton's corrections of d and chi at the crossings of a closed orbit, (2 n,).

    Parameters
    ----------
    slopes : (n, 2, 2) array
        Derivatives of the crossings behind passages in those before.
    gaps : (2 n,) array
        Where passages lead, less the next crossing: that behind the last is the first one.
    """
    n = len(slopes)
    matrix = -np.roll(np.eye(2 * n), 2, axis=1)
    for k, slope in enumerate(slopes):
        rows = slice(2 * k, 2 * k + 2)
        matrix[rows, rows] += slope
    return np.asarray(-np.linalg.solve(matrix, gaps))
