"""heyoka without the aligned components: Euler-Poisson in principal axes, or (eq1)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.methods import heyoka_batches as batches
from rigidpend.experiments.bench.measuring.methods.heyoka_batches import Build, Follower
from rigidpend.experiments.bench.measuring.methods.peers import shared_out
from rigidpend.experiments.bench.measuring.tasks import (
    Carrier,
    Crossed,
    MotionTask,
    RouteTask,
    Solver,
    carrier,
    time_unit,
)
from rigidpend.experiments.heyoka_peer import heyoka
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import (
    andoyer_from_body,
    andoyer_from_canonical,
    body_from_andoyer,
    canonical,
    canonical_from_andoyer,
)
from rigidpend.mechanics.equations import eq1
from rigidpend.numbers.alphabet import NO_SYMBOL
from rigidpend.numbers.doubles import Array
from rigidpend.routes.phases import Phases


def ends(body: Body, states: Array, tolerance: float, **build: Any) -> Any:
    """Give a function that carries states on: see `peers`."""
    return batches.ends(_principal(body, len(states))[1], tolerance, Build(**build))


def crossings(
    task: RouteTask, states: Array, tolerance: float, **build: Any
) -> Callable[[], Array]:
    """Give a function that finds crossings: see `peers`."""
    (names, system), wanted = _principal(task.problem.body), task.problem.n_symbols + 1
    follower = Follower(system, names[2], (0, 1), wanted, task.horizon, tolerance, Build(**build))
    return lambda: follower.run(states)


def ensemble(task: MotionTask, tolerance: float, threads: int, **build: Any) -> Carrier:
    """Carry orbits in M and gamma, by heyoka's ensemble of batches."""
    system = _principal(task.body)[1]
    return batches.ensemble(system, task.states, tolerance, Build(**build), threads)


def eq1_motion(task: MotionTask, tolerance: float, threads: int, **build: Any) -> Carrier:
    """Carry orbits in the paper's variables theta1, J1, theta2, J2."""
    s, body = time_unit(task.body), task.body

    def part(first: Array) -> Carrier:
        carry = batches.ends(_eq1(body)[1], tolerance, Build(**build))
        return carrier(first, lambda y, start, end: carry(y, start, np.full(y.shape[1], end)))

    made = shared_out(part, _to_eq1(task.states, body), threads)
    return Carrier(made.start, lambda t: made.to(s * t), lambda: _from_eq1(made.states(), body))


def eq1_codes(task: RouteTask, tolerance: float, threads: int, **build: Any) -> Solver:
    """Give crossings of J1 = J2/2; theta1, which goes on beyond 4 pi, tells the side."""
    body, wanted = task.problem.body, task.problem.n_symbols + 1
    names, system = _eq1(body)
    section, limit = names[1] - names[3] / 2.0, time_unit(body) * task.horizon

    def part(states: Array) -> Callable[[], Array]:
        follower = Follower(system, section, (0,), wanted, limit, tolerance, Build(**build))
        return lambda: follower.run(states)

    return Solver(shared_out(part, _eq1_start(task), threads), _by_side)


def _principal(body: Body, size: int = 6) -> tuple[Any, Any]:
    names = [heyoka().make_vars(f"x{i}") for i in range(size)]
    field = fields.of_body(body, angles=size == 8)
    return names, list(zip(names, field(names), strict=True))


def _eq1(body: Body) -> tuple[Any, Any]:
    hy = heyoka()
    names = hy.make_vars("theta1", "J1", "theta2", "J2")
    p = body.angles()
    # Symbols throughout: heyoka's cosine takes nothing else.
    symbols = p._replace(**{name: hy.expression(value) for name, value in p._asdict().items()})
    return names, list(zip(names, eq1(names, symbols, hy), strict=True))


def _eq1_start(task: RouteTask) -> Array:
    body, p = task.problem.body, task.problem
    states = np.empty((4, task.states.shape[1]))
    states[0], states[1] = body.alpha0 + body.beta0, float(p.J1_0)
    states[2], states[3] = Phases(task.theta2_0).high, float(p.J2_0(53))
    return states


def _to_eq1(states: Array, body: Body) -> Array:
    s = time_unit(body)
    c = canonical_from_andoyer(andoyer_from_body(s * states[:3], states[3:]), body.beta0)
    return np.stack((c.theta1, c.J1, c.theta2, c.J2))


def _from_eq1(found: Array, body: Body) -> Array:
    theta1, J1, theta2, J2 = found
    c = canonical(J1, J2, np.zeros_like(J1), theta1, theta2)
    M, gamma = body_from_andoyer(andoyer_from_canonical(c, body.beta0))
    return np.concatenate((M / time_unit(body), gamma))


def _by_side(found: Array) -> Crossed:
    """A symbol is 1 where theta1 has grown from a crossing to the next."""
    time, theta1 = found
    step = np.diff(theta1, axis=0)
    return Crossed(np.where(np.isnan(step), NO_SYMBOL, step > 0).astype(np.uint8), time)
