"""Solvers: a method made ready for a task, its orbits shared by threads.

An adapter is a function ``answered(task, tolerance, threads, **setting)`` that returns a `Solver`.
Peers do not know threads: each thread has a peer made ready for its part of the orbits, see
:func:`shared`. Peers integrate the package's own field.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.problems import Crossed, Task, time_unit
from rigidpend.experiments.principal_axes import beside, euler_poisson_field
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import separatrix_theta1
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.kernel.tape import trace
from rigidpend.routes.cycle import symbols

SMALLER = 1e-2
"""Absolute tolerance over the relative one, for components that pass through zero."""
SIGNS = {"plus": "+", "minus": "-", "times": "*", "divided": "/"}


class Solver(NamedTuple):
    """A method made ready for a task."""

    solve: Callable[[], Any]
    """The work that is timed."""
    read: Callable[[Any], Crossed] = lambda found: found
    """Makes the answer from the result of `solve`, untimed."""


Make = Callable[[Task], Solver]


def shared(follows: Callable[..., Callable[[], Array]]) -> Callable[..., Solver]:
    """Make the adapter of a peer from a function that follows some orbits; threads share them.

    It suits methods that release Python's lock while they compute. `follows` gives a function that
    returns, at crossings of M3 = 0, (3, n_symbols + 1, n): the physical time, NaN where there is
    no crossing, and M1 and M2 there.
    """

    @functools.wraps(follows)
    def answered(task: Task, tolerance: Any, threads: int, **setting: Any) -> Solver:
        read = functools.partial(_crossed, body=task.problem.body)
        if threads == 1:
            return Solver(follows(task, tolerance, **setting), read)
        columns = np.array_split(np.arange(task.states.shape[1]), threads)
        parts = [follows(task.of(part), tolerance, **setting) for part in columns if part.size]
        pool = ThreadPoolExecutor(len(parts))
        solve = lambda: np.concatenate(list(pool.map(lambda x: x(), parts)), axis=2)  # noqa: E731
        return Solver(solve, read)

    return answered


def _crossed(found: Array, body: Body) -> Crossed:
    time, M1, M2 = found
    places = separatrix_theta1(body.alpha0, body.beta0)
    theta1 = np.where(np.isnan(time), np.nan, 2 * np.arctan2(M1, M2) + body.beta0)
    return Crossed(symbols(beside(theta1, places)), time_unit(body) * time)


def flat(body: Body) -> Any:
    """Write ``rates(dy, t, y, args)``, which takes floats or arrays, and which numba can compile.

    Each quantity is a local variable, as in fast code written by hand, from the same tape as the
    package's own compiled fields.
    """
    A, r, mu = body.floats()
    # The moments are traced as components, because the tape turns division by a parameter into
    # multiplication by its reciprocal; with quotients, which round once, CyRK was a sixth faster.
    traced, parameters = trace(lambda y: euler_poisson_field(y[6:], r, mu)(y[:6]), 9)
    components = [*(f"y{i}" for i in range(6)), *map(repr, A)]
    names: list[str] = []
    known: dict[str, str] = {}
    for name, operands in traced.lines:
        if name == "component":
            names.append(components[operands[0]])
        elif name == "parameter":
            names.append(repr(parameters[operands[0]]))
        else:
            left, right = (names[i] for i in operands)
            # The tape keeps equal parameters apart; expressions that agree in text are joined here.
            names.append(known.setdefault(f"{left} {SIGNS[name]} {right}", f"x{len(known)}"))
    lines = [
        *(f"y{i} = y[{i}]" for i in range(6)),
        *(f"{name} = {expression}" for expression, name in known.items()),
        *(f"dy[{i}] = {names[k]}" for i, k in enumerate(traced.rates)),
    ]
    room: dict[str, Any] = {}
    exec(compile("\n    ".join(["def rates(dy, t, y, args):", *lines]), "<field>", "exec"), room)
    return room["rates"]
