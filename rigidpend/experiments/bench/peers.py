"""Methods made ready for a task: ours, heyoka and SciPy; CyRK has a module of its own.

Peers integrate the package's own field.

heyoka runs as its experts use it, with orbits side by side in SIMD lanes. With the numbers of a
body as parameters it is compiled once for all bodies; compiled for each body it runs 4 % faster.
SciPy's DOP853 has all orbits as one system, so that one Python call of the right-hand side serves
all of them; that was three to eight times faster than one orbit after the other with `solve_ivp`
and its events.

Each library is imported where it is used, because it may not be installed.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.methods import METHODS, SMALLER, Entrant
from rigidpend.experiments.bench.problems import Crossed, Task, flat, time_unit
from rigidpend.experiments.principal_axes import beside, euler_poisson_field, heyoka
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import separatrix_theta1, symbols
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.arithmetic import Arithmetic, resolve
from rigidpend.routes.certainty import FIRST_SCALES
from rigidpend.routes.codes import codes_of
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run

FALSE_POSITIONS = 12
"""Iterations of false position for SciPy, from the ends of a step to the crossings in it."""


class Solver(NamedTuple):
    """A method made ready for a task."""

    solve: Callable[[], Any]
    """The work that is timed."""
    read: Callable[[Any], Crossed] = lambda found: found
    """Makes the answer from the result of `solve`, untimed."""


Make = Callable[[Task], Solver]


def ready(name: str, task: Task, entry: Entrant, threads: int = 1) -> Solver:
    """A method made ready for a task, with its tolerance and its setting; imports what it needs.

    Peers do not know threads, but release Python's lock while they compute: each thread has a peer
    made ready for its part of the orbits.
    """
    method = METHODS[name]
    if method.runs:
        each = ((run, x._replace(setting=x.setting | entry.setting)) for run, x in method.runs)
        return compared(task, *(partial(ready, run, entry=x, threads=threads) for run, x in each))
    if not method.peer:
        return ours(task, entry.tolerance, threads, **entry.setting)
    columns = np.array_split(np.arange(task.states.shape[1]), threads)
    follows = partial(PEERS[method.family], tolerance=entry.tolerance, **entry.setting)
    parts = [follows(task.of(part)) for part in columns if part.size]
    pool = ThreadPoolExecutor(threads)

    def together() -> Array:
        return np.concatenate(list(pool.map(lambda follow: follow(), parts)), axis=2)

    solve = parts[0] if threads == 1 else together
    return Solver(solve, partial(_crossed, body=task.problem.body))


def _crossed(found: Array, body: Body) -> Crossed:
    time, M1, M2 = found
    places = separatrix_theta1(body.alpha0, body.beta0)
    theta1 = np.where(np.isnan(time), np.nan, 2 * np.arctan2(M1, M2) + body.beta0)
    return Crossed(symbols(beside(theta1, places)), time_unit(body) * time)


def compared(task: Task, *makes: Make) -> Solver:
    """Cross-check of a peer: run twice, compare, and run the columns that differ a third time.

    A symbol is trusted if two runs agree on it and on all before it. Where the first two differ,
    the third decides if it agrees with one of them. Only symbols are compared: runs of one
    formulation err alike, so that no limit on times could be derived, as for our method.
    """
    first, second, third = makes
    solvers = [first(task), second(task)]

    def solve() -> Crossed:
        a, b = (solver.read(solver.solve()) for solver in solvers)
        trusted = np.logical_and.accumulate(a.codes == b.codes, axis=0)
        codes, doubtful = a.codes.copy(), np.flatnonzero(~trusted.all(axis=0))
        if doubtful.size:
            # Compiled code serves other orbits as well; only the states are new.
            again = third(task.of(doubtful))
            c = again.read(again.solve())
            for other in (a, b):
                same = np.logical_and.accumulate(other.codes[:, doubtful] == c.codes, axis=0)
                trusted[:, doubtful] |= same
            codes[:, doubtful] = c.codes
        return Crossed(codes, a.crossing_time, trusted)

    return Solver(solve)


def ours(task: Task, tolerance: Any, threads: int, way: str = "", calls: int = 0) -> Solver:
    """Our methods: `route_codes` by one of its ways (``auto``, ...), with every symbol certain.

    The return maps and then so many `calls` are made before those that are timed: maps serve few
    orbits only of a problem that has been asked for often. Without a way only its first computation
    runs: Taylor series in doubles at a tolerance.
    """
    if way:
        given = task.problem, task.theta2_0, resolve(), threads
        if calls:
            codes_of(*given, "map")
        for _ in range(calls):
            codes_of(*given, way, use_kept=True)
        return Solver(lambda: codes_of(*given, way, use_kept=True))
    run = Run(task.problem, Phases(task.theta2_0), Arithmetic("taylor", tolerance, (53,)), threads)
    every = range(len(run.phases))
    return Solver(
        lambda: run.crossings(53, FIRST_SCALES, every),
        lambda found: Crossed(symbols(found.separatrix), found.time),
    )


def in_lanes(
    task: Task, tolerance: float, lanes: int = 8, parameters: bool = False
) -> Callable[[], Array]:
    """heyoka on Euler-Poisson; a lane whose orbit is done takes the next one.

    With `parameters` the numbers of the body are parameters of the compiled code; mu is part of
    two of them, as mu r.
    """
    hy, (A, r, mu) = heyoka(), task.problem.body.floats()
    names = [hy.make_vars(f"x{i}") for i in range(6)]
    field = euler_poisson_field(A, r, mu)
    if parameters:
        field = euler_poisson_field([hy.par[i] for i in range(3)], [hy.par[3], hy.par[4], 0.0], 1.0)
    wanted, n = task.problem.n_symbols + 1, task.states.shape[1]
    found = np.empty((3, wanted, n))
    # For each lane: its orbit, and the number of crossings so far.
    column, count = [0] * lanes, [0] * lanes

    def write(_: Any, __: Any, lane: int) -> bool:
        k = count[lane]
        count[lane] = k + 1
        if k < wanted:
            found[:, k, column[lane]] = made.time[lane], state[0, lane], state[1, lane]
        return k + 1 < wanted

    made = hy.taylor_adaptive_batch(
        list(zip(names, field(names), strict=True)),
        np.zeros((6, lanes)),
        tol=tolerance,
        t_events=[hy.t_event_batch(names[2], callback=write)],
    )
    if parameters:
        made.pars[:] = np.array([*A, mu * r[0], mu * r[1]])[:, None]
    state = made.state

    def follow() -> Array:
        found[:] = np.nan
        waiting, until = iter(range(n)), np.zeros(lanes)
        state[:] = task.states[:, :1]
        made.set_time(0.0)

        def load(lane: int) -> bool:
            """Put the next orbit into a lane; without one, let it idle and return False."""
            orbit = next(waiting, None)
            times = np.where(np.isfinite(made.time), made.time, 0.0)
            times[lane], count[lane] = 0.0, 0
            made.set_time(times)
            until[lane] = 0.0 if orbit is None else task.end
            state[:, lane] = task.states[:, orbit or 0]
            if orbit is not None:
                column[lane] = orbit
                made.reset_cooldowns(lane)
            return orbit is not None

        busy = {lane for lane in range(lanes) if load(lane)}
        while busy:
            made.propagate_until(until)
            for lane in list(busy):
                # A loose tolerance may spoil an orbit until its numbers are not finite.
                running = made.time[lane] < until[lane] and np.isfinite(state[:, lane]).all()
                if not (count[lane] < wanted and running) and not load(lane):
                    busy.discard(lane)
        return found.copy()

    return follow


def abreast(task: Task, tolerance: float) -> Callable[[], Array]:
    """SciPy's DOP853 with all orbits as one system; crossings from each step's dense output."""
    from scipy.integrate import DOP853

    rates, wanted, states = flat(task.problem.body), task.problem.n_symbols + 1, task.states
    tolerances: Any = {"rtol": tolerance, "atol": SMALLER * tolerance}

    def all_rates(t: float, y: Array) -> Array:
        found = np.empty_like(states)
        rates(found, t, y.reshape(states.shape), None)
        return found.ravel()

    def find() -> Array:
        solver: Any = DOP853(all_rates, 0.0, states.ravel(), task.end, **tolerances)
        at, count = np.full((3, wanted, states.shape[1]), np.nan), np.zeros(states.shape[1], int)
        while solver.status == "running" and (count < wanted).any():
            before = solver.y.reshape(states.shape)[2]
            said = solver.step()
            if solver.status == "failed":
                raise ArithmeticError(said)
            after = solver.y.reshape(states.shape)[2]
            columns = np.flatnonzero((before < 0) != (after < 0))
            columns = columns[count[columns] < wanted]
            if columns.size:
                dense, own = solver.dense_output(), (columns, np.arange(columns.size))

                def there(times: Array, dense: Any = dense, own: Any = own) -> Array:
                    """Each orbit at a time of its own, (6, k)."""
                    return np.asarray(dense(times).reshape(*states.shape, -1)[:, *own])

                a, b = (np.full(columns.size, x) for x in (solver.t_old, solver.t))
                times = _zeros(there, a, b, before[columns], after[columns])
                at[:, count[columns], columns] = times, *there(times)[:2]
                count[columns] += 1
        return at

    return find


def _zeros(there: Callable[[Array], Array], a: Array, b: Array, fa: Array, fb: Array) -> Array:
    """The zeros of M3 of several orbits, each between two times, by false position."""
    for _ in range(FALSE_POSITIONS):
        c = b - fb * (b - a) / np.where(fb == fa, 1.0, fb - fa)
        fc = there(c)[2]
        changes = (fc < 0) != (fb < 0)
        a, fa = np.where(changes, b, a), np.where(changes, fb, fa / 2)
        b, fb = c, fc
    return b


def compiled(task: Task, tolerance: float, method: str) -> Callable[[], Array]:
    """CyRK; its module here imports CyRK at once, and is therefore imported late."""
    from rigidpend.experiments.bench.cyrk_compiled import crossings, field_pointer

    orbits, wanted = np.ascontiguousarray(task.states.T), task.problem.n_symbols + 1
    given = field_pointer(task.problem.body), orbits, wanted, task.end, method, tolerance
    return lambda: crossings(*given).T


PEERS: dict[str, Callable[..., Callable[[], Array]]] = {
    "heyoka": in_lanes,
    "cyrk": compiled,
    "scipy": abreast,
}
"""Peers by family: from a task, a tolerance and a setting to a function that follows the orbits.

It gives, at crossings of M3 = 0, (3, n_symbols + 1, n): the physical time, NaN where there is no
crossing, and M1 and M2 there."""
