"""Engine `taylor`: many orbits at once, by a compiled kernel (see `kernel`).

A call of the kernel carries many orbits some steps on and notes the steps on which M3 may have been
zero, with their series. Crossings on noted steps are found afterwards; where M3 is monotone the
kernel has found its zero by Newton's method. Then orbits that are done make room for the next. The
kernel never calls Python, so that other threads run beside it: 4,000 orbits take two threads 0.56
of the time of one.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import check_stop, note
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers import Array
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    in_unit,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.arithmetic import bits_of_numbers
from rigidpend.orbits.integrate.kernel import following, taylor_step
from rigidpend.orbits.integrate.kernel.lane_numbers import exactly, in_parts
from rigidpend.orbits.integrate.kernel.machine_code import LANES, lanes_for
from rigidpend.orbits.integrate.step_crossings import (
    UNDECIDED,
    crosses,
    crossings_of_series,
    touch,
    value_at,
)

MOST_STEPS = 2_000_000
"""Steps without a crossing after which an orbit is given up; a passage takes some fifty.

A rotation of a light, nearly symmetric body takes 10.5 to 13.5 of them in doubles, 6.1 to 8.2 in
160 bits."""
TOGETHER = {53: 512, 106: 64, 159: 16, 212: 8, 424: 8}
"""Number of orbits carried at a time, by bits: the kernel then works for 4 ms or more."""
STEPS = {53: 128, 106: 32, 159: 16, 212: 8, 424: 8}
"""Number of steps in a call, by bits; half of them, on average, come after an orbit's end."""
EXPECTED = 50
"""Steps that a passage is expected to take."""
LONGER = 4
"""Divisor: a call takes at least a quarter of the steps for which all orbits have not crossed.

A passage of a nearly symmetric body takes some hundred thousand steps: in calls of 75 steps it took
four times as long."""
COLUMN = np.dtype([("orbit", int), ("count", int), ("silence", int), ("last", float)])
"""Type of a column.

It holds the number of the orbit, the number of its crossings, the number of steps since the last
crossing, and t' of that crossing."""
CONVERGED = 1e-9
"""Newton's last correction, as a share of the step, above which zeros are isolated instead."""


def crossings(orbits: Orbits, bits: int, tolerance: float) -> Crossings:
    """Crossings of orbits, each of which is the same to the last bit whatever the others are.

    This holds among orbits for which `in_unit` takes the same unit of M. `tolerance` is that of the
    Taylor series in 53 bits; every further bit halves it.
    """
    return Batch(orbits, bits, tolerance * 2.0 ** (53 - bits)).run()


def worth_a_thread(bits: int) -> int:
    """The number of orbits from which on a thread of their own works for 10 ms or more."""
    return 256 if bits_of_numbers(bits) == 53 else LANES


