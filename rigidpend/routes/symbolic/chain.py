"""Chains of passages: all crossings of an orbit with a given address, found at once.

In a passage an orbit keeps the invariant I of a periodic orbit, while its angle grows by
-ln|I|/Lambda(I). So a passage is given by the angles a and b at its ends: I follows from b - a
and the symbol, the crossings from the inverse charts. Where two passages meet, chi and d agree.
These equations tie a passage to its neighbours alone, so that Newton's method on all of them is
a sparse system, and no error grows along the orbit as it does in integration.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from rigidpend.numbers.doubles import Array
from rigidpend.orbits.return_map import SectionPoint
from rigidpend.routes.symbolic.tables import Level, PassageEnds, Signs, columns

MOST_ITERATIONS = 12
LONGEST_STEP = 0.5
"""Largest change of an angle in one iteration, radians."""
SETTLED = 1e-9
"""Size of the last correction, radians or widths of tables; its square, below rounding, is left."""


class NoOrbit(ArithmeticError):
    """No orbit has that address in the range of the map; the message gives the reason."""


class Arrival(NamedTuple):
    """The passage before the first crossing, as a function of one unknown."""

    I: float
    b: float
    I_slope: float
    b_slope: float

    def crossing(self, level: Level) -> PassageEnds:
        """The first crossing, an upward one: where that passage ends."""
        return level.arriving(np.array([self.I]), np.array([self.b]))


Begin: TypeAlias = Callable[[float], Arrival]
Places: TypeAlias = NDArray[np.int64] | int


def on_surface(b: float) -> Arrival:
    """The arrival of an orbit on the unstable surface of the lower periodic orbit."""
    return Arrival(0.0, b, 0.0, 1.0)


class Chain(NamedTuple):
    """An orbit through N passages, with its N + 1 crossings."""

    unknown: float
    """Value on which :class:`Arrival` depends."""
    a: Array
    """(N,) radians, or one more: the angle at the beginning of each passage."""
    b: Array
    """(N,) radians: the angle at its end."""
    I: Array
    """(N,) the invariants."""
    chi: Array
    """(N + 1,) radians, whole turns included."""
    d: Array
    """(N + 1,) dimensionless."""
    time: Array
    """(N,) t' of the passages."""
    residual: float
    """Largest disagreement where two passages meet: radians, or shares of the tables' width."""


def signs_of(symbols: Signs) -> Signs:
    """The signs of I: positive for symbol 1 past the upper orbit, and for 0 past the lower."""
    upper = np.arange(len(symbols)) % 2 == 0
    return np.where((np.asarray(symbols) == 1) == upper, 1, -1)


