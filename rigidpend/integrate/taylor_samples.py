"""Engine `taylor`, orbits of any field at given times, by heyoka."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.integrate.compiled import borrowed, heyoka
from rigidpend.numbers.generic import Numbers
from rigidpend.run.workers import check_stop

AT_ONCE = 20_000
"""Steps in a call, which cannot be interrupted; of a batch they take some 30 ms."""


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
