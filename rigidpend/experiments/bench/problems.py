"""Orbits whose symbols are asked for, of Fig. 4 or of randomly drawn bodies, and their equations.

States are (6, n), M and gamma in principal axes. Times are physical.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data import Data
from rigidpend.experiments.principal_axes import euler_poisson_field, initial, judged
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import scale
from rigidpend.numbers import Array
from rigidpend.numbers.exact import PI, exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.kernel.tape import trace
from rigidpend.routes.codes import codes_of
from rigidpend.routes.problem import RouteProblem

FIG4 = RouteProblem(Body((2, 1, "1.5"), (1, 1, 0), "0.001"), exact("1.3342"), exact("1e-8"), 15)
PASSAGE = 26.0
"""Longest time t' of a passage of the orbits of Fig. 4; the mean is 16."""
SEED = 40
"""Seed of the bodies that are the same in every run."""
WEIGHT = -4.0, math.log10(0.02)
"""log10 of the least and the largest mu/h0 of a drawn body."""
START = -12.0, -6.0
"""log10 of the least and the largest J1_0."""
SIGNS = {"plus": "+", "minus": "-", "times": "*", "divided": "/"}
"""Operations of the tape as Python writes them."""


class Task(NamedTuple):
    """Orbits that start on a separatrix, whose symbols and crossing times are asked for."""

    problem: RouteProblem
    theta2_0: Any
    """(n,) initial phases in radians, texts or doubles."""
    states: Array
    """(6, n) at time 0."""
    end: float
    """Physical time by which each orbit has made all its crossings."""

    def of(self, columns: Any) -> Task:
        """The task for some of the orbits."""
        states = np.ascontiguousarray(self.states[:, columns])
        return self._replace(theta2_0=self.theta2_0[columns], states=states)


class Crossed(NamedTuple):
    """The answer to a task, as far as it is compared; `RouteCodes` has the same fields."""

    codes: NDArray[np.uint8]
    """(n_symbols, n)."""
    crossing_time: Array
    """(n_symbols + 1, n), t'."""
    certain: Any = None
    """(n_symbols, n), True for trusted symbols; None if the method marks none."""


def time_unit(body: Body) -> float:
    """The factor s of t' = t s."""
    return float(scale(body.floats()[0], math))


def fig4(columns: int, n_symbols: int) -> Task:
    """The orbits of the first columns of Fig. 4's left array."""
    phases = np.array([f"{k}/10" for k in range(columns)], dtype=object)
    states = np.array(initial(FIG4, [exact(x) for x in phases]), dtype=float).T
    return _task(replace(FIG4, n_symbols=n_symbols), phases, states)


def random_routes(problem: RouteProblem, n: int) -> Task:
    """Orbits from random phases in doubles, the same in every run."""
    return from_phases(problem, np.random.default_rng(0).uniform(0, 2 * np.pi, n))


def from_phases(problem: RouteProblem, phases: Array) -> Task:
    """Orbits from phases in doubles."""
    # gamma is linear in the cosine and sine of the phase: two exact starts give all others.
    along, across = np.array(initial(problem, [exact(0), PI / 2]), dtype=float)
    gamma = np.outer(along[3:], np.cos(phases)) + np.outer(across[3:], np.sin(phases))
    M = np.repeat(along[:3, None], len(phases), axis=1)
    return _task(problem, phases, np.concatenate((M, gamma)))


def _task(problem: RouteProblem, phases: Any, states: Array) -> Task:
    end = PASSAGE * (problem.n_symbols + 1) / time_unit(problem.body)
    return Task(problem, phases, states, end)


def drawn(seed: int = SEED, bodies: int = 40) -> list[RouteProblem]:
    """Problems of randomly drawn bodies: any shape, any direction of r, any energy.

    Numbers have three or four digits, so that tables state a problem exactly.
    """
    random = np.random.default_rng(seed)
    return [_drawn(random) for _ in range(bodies)]


def shape(random: np.random.Generator) -> tuple[float, float]:
    """A2/A1 and A3/A1, uniform over the admitted shapes: A1 > A3 > A2, A2 + A3 > A1."""
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


def flat(body: Body) -> Any:
    """Write ``rates(dy, t, y, args)``, which takes floats or arrays, and which numba can compile.

    Each quantity is a local variable, as in fast code written by hand, from the same tape as the
    package's own compiled fields.
    """
    A, r, mu = body.floats()
    # The moments are traced as components, because the tape turns division by a parameter into
    # multiplication by its reciprocal; with quotients, which round once, CyRK was a sixth faster.
    traced, parameters = trace(lambda y: euler_poisson_field(y[6:], r, mu)(y[:6]), 9)
    components = [*(f"y{i}" for i in range(6)), *map(repr, A)]
    names: list[str] = []
    known: dict[str, str] = {}
    for name, operands in traced.lines:
        if name == "component":
            names.append(components[operands[0]])
        elif name == "parameter":
            names.append(repr(parameters[operands[0]]))
        else:
            left, right = (names[i] for i in operands)
            # The tape keeps equal parameters apart; expressions that agree in text are joined here.
            names.append(known.setdefault(f"{left} {SIGNS[name]} {right}", f"x{len(known)}"))
    lines = [
        *(f"y{i} = y[{i}]" for i in range(6)),
        *(f"{name} = {expression}" for expression, name in known.items()),
        *(f"dy[{i}] = {names[k]}" for i, k in enumerate(traced.rates)),
    ]
    room: dict[str, Any] = {}
    exec(compile("\n    ".join(["def rates(dy, t, y, args):", *lines]), "<field>", "exec"), room)
    return room["rates"]


def truth(task: Task) -> dict[str, Any]:
    """Symbols and crossing times in 113 bits, each established twice."""
    found = codes_of(task.problem, task.theta2_0, resolve(precisions=(113,)))
    if not found.certain.all():
        raise ArithmeticError("the reference is not certain")
    return {"codes": found.codes, "time": found.crossing_time}


def errors(answer: Crossed, true: Data) -> dict[str, float]:
    """Median over columns of the largest error of a crossing time, t', and the wrong symbols."""
    gap = np.abs(answer.crossing_time - true["time"])
    worst = np.where(np.isnan(gap), np.inf, gap).max(axis=0)
    wrong = judged(answer, true["codes"])["wrong_symbols"]
    return {"error": float(np.median(worst)), "wrong_symbols": wrong}