class System(NamedTuple):
    """The equations of a chain at one energy, of an open one or of a closed orbit."""

    level: Level
    begin: Begin | None
    """None for a closed orbit: the passage before the first is the last one."""
    signs: Signs
    """(N,)."""
    last: float | None = None
    """chi of the last crossing, radians; None for an orbit that ends on a stable surface.

    Of a closed orbit it is by how much chi grows in all."""
    longer: float = 0.0
    """Radians by which each passage is made longer, so that no crossing disturbs the next."""

    def guess(self, angles: Array, unknown: float) -> Array:
        """The unknowns of a chain whose crossings lie near chi = `angles`, (N + 1,)."""
        n = len(self.signs)
        upper = np.arange(n + 1) % 2 == 0
        zero = np.zeros(n + 1)
        before = self.level.crossings(~upper[:n], upper[:n], zero[:n], angles[1:])
        after = self.level.crossings(upper, upper, zero, angles)
        a, b = 2 * angles - after.chi, 2 * angles[1:] - before.chi
        x = np.empty(1 + 2 * n + (self.last is None))
        x[0] = unknown
        x[1::2] = a[: len(x[1::2])]
        x[2::2] = b
        return x

    def nearer(self, angles: Array, unknown: float) -> Array:
        """The same for chi = `angles` themselves: with the invariants that these lead to."""
        x, n = self.guess(angles, unknown), len(self.signs)
        upper = np.arange(n) % 2 == 0
        for _ in range(MOST_ITERATIONS):
            a, b = x[1::2], x[2::2]
            I, _ = self.level.invariants(self.signs, b - a[:n])
            a[:n] += angles[:n] - self.level.crossings(upper, upper, I, a[:n]).chi
            b += angles[1:] - self.level.crossings(~upper, upper, I, b).chi
        return x

    def unknowns(self, made: Chain) -> Array:
        """The unknowns of a chain that was found: a guess for another system."""
        x = np.empty(1 + len(made.a) + len(made.b))
        x[0], x[1::2], x[2::2] = made.unknown, made.a, made.b
        return x

    def evaluated(self, x: Array) -> tuple[Array, Any, Chain]:
        """Residuals, the Jacobian as a sparse array, and the chain.

        The last row of a closed orbit's leaves the first unknown alone, which has no part in it.
        """
        a, b, n, level = x[1::2], x[2::2], len(self.signs), self.level
        arrival = self.begin(float(x[0])) if self.begin else None
        I, slope = level.invariants(self.signs, b - a[:n] + self.longer)
        starts, ends = self._crossings(arrival, a, b, I)
        turned = ends.chi[1:] - starts.chi[:n]
        time = starts.constant[:n] - ends.constant[1:] + level.rates(I).rotation * turned
        rows, matrix = self._equations(arrival, slope, starts, ends)
        # Of a closed orbit the first crossing is an end too, but a whole growth of chi later.
        at = ends if arrival else starts
        chi, d = np.append(at.chi[:n], ends.chi[n]), np.append(at.d[:n], ends.d[n])
        residual = float(np.abs(rows).max(initial=0.0))
        return rows, matrix, Chain(float(x[0]), a, b, I, chi, d, time, residual)

    def _crossings(
        self, arrival: Arrival | None, a: Array, b: Array, I: Array
    ) -> tuple[PassageEnds, PassageEnds]:
        """The crossings where passages begin, and those where they end, from the arrival on."""
        n, odd = len(I), np.arange(len(I) + 1) % 2 == 1
        upper = ~odd[: len(a)]
        if arrival is None:
            ends = self.level.crossings(~upper, upper, I, b)
            return self.level.crossings(upper, upper, I, a), columns(ends, np.arange(-1, n))
        both = self.level.crossings(
            np.concatenate((~odd, upper)),
            np.concatenate((odd, upper)),
            np.concatenate(([arrival.I], I, I, np.zeros(len(a) - n))),
            np.concatenate(([arrival.b], b, a)),
        )
        return columns(both, slice(n + 1, None)), columns(both, slice(0, n + 1))

    def _equations(
        self, arrival: Arrival | None, slope: Array, starts: PassageEnds, ends: PassageEnds
    ) -> tuple[Array, Any]:
        n, m, closed = len(slope), len(starts.chi), arrival is None
        size, entries = 1 + n + m, list[Array]()
        rows = np.zeros(size)

        def put(row: Places, column: Places, value: Array | float) -> None:
            each = np.broadcast_arrays(*map(np.atleast_1d, (row, column, value)))
            entries.append(np.array(each, dtype=float))

        k, slopes = np.arange(m), np.append(slope, np.zeros(m - n))
        # Crossings behind a passage, and behind which: of a closed orbit the first has the last.
        reached = k if closed else k[1:]
        behind = (reached - 1) % n
        parts = ((ends.chi, ends.chi_by, starts.chi, starts.chi_by, 1.0),
                 (ends.d, ends.d_by, starts.d, starts.d_by, self.level.unit))  # fmt: skip
        for part, (end, (end_I, end_b), start, (start_I, start_a), unit) in enumerate(parts):
            row = 2 * k + part
            rows[row] = (end[:m] - start) / unit
            put(row, 2 * k + 1, (start_I * slopes - start_a) / unit)
            put(row[:n], 2 * k[:n] + 2, (-start_I * slopes)[:n] / unit)
            in_a = -end_I[1:] * slope
            in_b = end_b[1:] - in_a
            put(row[reached], 2 * behind + 1, in_a[behind] / unit)
            put(row[reached], 2 * behind + 2, in_b[behind] / unit)
            if arrival:
                first = end_I[0] * arrival.I_slope + end_b[0] * arrival.b_slope
                put(row[0], 0, first / unit)
            if part == 0 and m == n and not closed:
                rows[-1] = end[-1] - self.last
                put(2 * n, 2 * n - 1, in_a[-1])
                put(2 * n, 2 * n, in_b[-1])
        if closed:
            rows[0] -= self.last
            put(2 * n, 0, 1.0)
        row, column, value = np.concatenate(entries, axis=1)
        at = row.astype(np.intp), column.astype(np.intp)
        return rows, coo_array((value, at), shape=(size, size)).tocsc()

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
                step = splu(matrix).solve(rows)
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
        at = np.flatnonzero(np.abs(made.I) >= widest)
        if at.size:
            k = int(at[0])
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


def corrections(
    slopes: Array,
    gaps: Array,
    begin: Array | None = None,
    end: tuple[Array, Array] | None = None,
) -> Array:
    """Newton's corrections of d and chi at the crossings of N orbits that pass n times.

    Parameters
    ----------
    slopes : (n, 2, 2, N) array
        Derivatives of the crossings behind passages in those before.
    gaps : (n, 2, N) array
        Where passages lead, less the next crossing: that behind the last is the first one.
    begin : (2, N) array, optional
        Of orbits that do not close, derivatives of the first crossing in what it depends on.
    end : (N,) array and (2, N) array, optional
        What must vanish at their last crossing, and its derivatives.

    Returns
    -------
    (N, 2 n) array, or (N, 2 n + 1) of what the first crossing depends on and the others
    """
    n, N = len(slopes), slopes.shape[-1]
    matrix, off = np.zeros((N, 2 * n, 2 * n + 2)), gaps.reshape(2 * n, N).T
    for k, slope in enumerate(slopes):
        rows = slice(2 * k, 2 * k + 2)
        matrix[:, rows, rows] = np.moveaxis(slope, -1, 0)
        matrix[:, rows, 2 * k + 2 : 2 * k + 4] = -np.eye(2)
    if begin is None or end is None:
        matrix[:, :, :2] += matrix[:, :, -2:]
        matrix = matrix[:, :, :-2]
    else:
        last = np.zeros((N, 1, 2 * n + 2))
        last[:, 0, -2:] = end[1].T
        matrix, off = np.append(matrix, last, axis=1), np.append(off, end[0][:, None], axis=1)
        first = np.einsum("nij,jn->ni", matrix[:, :, :2], begin)
        matrix = np.append(first[..., None], matrix[:, :, 2:], axis=2)
    return np.asarray(-np.linalg.solve(matrix, off[..., None])[..., 0])
