"""Ours: Taylor series on the separatrix-aligned components, as rigidpend calls them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.methods.peers import shared_out
from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    Carrier,
    Crossed,
    MotionTask,
    RouteTask,
    Solver,
    aligned_states,
    carrier,
    time_unit,
)
from rigidpend.mechanics.coordinates import Aligned, body_from_aligned
from rigidpend.mechanics.equations import aligned_coefficients
from rigidpend.numbers.doubles import Array
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate.records import Crossings, Orbits
from rigidpend.routes.codes import route_codes as certified
from rigidpend.routes.cycle import symbols
from rigidpend.routes.herpolhode import alpha_at, initial_state
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import passage_limit
from rigidpend.routes.start import Scales, start, states_double, states_exact


def motion(task: MotionTask, tolerance: float, threads: int) -> Carrier:
    """All orbits side by side, by `integrate.sample_orbits`."""
    coefficients = aligned_coefficients(task.body.angles(), math)
    s = time_unit(task.body)

    def part(first: Array) -> Carrier:
        def advance(states: Array, start: float, end: float) -> Array:
            times = [s * start, s * end]
            return integrate.sample_orbits(coefficients, states, times, tolerance=tolerance)[:, -1]

        return carrier(first, advance)

    made = shared_out(part, aligned_states(task.body, task.states), threads)
    return Carrier(made.start, made.to, lambda: _principal(task, made.states()))


def route_codes(task: RouteTask, _: None, threads: int, method: str = "auto") -> Solver:
    """Route codes as a user gets them: every symbol by two computations, all else by default."""
    p = task.problem
    given: dict[str, Any] = {"h0": p.h0, "J1_0": p.J1_0, "n_symbols": p.n_symbols}

    def solve() -> Any:
        return certified(p.body, task.theta2_0, **given, jobs=threads, method=method)

    return Solver(
        solve, lambda found: Crossed(found.codes, found.crossing_time, certain=found.certain)
    )


def codes(task: RouteTask, tolerance: float | None, threads: int, bits: int = 53) -> Solver:
    """One computation in `bits` bits, and no cross-check."""
    p = task.problem
    if tolerance is None:
        tolerance = integrate.DEFAULT_TOLERANCE["taylor"]
    phases, limit = Phases(task.theta2_0), passage_limit(p, bits)

    def solve() -> Crossings:
        begin = start(p, bits, Scales())
        states: Any = (
            states_double(begin, phases.high, phases.rest)
            if bits == 53
            else states_exact(begin, phases.exactly(range(len(phases))), bits)
        )
        orbits = Orbits(begin.coefficients, states, p.n_symbols + 1, limit)
        return integrate.crossings(
            orbits, engine="taylor", bits=bits, tolerance=tolerance, jobs=threads
        )

    return Solver(solve, lambda found: Crossed(symbols(found.separatrix), found.time))


def angle(task: AngleTask, tolerance: float, threads: int) -> Solver:
    """alpha(T) as rigidpend has it: theta3 by quadrature, alpha by (th_al), side by side."""
    body = task.problem.body
    beginning = [initial_state(task.problem, float(x)) for x in task.theta2_0]
    states, ends = np.stack(beginning, axis=1), time_unit(body) * task.ends
    return Solver(lambda: alpha_at(body, states, ends, tolerance), lambda found: found)


def _principal(task: MotionTask, states: Array) -> Array:
    found = body_from_aligned(Aligned(*states), task.body.alpha0, time_unit(task.body))
    return np.concatenate(found)
