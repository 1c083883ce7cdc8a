"""heyoka as its experts use it: orbits side by side in batches, any field, with or without events.

What can be chosen, and is searched over by the benchmark: the number of lanes (1 is heyoka's
integrator of one orbit), and compact mode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import Carrier, carrier
from rigidpend.experiments.heyoka_peer import heyoka
from rigidpend.numbers.doubles import Array


class Build(NamedTuple):
    """Build of an integrator."""

    lanes: int = 8
    compact: bool = False


def ends(system: Any, tolerance: float, build: Build) -> Callable[[Array, float, Array], Array]:
    """Give a function that carries orbits (d, n) on, as many at once as there are lanes."""
    made, width = _compiled(system, tolerance, build), build.lanes

    def one_by_one(states: Array, start: float, times: Array) -> Array:
        after = np.empty_like(states)
        for k in range(states.shape[1]):
            made.time, made.state[:] = start, states[:, k]
            made.propagate_until(times[k])
            after[:, k] = made.state
        return after

    def side_by_side(states: Array, start: float, times: Array) -> Array:
        after = np.empty_like(states)
        for first in range(0, states.shape[1], width):
            made.set_time(start)
            made.state[:] = _lanes(states, first, width)
            made.propagate_until(_lanes(times[None], first, width)[0])
            count = min(width, states.shape[1] - first)
            after[:, first : first + count] = made.state[:, :count]
        return after

    return one_by_one if width == 1 else side_by_side


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

    return carrier(states, advance)


def _compiled(system: Any, tolerance: float, build: Build, **events: Any) -> Any:
    hy, d = heyoka(), len(system)
    shape = d if build.lanes == 1 else (d, build.lanes)
    make = hy.taylor_adaptive if build.lanes == 1 else hy.taylor_adaptive_batch
    return make(system, np.zeros(shape), tol=tolerance, compact_mode=build.compact, **events)


def _lanes(values: Array, first: int, width: int) -> Array:
    """Columns from `first` on; the last one is repeated where there are too few."""
    return values[:, np.minimum(np.arange(first, first + width), values.shape[1] - 1)]


class Follower:
    """Orbits followed to zeros of a section: one after the other, or side by side in lanes."""

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
        """Compile it; `kept` are components of the state, `limit` is a time at which to give up."""
        self.kept, self.wanted, self.limit, self.lanes = kept, wanted, limit, build.lanes
        self.column, self.count = [0] * self.lanes, [0] * self.lanes
        hy, write = heyoka(), self._write
        event = (
            hy.t_event(section, callback=lambda made, _: write(made.time, 0))
            if self.lanes == 1
            else hy.t_event_batch(section, callback=lambda made, _, k: write(made.time[k], k))
        )
        self.integrator = _compiled(system, tolerance, build, t_events=[event])
        self.state = self.integrator.state.reshape(len(system), self.lanes)

    def run(self, states: Array) -> Array:
        """Times of `wanted` zeros and what is kept there, (1 + k, wanted, n); NaN for none."""
        shape = 1 + len(self.kept), self.wanted, states.shape[1]
        self.found = np.full(shape, np.nan)
        if self.lanes == 1:
            self._run_one_by_one(states)
        else:
            self._run_side_by_side(states)
        return self.found

    def _write(self, time: float, lane: int) -> bool:
        k, column = self.count[lane], self.column[lane]
        self.count[lane] = k + 1
        if k < self.wanted:
            self.found[0, k, column] = time
            for i, component in enumerate(self.kept, 1):
                self.found[i, k, column] = self.state[component, lane]
        return k + 1 < self.wanted

    def _run_one_by_one(self, states: Array) -> None:
        made = self.integrator
        for column, state in enumerate(states.T):
            self.column[0], self.count[0] = column, 0
            made.time, made.state[:] = 0.0, state
            made.reset_cooldowns()
            made.propagate_until(self.limit)

    def _run_side_by_side(self, states: Array) -> None:
        """A lane whose orbit is done takes the next one."""
        made, width = self.integrator, self.lanes
        waiting, until = iter(range(states.shape[1])), np.zeros(width)
        made.state[:] = states[:, :1]
        made.set_time(0.0)
        busy = {lane for lane in range(width) if self._load(lane, waiting, states, until)}
        while busy:
            made.propagate_until(until)
            for lane in list(busy):
                # An orbit that a loose tolerance has spoilt has a time that is none.
                running = made.time[lane] < until[lane] and np.isfinite(self.state[:, lane]).all()
                if self.count[lane] < self.wanted and running:
                    continue
                if not self._load(lane, waiting, states, until):
                    busy.discard(lane)

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
