"""Methods made ready, and the adapters of heyoka, diffrax and SciPy; CyRK's is a module of its own.

heyoka, as its experts use it, has orbits side by side in lanes, on Euler-Poisson or on (eq1). With
the numbers of a body as parameters it is compiled once for all bodies; compiled for each, it is 4 %
faster then. diffrax (JAX) runs in double precision, vmapped over the orbits and compiled as a
whole. SciPy's DOP853 has a right-hand side as fast as Python has it, all orbits as one system: a
call of Python then serves all of them, which was three to eight times faster than one orbit after
the other with `solve_ivp` and its events.

Each library is imported where it is used, for it may not be installed.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.bench import ours
from rigidpend.experiments.bench.methods import METHODS, Entrant
from rigidpend.experiments.bench.problems import FIELDS, Crossed, Task, time_unit
from rigidpend.experiments.bench.solvers import SMALLER, Make, Solve, Solver, crossed, flat, shared
from rigidpend.experiments.principal_axes import heyoka
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import (
    Canonical,
    andoyer_from_body,
    andoyer_from_canonical,
    body_from_andoyer,
    canonical_from_andoyer,
)
from rigidpend.mechanics.equations import eq1 as eq1_rates
from rigidpend.numbers.expressions import NO_SYMBOL
from rigidpend.numbers.generic import Array, Numbers
from rigidpend.routes.phases import Phases

FALSE_POSITIONS = 12
"""Steps of SciPy's from the ends of a step to the crossings in it."""
AT_ONCE = 1e-3
"""A time, physical, until which diffrax goes when only compilation is wanted."""


def made(name: str, task: Task, entry: Entrant, threads: int = 1) -> Solver:
    """A method made ready for a task, with its tolerance and its setting; imports what it needs."""
    method = METHODS[name]
    if method.runs:
        each = ((run, x._replace(setting=x.setting | entry.setting)) for run, x in method.runs)
        return compared(task, *(partial(made, run, entry=x, threads=threads) for run, x in each))
    return ADAPTERS[method.family](task, entry.tolerance, threads, **entry.setting)


def compared(task: Task, first: Make, second: Make, third: Make) -> Solver:
    """Cross-check of a peer: run twice, compare, and run the columns that differ a third time.

    A symbol is trusted where two runs agree on it and on all before it. Where the first two differ
    the third decides, if it agrees with one of them. Nothing tells how near an agreement must be,
    as it does for ours: runs of one formulation err alike.
    """
    solvers = [first(task), second(task)]

    def solve() -> Crossed:
        a, b = (solver.read(solver.solve()) for solver in solvers)
        trusted = np.logical_and.accumulate(a.codes == b.codes, axis=0)
        codes, doubtful = a.codes.copy(), np.flatnonzero(~trusted.all(axis=0))
        if doubtful.size:
            # What is compiled for other orbits serves these; only their states are new.
            again = third(task.of(doubtful))
            c = again.read(again.solve())
            for other in (a, b):
                same = np.logical_and.accumulate(other.codes[:, doubtful] == c.codes, axis=0)
                trusted[:, doubtful] |= same
            codes[:, doubtful] = c.codes
        return Crossed(codes, a.time, trusted)

    return Solver(solve)


@shared
def in_lanes(
    task: Task, tolerance: float, lanes: int = 8, eq1: bool = False, parameters: bool = False
) -> Solver:
    """heyoka; by (eq1) in the paper's variables theta1, J1, theta2, J2.

    With `parameters` the numbers of the body are parameters of what is compiled.
    """
    body, write, routes = task.body, _eq1 if eq1 else _principal, task.kind == "routes"
    names, rates, numbers = write(body, len(task.states), parameters)

    def compiled(**events: Any) -> Any:
        begin, system = np.zeros((len(names), lanes)), list(zip(names, rates, strict=True))
        made = heyoka().taylor_adaptive_batch(system, begin, tol=tolerance, **events)
        if parameters:
            made.pars[:] = np.array(numbers)[:, None]
        return made

    if not eq1:
        if routes:
            return Solver(_follow(compiled, names[2], (0, 1), task), partial(crossed, body=body))
        return Solver(_to_ends(compiled(), task))
    states = _eq1_start(task) if routes else _to_eq1(task.states, body)
    begun = task._replace(times=time_unit(body) * task.times, states=states)
    if routes:
        return Solver(_follow(compiled, names[1] - names[3] / 2.0, (0,), begun), _by_side)
    return Solver(_to_ends(compiled(), begun), partial(_from_eq1, body=body))


