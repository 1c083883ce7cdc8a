"""Solvers: a method made ready for a task, its orbits shared by threads.

An adapter is a function ``answered(task, tolerance, threads, **setting)`` that gives a `Solver`.
Most know nothing of threads, and are made ready for a part of the orbits: see :func:`shared`. The
fields that they integrate are composed of the package's equations.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.problems import FIELDS, Crossed, Task, time_unit
from rigidpend.experiments.principal_axes import beside
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import separatrix_theta1
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.kernel.tape import trace
from rigidpend.routes.cycle import symbols

SMALLER = 1e-2
"""The absolute tolerance, of the relative one: for components that pass through zero."""
SIGNS = {"plus": "+", "minus": "-", "times": "*", "divided": "/"}


class Solver(NamedTuple):
    """A method made ready for a task."""

    solve: Callable[[], Any]
    """All the work that is timed."""
    read: Callable[[Any], Any] = lambda found: found
    """From what `solve` gave to the answer: states (6 or 8, n), alpha (1, n) or `Crossed`."""


Make = Callable[[Task], Solver]
Solve = Callable[[], Array]


def shared(adapter: Callable[..., Solver]) -> Callable[..., Solver]:
    """The adapter of all orbits, which threads share, from one of a part of them.

    It serves every method that leaves Python's lock while it computes.
    """

    @functools.wraps(adapter)
    def answered(task: Task, tolerance: Any, threads: int, **setting: Any) -> Solver:
        if threads == 1:
            return adapter(task, tolerance, **setting)
        columns = np.array_split(np.arange(task.states.shape[1]), threads)
        parts = [adapter(task.of(part), tolerance, **setting) for part in columns if part.size]
        pool = ThreadPoolExecutor(len(parts))

        def read(found: list[Any]) -> Any:
            answers = [part.read(one) for part, one in zip(parts, found, strict=True)]
            if task.kind != "routes":
                return np.concatenate(answers, axis=-1)
            return Crossed(*(np.hstack([x[k] for x in answers]) for k in range(2)))

        return Solver(lambda: list(pool.map(lambda part: part.solve(), parts)), read)

    return answered


def crossed(found: Array, body: Body) -> Crossed:
    """The answer from what was found at crossings of M3 = 0, (3, n_symbols + 1, n).

    That is the physical time, NaN where there is no crossing, and M1 and M2 there.
    """
    time, M1, M2 = found
    places = separatrix_theta1(body.alpha0, body.beta0)
    theta1 = np.where(np.isnan(time), np.nan, 2 * np.arctan2(M1, M2) + body.beta0)
    return Crossed(symbols(beside(theta1, places)), time_unit(body) * time)


def flat(body: Body, size: int) -> Any:
    """Write ``rates(dy, t, y, args)``, which takes floats or arrays, and which numba can compile.

    Each quantity is a local variable, as a hand would write it for speed, from the tape that the
    package's own compiled fields are made of.
    """
    A, r, mu = body.floats()
    # The moments are components too, for the tape multiplies by reciprocals of parameters: with
    # quotients, which round once, CyRK was a sixth faster.
    traced, parameters = trace(lambda y: FIELDS[size](y[size:], r, mu)(y[:size]), size + 3)
    components = [*(f"y{i}" for i in range(size)), *map(repr, A)]
    names: list[str] = []
    known: dict[str, str] = {}
    for name, operands in traced.lines:
        if name == "component":
            names.append(components[operands[0]])
        elif name == "parameter":
            names.append(repr(parameters[operands[0]]))
        else:
            left, right = (names[i] for i in operands)
            text = f"{left} {SIGNS[name]} {right}"
            # The tape tells parameters apart, even equal ones.
            whole = name == "divided" and right == "1.0"
            names.append(left if whole else known.setdefault(text, f"x{len(known)}"))
    lines = [
        *(f"y{i} = y[{i}]" for i in range(size)),
        *(f"{name} = {expression}" for expression, name in known.items()),
        *(f"dy[{i}] = {names[k]}" for i, k in enumerate(traced.rates)),
    ]
    room: dict[str, Any] = {}
    exec(compile("\n    ".join(["def rates(dy, t, y, args):", *lines]), "<field>", "exec"), room)
    return room["rates"]
