"""heyoka without the aligned components: (eq1), or Euler-Poisson in principal axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.methods import heyoka_batches as batches
from rigidpend.experiments.bench.measuring.methods.heyoka_batches import BatchCrossings, Build
from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    Crossed,
    MotionTask,
    RouteTask,
    Solver,
    crossed,
    time_unit,
)
from rigidpend.experiments.bench.measuring.threads import shared_out
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


def eq1_motion(task: MotionTask, tolerance: float, threads: int, **build: Any) -> Carrier:
    """Orbits in the paper's variables theta1, J1, theta2, J2."""
    s, body = time_unit(task.body), task.body
    made = shared_out(
        lambda states: batches.carrier(_eq1(body)[1], states, tolerance, Build(**build)),
        _to_eq1(task.states, body),
        threads,
    )
    return Carrier(made.start, lambda t: made.to(s * t), lambda: _from_eq1(made.states(), body))


def principal_motion(task: MotionTask, tolerance: float, threads: int, **build: Any) -> Carrier:
    """Orbits in M and gamma."""
    system = _principal(task.body)[1]
    return shared_out(
        lambda states: batches.carrier(system, states, tolerance, Build(**build)),
        task.states,
        threads,
    )


def ensemble_motion(task: MotionTask, tolerance: float, threads: int, **build: Any) -> Carrier:
    """Orbits in M and gamma, by heyoka's ensemble of batches."""
    system = _principal(task.body)[1]
    return batches.ensemble(system, task.states, tolerance, Build(**build), threads)


def eq1_codes(task: RouteTask, tolerance: float, threads: int, **build: Any) -> Solver:
    """Crossings of J1 = J2/2; theta1, which goes on beyond 4 pi, tells the side."""
    body, p = task.problem.body, task.problem
    names, system = _eq1(body)
    section, limit = names[1] - names[3] / 2.0, time_unit(body) * task.horizon
    wanted = p.n_symbols + 1
    solve = shared_out(
        lambda states: batches.crossings(
            system, section, states, (0,), wanted, limit, tolerance, Build(**build)
        ),
        _eq1_start(task),
        threads,
    )
    return Solver(solve, _by_side)


def principal_codes(task: RouteTask, tolerance: float, threads: int, **build: Any) -> Solver:
    """Crossings of M3 = 0, and the separatrix beside which each lies."""
    body, wanted = task.problem.body, task.problem.n_symbols + 1
    names, system = _principal(body)
    solve = shared_out(
        lambda states: batches.crossings(
            system, names[2], states, (0, 1), wanted, task.horizon, tolerance, Build(**build)
        ),
        task.states,
        threads,
    )
    return Solver(solve, lambda found: crossed(found.time, found.kept, body, found.rising))


def principal_angle(task: AngleTask, tolerance: float, threads: int, **build: Any) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""
    field = fields.of_body(task.problem.body, angles=True)
    names = [heyoka().make_vars(f"x{i}") for i in range(8)]
    system = list(zip(names, field(names), strict=True))
    solve = batches.ends(system, task.states, task.ends, tolerance, Build(**build))
    return Solver(solve, lambda found: found[7])


def _principal(body: Body) -> tuple[Any, Any]:
    names = [heyoka().make_vars(f"x{i}") for i in range(6)]
    return names, list(zip(names, fields.of_body(body)(names), strict=True))


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


def _by_side(found: BatchCrossings) -> Crossed:
    """A symbol is 1 where theta1 has grown from a crossing to the next."""
    step = np.diff(found.kept[0], axis=0)
    return Crossed(np.where(np.isnan(step), NO_SYMBOL, step > 0).astype(np.uint8), found.time)
