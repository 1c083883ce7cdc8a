"""Engine `scipy`: Dormand and Prince's method 8(5,3), an alternative to the Taylor engine.

Orbits advance side by side as one system, so that one Python call serves all of them. Orbits that
are done leave the system.
"""

from typing import Any, cast

import numpy as np

from rigidpend.machine.workers import check_stop, note
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers import Array
from rigidpend.orbits.integrate import Crossings, Orbits, Outcome, no_crossings, silent_outcome
from rigidpend.orbits.integrate.step_crossings import crosses

SIDE_BY_SIDE = 64
"""Number of orbits in one system, all of which take the step of the most demanding orbit."""


def crossings(orbits: Orbits, tolerance: float) -> Crossings:
    """Crossings of orbits, followed as one system; SciPy takes tolerances from 2.3e-14 on."""
    from scipy.integrate import DOP853

    method, smallest, time, states = cast(Any, DOP853), floor(orbits, tolerance), 0.0, orbits.states
    n = states.shape[1]
    found, active = no_crossings(orbits.n_crossings, n), np.arange(n)
    count, last = np.zeros(n, dtype=int), np.zeros(n)

    def told() -> str:
        """Progress of these orbits, in words."""
        crossings = f"{count[active].min()} of {orbits.n_crossings} crossings or more"
        return f"{active.size} orbits under way by DOP853, {crossings}"

    def rates(_: float, flat: Array) -> Array:
        return np.concatenate(aligned(flat.reshape(6, -1), orbits.coefficients))

    while active.size:
        absolute = np.broadcast_to(smallest, states.shape).ravel()
        solver = method(rates, time, states.ravel(), np.inf, rtol=tolerance, atol=absolute)
        ended = np.zeros(active.size, dtype=bool)
        # When an orbit is done, a new system of the others begins.
        while not ended.any():
            check_stop()
            note(told)
            before = solver.y.reshape(6, -1)[2]
            solver.step()
            time, states = solver.t, solver.y.reshape(6, -1)
            if solver.status != "running" or not np.isfinite(states).all():
                # The outcomes of the orbits in the system are still FAILED, as at the beginning.
                return found
            # Two crossings within one step have no change of sign between them, and are missed.
            crossed = np.flatnonzero(crosses(before, states[2]))
            if crossed.size:
                columns, rising, (Qp, Qm) = (
                    active[crossed],
                    before[crossed] < 0,
                    states[:2, crossed],
                )
                times = _zeros(solver, crossed, rising)
                last[columns] = found.time[count[columns], columns] = times
                beside = separatrix_beside(rising, Qp, Qm)
                found.separatrix[count[columns], columns] = beside
                count[columns] += 1
            done = count[active] == orbits.n_crossings
            ended = done | (time - last[active] > orbits.passage_limit)
            for lane in np.flatnonzero(ended):
                silent = Outcome.COMPLETE if done[lane] else silent_outcome(*states[:2, lane])
                found.outcome[active[lane]] = silent
        active, states = active[~ended], states[:, ~ended]
    return found


def floor(orbits: Orbits, tolerance: float) -> Array:
    """Absolute tolerances (6, 1), of Qp and Qm relative to their size at the start."""
    # Near a pendulum motion Qp and Qm are small, and their relative precision decides the symbols:
    # each orbit's larger one counts, and of all orbits the smallest of these.
    size = np.abs(orbits.states[:2]).max(axis=0).min() or 1.0
    return tolerance * np.array([size, size, 1, 1, 1, 1])[:, None]


def _zeros(solver: Any, crossed: Any, rising: Any) -> Array:
    """Times at which M3 = 0 on the last step, for each crossed orbit, by bisection side by side."""
    dense = solver.dense_output()
    low, high = np.full(crossed.size, solver.t_old), np.full(crossed.size, solver.t)
    while True:
        middle = (low + high) / 2
        if not ((low < middle) & (middle < high)).any():
            return middle
        # The interpolant gives all orbits at each of the times; each orbit needs its own time.
        M3 = dense(middle).reshape(6, -1, crossed.size)[2, crossed, range(crossed.size)]
        beyond = (M3 > 0) == rising
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)


def sample(field: Any, states: Array, times: Array, tolerance: float) -> Array:
    """States (d, k, n) of orbits from states (d, n), at times (k, 1) for all or (k, n) for each.

    With the same times for all, the orbits are one system; else each is integrated alone.
    ArithmeticError is raised if the integration ends early.
    """
    from scipy.integrate import solve_ivp

    (size, n), (count, several) = states.shape, times.shape
    if several > 1:
        each = [sample(field, states[:, [i]], times[:, [i]], tolerance) for i in range(n)]
        return np.concatenate(each, axis=2)
    # The only time is 0.
    if not times[-1, 0]:
        return states[:, None]

    def rates(_: float, flat: Array) -> Array:
        y = flat.reshape(states.shape) if n > 1 else flat
        found = aligned(y, field) if isinstance(field, AlignedCoefficients) else field(y)
        # A constant rate becomes an array like the others.
        return np.stack(np.broadcast_arrays(*found, y[0])[:size]).ravel()

    # A component near zero may err by a hundredth of what one near 1 may.
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
