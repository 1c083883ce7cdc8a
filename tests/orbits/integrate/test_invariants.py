"""What the equations of motion conserve, over orbits as long as those of Fig. 4."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.coordinates import Aligned, body_from_aligned, scale
from rigidpend.mechanics.equations import aligned_coefficients, energy, euler_poisson
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import ENGINES, FIG4, GENERIC, on_separatrix
from tests.strategies import floats_of

TIMES = np.linspace(0, 260, 500)
BOUND = {"taylor": 5e-14, "scipy": 2e-12}
"""How far an integral, of size about one, may drift in 260 units of time, by engine."""


def aligned_orbit(body: Any, engine: str) -> tuple[Any, Any]:
    numbers = aligned_coefficients(body.angles(), math)
    begin = on_separatrix(2, body, 1e-8, 1.1, math.sqrt(2))
    orbit = states_at(numbers, begin, TIMES, engine=engine)
    assert np.ptp(np.sign(orbit[2])) == 2, "the orbit must have gone up and down"
    return body_from_aligned(Aligned(*orbit), body.alpha0, scale(floats_of(body)[0]))


def orbit_off_the_level_zero(body: Any, engine: str) -> tuple[Any, Any]:
    A, r, mu = floats_of(body)
    begin = [0.5, 0.4, 1.2, 0.48, 0.6, 0.64]
    field: Any = lambda x, m: euler_poisson(x[:3], x[3:], A.tolist(), r.tolist(), mu)  # noqa: E731
    orbit = states_at(field, begin, TIMES, engine=engine)
    # The integrals are of size one and the orbit moves, so conserving them says something.
    assert np.ptp(orbit, axis=1).min() > 0.2
    return orbit[:3], orbit[3:]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
@pytest.mark.parametrize("orbit", [aligned_orbit, orbit_off_the_level_zero])
def test_invariant_energy_and_the_lengths_of_gamma_and_M_gamma(
    orbit: Any, body: Any, engine: str
) -> None:
    (M, gamma), (A, r, mu) = orbit(body, engine), floats_of(body)
    for integral in (energy(M, gamma, A, r, mu), (gamma**2).sum(axis=0), (M * gamma).sum(axis=0)):
        assert np.abs(integral - integral[0]).max() < BOUND[engine]
