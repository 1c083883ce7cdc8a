"""The problems: the task of each, its truth, and what an answer errs by; bodies drawn by lot.

`methods.PROBLEMS` says what each is. States are (6, n), M and gamma in principal axes, or (8, n)
with theta3 and alpha. Times are physical.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data import Data
from rigidpend.experiments.principal_axes import (
    carry,
    euler_poisson_field,
    initial,
    integrator,
    judged,
)
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import scale
from rigidpend.mechanics.equations import cross, euler_poisson
from rigidpend.mechanics.free_body import around_M1, around_M2
from rigidpend.mechanics.in_space import alpha_ahead, angular_velocity, hodograph, turning_rate
from rigidpend.numbers.exact import PI, exact
from rigidpend.numbers.generic import Array, Numbers, Scalar
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.codes import codes_of
from rigidpend.routes.problem import RouteProblem

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
FIG5_PHASES = np.array(("1.02", "1.83"), dtype=object)
SEED = 40
"""Seed of the drawn bodies that are the same in every run."""
WEIGHT = -4.0, math.log10(0.02)
"""log10 of the least and the largest mu/h0 of a drawn body."""
START = -12.0, -6.0
"""log10 of the least and the largest J1_0."""


class Task(NamedTuple):
    """Orbits, and what is asked of them: where they are at a time, their symbols, or alpha."""

    kind: str
    """``motion``, ``routes`` or ``angle``."""
    body: Body
    states: Array
    """(6 or 8, n) at time 0."""
    times: Array
    """(n,): when an orbit ends; for routes a time by which it has made all crossings."""
    problem: Any = None
    """The `RouteProblem` of orbits that start on a separatrix."""
    theta2_0: Any = None
    """(n,) initial phases in radians, texts or doubles."""

    def of(self, columns: Any) -> Task:
        """The same for some of the orbits."""
        states = np.ascontiguousarray(self.states[:, columns])
        phases = None if self.theta2_0 is None else self.theta2_0[columns]
        return self._replace(states=states, times=self.times[columns], theta2_0=phases)


class Crossed(NamedTuple):
    """The answer to a task of routes."""

    codes: NDArray[np.uint8]
    """(n_symbols, n)."""
    time: Array
    """(n_symbols + 1, n), t'."""
    certain: Any = None
    """(n_symbols, n), of a method that says which symbols it vouches for."""


def time_unit(body: Body) -> float:
    """s, by which t' = t s."""
    return float(scale(body.floats()[0], math))


def with_angles(A: Numbers, r: Numbers, mu: Scalar) -> Callable[[Any], tuple[Any, ...]]:
    """Euler-Poisson with the rates of theta3 and alpha, of 8 numbers."""

    def field(y: Scalar) -> tuple[Any, ...]:
        M, gamma = y[:3], y[3:6]
        rates = euler_poisson(M, gamma, A, r, mu)
        omega, domega = angular_velocity(M, A), angular_velocity(rates[:3], A)
        return (*rates, turning_rate(M, r, mu), hodograph(omega, gamma, domega)[2])

    return field


FIELDS: dict[int, Callable[..., Any]] = {6: euler_poisson_field, 8: with_angles}
"""Euler-Poisson by its number of components: of A, r and mu, the function of them."""


def _motion(body: Body, states: Array, time: float) -> Task:
    return Task("motion", body, states, np.full(states.shape[1], time))


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
    return _motion(FREE, states, sizes.turns * 2 * math.pi * float(FREE.A[2]) / MOMENTUM)


def pendulum(sizes: Any) -> Task:
    """Rotations from the lowest point, tau = 0, of energies h0 from 1.1 mu to 20 mu.

    M3 < 0: then J1 = 0 exactly, which spares (eq1) the rounding of J2 - J1.
    """
    (_, _, A3), r, mu = PENDULUM.floats()
    h0 = mu * (1 + np.geomspace(0.1, 19.0, sizes.orbits))
    states = np.zeros((6, sizes.orbits))
    states[2] = -np.sqrt(2 * A3 * (h0 + mu))
    states[3], states[4] = -r[0], -r[1]
    return _motion(PENDULUM, states, sizes.turns * 2 * math.pi * math.sqrt(A3 / (2 * mu)))


def codes(sizes: Any) -> Task:
    """The first columns of the left array."""
    problem = replace(FIG4, n_symbols=sizes.n_symbols)
    phases = np.array([f"{k}/10" for k in range(sizes.columns)], dtype=object)
    return _routes(problem, phases, _starts(problem, phases))


def _starts(problem: RouteProblem, phases: Any) -> Array:
    return np.array(initial(problem, [exact(x) for x in phases]), dtype=float).T