def _principal(body: Body, size: int, parameters: bool) -> tuple[Any, Any, Numbers]:
    """Names, rates and parameters of Euler-Poisson; mu is in two of them, beside r."""
    hy, (A, r, mu) = heyoka(), body.floats()
    names = [hy.make_vars(f"x{i}") for i in range(size)]
    if parameters:
        moments, weight = [hy.par[i] for i in range(3)], [hy.par[3], hy.par[4], 0.0]
        field = FIELDS[size](moments, weight, 1.0)
        return names, field(names), (*A, mu * r[0], mu * r[1])
    return names, FIELDS[size](A, r, mu)(names), ()


def _eq1(body: Body, _: int, parameters: bool) -> tuple[Any, Any, Numbers]:
    """Names, rates and parameters of (eq1)."""
    hy, p = heyoka(), body.angles()
    names, numbers = hy.make_vars("theta1", "J1", "theta2", "J2"), tuple(map(float, p))
    # Symbols throughout: heyoka's cosine takes nothing else.
    symbols = [hy.par[k] if parameters else hy.expression(x) for k, x in enumerate(numbers)]
    return names, eq1_rates(names, type(p)(*symbols), hy), numbers


def _eq1_start(task: Task) -> Array:
    p, phases = task.problem, Phases(task.theta2_0).high
    theta1, J1, J2 = p.body.alpha0 + p.body.beta0, float(p.J1_0), float(p.J2_0(53))
    return np.array(np.broadcast_arrays(theta1, J1, phases, J2))


def _to_eq1(states: Array, body: Body) -> Array:
    s = time_unit(body)
    c = canonical_from_andoyer(andoyer_from_body(s * states[:3], states[3:]), body.beta0)
    return np.stack((c.theta1, c.J1, c.theta2, c.J2))


def _from_eq1(found: Array, body: Body) -> Array:
    theta1, J1, theta2, J2 = found
    c = Canonical(J1, J2 - J1, 0.0, theta1, theta2, 0.0, 1.0)
    M, gamma = body_from_andoyer(andoyer_from_canonical(c, body.beta0))
    return np.concatenate((M / time_unit(body), gamma))


def _by_side(found: Array) -> Crossed:
    """A symbol is 1 where theta1, which goes on beyond 4 pi, has grown between crossings."""
    time, theta1 = found
    step = np.diff(theta1, axis=0)
    return Crossed(np.where(np.isnan(step), NO_SYMBOL, step > 0).astype(np.uint8), time)


def _to_ends(made: Any, task: Task) -> Solve:
    """Give a function that carries orbits to their ends, as many at once as there are lanes."""
    states, lanes = task.states, made.state.shape[1]

    def carry() -> Array:
        after, n = np.empty_like(states), states.shape[1]
        for first in range(0, n, lanes):
            # The last orbit is repeated where there are too few.
            some = np.minimum(np.arange(first, first + lanes), n - 1)
            made.set_time(0.0)
            made.state[:] = states[:, some]
            made.propagate_until(task.times[some])
            after[:, first : first + lanes] = made.state[:, : n - first]
        return after

    return carry


