"""Problem 3: the binary route codes of Fig. 4, left array.

Like is compared with like: other methods deliver symbols and no word on whether they are right.
The default is therefore what rigidpend picks for that, the aligned components in batches, once.
`route_codes`, which gives every symbol cross-checked, computes all of them twice and the
doubtful ones once more; it is a line of its own, which shows what certainty costs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.tasks import (
    Crossed,
    RouteTask,
    time_unit,
)
from rigidpend.experiments.data.tree import Data
from rigidpend.experiments.principal_axes import initial
from rigidpend.mechanics.body import Body
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import PI, exact
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import RouteProblem, rotation_period

TITLE = "route codes of Fig. 4"
ERROR = "median over the columns of the largest error of a crossing time, t'"
KIND = "routes"
DEFAULT = "aligned_batch"

BODY = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
H0, J1_0 = "1.3342", "1e-8"
PASSAGE = 26.0
"""t' by which any passage of these orbits is over; the mean is 16."""


def task(sizes: Any) -> RouteTask:
    """The first columns of the left array."""
    phases = tuple(f"{k}/10" for k in range(sizes.columns))
    problem = _problem(sizes.n_symbols)
    states = np.array(initial(problem, [exact(x) for x in phases]), dtype=float).T
    return _routes(problem, phases, states)


def random_task(n: int, n_symbols: int) -> RouteTask:
    """Orbits from random phases, doubles."""
    phases = np.random.default_rng(0).uniform(0, 2 * np.pi, n)
    return from_phases(phases, J1_0, n_symbols)


def from_phases(phases: Array, J1_0: str, n_symbols: int) -> RouteTask:
    """Orbits from phases in doubles, and another J1_0."""
    problem = _problem(n_symbols, J1_0)
    # gamma is linear in the cosine and the sine of the phase.
    along, across = np.array(initial(problem, [exact(0), PI / 2]), dtype=float)
    gamma = np.outer(along[3:], np.cos(phases)) + np.outer(across[3:], np.sin(phases))
    M = np.repeat(along[:3, None], len(phases), axis=1)
    return _routes(problem, phases, np.concatenate((M, gamma)))


def _problem(n_symbols: int, J1_0: str = J1_0) -> RouteProblem:
    return RouteProblem(BODY, exact(H0), exact(J1_0), n_symbols)


def _routes(problem: RouteProblem, phases: Any, states: Array) -> RouteTask:
    s = time_unit(BODY)
    horizon, period = PASSAGE * (problem.n_symbols + 1), rotation_period(problem)
    return RouteTask(problem, phases, states, horizon / s, period / s)


def reference(task: RouteTask) -> dict[str, Any]:
    """Symbols and crossing times in 113 bits, each established twice."""
    p = task.problem
    found = route_codes(
        p.body, task.theta2_0, h0=p.h0, J1_0=p.J1_0, n_symbols=p.n_symbols, precisions=(113,)
    )
    if not found.certain.all():
        raise ArithmeticError("the reference is not certain")
    return {"codes": found.codes, "time": found.crossing_time}


def error(answer: Crossed, reference: Data) -> dict[str, float]:
    """See `ERROR`; also the worst column, the wrong symbols, and which of them are trusted."""
    gap = np.abs(answer.time - reference["time"])
    worst = np.where(np.isnan(gap), np.inf, gap).max(axis=0)
    wrong = answer.codes != reference["codes"]
    trusted = np.ones_like(wrong) if answer.certain is None else answer.certain
    return {
        "error": float(np.median(worst)),
        "worst": float(worst.max()),
        "wrong": float(wrong.mean()),
        "wrong_symbols": float(wrong.sum()),
        "undecided": float((~trusted).sum()),
        "wrong_trusted": float((wrong & trusted).sum()),
    }
