"""The problems: the task of each, its truth, and what an answer errs by; bodies drawn by lot.

`methods.PROBLEMS` says what each is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rigidpend.experiments.bench.solvers import Crossed, Task, time_unit, with_angles
from rigidpend.experiments.data import Data
from rigidpend.experiments.principal_axes import carry, euler_poisson_field, initial, integrator
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import cross, energy
from rigidpend.mechanics.free_body import around_M1, around_M2
from rigidpend.mechanics.in_space import alpha_ahead, angular_velocity
from rigidpend.mechanics.pendulum import body_motion
from rigidpend.numbers.exact import PI, context, exact
from rigidpend.numbers.generic import Array
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import RouteProblem, rotation_period

FREE = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu=0)
MOMENTUM = 2.0
"""|M| of the free body, physical, that of Fig. 3 and Fig. 5."""
PENDULUM = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.1")
FIG4 = RouteProblem(Body((2, 1, "1.5"), (1, 1, 0), "0.001"), exact("1.3342"), exact("1e-8"), 15)
PASSAGE = 26.0
"""t' by which any passage of the orbits of Fig. 4 is over; the mean is 16."""
FIG5 = RouteProblem(
    Body((2, "1.5", "1.8"), (0, 1, 0), "0.01"), exact("10/9"), exact("2.39205e-9"), 5
)
FIG5_PHASES = ("1.02", "1.83")
LOOKS = 20
"""Number of times at which the integrals are looked at, over long times."""
SEED, BODIES = 40, 40
"""Seed and number of the drawn bodies that are the same in every run."""
WEIGHT = -4.0, math.log10(0.02)
"""log10 of the least and the largest mu/h0 of a drawn body."""
START = -12.0, -6.0
"""log10 of the least and the largest J1_0."""


def _motion(body: Body, states: Array, period: float, turns: float, looks: int = 1) -> Task:
    times = turns * period * np.arange(1, looks + 1) / looks
    return Task("motion", body, states, np.tile(times[:, None], states.shape[1]), period)