def _follow(compiled: Callable[..., Any], section: Any, kept: tuple[int, ...], task: Task) -> Solve:
    """Give a function that follows orbits side by side to the zeros of a section.

    It gives times of `wanted` zeros and the components `kept` there, (1 + k, wanted, n); NaN for
    none. A lane whose orbit is done takes the next one.
    """
    wanted, limit, n = task.problem.n_symbols + 1, float(task.times.max()), task.states.shape[1]
    found = np.empty((1 + len(kept), wanted, n))

    def write(_: Any, __: Any, lane: int) -> bool:
        k = count[lane]
        count[lane] = k + 1
        if k < wanted:
            found[:, k, column[lane]] = made.time[lane], *(state[i, lane] for i in kept)
        return k + 1 < wanted

    made = compiled(t_events=[heyoka().t_event_batch(section, callback=write)])
    state, lanes = made.state, made.state.shape[1]
    # By lane: its orbit, and the zeros that it has had.
    column, count = [0] * lanes, [0] * lanes

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
            until[lane] = 0.0 if orbit is None else limit
            state[:, lane] = task.states[:, orbit or 0]
            if orbit is not None:
                column[lane] = orbit
                made.reset_cooldowns(lane)
            return orbit is not None

        busy = {lane for lane in range(lanes) if load(lane)}
        while busy:
            made.propagate_until(until)
            for lane in list(busy):
                # An orbit that a loose tolerance has spoilt has a time that is none.
                running = made.time[lane] < until[lane] and np.isfinite(state[:, lane]).all()
                if not (count[lane] < wanted and running) and not load(lane):
                    busy.discard(lane)
        return found.copy()

    return follow


@shared
def vmapped(task: Task, tolerance: float, solver: str) -> Solver:
    """diffrax, compiled for as many orbits as each thread has."""
    first = task.states.T
    if task.kind == "routes":
        find = _crossings(task.body, task.problem.n_symbols + 1, solver)

        def solve(horizon: float) -> Array:
            times, there = (np.asarray(x) for x in find(first, tolerance, horizon))
            return np.concatenate((times.T[None], there.transpose(2, 1, 0)[:2]))

        solve(AT_ONCE)
        limit = float(task.times.max())
        return Solver(lambda: solve(limit), partial(crossed, body=task.body))
    carry = _to(task.body, len(task.states), solver)

    def ends(times: Array) -> Array:
        return np.asarray(carry(first, times, tolerance)).T

    ends(np.full(len(first), AT_ONCE))
    return Solver(lambda: ends(task.times))


def _orbit(body: Body, size: int, solver: str) -> Any:
    """Give a function that follows an orbit from a time to another, by diffrax."""
    import diffrax
    import jax
    import jax.numpy as jnp

    settings: Any = jax.config
    settings.update("jax_enable_x64", True)
    field = FIELDS[size](*body.floats())
    term = diffrax.ODETerm(lambda t, y, args: jnp.stack(field(y)))

    def follow(state: Numbers, start: Any, stop: Any, tolerance: Any, **event: Any) -> Any:
        controller = diffrax.PIDController(rtol=tolerance, atol=SMALLER * tolerance)
        method = getattr(diffrax, solver)()
        words = {"stepsize_controller": controller, "max_steps": None, **event}
        return diffrax.diffeqsolve(term, method, start, stop, None, state, **words)

    return follow


@functools.cache
def _to(body: Body, size: int, solver: str) -> Any:
    """The states of orbits (n, d) at their ends, compiled: of states, times and tolerance."""
    follow = _orbit(body, size, solver)
    import jax

    return jax.jit(jax.vmap(lambda y, *given: follow(y, 0.0, *given).ys[-1], in_axes=(0, 0, None)))


@functools.cache
def _crossings(body: Body, wanted: int, solver: str) -> Any:
    """Times (n, wanted) and states of the crossings, compiled: of states, tolerance and horizon."""
    follow = _orbit(body, 6, solver)
    import diffrax
    import jax
    import jax.numpy as jnp
    import optimistix

    event = diffrax.Event(  # By a root finder, upwards and downwards in turn.
        lambda t, y, args, **_: args * y[2],
        root_finder=optimistix.Newton(1e-14, 1e-14, optimistix.rms_norm),
        direction=True,
    )

    def route(state: Numbers, tolerance: Any, horizon: Any) -> Any:
        def passage(carried: Any, upwards: Any) -> Any:
            time, state = carried
            words = {"args": upwards, "event": event, "throw": False}
            found = follow(state, time, horizon, tolerance, **words)
            carried = found.ts[-1], found.ys[-1]
            return carried, carried

        turns = jnp.where(jnp.arange(wanted) % 2 == 0, 1.0, -1.0)
        return jax.lax.scan(passage, (jnp.zeros(()), state), turns)[1]

    return jax.jit(jax.vmap(route, in_axes=(0, None, None)))


