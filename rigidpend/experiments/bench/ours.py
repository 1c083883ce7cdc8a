"""Ours: Taylor series on aligned components, route codes, closed forms, operator splitting."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.experiments import lie_poisson
from rigidpend.experiments.bench.problems import Crossed, Task, time_unit
from rigidpend.experiments.bench.solvers import Solver, in_looks, shared_out
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import aligned_coefficients, cross, energy
from rigidpend.mechanics.in_space import angular_velocity
from rigidpend.mechanics.pendulum import body_motion
from rigidpend.mechanics.poinsot import Orbit, angle, momentum, through
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.arithmetic import DEFAULT_TOLERANCE, Arithmetic, resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes import codes
from rigidpend.routes.certainty import FIRST
from rigidpend.routes.cycle import symbols
from rigidpend.routes.herpolhode import alpha_at, initial_state
from rigidpend.routes.phases import Phases
from rigidpend.routes.run import Run


def answered(task: Task, knob: Any, threads: int, way: str = "", bits: int = 53) -> Solver:
    """The answer to any task.

    The knob is the tolerance of the series. The way is ``closed``, or a method of `route_codes`,
    where every symbol is told by two computations; else series, of so many `bits`, and no
    cross-check.
    """
    if way == "closed":
        at = _pendulums(task) if float(task.body.mu) else _free_bodies(task)
        return Solver(lambda: np.array([at(times[0]) for times in task.times]))
    if way:
        given = task.problem, task.theta2_0, resolve(), threads, way
        return Solver(
            lambda: codes.codes_of(*given, kept=True),
            lambda found: Crossed(found.codes, found.crossing_time, certain=found.certain),
        )
    if task.kind == "routes":
        return one_computation(task, knob, threads, bits)
    return alpha(task, knob) if task.kind == "angle" else motion(task, knob, threads)


def one_computation(task: Task, tolerance: float | None, threads: int, bits: int) -> Solver:
    """Symbols from the first of the two alone, by default at the tolerance of the package."""
    arithmetic = Arithmetic("taylor", tolerance or DEFAULT_TOLERANCE["taylor"], (bits,))
    run = Run(task.problem, Phases(task.theta2_0), arithmetic, threads)
    every = range(len(run.phases))
    return Solver(
        lambda: run.crossings(bits, FIRST, every),
        lambda found: Crossed(symbols(found.separatrix), found.time),
    )


def alpha(task: Task, tolerance: float) -> Solver:
    """alpha(T) as rigidpend has it: theta3 by quadrature, alpha by (th_al), side by side."""
    beginning = [initial_state(task.problem, float(x)) for x in task.theta2_0]
    states, ends = np.stack(beginning, axis=1), time_unit(task.body) * task.times[-1]
    return Solver(lambda: alpha_at(task.body, states, ends, tolerance))


def motion(task: Task, tolerance: float, threads: int) -> Solver:
    """All orbits side by side, by `states.states_at`."""
    coefficients, s = aligned_coefficients(task.body.angles(), math), time_unit(task.body)
    begun = task._replace(states=aligned_states(task.body, task.states))

    def part(some: Task) -> Callable[[], Array]:
        times = s * some.times[:, 0]
        return lambda: states_at(coefficients, some.states, times, tolerance=tolerance)

    def read(found: Array) -> Array:
        vectors = body_from_aligned(Aligned(*found), task.body.alpha0, s)
        return np.concatenate(vectors).transpose(1, 0, 2)

    return Solver(shared_out(part, begun, threads), read)


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


def split(task: Task, steps: float, threads: int, order: int) -> Solver:
    """Operator splitting of Lie-Poisson type, with so many steps in a period."""
    body, longest = task.body, task.period / steps
    made = lie_poisson.splitting(*body.floats(), order)

    def carry(states: Array, start: float, times: Array) -> Array:
        count = math.ceil((times[0] - start) / longest)
        vectors = [np.stack((states[i], states[i + 3])) for i in range(3)]
        found = made.advance(vectors, (times[0] - start) / count, count)
        return np.concatenate(([x[0] for x in found], [x[1] for x in found]))

    return Solver(in_looks(task, carry))


def _pendulums(task: Task) -> Callable[[float], Array]:
    """The pendulum motions (5:3), one after the other, in Python's floats."""
    A, r, mu = task.body.floats()
    energies = energy(task.states[:3], task.states[3:], A, r, mu).tolist()

    def at(time: float) -> Array:
        ends = [body_motion(time, -1, A[2], r, h0, mu, math) for h0 in energies]
        return np.array([(*M, *gamma) for M, gamma in ends]).T

    return at


def _free_bodies(task: Task) -> Callable[[float], Array]:
    """The free body by Jacobi's functions, one orbit after the other."""
    orbits = [_orbit(task.body, state) for state in task.states.T]
    return lambda time: np.stack([_ended(*orbit, time) for orbit in orbits], axis=1)


def _orbit(body: Body, state: Array) -> tuple[Orbit, float, float]:
    """The orbit through a state, the time on it, and the angle of gamma in space."""
    M, gamma = state[:3], state[3:]
    [aligned] = aligned_states(body, state[:, None]).T
    orbit, begin = through(body, Aligned(*aligned))
    radius, across = _axes(M, orbit)
    lean = math.atan2(gamma @ across, gamma @ radius)
    return orbit, begin, lean + float(angle(orbit, begin))


def _ended(orbit: Orbit, begin: float, lean: float, time: float) -> Array:
    """M and gamma, which stands still in space, across M."""
    M = momentum(orbit, begin + time)
    radius, across = _axes(M, orbit)
    left = lean - float(angle(orbit, begin + time))
    return np.concatenate((M, math.cos(left) * radius + math.sin(left) * across))


def _axes(M: Any, orbit: Orbit) -> tuple[Array, Array]:
    """Unit vectors across M, in body axes: along the component of omega, and a right angle on."""
    across = np.array(cross(M, angular_velocity(M, orbit.A)))
    across /= np.linalg.norm(across)
    return np.array(cross(across, M)) / orbit.G, across