def free_body(sizes: Any) -> Task:
    """Orbits around both axes, from near the centres to near the separatrix."""
    heights = 1 - np.geomspace(0.9, 1e-3, sizes.orbits)
    phases = np.linspace(0.0, 6.0, sizes.orbits)
    around = [around_M1, around_M2]
    M = np.stack(
        [
            around[i % 2](FREE.alpha0, height, 1 - i // 2 % 2 * 2, phase)
            for i, (height, phase) in enumerate(zip(heights, phases, strict=True))
        ],
        axis=1,
    )
    gamma = np.stack(cross(M, (0.6, 0.0, 0.8)))
    states = np.concatenate((MOMENTUM * M, gamma / np.linalg.norm(gamma, axis=0)))
    return _motion(FREE, states, 2 * math.pi * float(FREE.A[2]) / MOMENTUM, sizes.turns)


def pendulum(sizes: Any) -> Task:
    """Rotations from the lowest point, tau = 0, of energies h0 from 1.1 mu to 20 mu.

    M3 < 0: then J1 = 0 exactly, which spares (eq1) the rounding of J2 - J1.
    """
    (_, _, A3), r, mu = PENDULUM.floats()
    h0 = mu * (1 + np.geomspace(0.1, 19.0, sizes.orbits))
    states = np.zeros((6, sizes.orbits))
    states[2] = -np.sqrt(2 * A3 * (h0 + mu))
    states[3], states[4] = -r[0], -r[1]
    period = 2 * math.pi * math.sqrt(A3 / (2 * mu))
    return _motion(PENDULUM, states, period, sizes.turns)._replace(h0=h0)


def codes(sizes: Any) -> Task:
    """The first columns of the left array."""
    problem = replace(FIG4, n_symbols=sizes.n_symbols)
    phases = tuple(f"{k}/10" for k in range(sizes.columns))
    states = np.array(initial(problem, [exact(x) for x in phases]), dtype=float).T
    return _routes(problem, phases, states)


def precession_angle(sizes: Any) -> Task:
    """The two orbits of Fig. 5, to half a passage behind the last crossing.

    alpha - theta3 at the start is that of (th_al).
    """
    body = FIG5.body
    states = np.array(initial(FIG5, [exact(x) for x in FIG5_PHASES]), dtype=float).T
    omega = angular_velocity(states[:3], body.floats()[0])
    ahead = alpha_ahead(states[:3], omega, states[3:])
    given: dict[str, Any] = {"h0": FIG5.h0, "J1_0": FIG5.J1_0, "n_symbols": FIG5.n_symbols}
    route = route_codes(body, FIG5_PHASES, **given).crossing_time
    ends = np.round(route[-1] + (route[-1] - route[-2]) / 2) / time_unit(body)
    full = np.concatenate((states, np.zeros((1, len(ends))), ahead[None]))
    return Task("angle", body, full, ends[None], problem=FIG5, theta2_0=FIG5_PHASES)


def long_time(sizes: Any) -> Task:
    """Orbits of Fig. 4 from random phases, beside the separatrices for very many periods."""
    states = random_routes(FIG4, sizes.companions).states
    period = rotation_period(FIG4) / time_unit(FIG4.body)
    return _motion(FIG4.body, states, period, sizes.periods, LOOKS)


def random_routes(problem: RouteProblem, n: int) -> Task:
    """Orbits from random phases, doubles, the same ones in every run."""
    return from_phases(problem, np.random.default_rng(0).uniform(0, 2 * np.pi, n))


def from_phases(problem: RouteProblem, phases: Array) -> Task:
    """Orbits from phases in doubles."""
    # gamma is linear in the cosine and the sine of the phase.
    along, across = np.array(initial(problem, [exact(0), PI / 2]), dtype=float)
    gamma = np.outer(along[3:], np.cos(phases)) + np.outer(across[3:], np.sin(phases))
    M = np.repeat(along[:3, None], len(phases), axis=1)
    return _routes(problem, phases, np.concatenate((M, gamma)))


def _routes(problem: RouteProblem, phases: Any, states: Array) -> Task:
    horizon = PASSAGE * (problem.n_symbols + 1) / time_unit(problem.body)
    times = np.full((1, states.shape[1]), horizon)
    return Task("routes", problem.body, states, times, problem=problem, theta2_0=phases)


def drawn(seed: int = SEED, bodies: int = BODIES) -> list[RouteProblem]:
    """Problems of bodies drawn by lot: any shape, any direction of r, any energy.

    Numbers have three or four digits, so that a problem can be written down.
    """
    random = np.random.default_rng(seed)
    return [_drawn(random) for _ in range(bodies)]


def _drawn(random: np.random.Generator) -> RouteProblem:
    A2, A3 = 1.0, 0.0
    # Evenly over the shapes that a body may have, A1 > A3 > A2 and A2 + A3 > A1.
    while not (0.01 < A2 < A3 - 0.002 < 0.996 and A2 + A3 > 1.002):
        A2, A3 = random.uniform(0, 1, 2)
    A1, angle, h0 = random.uniform(1.5, 3), random.uniform(0, math.pi / 2), random.uniform(0.8, 1.6)
    weight, start = (10 ** random.uniform(*ends) for ends in (WEIGHT, START))
    A = (f"{A1:.3f}", f"{A1 * A2:.3f}", f"{A1 * A3:.3f}")
    r = (f"{math.cos(angle):.3f}", f"{math.sin(angle):.3f}", 0)
    h = f"{h0:.4f}"
    body = Body(A, r, f"{weight * float(h):.3g}")
    return RouteProblem(body, exact(h), exact(f"{start:.3g}"), FIG4.n_symbols)


def ends_in_113_bits(task: Task) -> dict[str, Array]:
    """The states at the end, in 113 bits."""
    made = integrator(task.body, euler_poisson_field, 6, 113)
    ways = zip(task.states.T, task.times[-1], strict=True)
    return {"states": np.array([carry(made, state, end) for state, end in ways]).T}


def ends_of_pendulums(task: Task) -> dict[str, Array]:
    """The states at the end, by (5:3) in 113 bits."""
    m = context(113)
    A3, mu = (x.in_context(m) for x in (task.body.A[2], task.body.mu))
    r = [x.in_context(m) for x in task.body.r]
    ways = zip(task.h0, task.times[-1], strict=True)
    ends = [body_motion(m.mpf(end), -1, A3, r, m.mpf(h0), mu, m) for h0, end in ways]
    return {"states": np.array([[*M, *gamma] for M, gamma in ends], dtype=float).T}


def codes_in_113_bits(task: Task) -> dict[str, Any]:
    """Symbols and crossing times in 113 bits, each established twice."""
    p = task.routes
    given: dict[str, Any] = {"h0": p.h0, "J1_0": p.J1_0, "n_symbols": p.n_symbols}
    found = route_codes(p.body, task.theta2_0, **given, precisions=(113,))
    if not found.certain.all():
        raise ArithmeticError("the reference is not certain")
    return {"codes": found.codes, "time": found.crossing_time}


def alpha_in_113_bits(task: Task) -> dict[str, Array]:
    """alpha(T) in 113 bits, of the exact initial states."""
    made = integrator(task.body, with_angles, 8, 113)
    starts = initial(task.routes, [exact(x) for x in task.theta2_0], 113)
    # Where the two angles start is a mere constant; its double is the same for everyone.
    ways = zip(starts, task.states[6:].T, task.times[-1], strict=True)
    return {"alpha": np.array([carry(made, [*y, *angles], end)[7] for y, angles, end in ways])}


def integrals_at_the_start(task: Task) -> dict[str, Array]:
    """The integrals at the start, in units of what they are compared with."""
    return dict(zip(("energy", "gamma", "area"), integrals(task.body, task.states), strict=True))


def integrals(body: Body, states: Array) -> tuple[Array, Array, Array]:
    """Energy, \\|gamma\\| and M . gamma, each (n,)."""
    M, gamma = states[:3], states[3:]
    height = energy(M, gamma, *body.floats())
    return height, np.linalg.norm(gamma, axis=0), (M * gamma).sum(axis=0)


def error_of_motion(answer: Array, truth: Data) -> dict[str, float]:
    """The largest distance at the end; `answer` is (k, 6, n)."""
    gap = answer[-1] - truth["states"]
    gap[:3] /= np.linalg.norm(truth["states"][:3], axis=0)
    return {"error": float(np.linalg.norm(gap, axis=0).max())}


def error_of_codes(answer: Crossed, truth: Data) -> dict[str, float]:
    """Errors of the crossing times, the wrong symbols, and which of them are trusted."""
    gap = np.abs(answer.time - truth["time"])
    worst = np.where(np.isnan(gap), np.inf, gap).max(axis=0)
    counts = {name: float(number) for name, number in judged(answer, truth["codes"]).items()}
    told = {name: counts[name] for name in ("undecided", "wrong_trusted")}
    wrong = {"wrong": counts["wrong"] / counts["symbols"], "wrong_symbols": counts["wrong"]}
    return {"error": float(np.median(worst)), "worst": float(worst.max()), **wrong, **told}


def judged(answer: Crossed, true: Any) -> dict[str, int]:
    """Numbers of symbols of as many orbits as the truth has: of all, of wrong ones, and so on.

    Those vouched for are told apart, and undecided ones; all are vouched for by a method that does
    not say which.
    """
    n = true.shape[1]
    wrong = answer.codes[:, :n] != true
    trusted = np.ones_like(wrong) if answer.certain is None else answer.certain[:, :n]
    masks = {"symbols": wrong | True, "wrong": wrong, "wrong_trusted": wrong & trusted}
    return {name: int(mask.sum()) for name, mask in {**masks, "undecided": ~trusted}.items()}


def error_of_alpha(answer: Array, truth: Data) -> dict[str, float]:
    """The largest error; alpha is an angle."""
    gap = answer - truth["alpha"]
    return {"error": float(np.abs(np.remainder(gap + math.pi, 2 * math.pi) - math.pi).max())}


def error_of_integrals(answer: Array, truth: Data) -> dict[str, float]:
    """The largest drifts at any look; `answer` is (k, 6, n)."""
    found = np.array([integrals(FIG4.body, states) for states in answer])
    energy, gamma, area = found.transpose(1, 0, 2)
    drift = {
        "energy": np.abs(energy / truth["energy"] - 1).max(),
        "gamma": np.abs(gamma / truth["gamma"] - 1).max(),
        # M . gamma is zero; it is compared with |M|, which is sqrt(2 A E) up to a few per cent.
        "area": (np.abs(area - truth["area"]) / np.sqrt(np.abs(truth["energy"]))).max(),
    }
    return {"error": float(max(drift.values())), **{k: float(v) for k, v in drift.items()}}


class Asked(NamedTuple):
    """Functions of a problem."""

    task: Callable[[Any], Task]
    """From the sizes of `schema.Workload`."""
    truth: Callable[[Task], dict[str, Any]]
    """Arrays: in 113 bits, in closed form, or integrals of motion."""
    error: Callable[[Any, Data], dict[str, float]]
    """From an answer and the truth: ``error`` first, then what else is told."""


ASKED = {
    "free_body": Asked(free_body, ends_in_113_bits, error_of_motion),
    "pendulum": Asked(pendulum, ends_of_pendulums, error_of_motion),
    "codes": Asked(codes, codes_in_113_bits, error_of_codes),
    "precession_angle": Asked(precession_angle, alpha_in_113_bits, error_of_alpha),
    "long_time": Asked(long_time, integrals_at_the_start, error_of_integrals),
}
"""Functions by the names of `methods.PROBLEMS`."""