@shared
def abreast(task: Task, tolerance: float) -> Solver:
    """SciPy's DOP853."""
    if task.kind == "routes":
        return Solver(_all_crossings(task, tolerance), partial(crossed, body=task.body))
    return Solver(_all_to(task, tolerance))


def _all_to(task: Task, tolerance: float) -> Solve:
    """Give a function that carries orbits to their ends."""
    rates, states = flat(task.body, len(task.states)), task.states

    def carry() -> Array:
        # Each orbit in units of its own way, so that all of them arrive at 1.
        solver = _dop853(rates, states, 1.0, tolerance, task.times)
        while solver.status == "running":
            _step(solver)
        return np.asarray(solver.y.reshape(states.shape))

    return carry


def _all_crossings(task: Task, tolerance: float) -> Solve:
    """Give a function that finds crossings by each step's dense output."""
    rates, wanted, states = flat(task.body, 6), task.problem.n_symbols + 1, task.states
    (n, horizon), shape = (states.shape[1], float(task.times.max())), states.shape

    def find() -> Array:
        solver = _dop853(rates, states, horizon, tolerance)
        at, count = np.full((3, wanted, n), np.nan), np.zeros(n, dtype=int)
        while solver.status == "running" and (count < wanted).any():
            before = solver.y.reshape(shape)[2]
            _step(solver)
            after = solver.y.reshape(shape)[2]
            columns = np.flatnonzero((before < 0) != (after < 0))
            columns = columns[count[columns] < wanted]
            if columns.size:
                dense = solver.dense_output()
                sides = [before[columns], after[columns]]
                times = _zeros(dense, columns, shape, solver.t_old, solver.t, sides)
                there = dense(times).reshape(*shape, columns.size)
                there = there[:, columns, np.arange(columns.size)]
                at[:, count[columns], columns] = times, there[0], there[1]
                count[columns] += 1
        return at

    return find


def _dop853(rates: Any, states: Array, end: float, tolerance: float, unit: Any = 1.0) -> Any:
    from scipy.integrate import DOP853

    def all_rates(t: float, y: Array) -> Array:
        found = np.empty_like(states)
        rates(found, t, y.reshape(states.shape), None)
        return (unit * found).ravel()

    tolerances: Any = {"rtol": tolerance, "atol": SMALLER * tolerance}
    return DOP853(all_rates, 0.0, states.ravel(), end, **tolerances)


def _step(solver: Any) -> None:
    said = solver.step()
    if solver.status == "failed":
        raise ArithmeticError(said)


def _zeros(dense: Any, columns: Any, shape: Any, start: Any, end: Any, sides: list[Array]) -> Array:
    """The zeros of M3 of each of those orbits between two times, by false positions."""
    (fa, fb), m = sides, columns.size
    a, b = np.full(m, start), np.full(m, end)
    for _ in range(FALSE_POSITIONS):
        c = b - fb * (b - a) / np.where(fb == fa, 1.0, fb - fa)
        fc = dense(c).reshape(*shape, m)[2, columns, np.arange(m)]
        changes = (fc < 0) != (fb < 0)
        a, fa = np.where(changes, b, a), np.where(changes, fb, fa / 2)
        b, fb = c, fc
    return b


@shared
def _compiled(task: Task, tolerance: float, **setting: Any) -> Solver:
    """CyRK, whose module needs it already to be imported."""
    from rigidpend.experiments.bench import cyrk_compiled

    return cyrk_compiled.answered(task, tolerance, **setting)


ADAPTERS: dict[str, Callable[..., Solver]] = {
    "ours": ours.answered,
    "heyoka": in_lanes,
    "cyrk": _compiled,
    "diffrax": vmapped,
    "scipy": abreast,
}
"""From a task, a tolerance, threads and a setting to the answer: by the family of a method."""