class Batch:
    """Orbits of one body that are being followed, a column for each that is not yet done."""

    def __init__(self, orbits: Orbits, bits: int, tolerance: float) -> None:
        self.bits, order = bits, taylor_step.order_of(tolerance)
        self.kind = bits = bits_of_numbers(bits)
        self.unit, c, scaled = in_unit(orbits.coefficients, orbits.states, bits)
        """Unit of M. All times within the batch are in its inverse."""
        limit = orbits.passage_limit * float(self.unit)
        self.orbits = orbits = Orbits(c, scaled, orbits.n_crossings, limit)
        states = np.concatenate(in_parts(orbits.states, bits))
        self.n = states.shape[1]
        self.abreast = lanes_for(self.n)
        self.kernel = following.carrying(order, bits, self.abreast)
        self.width = min(TOGETHER[bits], -(-self.n // self.abreast) * self.abreast)
        self.found, self.seen = no_crossings(orbits.n_crossings, self.n), [np.empty((3, 0))]
        self.parameters = in_parts(orbits.coefficients, bits)
        self.initial = np.concatenate((states, np.zeros((2, self.n))))
        """Columns of all orbits at the start: the parts of the state, and the two of the time."""
        self.rows = np.zeros((len(self.initial), self.width))
        # Views: the kernel changes both in place, and `load` moves whole columns of `rows`.
        self.states, self.times = self.rows[:-2], self.rows[-2:]
        # The same room however few the orbits are: pages that are never written take no memory.
        self.notes = np.empty(STEPS[bits] * TOGETHER[bits], following.note(order, bits))
        self.lanes, self.next = np.zeros(0, COLUMN), 0

    def run(self) -> Crossings:
        """Follow all orbits."""
        self.load()
        while self.lanes.size:
            check_stop()
            number = self.steps
            self.take(crossings_on(self.noted(number), self.bits), number)
            note(self._told)
            self.load(self.ended())
        written(np.hstack(self.seen), self.found, self.orbits.passage_limit)
        self.found.time[:] /= float(self.unit)
        return self.found

    @property
    def steps(self) -> int:
        """Steps for the next call: few if orbits are nearly done, many if none has long crossed."""
        left = int(self.orbits.n_crossings - self.lanes["count"].min())
        silence = int(self.lanes["silence"].min())
        usual = min(STEPS[self.kind], left * EXPECTED // 2)
        # Never more than the notes have room for, should each step of each lane be noted.
        return min(max(usual, silence // LONGER), self.notes.size // self.width)

    def _told(self) -> str:
        """Progress of these orbits, in words."""
        open_ = self.n - self.next + self.lanes.size
        reached = float(self.times[0, : self.lanes.size].max()) / float(self.unit)
        limit = self.orbits.passage_limit / float(self.unit)
        said = f"{open_} of {self.n} orbits under way in {self.bits} bits, at t' = {reached:.4g}"
        return f"{said}; a passage takes {limit:.4g} at most"

    def noted(self, number: int) -> Any:
        """Carry all columns some steps on, and return the notes of steps where M3 may vanish."""
        m = self.lanes.size
        groups = -(-m // self.abreast)
        # Lanes without an orbit repeat the first, whose numbers are harmless; their notes are
        # dropped below.
        self.states[:, m:], self.times[:, m:] = self.states[:, :1], self.times[:, :1]
        given = self.states, self.width, self.times, self.parameters
        count = self.kernel(*given, touch(self.bits), groups, number, self.notes)
        taken = self.notes[:count]
        # Where series overflow nothing is known; `ended` finds the state that is not finite.
        return taken[np.isfinite(taken["after"]) & (taken["lane"] < m)]

    def take(self, found: Array, number: int) -> None:
        """Take in the crossings `found` on a call of so many steps."""
        at, lanes = found[0].astype(np.int64), self.lanes
        self.seen.append(np.array([lanes["orbit"][at], *found[1:]]))
        crossed = np.bincount(at, minlength=lanes.size)
        lanes["count"] += crossed
        lanes["silence"] = np.where(crossed > 0, 0, lanes["silence"] + number)
        np.maximum.at(lanes["last"], at, found[1])
        # After an undecided touch the orbit is not known: it counts as done, and `written` ends it.
        lanes["count"][at[found[2] == UNDECIDED]] = self.orbits.n_crossings

    def ended(self) -> NDArray[np.bool_]:
        """Tell the columns whose orbits are done, and write their outcomes."""
        lanes, outcome = self.lanes, self.found.outcome
        complete = lanes["count"] >= self.orbits.n_crossings
        # All others keep FAILED, which `no_crossings` has set.
        finite = np.isfinite(self.states[:, : lanes.size].sum(axis=0))
        waited = self.times[0, : lanes.size] > lanes["last"] + self.orbits.passage_limit
        late = finite & waited
        given_up = lanes["silence"] >= MOST_STEPS
        outcome[lanes["orbit"][given_up]] = Outcome.TOO_LONG
        outcome[lanes["orbit"][complete]] = Outcome.COMPLETE
        for k in np.flatnonzero(late & ~complete):
            outcome[lanes["orbit"][k]] = silent_outcome(*self.states[:2, k])
        return complete | late | ~finite | given_up

    def load(self, ended: Any = ()) -> None:
        """Remove the columns of orbits that are done, and append those of the next orbits."""
        kept = np.flatnonzero(~np.asarray(ended, dtype=bool))
        new = np.arange(self.next, min(self.n, self.next + self.width - kept.size))
        self.next += new.size
        begun = np.zeros(new.size, COLUMN)
        begun["orbit"] = new
        self.lanes = np.concatenate((self.lanes[kept], begun))
        rows = np.concatenate((self.rows[:, kept], self.initial[:, new]), axis=1)
        self.rows[:, : self.lanes.size] = rows


def written(rows: Array, found: Crossings, limit: float) -> None:
    """Write crossings into a record, from `rows` of orbit, t' and separatrix, (3, m), in any order.

    An orbit ends before an undecided touch, and before a crossing for which it took longer than
    `limit`. Crossings beyond those that the record has room for are dropped.
    """
    # Sorted by orbit, and by time within each orbit.
    columns, times, separatrix = rows[:, np.lexsort((rows[1], rows[0]))]
    columns, separatrix = columns.astype(np.int64), separatrix.astype(np.int64)
    # `searchsorted` tells where each orbit begins: `row` numbers an orbit's crossings from 0.
    row = np.arange(columns.size) - np.searchsorted(columns, columns)
    waited = np.where(row > 0, times - np.roll(times, 1), times)
    ends = (separatrix == UNDECIDED) | (waited > limit)
    n_rows, n = found.time.shape
    # The first row of each orbit that ends it; `n_rows` where none does.
    stop = np.full(n, n_rows)
    np.minimum.at(stop, columns[ends], row[ends])
    kept, last = row < stop[columns], ends & (row == stop[columns])
    undecided = separatrix[last] == UNDECIDED
    found.outcome[columns[last]] = np.where(undecided, Outcome.FAILED, Outcome.NO_CROSSING)
    # Written last: what ends an orbit may come right after the last crossing that is asked for.
    found.outcome[columns[kept & (row == n_rows - 1)]] = Outcome.COMPLETE
    found.time[row[kept], columns[kept]] = times[kept]
    found.separatrix[row[kept], columns[kept]] = separatrix[kept]


def crossings_on(steps: Any, bits: int) -> Array:
    """All crossings on noted steps as rows of lane, t' and separatrix, (3, n).

    `UNDECIDED` stands in the place of the separatrix for a touch that is not decided.
    """
    changed = crosses(steps["series"][:, 2, 0, 0], steps["after"])
    steady = steps["steady"] > 0
    # Newton's method may have met a slope of zero: its correction is then no number, and not exact.
    with np.errstate(invalid="ignore"):
        exact = np.abs(steps["correction"]) <= CONVERGED * steps["length"]
    single = steady & changed & exact
    # A monotone M3 of one sign at both ends has no zero; every other step may have several.
    doubtful = ~single & (changed | ~steady)
    return np.hstack((_single(steps[single]), _isolated(steps[doubtful], bits)))


def _single(steps: Any) -> Array:
    """The one crossing on each step, as the kernel has found it."""
    rising = steps["series"][:, 2, 0, 0] < 0
    separatrix = separatrix_beside(rising, steps["Qp"], steps["Qm"])
    return np.array([steps["lane"], steps["time"] + steps["zero"], separatrix])


def _isolated(steps: Any, bits: int) -> Array:
    """All crossings on doubtful steps, from the isolated zeros of each series."""
    seen: list[tuple[float, float, int]] = []
    for step in steps:
        series, length = step["series"], step["length"]
        # Polynomials in the share of the step, whose zeros are sought in (0, 1].
        shares = series[..., 0] * length ** np.arange(series.shape[1])
        depth = touch(bits) * float(np.sqrt((shares[:, 0] ** 2).sum()))
        exactly_ = _without_rounding(series[2], length) if bits > 53 else None
        for share, separatrix in crossings_of_series(shares, depth, exactly_):
            seen.append((step["lane"], step["time"] + share * length, separatrix))
    return np.array(seen, dtype=float).reshape(-1, 3).T


def _without_rounding(series: Array, length: float) -> Callable[[float], float]:
    """A series (order + 1, parts) as an exact function of the share of the step, rounded once."""
    terms = [sum(map(Fraction, parts)) for parts in series]
    return lambda share: float(value_at(terms, Fraction(share) * Fraction(length)))


def advance(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    count: int,
    bits: int,
    tolerance: float,
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit `count` steps on: t' since the start and state at the end of each step.

    Coefficients, state, times and results are Fractions. `tolerance` is that at 53 bits, and every
    further bit halves it.
    """
    alone = Orbits(coefficients, np.array([state]).T, 0, 0.0)
    run = Batch(alone, bits, tolerance * 2.0 ** (53 - bits))
    run.load()
    found = []
    for _ in range(count):
        check_stop()
        # `noted` is called for the step alone: the caller finds crossings on its own.
        run.noted(1)
        here = exactly(run.states[:, 0].reshape(-1, len(state)))
        here[:3] *= run.unit
        found.append((exactly(run.times[:, 0]) / run.unit, tuple(here)))
    return found
