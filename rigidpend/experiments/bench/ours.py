"""Ours: one computation by Taylor series on aligned components, or route codes."""

from __future__ import annotations

from typing import Any

from rigidpend.experiments.bench.problems import Crossed, Task
from rigidpend.experiments.bench.solvers import Solver
from rigidpend.orbits.integrate.arithmetic import Arithmetic, resolve
from rigidpend.routes import codes
from rigidpend.routes.certainty import FIRST
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run


def answered(task: Task, tolerance: Any, threads: int, way: str = "") -> Solver:
    """The answer to a task.

    The way is a method of `route_codes`, where every symbol is told by two computations; without
    one, the first of these alone answers, series of a tolerance in doubles.
    """
    if way:
        given = task.problem, task.theta2_0, resolve(), threads, way
        return Solver(
            lambda: codes.codes_of(*given, kept=True),
            lambda found: Crossed(found.codes, found.crossing_time, found.certain),
        )
    run = Run(task.problem, Phases(task.theta2_0), Arithmetic("taylor", tolerance, (53,)), threads)
    every = range(len(run.phases))
    return Solver(
        lambda: run.crossings(53, FIRST, every),
        lambda found: Crossed(symbols(found.separatrix), found.time),
    )
