"""What a script with heyoka does, one orbit after the other; the field is the caller's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.integrate.compiled import heyoka
from rigidpend.measure.benchmark.methods.real128 import typed
from rigidpend.measure.benchmark.tasks import Array, Crossed, Flow
from rigidpend.routes.cycle import symbols

Record = Callable[[Any, float, bool], tuple[float, Any]]


def number(bits: int) -> Callable[[Any], Any]:
    """What makes a number of `bits` bits."""
    if bits == 64:
        return lambda x: np.longdouble(float(x)) + np.longdouble(float(x - float(x)))
    return float if bits == 53 else typed


def integrator(system: Any, tolerance: float, bits: int = 53, **events: Any) -> Any:
    """heyoka's adaptive integrator in one of its types."""
    hy, make = heyoka(), number(bits)
    kinds = {53: float, 64: np.longdouble, 113: getattr(hy, "real128", None)}
    return hy.taylor_adaptive(
        system,
        [make(0)] * len(system),
        time=make(0),
        tol=make(tolerance * 2.0 ** (53 - bits)),
        fp_type=kinds[bits],
        compact_mode=bits > 64,
        **events,
    )


def flow(system: Any, states: Array, tolerance: float, bits: int = 53) -> Flow:
    """Orbits (d, n) carried on, one after the other."""
    ta, make = integrator(system, tolerance, bits), number(bits)
    first = [[make(float(x)) for x in state] for state in states.T]
    now: list[Any] = [make(0), first]

    def begin() -> None:
        now[:] = [make(0), first]

    def to(time: float) -> None:
        end = make(time)
        now[:] = [end, [_carried(ta, state, now[0], end) for state in now[1]]]

    return Flow(begin, to, lambda: np.array(now[1], dtype=float).T)


def ends(system: Any, states: Array, times: Any, tolerance: float) -> Callable[[], Array]:
    """A function that carries orbits from time 0, each to its own end."""
    ta = integrator(system, tolerance)

    def solve() -> Array:
        each = zip(states.T, times, strict=True)
        return np.array([_carried(ta, state, 0.0, end) for state, end in each]).T

    return solve


def events(
    system: Any,
    section: Any,
    record: Record,
    states: Array,
    tolerance: float,
    wanted: int,
    limit: float,
) -> Callable[[], list[list[tuple[float, Any]]]]:
    """A function that follows orbits to their `wanted` zeros of `section`, with a record of each.

    Parameters
    ----------
    record : callable
        ``record(state, time, rising)``.
    limit : float
        A time at which to give up.
    """
    hy = heyoka()
    found: list[list[tuple[float, Any]]] = []

    def at_event(ta: Any, direction: int) -> bool:
        found[-1].append(record(ta.state, ta.time, direction > 0))
        return len(found[-1]) < wanted

    ta = integrator(system, tolerance, t_events=[hy.t_event(section, callback=at_event)])

    def solve() -> list[list[tuple[float, Any]]]:
        found.clear()
        for state in states.T:
            found.append([])
            ta.time, ta.state[:] = 0.0, state
            ta.reset_cooldowns()
            ta.propagate_until(limit)
        return list(found)

    return solve


def read_crossings(found: Any) -> Crossed:
    """Symbols from the separatrices beside which each crossing lies; NaN and 0 where none is."""
    wanted = max(map(len, found))
    time, beside = np.full((wanted, len(found)), np.nan), np.zeros((wanted, len(found)), dtype=int)
    for column, orbit in enumerate(found):
        for k, (moment, separatrix) in enumerate(orbit[:wanted]):
            time[k, column], beside[k, column] = moment, separatrix
    return Crossed(symbols(beside), time)


def _carried(ta: Any, state: Any, start: Any, end: Any) -> Any:
    ta.time, ta.state[:] = start, state
    ta.propagate_until(end)
    return ta.state.copy()
