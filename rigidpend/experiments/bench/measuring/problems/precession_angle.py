"""Problem 4: alpha(T) of Fig. 5, T half a passage behind the last crossing of each route."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.fields import with_angles
from rigidpend.experiments.bench.measuring.tasks import (
    AngleTask,
    moments,
    time_unit,
)
from rigidpend.experiments.data.tree import Data
from rigidpend.experiments.principal_axes import carry, initial, integrator
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.hodograph import alpha_ahead, angular_velocity
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import exact
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import RouteProblem, rotation_period

TITLE = "alpha(T) of Fig. 5"
ERROR = "largest error of alpha(T), radians, over the two orbits"
KIND = "angle"
DEFAULT = "aligned_batch"

BODY = Body(A=(2, "1.5", "1.8"), r=(0, 1, 0), mu="0.01")
H0, J1_0, THETA2_0 = "10/9", "2.39205e-9", ("1.02", "1.83")
N_SYMBOLS = 5


def task(sizes: Any) -> AngleTask:
    """The two orbits of the figure; alpha - theta3 at the start is that of (th_al)."""
    problem = RouteProblem(BODY, exact(H0), exact(J1_0), N_SYMBOLS)
    states = np.array(initial(problem, [exact(x) for x in THETA2_0]), dtype=float).T
    omega = angular_velocity(states[:3], moments(BODY))
    ahead = alpha_ahead(states[:3], omega, states[3:])
    route = route_codes(BODY, THETA2_0, h0=H0, J1_0=J1_0, n_symbols=N_SYMBOLS).crossing_time
    ends = route[-1] + (route[-1] - route[-2]) / 2
    s = time_unit(BODY)
    full = np.concatenate((states, np.zeros((1, len(THETA2_0))), ahead[None]))
    return AngleTask(problem, THETA2_0, full, np.round(ends) / s, rotation_period(problem) / s)


def reference(task: AngleTask) -> dict[str, Array]:
    """alpha(T) in 113 bits, of the exact initial states."""
    made = integrator(task.problem.body, with_angles, 8, 113)
    starts = initial(task.problem, [exact(x) for x in task.theta2_0], 113)
    # Where the two angles start is a mere constant; its double is the same for everyone.
    ways = zip(starts, task.states[6:].T, task.ends, strict=True)
    return {"alpha": np.array([carry(made, [*y, *angles], end)[7] for y, angles, end in ways])}


def error(answer: Array, reference: Data) -> dict[str, float]:
    """See `ERROR`; alpha is an angle."""
    gap = answer - reference["alpha"]
    return {"error": float(np.abs(np.remainder(gap + math.pi, 2 * math.pi) - math.pi).max())}
