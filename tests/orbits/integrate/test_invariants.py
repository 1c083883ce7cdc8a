"""What the equations of motion conserve, over orbits as long as those of Fig. 4."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import (
    aligned,
    aligned_coefficients,
    energy,
    euler_poisson,
)
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import (
    ENGINES,
    FIG4,
    GENERIC,
    on_separatrix,
)
from tests.strategies import floats_of

DURATION = 260.0
BOUND = {"taylor": 5e-14, "scipy": 2e-12}
"""How far an integral, of size about one, may drift over `DURATION`, by engine."""


def drift(M: Any, gamma: Any, body: Any) -> float:
    """The largest change of energy, |gamma|^2 and M . gamma along an orbit."""
    A, r, mu = floats_of(body)
    integrals = [
        energy(M, gamma, A, r, mu),
        sum(x * x for x in gamma),
        sum(x * y for x, y in zip(M, gamma, strict=True)),
    ]
    return max(float(np.abs(values - values[0]).max()) for values in integrals)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
def test_invariant_integrals_of_the_aligned_field(body: Any, engine: str) -> None:
    numbers = aligned_coefficients(body.angles(), math)
    begin = on_separatrix(2, body, 1e-8, 1.1, math.sqrt(2))
    times = np.linspace(0, DURATION, 500)
    orbit = states_at(lambda state, m: aligned(state, numbers), begin, times, engine=engine)
    assert np.ptp(np.sign(orbit[2])) == 2, "the orbit must have gone up and down"
    A, _, _ = floats_of(body)
    M, gamma = body_from_aligned(Aligned(*orbit), body.alpha0, scale(A))
    assert drift(M, gamma, body) < BOUND[engine]
    # Here M . gamma = 0 and |gamma| = 1 from the start.
    assert np.abs((M * gamma).sum(axis=0)).max() < BOUND[engine]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
def test_invariant_integrals_of_euler_poisson_off_the_level_zero(body: Any, engine: str) -> None:
    A, r, mu = floats_of(body)
    begin = [0.5, 0.4, 1.2, 0.48, 0.6, 0.64]
    times = np.linspace(0, DURATION, 500)
    orbit = states_at(
        lambda x, m: euler_poisson(x[:3], x[3:], A.tolist(), r.tolist(), mu),
        begin,
        times,
        engine=engine,
    )
    # The integrals are of size one and the orbit moves, so conserving them says something.
    assert np.ptp(orbit, axis=1).min() > 0.2
    assert drift(orbit[:3], orbit[3:], body) < BOUND[engine]
