"""Engine `taylor`, orbits at given times: of any field, or batches of the aligned field."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.integrate.compiled import aligned_system, borrowed, heyoka
from rigidpend.numbers.generic import Numbers
from rigidpend.run.workers import check_stop

AT_ONCE = 20_000
"""Steps in a call, which cannot be interrupted; of a batch they take some 30 ms."""
FEW = 64
"""Up to so many times are reached one by one, for they may lie far apart."""
PIECE = 1024
"""Times in a call, if they are more."""


def sample(field: Any, state: Numbers, times: Numbers, tolerance: float) -> Any:
    """An orbit of any field at given times (see `rigidpend.integrate.sample`)."""
    with borrowed(_Alone, _system(field, len(state)), tolerance) as alone:
        ending, *_, states = alone.run(state, times)
    if int(ending) != int(heyoka().taylor_outcome.time_limit):
        raise ArithmeticError(f"the integration ended early: {ending}")
    return states.T


def ends(field: Any, states: Numbers, times: Numbers, tolerance: float) -> Any:
    """Orbits of any field, each at a time of its own (see `rigidpend.integrate.ends`)."""
    n, found = len(times), np.empty_like(states)
    width = min(n, heyoka().recommended_simd_size())
    with borrowed(_Abreast, _system(field, len(states)), width, tolerance) as abreast:
        for first in range(0, n, width):
            # The last batch is filled up with orbits that are computed again.
            columns = slice(min(first, n - width), first + width)
            found[:, columns] = abreast.run(states[:, columns], times[columns])
    if not np.isfinite(found).all():
        raise ArithmeticError("an orbit did not reach its time")
    return found


def sample_batch(coefficients: Any, states: Numbers, times: Numbers, tolerance: float) -> Any:
    """Orbits of the aligned field (see `rigidpend.integrate.sample_orbits`)."""
    n = states.shape[1]
    found = np.empty((6, times.size, n))
    with borrowed(_Sampler, tolerance) as sampler:
        for first in range(0, n, sampler.width):
            columns = slice(first, min(first + sampler.width, n))
            found[..., columns] = sampler.run(coefficients, states[:, columns], times)
    return found


def _system(field: Any, size: int) -> tuple[Any, ...]:
    """The equations in heyoka's expressions, which can be compared: equal ones share code."""
    names = [heyoka().make_vars(f"x{i}") for i in range(size)]
    return tuple(zip(names, field(names, _Functions()), strict=True))


class _Alone:
    """An integrator of one orbit."""

    def __init__(self, system: Any, tolerance: float) -> None:
        self.integrator = heyoka().taylor_adaptive(
            list(system), np.zeros(len(system)), tol=tolerance
        )

    def run(self, state: Numbers, times: Numbers) -> Any:
        self.integrator.time = times[0]
        self.integrator.state[:] = state
        return self.integrator.propagate_grid(times)


class _Abreast:
    """A batch integrator, of which each lane goes as far as it is told."""

    def __init__(self, system: Any, width: int, tolerance: float) -> None:
        self.integrator = heyoka().taylor_adaptive_batch(
            list(system), np.zeros((len(system), width)), tol=tolerance
        )

    def run(self, states: Numbers, times: Numbers) -> Any:
        self.integrator.set_time(0.0)
        self.integrator.state[:] = states
        _advance(self.integrator, times)
        return self.integrator.state


class _Sampler:
    """A batch integrator without events."""

    def __init__(self, tolerance: float) -> None:
        hy = heyoka()
        self.width = hy.recommended_simd_size()
        field, _ = aligned_system(hy)
        self.integrator = hy.taylor_adaptive_batch(
            field,
            np.zeros((6, self.width)),
            pars=np.zeros((9, self.width)),
            tol=tolerance,
        )

    def run(self, coefficients: Any, states: Numbers, times: Numbers) -> Any:
        """At most `width` orbits; lanes without an orbit repeat the first."""
        n = states.shape[1]
        lanes = np.concatenate((states, np.repeat(states[:, :1], self.width - n, axis=1)), axis=1)
        self.integrator.pars[:] = np.asarray(coefficients)[:, None]
        self.integrator.set_time(times[0])
        self.integrator.state[:] = lanes
        found = self._between(lanes, times)
        if not np.isfinite(found).all():
            raise ArithmeticError("an orbit did not reach the last of the times")
        return found.transpose(1, 0, 2)[..., :n]

    def _between(self, lanes: Numbers, times: Numbers) -> Any:
        if times.size > FEW:
            grid = np.repeat(times[:, None], self.width, axis=1)
            # Each piece begins at the last time of the one before, where the integrator is.
            pieces = [grid[k : k + PIECE + 1] for k in range(0, len(grid) - 1, PIECE)]
            return np.concatenate([lanes[None], *(self._on_grid(piece)[1:] for piece in pieces)])
        found = [lanes]
        for time in times[1:]:
            _advance(self.integrator, time)
            found.append(self.integrator.state.copy())
        return np.stack(found)

    def _on_grid(self, grid: Numbers) -> Any:
        check_stop()
        return self.integrator.propagate_grid(grid)[1]


def _advance(integrator: Any, until: Any) -> None:
    """Carry the lanes to a time, in calls that are short enough to wait for."""
    outcomes = heyoka().taylor_outcome
    while True:
        check_stop()
        integrator.propagate_until(until, max_steps=AT_ONCE)
        endings = {int(result[0]) for result in integrator.propagate_res}
        if int(outcomes.err_nf_state) in endings or int(outcomes.step_limit) not in endings:
            return


class _Functions:
    """The namespace of a field: heyoka's functions of symbols, math's of plain numbers."""

    def __getattr__(self, name: str) -> Callable[[Any], Any]:
        hy = heyoka()
        of_symbol, of_number = getattr(hy, name), getattr(math, name)
        return lambda x: (of_symbol if isinstance(x, hy.expression) else of_number)(x)
