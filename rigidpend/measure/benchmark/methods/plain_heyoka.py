"""heyoka as a first script would use it: (eq1), or Euler-Poisson in principal axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.body import Body
from rigidpend.coordinates import (
    aligned_from_body,
    andoyer_from_body,
    andoyer_from_canonical,
    body_from_andoyer,
    canonical,
    canonical_from_andoyer,
)
from rigidpend.equations import eq1
from rigidpend.integrate.compiled import heyoka
from rigidpend.integrate.records import separatrix_beside
from rigidpend.measure.benchmark import fields
from rigidpend.measure.benchmark.methods import heyoka_scripts as scripts
from rigidpend.measure.benchmark.tasks import (
    Angle,
    Array,
    Crossed,
    Flow,
    Motion,
    Routes,
    Solver,
    time_unit,
)
from rigidpend.routes.phases import Phases


def eq1_flow(task: Motion, tolerance: float) -> Flow:
    """Orbits in the paper's variables theta1, J1, theta2, J2."""
    s, body = time_unit(task.body), task.body
    flow = scripts.flow(_eq1(body)[1], _to_eq1(task.states, body), tolerance)
    return Flow(flow.start, lambda t: flow.to(s * t), lambda: _from_eq1(flow.states(), body))


def principal_flow(task: Motion, tolerance: float) -> Flow:
    """Orbits in M and gamma."""
    return scripts.flow(_principal(fields.of_body(task.body), 6)[1], task.states, tolerance)


def eq1_codes(task: Routes, tolerance: float) -> Solver:
    """Crossings of J1 = J2/2; theta1, which goes on beyond 4 pi, tells the side."""
    body, p = task.problem.body, task.problem
    names, system = _eq1(body)
    states = np.empty((4, len(task.theta2_0)))
    states[0], states[1] = body.alpha0 + body.beta0, float(p.J1_0)
    states[2], states[3] = Phases(task.theta2_0).high, float(p.J2_0(53))

    def record(state: Any, time: float, _: bool) -> tuple[float, float]:
        return time, float(state[0])

    section = names[1] - names[3] / 2.0
    limit = time_unit(body) * task.horizon
    solve = scripts.events(system, section, record, states, tolerance, p.n_symbols + 1, limit)
    return Solver(solve, lambda found: _by_side(found, p.n_symbols + 1))


def principal_codes(task: Routes, tolerance: float) -> Solver:
    """Crossings of M3 = 0, and the separatrix beside which each lies."""
    body, s = task.problem.body, time_unit(task.problem.body)
    names, system = _principal(fields.of_body(body), 6)

    def record(state: Any, time: float, rising: bool) -> tuple[float, int]:
        a = aligned_from_body(state[:3], state[3:], body.alpha0, s)
        return s * time, separatrix_beside(rising, a.Qp, a.Qm)

    wanted = task.problem.n_symbols + 1
    solve = scripts.events(system, names[2], record, task.states, tolerance, wanted, task.horizon)
    return Solver(solve, scripts.read_crossings)


def principal_angle(task: Angle, tolerance: float) -> Solver:
    """alpha(T), with the quadratures of theta3 and alpha."""
    _, system = _principal(fields.of_body(task.problem.body, angles=True), 8)
    return Solver(scripts.ends(system, task.states, task.ends, tolerance), lambda found: found[7])


def _principal(field: Any, size: int) -> tuple[Any, Any]:
    names = [heyoka().make_vars(f"x{i}") for i in range(size)]
    return names, list(zip(names, field(names), strict=True))


def _eq1(body: Body) -> tuple[Any, Any]:
    hy = heyoka()
    names = hy.make_vars("theta1", "J1", "theta2", "J2")
    p = body.angles()
    # Symbols throughout: heyoka's cosine takes nothing else.
    symbols = p._replace(**{name: hy.expression(value) for name, value in p._asdict().items()})
    return names, list(zip(names, eq1(names, symbols, hy), strict=True))


def _to_eq1(states: Array, body: Body) -> Array:
    s = time_unit(body)
    c = canonical_from_andoyer(andoyer_from_body(s * states[:3], states[3:]), body.beta0)
    return np.stack((c.theta1, c.J1, c.theta2, c.J2))


def _from_eq1(found: Array, body: Body) -> Array:
    theta1, J1, theta2, J2 = found
    c = canonical(J1, J2, np.zeros_like(J1), theta1, theta2)
    M, gamma = body_from_andoyer(andoyer_from_canonical(c, body.beta0))
    return np.concatenate((M / time_unit(body), gamma))


def _by_side(found: Any, wanted: int) -> Crossed:
    """A symbol is 1 where theta1 has grown from a crossing to the next."""
    time, theta1 = np.full((2, wanted, len(found)), np.nan)
    for column, orbit in enumerate(found):
        for k, (moment, angle) in enumerate(orbit[:wanted]):
            time[k, column], theta1[k, column] = moment, angle
    step = np.diff(theta1, axis=0)
    return Crossed(np.where(np.isnan(step), 255, step > 0).astype(np.uint8), time)
