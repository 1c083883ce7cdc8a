"""Ours: Taylor series on the separatrix-aligned components, as rigidpend calls them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend import integrate
from rigidpend.coordinates import Aligned, body_from_aligned
from rigidpend.equations import aligned, aligned_coefficients
from rigidpend.herpolhode import alpha_at, initial_state
from rigidpend.hodograph import field as with_angles
from rigidpend.integrate.compiled import heyoka
from rigidpend.integrate.records import Crossings, Orbits, separatrix_beside
from rigidpend.measure.benchmark.methods import heyoka_scripts as scripts
from rigidpend.measure.benchmark.tasks import (
    Angle,
    Array,
    Crossed,
    Flow,
    Motion,
    Routes,
    Solver,
    aligned_states,
    time_unit,
)
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.routes.codes import route_codes as certified
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import passage_limit
from rigidpend.routes.start import Scales, start, states_double, states_exact


def batch(task: Motion, tolerance: float) -> Flow:
    """All orbits side by side, by `integrate.sample_orbits`."""
    coefficients = aligned_coefficients(task.body.angles(), math)
    first, s = aligned_states(task.body, task.states), time_unit(task.body)
    now: list[Any] = [0.0, first]

    def begin() -> None:
        now[:] = [0.0, first]

    def to(time: float) -> None:
        times = [s * now[0], s * time]
        ended = integrate.sample_orbits(coefficients, now[1], times, tolerance=tolerance)
        now[:] = [time, ended[:, -1]]

    return Flow(begin, to, lambda: _principal(task, now[1]))


def scalar(task: Motion, tolerance: float | None, bits: int = 53) -> Flow:
    """One orbit after the other, in any of heyoka's types; above 53 bits to rounding."""
    hy, s = heyoka(), time_unit(task.body)
    number = scripts.number(bits)
    m = context(bits + GUARD_BITS)
    coefficients = aligned_coefficients(task.body.angles(bits + GUARD_BITS), m)
    exactly = type(coefficients)(*(hy.expression(number(x)) for x in coefficients))
    names = hy.make_vars(*Aligned._fields)
    system = list(zip(names, aligned(names, exactly), strict=True))
    tolerance = tolerance or integrate.DEFAULT_TOLERANCE["taylor"]
    flow = scripts.flow(system, aligned_states(task.body, task.states), tolerance, bits)
    return Flow(flow.start, lambda t: flow.to(s * t), lambda: _principal(task, flow.states()))


def route_codes(task: Routes, _: None) -> Solver:
    """What a user calls: every symbol established by two computations, all else by default."""
    p = task.problem
    given: dict[str, Any] = {"h0": p.h0, "J1_0": p.J1_0, "n_symbols": p.n_symbols}

    def solve() -> Any:
        return certified(p.body, task.theta2_0, **given)

    return Solver(solve, lambda found: Crossed(found.codes, found.crossing_time))


def crossings(task: Routes, tolerance: float | None, bits: int = 53) -> Solver:
    """One computation in `bits` bits, and no certificate."""
    p, tolerance = task.problem, tolerance or integrate.DEFAULT_TOLERANCE["taylor"]
    phases, limit = Phases(task.theta2_0), passage_limit(p, bits)

    def solve() -> Crossings:
        begin = start(p, bits, Scales())
        states: Any = (
            states_double(begin, phases.high, phases.rest)
            if bits == 53
            else states_exact(begin, phases.exactly(range(len(phases))), bits)
        )
        orbits = Orbits(begin.coefficients, states, p.n_symbols + 1, limit)
        return integrate.crossings(orbits, engine="taylor", bits=bits, tolerance=tolerance, jobs=1)

    return Solver(solve, lambda found: Crossed(symbols(found.separatrix), found.time))


def crossings_scalar(task: Routes, tolerance: float) -> Solver:
    """One orbit after the other in doubles: what the batch is worth."""
    p, hy = task.problem, heyoka()
    begin, phases = start(p, 53, Scales()), Phases(task.theta2_0)
    states = states_double(begin, phases.high, phases.rest)
    names = hy.make_vars(*Aligned._fields)
    system = list(zip(names, aligned(names, begin.coefficients), strict=True))
    wanted, limit = p.n_symbols + 1, passage_limit(p, 53) * (p.n_symbols + 1)

    def record(state: Any, time: float, rising: bool) -> tuple[float, int]:
        return time, separatrix_beside(rising, state[0], state[1])

    solve = scripts.events(system, names[2], record, states, tolerance, wanted, limit)
    return Solver(solve, scripts.read_crossings)


def angle(task: Angle, tolerance: float) -> Solver:
    """alpha(T) by the quadrature (eqPV), one orbit after the other: what (th_al) spares."""
    hy, body = heyoka(), task.problem.body
    states = np.concatenate((_beginning(task), task.states[7:]))
    names = [hy.make_vars(f"x{i}") for i in range(8)]
    system = list(zip(names, with_angles(body)(names, math), strict=True))
    solve = scripts.ends(system, states, time_unit(body) * task.ends, tolerance)
    return Solver(solve, lambda found: found[7])


def angle_batch(task: Angle, tolerance: float) -> Solver:
    """alpha(T) as rigidpend has it: theta3 by quadrature, alpha by (th_al), side by side."""
    body, states = task.problem.body, _beginning(task)
    ends = time_unit(body) * task.ends
    return Solver(lambda: alpha_at(body, states, ends, tolerance), lambda found: found)


def _beginning(task: Angle) -> Array:
    """Aligned components and theta3 at the start, (7, n)."""
    return np.stack([initial_state(task.problem, float(x)) for x in task.theta2_0], axis=1)


def _principal(task: Motion, states: Array) -> Array:
    found = body_from_aligned(Aligned(*states), task.body.alpha0, time_unit(task.body))
    return np.concatenate(found)
