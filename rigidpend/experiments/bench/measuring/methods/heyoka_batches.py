"""heyoka as its experts use it: orbits side by side in batches, any field, with or without events.

What can be chosen, and is searched over by the benchmark: the number of lanes (1 is heyoka's
integrator of one orbit), compact mode, and whether a crossing is a terminal event or not. A lane
whose orbit is done takes the next one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.measuring import tasks
from rigidpend.experiments.bench.measuring.tasks import Carrier
from rigidpend.experiments.heyoka_peer import heyoka
from rigidpend.numbers.doubles import Array


class Build(NamedTuple):
    """Build of an integrator."""

    lanes: int = 8
    compact: bool = False
    terminal: bool = True
    """True if a crossing ends the step; else it is looked up in it."""


class BatchCrossings(NamedTuple):
    """Zeros of a section along each orbit."""

    time: Array
    """(wanted, n), in the time of the system; NaN where there is none."""
    kept: Array
    """(k, wanted, n): those components of the state that were asked for."""
    rising: Any
    """(wanted, n) of bool."""


def carrier(system: Any, states: Array, tolerance: float, build: Build) -> Carrier:
    """Carry orbits (d, n) on, as many at once as there are lanes."""
    made = _compiled(system, tolerance, build)

    def advance(states: Array, start: float, end: float) -> Array:
        return _carried(made, states, start, np.full(states.shape[1], end))

    return tasks.carrier(states, advance)


def ends(
    system: Any, states: Array, times: Array, tolerance: float, build: Build
) -> Callable[[], Array]:
    """Give a function that carries orbits from time 0, each to its own end; (d, n)."""
    made = _compiled(system, tolerance, build)
    return lambda: _carried(made, states, 0.0, times)


def ensemble(system: Any, states: Array, tolerance: float, build: Build, threads: int) -> Carrier:
    """Carry orbits on by `ensemble_propagate_until_batch`, which copies its integrator."""
    hy, width = heyoka(), build.lanes
    made = _compiled(system, tolerance, build)

    def advance(before: Array, start: float, end: float) -> Array:
        def loaded(integrator: Any, part: int) -> Any:
            integrator.set_time(start)
            integrator.state[:] = _lanes(before, part * width, width)
            return integrator

        parts = -(-before.shape[1] // width)
        ended = hy.ensemble_propagate_until_batch(made, end, parts, loaded, max_workers=threads)
        after = np.concatenate([result[0].state for result in ended], axis=1)
        return after[:, : before.shape[1]]

    return tasks.carrier(states, advance)


def crossings(
    system: Any,
    section: Any,
    states: Array,
    kept: tuple[int, ...],
    wanted: int,
    limit: float,
    tolerance: float,
    build: Build,
) -> Callable[[], BatchCrossings]:
    """Give a function that follows orbits to their `wanted` zeros of `section`.

    Parameters
    ----------
    states : (d, n) array
    kept : tuple of int
        Components of the state to be kept at each zero: exactly there where events are
        terminal, else at the end of the step in which it lies, which tells their sign.
    limit : float
        A time at which to give up.
    """
    follow = (_Lanes if build.lanes > 1 else _OneByOne)(
        system, section, kept, wanted, limit, tolerance, build
    )
    return lambda: follow.run(states)


def _compiled(system: Any, tolerance: float, build: Build, **events: Any) -> Any:
    hy, d = heyoka(), len(system)
    shape = d if build.lanes == 1 else (d, build.lanes)
    make = hy.taylor_adaptive if build.lanes == 1 else hy.taylor_adaptive_batch
    return make(system, np.zeros(shape), tol=tolerance, compact_mode=build.compact, **events)


def _carried(made: Any, states: Array, start: float, times: Array) -> Array:
    after = np.empty_like(states)
    if made.state.ndim == 1:
        for k in range(states.shape[1]):
            made.time, made.state[:] = start, states[:, k]
            made.propagate_until(times[k])
            after[:, k] = made.state
        return after
    width = made.state.shape[1]
    for first in range(0, states.shape[1], width):
        made.set_time(start)
        made.state[:] = _lanes(states, first, width)
        made.propagate_until(_lanes(times[None], first, width)[0])
        count = min(width, states.shape[1] - first)
        after[:, first : first + count] = made.state[:, :count]
    return after


def _lanes(values: Array, first: int, width: int) -> Array:
    """Columns from `first` on; the last one is repeated where there are too few."""
    return values[:, np.minimum(np.arange(first, first + width), values.shape[1] - 1)]


class _Follower:
    """Shared part of both ways to follow orbits: the event, and its record."""

    def __init__(
        self,
        system: Any,
        section: Any,
        kept: tuple[int, ...],
        wanted: int,
        limit: float,
        tolerance: float,
        build: Build,
    ) -> None:
        self.kept, self.wanted, self.limit = list(kept), wanted, limit
        kind = ("t_event" if build.terminal else "nt_event") + ("_batch" * (build.lanes > 1))
        event = getattr(heyoka(), kind)(section, callback=self.recorder(build.terminal))
        name = "t_events" if build.terminal else "nt_events"
        self.integrator = _compiled(system, tolerance, build, **{name: [event]})
        self.steps: dict[str, Any] = {} if build.terminal else {"callback": self.go_on}

    def recorder(self, terminal: bool) -> Any:
        raise NotImplementedError

    def go_on(self, _: Any) -> bool:
        """Step callback of events that are not terminal: stop where an orbit is done."""
        raise NotImplementedError

    def empty(self, n: int) -> BatchCrossings:
        shape = (self.wanted, n)
        return BatchCrossings(
            np.full(shape, np.nan),
            np.full((len(self.kept), *shape), np.nan),
            np.zeros(shape, dtype=bool),
        )


class _OneByOne(_Follower):
    """One orbit after the other."""

    found: BatchCrossings
    column = count = 0

    def recorder(self, terminal: bool) -> Any:
        me = self

        def write(integrator: Any, time: float, direction: int) -> bool:
            if me.count < me.wanted:
                me.found.time[me.count, me.column] = time
                me.found.kept[:, me.count, me.column] = integrator.state[me.kept]
                me.found.rising[me.count, me.column] = direction > 0
            me.count += 1
            return me.count < me.wanted

        if terminal:
            return lambda integrator, d: write(integrator, integrator.time, d)
        return lambda integrator, time, d: write(integrator, time, d) and None

    def go_on(self, _: Any) -> bool:
        return self.count < self.wanted

    def run(self, states: Array) -> BatchCrossings:
        self.found, made = self.empty(states.shape[1]), self.integrator
        for self.column, state in enumerate(states.T):
            self.count = 0
            made.time, made.state[:] = 0.0, state
            made.reset_cooldowns()
            made.propagate_until(self.limit, **self.steps)
        return self.found


class _Lanes(_Follower):
    """As many orbits at once as there are lanes."""

    found: BatchCrossings

    def __init__(self, *given: Any) -> None:
        self.lanes: int = given[-1].lanes
        self.column, self.count = [0] * self.lanes, [0] * self.lanes
        super().__init__(*given)
        self.state = self.integrator.state

    def recorder(self, terminal: bool) -> Any:
        me = self

        def write(time: float, direction: int, lane: int) -> bool:
            k, column = me.count[lane], me.column[lane]
            me.count[lane] = k + 1
            if k < me.wanted:
                me.found.time[k, column] = time
                me.found.rising[k, column] = direction > 0
                for i, component in enumerate(me.kept):
                    me.found.kept[i, k, column] = me.state[component, lane]
            return k + 1 < me.wanted

        if terminal:
            return lambda integrator, d, lane: write(integrator.time[lane], d, lane)
        return lambda integrator, time, d, lane: write(time, d, lane) and None

    def go_on(self, _: Any) -> bool:
        return max(self.count) < self.wanted

    def run(self, states: Array) -> BatchCrossings:
        made, width, n = self.integrator, self.lanes, states.shape[1]
        self.found = self.empty(n)
        waiting, until = iter(range(n)), np.zeros(width)
        made.state[:] = states[:, :1]
        made.set_time(0.0)
        busy = {lane for lane in range(width) if self._load(lane, waiting, states, until)}
        while busy:
            made.propagate_until(until, **self.steps)
            for lane in list(busy):
                # An orbit that a loose tolerance has spoilt has a time that is none.
                running = made.time[lane] < until[lane] and np.isfinite(self.state[:, lane]).all()
                if self.count[lane] < self.wanted and running:
                    continue
                if not self._load(lane, waiting, states, until):
                    busy.discard(lane)
        return self.found

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