def precession_angle(sizes: Any) -> Task:
    """The two orbits of Fig. 5, to half a passage behind the last crossing.

    alpha - theta3 at the start is that of (th_al).
    """
    body, states = FIG5.body, _starts(FIG5, FIG5_PHASES)
    omega = angular_velocity(states[:3], body.floats()[0])
    ahead = alpha_ahead(states[:3], omega, states[3:])
    route = codes_of(FIG5, FIG5_PHASES, resolve()).crossing_time
    ends = np.round(route[-1] + (route[-1] - route[-2]) / 2) / time_unit(body)
    full = np.concatenate((states, np.zeros((1, len(ends))), ahead[None]))
    return Task("angle", body, full, ends, FIG5, FIG5_PHASES)


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
    times = np.full(states.shape[1], horizon)
    return Task("routes", problem.body, states, times, problem, phases)


def drawn(seed: int = SEED, bodies: int = 40) -> list[RouteProblem]:
    """Problems of bodies drawn by lot: any shape, any direction of r, any energy.

    Numbers have three or four digits, so that a problem can be written down.
    """
    random = np.random.default_rng(seed)
    return [_drawn(random) for _ in range(bodies)]


def shape(random: np.random.Generator) -> tuple[float, float]:
    """A2/A1 and A3/A1, evenly over the shapes that a body may have: A1 > A3 > A2, A2 + A3 > A1."""
    A2, A3 = 1.0, 0.0
    while not (0.01 < A2 < A3 - 0.002 < 0.996 and A2 + A3 > 1.002):
        A2, A3 = random.uniform(0, 1, 2)
    return A2, A3


def _drawn(random: np.random.Generator) -> RouteProblem:
    A2, A3 = shape(random)
    A1, angle, h0 = random.uniform(1.5, 3), random.uniform(0, math.pi / 2), random.uniform(0.8, 1.6)
    weight, start = (10 ** random.uniform(*ends) for ends in (WEIGHT, START))
    A = (f"{A1:.3f}", f"{A1 * A2:.3f}", f"{A1 * A3:.3f}")
    r = (f"{math.cos(angle):.3f}", f"{math.sin(angle):.3f}", 0)
    h = f"{h0:.4f}"
    body = Body(A, r, f"{weight * float(h):.3g}")
    return RouteProblem(body, exact(h), exact(f"{start:.3g}"), FIG4.n_symbols)


def ends_in_113_bits(task: Task) -> dict[str, Array]:
    """The states at the end, in 113 bits; exact initial ones where a problem has them."""
    starts: Any = task.states.T
    if task.problem:
        M_gamma = initial(task.problem, [exact(x) for x in task.theta2_0], 113)
        # Where the two angles start is a mere constant; its double is the same for everyone.
        starts = [[*y, *angles] for y, angles in zip(M_gamma, starts[:, 6:], strict=True)]
    size = len(task.states)
    made = integrator(task.body, FIELDS[size], size, 113)
    ways = zip(starts, task.times, strict=True)
    return {"states": np.array([carry(made, state, end) for state, end in ways]).T}


def codes_in_113_bits(task: Task) -> dict[str, Any]:
    """Symbols and crossing times in 113 bits, each established twice."""
    found = codes_of(task.problem, task.theta2_0, resolve(precisions=(113,)))
    if not found.certain.all():
        raise ArithmeticError("the reference is not certain")
    return {"codes": found.codes, "time": found.crossing_time}


def error_of_motion(answer: Array, truth: Data) -> dict[str, float]:
    """The largest distance of (M/\\|M\\|, gamma) at the end."""
    gap = answer - truth["states"]
    gap[:3] /= np.linalg.norm(truth["states"][:3], axis=0)
    return {"error": float(np.linalg.norm(gap, axis=0).max())}


def error_of_codes(answer: Crossed, truth: Data) -> dict[str, float]:
    """Median over the columns of the largest error of a crossing time, t'; symbols judged."""
    gap = np.abs(answer.time - truth["time"])
    worst = np.where(np.isnan(gap), np.inf, gap).max(axis=0)
    return {"error": float(np.median(worst)), **judged(answer, truth["codes"])}


def error_of_alpha(answer: Array, truth: Data) -> dict[str, float]:
    """The largest error of alpha(T), the last row, which is an angle, in radians."""
    gap = answer[-1] - truth["states"][-1]
    return {"error": float(np.abs(np.remainder(gap + math.pi, 2 * math.pi) - math.pi).max())}


class Stage(NamedTuple):
    """A problem made ready."""

    task: Task
    truth: Data
    """Arrays, in 113 bits."""
    error: Callable[[Any, Data], dict[str, float]]
    """From an answer and the truth: ``error`` first, then what else is told."""


ASKED: dict[str, tuple[Callable[[Any], Task], Callable[[Task], Data], Callable[..., Any]]] = {
    "free_body": (free_body, ends_in_113_bits, error_of_motion),
    "pendulum": (pendulum, ends_in_113_bits, error_of_motion),
    "codes": (codes, codes_in_113_bits, error_of_codes),
    "precession_angle": (precession_angle, ends_in_113_bits, error_of_alpha),
}
"""Task, truth and error by the names of `methods.PROBLEMS`."""


def stage(problem: str, sizes: Any, truth: Data | None = None) -> Stage:
    """A problem of the sizes of `schema.Workload`; its truth is computed if it is not given."""
    make, true, error = ASKED[problem]
    task = make(sizes)
    return Stage(task, truth or true(task), error)
