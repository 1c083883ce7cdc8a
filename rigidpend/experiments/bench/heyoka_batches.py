"""heyoka as its experts use it: orbits side by side in lanes, on Euler-Poisson or on (eq1).

The number of lanes is searched over by the benchmark. An integrator of one orbit, compact mode
and the library's own ensemble were, too, and took more time at every problem. With the numbers of
a body as parameters it is compiled once for all bodies; compiled for each, it is 4 % faster then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.solvers import (
    Crossed,
    Ends,
    Solver,
    Task,
    answering,
    in_looks,
    shared_out,
    time_unit,
    with_angles,
)
from rigidpend.experiments.principal_axes import euler_poisson_field, heyoka
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import (
    andoyer_from_body,
    andoyer_from_canonical,
    body_from_andoyer,
    canonical,
    canonical_from_andoyer,
)
from rigidpend.mechanics.equations import eq1
from rigidpend.numbers.expressions import NO_SYMBOL
from rigidpend.numbers.generic import Array
from rigidpend.routes.phases import Phases


class Equations(NamedTuple):
    """Equations for heyoka."""

    names: list[Any]
    rates: list[Any]
    numbers: Sequence[float] = ()
    """Values of the parameters in them."""


def answered(
    task: Task,
    tolerance: float,
    threads: int,
    lanes: int,
    eq1: bool = False,
    parameters: bool = False,
) -> Solver:
    """The answer to any task; by (eq1) in the paper's variables theta1, J1, theta2, J2.

    With `parameters` the numbers of the body are parameters of what is compiled.
    """
    body = task.body
    if eq1:
        return _by_eq1(task, tolerance, threads, lanes, parameters)

    def ends(part: Task) -> Ends:
        return _ends(_principal(body, len(part.states), parameters), tolerance, lanes)

    def crossings(part: Task) -> Callable[[], Array]:
        system = _principal(body, 6, parameters)
        follower = Follower(system, system.names[2], (0, 1), part, tolerance, lanes)
        return lambda: follower.run(part.states)

    return answering(task, threads, ends, crossings)


def _by_eq1(task: Task, tolerance: float, threads: int, lanes: int, parameters: bool) -> Solver:
    body, system = task.body, _eq1(task.body, parameters)
    if task.kind == "routes":
        section, begun = system.names[1] - system.names[3] / 2.0, _eq1_start(task)

        def find(part: Task) -> Callable[[], Array]:
            follower = Follower(system, section, (0,), part, tolerance, lanes)
            return lambda: follower.run(part.states)

        return Solver(shared_out(find, begun, threads), _by_side)
    begun = task._replace(states=_to_eq1(task.states, body), times=time_unit(body) * task.times)
    solve = shared_out(lambda x: in_looks(x, _ends(system, tolerance, lanes)), begun, threads)
    return Solver(solve, lambda found: np.array([_from_eq1(y, body) for y in found]))


def _principal(body: Body, size: int, parameters: bool) -> Equations:
    hy, make = heyoka(), with_angles if size == 8 else euler_poisson_field
    names = [hy.make_vars(f"x{i}") for i in range(size)]
    A, r, mu = body.floats()
    if not parameters:
        return Equations(names, list(make(A, r, mu)(names)))
    numbers = (*A, mu * r[0], mu * r[1])
    field = make([hy.par[i] for i in range(3)], [hy.par[3], hy.par[4], 0.0], 1.0)
    return Equations(names, list(field(names)), numbers)


def _eq1(body: Body, parameters: bool) -> Equations:
    hy, p = heyoka(), body.angles()
    names, numbers = hy.make_vars("theta1", "J1", "theta2", "J2"), list(map(float, p))
    # Symbols throughout: heyoka's cosine takes nothing else.
    symbols = [hy.par[k] if parameters else hy.expression(x) for k, x in enumerate(numbers)]
    rates = eq1(names, type(p)(*symbols), hy)
    return Equations(names, list(rates), numbers if parameters else ())


def _eq1_start(task: Task) -> Task:
    body, p = task.body, task.routes
    states = np.empty((4, task.states.shape[1]))
    states[0], states[1] = body.alpha0 + body.beta0, float(p.J1_0)
    states[2], states[3] = Phases(task.theta2_0).high, float(p.J2_0(53))
    return task._replace(states=states, times=time_unit(body) * task.times)


def _to_eq1(states: Array, body: Body) -> Array:
    s = time_unit(body)
    c = canonical_from_andoyer(andoyer_from_body(s * states[:3], states[3:]), body.beta0)
    return np.stack((c.theta1, c.J1, c.theta2, c.J2))


def _from_eq1(found: Array, body: Body) -> Array:
    theta1, J1, theta2, J2 = found
    c = canonical(J1, J2, np.zeros_like(J1), theta1, theta2)
    M, gamma = body_from_andoyer(andoyer_from_canonical(c, body.beta0))
    return np.concatenate((M / time_unit(body), gamma))


def _by_side(found: Array) -> Crossed:
    """A symbol is 1 where theta1, which goes on beyond 4 pi, has grown between crossings."""
    time, theta1 = found
    step = np.diff(theta1, axis=0)
    return Crossed(np.where(np.isnan(step), NO_SYMBOL, step > 0).astype(np.uint8), time)


def _compiled(system: Equations, tolerance: float, lanes: int, **events: Any) -> Any:
    make, rates = heyoka().taylor_adaptive_batch, zip(system.names, system.rates, strict=True)
    made = make(list(rates), np.zeros((len(system.names), lanes)), tol=tolerance, **events)
    if system.numbers:
        made.pars[:] = np.array(system.numbers)[:, None]
    return made


def _ends(system: Equations, tolerance: float, lanes: int) -> Ends:
    """Give a function that carries orbits (d, n) on, as many at once as there are lanes."""
    made = _compiled(system, tolerance, lanes)

    def carry(states: Array, start: float, times: Array) -> Array:
        after, n = np.empty_like(states), states.shape[1]
        for first in range(0, n, lanes):
            # The last orbit is repeated where there are too few.
            some = np.minimum(np.arange(first, first + lanes), n - 1)
            made.set_time(start)
            made.state[:] = states[:, some]
            made.propagate_until(times[some])
            after[:, first : first + lanes] = made.state[:, : n - first]
        return after

    return carry


class Follower:
    """Orbits followed side by side in lanes to the zeros of a section."""

    def __init__(
        self,
        system: Equations,
        section: Any,
        kept: tuple[int, ...],
        task: Task,
        tolerance: float,
        lanes: int,
    ) -> None:
        """Compile it; `kept` are components of the state that are told of each zero."""
        self.kept, self.wanted, self.lanes = kept, task.routes.n_symbols + 1, lanes
        self.limit = float(task.times.max())
        self.column, self.count = [0] * lanes, [0] * lanes
        event = heyoka().t_event_batch(section, callback=lambda made, _, k: self._write(made, k))
        self.integrator = _compiled(system, tolerance, lanes, t_events=[event])
        self.state = self.integrator.state

    def run(self, states: Array) -> Array:
        """Times of `wanted` zeros and what is kept there, (1 + k, wanted, n); NaN for none.

        A lane whose orbit is done takes the next one.
        """
        made, n = self.integrator, states.shape[1]
        self.found = np.full((1 + len(self.kept), self.wanted, n), np.nan)
        waiting, until = iter(range(n)), np.zeros(self.lanes)
        made.state[:] = states[:, :1]
        made.set_time(0.0)
        busy = {lane for lane in range(self.lanes) if self._load(lane, waiting, states, until)}
        while busy:
            made.propagate_until(until)
            for lane in list(busy):
                # An orbit that a loose tolerance has spoilt has a time that is none.
                running = made.time[lane] < until[lane] and np.isfinite(made.state[:, lane]).all()
                if self.count[lane] < self.wanted and running:
                    continue
                if not self._load(lane, waiting, states, until):
                    busy.discard(lane)
        return self.found

    def _write(self, made: Any, lane: int) -> bool:
        k, column = self.count[lane], self.column[lane]
        self.count[lane] = k + 1
        if k < self.wanted:
            self.found[:, k, column] = made.time[lane], *(self.state[i, lane] for i in self.kept)
        return k + 1 < self.wanted

    def _load(self, lane: int, waiting: Iterator[int], states: Array, until: Array) -> bool:
        """Put the next orbit into a lane; without one, let it idle and return False."""
        made, column = self.integrator, next(waiting, None)
        times = np.where(np.isfinite(made.time), made.time, 0.0)
        times[lane], self.count[lane] = 0.0, 0
        made.set_time(times)
        until[lane] = 0.0 if column is None else self.limit
        made.state[:, lane] = states[:, column or 0]
        if column is not None:
            self.column[lane] = column
            made.reset_cooldowns(lane)
        return column is not None
