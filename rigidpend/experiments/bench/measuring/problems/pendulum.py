"""Problem 2: the pendulum motions (5:3), from slow to fast rotations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.problems.free_body import error as error
from rigidpend.experiments.bench.measuring.tasks import (
    MotionTask,
    direction,
    moments,
)
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.pendulum import body_motion
from rigidpend.numbers.doubles import Array
from rigidpend.numbers.exact import context

TITLE = "pendulum (5:3)"
ERROR = "largest distance of (M/|M|, gamma) from the truth at the end, over the orbits"
KIND = "motion"
DEFAULT = "closed_form"

BODY = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.1")


def task(sizes: Any) -> MotionTask:
    """Rotations from the lowest point, tau = 0, of energies h0 from 1.1 mu to 20 mu.

    M3 < 0: then J1 = 0 exactly, which spares (eq1) the rounding of J2 - J1.
    """
    A3, r, mu = moments(BODY)[2], direction(BODY), float(BODY.mu)
    h0 = mu * (1 + np.geomspace(0.1, 19.0, sizes.orbits))
    states = np.zeros((6, sizes.orbits))
    states[2] = -np.sqrt(2 * A3 * (h0 + mu))
    states[3], states[4] = -r[0], -r[1]
    period = 2 * math.pi * math.sqrt(A3 / (2 * mu))
    return MotionTask(BODY, states, sizes.turns * period, period, h0)


def reference(task: MotionTask) -> dict[str, Array]:
    """The states at the end, by (5:3) in 113 bits."""
    m = context(113)
    A3, mu = (x.in_context(m) for x in (task.body.A[2], task.body.mu))
    r = [x.in_context(m) for x in task.body.r]
    assert task.h0 is not None
    ends = [body_motion(m.mpf(task.end), -1, A3, r, m.mpf(h0), mu, m) for h0 in task.h0]
    return {"states": np.array([[*M, *gamma] for M, gamma in ends], dtype=float).T}
