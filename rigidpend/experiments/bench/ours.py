"""Ours: Taylor series on aligned components, route codes, the pendulum in closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.problems import Crossed, Task, time_unit
from rigidpend.experiments.bench.solvers import Solver, shared
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import aligned_coefficients, energy
from rigidpend.mechanics.pendulum import body_motion
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import Arithmetic, resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes import codes
from rigidpend.routes.certainty import FIRST
from rigidpend.routes.cycle import symbols
from rigidpend.routes.herpolhode import alpha_at, initial_state
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run


def answered(task: Task, tolerance: Any, threads: int, way: str = "") -> Solver:
    """The answer to any task.

    The way is ``closed``, or a method of `route_codes`, where every symbol is told by two
    computations; else series of a tolerance in doubles, and no cross-check.
    """
    if way == "closed":
        return Solver(lambda: pendulums(task))
    if way:
        given = task.problem, task.theta2_0, resolve(), threads, way
        return Solver(
            lambda: codes.codes_of(*given, kept=True),
            lambda found: Crossed(found.codes, found.crossing_time, certain=found.certain),
        )
    if task.kind == "routes":
        return one_computation(task, tolerance, threads)
    return alpha(task, tolerance) if task.kind == "angle" else motion(task, tolerance, threads)


def one_computation(task: Task, tolerance: float, threads: int) -> Solver:
    """Symbols from the first of the two computations alone."""
    run = Run(task.problem, Phases(task.theta2_0), Arithmetic("taylor", tolerance, (53,)), threads)
    every = range(len(run.phases))
    return Solver(
        lambda: run.crossings(53, FIRST, every),
        lambda found: Crossed(symbols(found.separatrix), found.time),
    )


def alpha(task: Task, tolerance: float) -> Solver:
    """alpha(T) as rigidpend has it: theta3 by quadrature, alpha by (th_al), side by side."""
    beginning = [initial_state(task.problem, float(x)) for x in task.theta2_0]
    states, ends = np.stack(beginning, axis=1), time_unit(task.body) * task.times
    return Solver(lambda: alpha_at(task.body, states, ends, tolerance)[None])


@shared
def motion(task: Task, tolerance: float) -> Solver:
    """All orbits side by side, by `states.states_at`."""
    coefficients, s = aligned_coefficients(task.body.angles(), math), time_unit(task.body)
    # All orbits of a motion end at one time.
    states, ends = aligned_states(task.body, task.states), s * task.times[:1]

    def read(found: Array) -> Array:
        return np.concatenate(body_from_aligned(Aligned(*found), task.body.alpha0, s))

    return Solver(lambda: states_at(coefficients, states, ends, tolerance=tolerance)[:, 0], read)


def aligned_states(body: Body, states: Array) -> Array:
    """Aligned components (6, n) of states (6, n), doubles that are taken exactly, rounded once.

    In more bits than doubles: beside a separatrix the small component is a difference, and what is
    lost there the whole orbit shows.
    """
    m = context(53 + GUARD_BITS)
    half = body.angles(53 + GUARD_BITS).alpha0 / 2
    s = scale([x.in_context(m) for x in body.A], m)
    found = states.copy()
    found[2] *= float(s)
    for k, (M1, M2) in enumerate(states[:2].T):
        x, y = s * m.cos(half) * m.mpf(M1), s * m.sin(half) * m.mpf(M2)
        found[:2, k] = float(x + y), float(x - y)
    return found


def pendulums(task: Task) -> Array:
    """The pendulum motions (5:3) at their ends, one after the other, in Python's floats."""
    A, r, mu = task.body.floats()
    energies = energy(task.states[:3], task.states[3:], A, r, mu).tolist()
    each = zip(task.times.tolist(), energies, strict=True)
    ends = [body_motion(time, -1, A[2], r, h0, mu, math) for time, h0 in each]
    return np.array([(*M, *gamma) for M, gamma in ends]).T
