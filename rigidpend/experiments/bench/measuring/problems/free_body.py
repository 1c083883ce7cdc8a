"""Problem 1: the free body (mu = 0), also by its elliptic functions.

These are no default: they cost a Python call an orbit, whatever the time, and over 25 turns the
series on orbits side by side cost less. They are the most exact in doubles.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.fields import principal
from rigidpend.experiments.bench.measuring.tasks import MotionTask
from rigidpend.experiments.data.tree import Data
from rigidpend.experiments.principal_axes import carry, integrator
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import cross
from rigidpend.mechanics.free_body import around_M1, around_M2
from rigidpend.numbers.doubles import Array

TITLE = "free body"
ERROR = "largest distance of (M/|M|, gamma) from the truth at the end, over the orbits"
KIND = "motion"
DEFAULT = "aligned_batch"

BODY = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu=0)
MOMENTUM = 2.0
"""|M|, physical, that of Fig. 3 and Fig. 5."""


def task(sizes: Any) -> MotionTask:
    """Orbits around both axes, from near the centres to near the separatrix."""
    heights = 1 - np.geomspace(0.9, 1e-3, sizes.orbits)
    phases = np.linspace(0.0, 6.0, sizes.orbits)
    around = [around_M1, around_M2]
    M = np.stack(
        [
            around[i % 2](BODY.alpha0, height, 1 - i // 2 % 2 * 2, phase)
            for i, (height, phase) in enumerate(zip(heights, phases, strict=True))
        ],
        axis=1,
    )
    gamma = np.stack(cross(M, (0.6, 0.0, 0.8)))
    states = np.concatenate((MOMENTUM * M, gamma / np.linalg.norm(gamma, axis=0)))
    period = 2 * math.pi * float(BODY.A[2]) / MOMENTUM
    return MotionTask(BODY, states, sizes.turns * period, period)


def reference(task: MotionTask) -> dict[str, Array]:
    """The states at the end, in 113 bits."""
    made = integrator(task.body, principal, 6, 113)
    return {"states": np.array([carry(made, state, task.end) for state in task.states.T]).T}


def error(answer: Array, reference: Data) -> dict[str, float]:
    """See `ERROR`."""
    truth = reference["states"]
    gap = answer - truth
    gap[:3] /= np.linalg.norm(truth[:3], axis=0)
    return {"error": float(np.linalg.norm(gap, axis=0).max())}
