"""Solvers: a method made ready for a task, its orbits shared by threads.

An adapter is a function ``answered(task, tolerance, threads, **setting)`` that gives a `Solver`.
Most methods carry states to their ends, and find crossings by themselves: two functions of a part
of the orbits, which :func:`answering` makes the answer to any task. The fields that they integrate
are composed of the package's equations.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.problems import FIELDS, Crossed, Task, time_unit
from rigidpend.mechanics.body import Body
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
    """From what `solve` gave to the answer: states (6, n), `Crossed`, or alpha (n,)."""


Make = Callable[[Task], Solver]
Solve = Callable[[], Array]


def answering(
    task: Task, threads: int, ends: Callable[[Task], Solve], crossings: Callable[[Task], Solve]
) -> Solver:
    """The answer of a method that is made ready for a part of the orbits by two functions.

    What the one gives carries their states to the ends, (6 or 8, n); what the other gives finds
    time, M1 and M2 at their crossings of M3 = 0: (3, wanted, n), NaN where there is none.
    """
    if task.kind == "routes":
        find = shared_out(crossings, task, threads)
        return Solver(find, lambda found: crossed(found[0], found[1:], task.body))
    solve = shared_out(ends, task, threads)
    return Solver(solve, lambda found: found[7]) if task.kind == "angle" else Solver(solve)


def shared_out(make: Callable[[Task], Solve], task: Task, threads: int) -> Solve:
    """Give ``make(task)`` with the orbits shared among threads.

    It serves every method that leaves Python's lock while it computes. What is found has the
    orbits last.
    """
    if threads == 1:
        return make(task)
    columns = np.array_split(np.arange(task.states.shape[1]), threads)
    parts = [make(task.of(part)) for part in columns if part.size]
    pool = ThreadPoolExecutor(len(parts))
    return lambda: np.concatenate(list(pool.map(lambda solve: solve(), parts)), axis=-1)


def crossed(time: Any, M: Any, body: Body) -> Crossed:
    """The answer from what was found at crossings of M3 = 0.

    `time` is physical, (n_symbols + 1, n), NaN where there is no crossing; `M` are M1 and M2
    there, (2, n_symbols + 1, n), or near enough to have the signs of Qp and Qm.
    """
    # M3 goes upwards and downwards in turn.
    rising = np.arange(len(time))[:, None] % 2 == 0
    half = body.alpha0 / 2
    along, across = math.cos(half) * M[0], math.sin(half) * M[1]
    beside = np.where(rising, np.where(along + across > 0, 2, 4), np.where(along < across, 1, 3))
    return Crossed(symbols(np.where(np.isnan(time), 0, beside)), time_unit(body) * time)


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
