"""Bodies drawn by lot, for speed is to be had with every body and not with that of Fig. 4 alone."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem

SEED = 40
"""Seed of the bodies that are the same in every run."""
BODIES = 40
N_SYMBOLS = 15
ORBITS = 20_000
WEIGHT = -4.0, math.log10(0.02)
"""log10 of the least and the largest mu/h0."""
START = -12.0, -6.0
"""log10 of the least and the largest J1_0."""


def drawn(seed: int = SEED, bodies: int = BODIES) -> list[RouteProblem]:
    """Problems of bodies drawn by lot: any shape, any direction of r, any energy.

    Numbers have three or four digits, so that a problem can be written down.
    """
    random = np.random.default_rng(seed)
    return [_problem(random) for _ in range(bodies)]


def phases(orbits: int = ORBITS, seed: int = SEED) -> NDArray[np.float64]:
    """theta2_0 of orbits of such a problem, radians."""
    return np.random.default_rng(seed).uniform(0, 2 * np.pi, orbits)


def _problem(random: np.random.Generator) -> RouteProblem:
    A2, A3 = 1.0, 0.0
    # Evenly over the shapes that a body may have, A1 > A3 > A2 and A2 + A3 > A1.
    while not (0.01 < A2 < A3 - 0.002 < 0.996 and A2 + A3 > 1.002):
        A2, A3 = random.uniform(0, 1, 2)
    A1, angle, h0 = random.uniform(1.5, 3), random.uniform(0, math.pi / 2), random.uniform(0.8, 1.6)
    weight, start = (10 ** random.uniform(*ends) for ends in (WEIGHT, START))
    A = (f"{A1:.3f}", f"{A1 * A2:.3f}", f"{A1 * A3:.3f}")
    r = (f"{math.cos(angle):.3f}", f"{math.sin(angle):.3f}", 0)
    h = f"{h0:.4f}"
    return RouteProblem(
        Body(A, r, f"{weight * float(h):.3g}"), exact(h), exact(f"{start:.3g}"), N_SYMBOLS
    )
