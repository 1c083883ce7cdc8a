"""Engine `scipy`: Dormand-Prince 8(5,3) on the aligned field: the Taylor engine's rival.

Orbits advance side by side as one system, so that a Python call serves all of them. Orbits
that are done leave it.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from rigidpend.machine.workers import check_stop, note
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate import (
    Crossings,
    Orbits,
    Outcome,
    no_crossings,
    silent_outcome,
)

SIDE_BY_SIDE = 64
"""Number of orbits in one system: all take the step of the most demanding one."""


def crossings(orbits: Orbits, tolerance: float) -> Crossings:
    """Crossings of orbits, all of them one system; SciPy takes relative tolerances from 2.3e-14."""
    abreast, time, states = Abreast(orbits, tolerance), 0.0, orbits.states
    while abreast.active.size:
        time, states = abreast.advance(time, states)
    return abreast.found


def sample(field: Any, states: Array, times: Array, tolerance: float) -> Array:
    """States (d, k, n) from states (d, n) at times (k, 1), of one system, or (k, n), each alone."""
    from scipy.integrate import solve_ivp

    (size, n), (count, several) = states.shape, times.shape
    if several > 1:
        each = [sample(field, states[:, [i]], times[:, [i]], tolerance) for i in range(n)]
        return np.concatenate(each, axis=2)
    if not times[-1, 0]:
        return states[:, None]

    def rates(_: float, flat: Array) -> Array:
        y = flat.reshape(states.shape) if n > 1 else flat
        found = aligned(y, field) if isinstance(field, AlignedCoefficients) else field(y, np)
        return np.stack(np.broadcast_arrays(*found, y[0])[:size]).ravel()

    found: Any = solve_ivp(
        rates,
        (0.0, times[-1, 0]),
        states.ravel(),
        method="DOP853",
        t_eval=times[:, 0],
        rtol=tolerance,
        atol=tolerance * 1e-2,
    )
    if not found.success:
        raise ArithmeticError(f"the integration ended early: {found.message}")
    return np.asarray(found.y.reshape(size, n, count).transpose(0, 2, 1))


class Abreast:
    """Orbits that advance together, with the crossings found so far."""

    def __init__(self, orbits: Orbits, tolerance: float) -> None:
        self.orbits, self.tolerance = orbits, tolerance
        n = orbits.states.shape[1]
        self.found = no_crossings(orbits.n_crossings, n)
        self.count, self.last, self.active = np.zeros(n, dtype=int), np.zeros(n), np.arange(n)
        # Absolute tolerances: a Q counts relative to its smallest initial size.
        size = np.abs(orbits.states[:2]).max(axis=0).min() or 1.0
        self.floor = tolerance * np.array([size, size, 1, 1, 1, 1])[:, None]

    def advance(self, time: float, states: Array) -> tuple[float, Array]:
        """Integrate until some orbit is done; the time and the states of those left."""
        from scipy.integrate import DOP853

        shape, coefficients, method = states.shape, self.orbits.coefficients, cast(Any, DOP853)
        solver = method(
            lambda _, flat: np.concatenate(aligned(flat.reshape(shape), coefficients)),
            time,
            states.ravel(),
            np.inf,
            rtol=self.tolerance,
            atol=np.broadcast_to(self.floor, shape).ravel(),
        )
        while True:
            check_stop()
            note(self._told)
            before = solver.y.reshape(shape)[2]
            solver.step()
            now = solver.y.reshape(shape)
            if solver.status != "running" or not np.isfinite(solver.y).all():
                # They stay as they are told from the beginning: failed.
                self.active = self.active[:0]
                return solver.t, now[:, :0]
            crossed = np.flatnonzero(np.sign(before) * np.sign(now[2]) < 0)
            if crossed.size:
                self._record(crossed, solver, shape, now)
            staying = self._staying(solver.t, now)
            if not staying.all():
                self.active = self.active[staying]
                return solver.t, now[:, staying]

    def _told(self) -> str:
        """Progress of these orbits, in words."""
        fewest = int(self.count[self.active].min())
        crossings = f"{fewest} of {self.orbits.n_crossings} crossings or more"
        return f"{self.active.size} orbits under way by DOP853, {crossings}"

    def _record(self, crossed: Any, solver: Any, shape: tuple[int, ...], now: Array) -> None:
        columns = self.active[crossed]
        times = _zeros(solver.dense_output(), solver.t_old, solver.t, shape, crossed, now)
        Qp, Qm, M3 = now[:3, crossed]
        self.found.time[self.count[columns], columns] = times
        beside = list(map(separatrix_beside, M3 > 0, Qp, Qm))
        self.found.separatrix[self.count[columns], columns] = beside
        self.count[columns] += 1
        self.last[columns] = times

    def _staying(self, time: float, now: Array) -> Any:
        """Mask of the orbits that go on; the outcome of the others is recorded."""
        done = self.count[self.active] == self.orbits.n_crossings
        late = time - self.last[self.active] > self.orbits.passage_limit
        for lane in np.flatnonzero(done | late):
            silent = Outcome.COMPLETE if done[lane] else silent_outcome(*now[:2, lane])
            self.found.outcome[self.active[lane]] = silent
        return ~(done | late)


def _zeros(
    dense: Any, start: float, end: float, shape: tuple[int, ...], crossed: Any, now: Array
) -> Array:
    """When M3 = 0 for each crossed orbit, by bisection side by side."""
    low, high = np.full(crossed.size, start), np.full(crossed.size, end)
    rising = now[2, crossed] > 0
    while True:
        middle = (low + high) / 2
        if not ((low < middle) & (middle < high)).any():
            return middle
        # The interpolant gives all components at a time; each orbit needs its own.
        M3 = dense(middle).reshape(*shape, crossed.size)[2, crossed, range(crossed.size)]
        beyond = (M3 > 0) == rising
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
