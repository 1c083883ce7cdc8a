"""Problem 5: drift of the integrals over very many periods, beside the separatrices."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigidpend.experiments.bench.measuring.problems import codes
from rigidpend.experiments.bench.measuring.tasks import (
    MotionTask,
    direction,
    moments,
)
from rigidpend.experiments.data.tree import Data
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import energy
from rigidpend.numbers.doubles import Array

TITLE = "integrals over long times"
ERROR = "largest drift of energy, |gamma| and M.gamma, relative, over the orbits and the time"
KIND = "long"
DEFAULT = "aligned_batch"


def task(sizes: Any) -> MotionTask:
    """Orbits of Fig. 4, from random phases."""
    found = codes.random_task(sizes.companions, 1)
    return MotionTask(codes.BODY, found.states, sizes.periods * found.period, found.period)


def reference(task: MotionTask) -> dict[str, Array]:
    """The integrals at the start, in units of what they are compared with."""
    return dict(zip(("energy", "gamma", "area"), integrals(task.body, task.states), strict=True))


def integrals(body: Body, states: Array) -> tuple[Array, Array, Array]:
    """Energy, \\|gamma\\| and M . gamma, each (n,)."""
    M, gamma = states[:3], states[3:]
    height = energy(M, gamma, moments(body), direction(body), float(body.mu))
    return height, np.linalg.norm(gamma, axis=0), (M * gamma).sum(axis=0)


def error(answer: Any, reference: Data) -> dict[str, float]:
    """See `ERROR`; `answer` is a list of states (6, n), on the way and at the end."""
    found = [integrals(codes.BODY, states) for states in answer]
    energy, gamma, area = np.array(found).transpose(1, 0, 2)
    drift = {
        "energy": np.abs(energy / reference["energy"] - 1).max(),
        "gamma": np.abs(gamma / reference["gamma"] - 1).max(),
        # M . gamma is zero; it is compared with |M|, which is sqrt(2 A E) up to a few per cent.
        "area": (np.abs(area - reference["area"]) / np.sqrt(np.abs(reference["energy"]))).max(),
    }
    return {"error": float(max(drift.values())), **{k: float(v) for k, v in drift.items()}}
