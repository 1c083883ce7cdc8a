"""Actions of closed orbits: their derivative in the energy, and the form in the paper's letters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.coordinates import Aligned, canonical_from_aligned
from rigidpend.mechanics.equations import eq1
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.return_map import return_map
from rigidpend.routes.symbolic.chain import crossing_states
from rigidpend.routes.symbolic.closed import actions, closed
from rigidpend.routes.symbolic.levels import Level
from tests.routes.symbolic.fig4 import BODY, H, level

STEP = 1e-4
"""Half the difference of energies; its square, times the third derivative, is left."""
WORDS = [(0,), (0, 1), (1, 0), (0, 0, 1)]


def test_the_derivative_in_the_energy_is_the_period() -> None:
    made = return_map(BODY, h=(H - BODY.mu, H + BODY.mu))
    ends = [Level(made, float(H) + side * STEP) for side in (-1, 1)]
    low, high = (actions([closed(one, word, 11).chain for word in WORDS]) for one in ends)
    periods = [closed(level(), word, 11).period for word in WORDS]
    np.testing.assert_allclose((high - low) / (2 * STEP), periods, rtol=1e-7)


@pytest.mark.parametrize("word", [(0, 1), (0, 0, 1)])
def test_the_action_is_the_integral_in_canonical_variables(word: tuple[int, ...]) -> None:
    """J1 dtheta1 + J2 dtheta2 along the paper's equations, through each passage."""
    chain = closed(level(), word, 11).chain
    p = BODY.angles()
    states = crossing_states(chain)[:, :-1]
    at = canonical_from_aligned(Aligned(*states), p.alpha0, p.beta0)
    begin = np.array([at.theta1, at.J1, at.theta2, at.J1 + at.J2mJ1])

    def rates(state: Any, m: Any) -> tuple[Any, ...]:
        found = eq1(state[:4], p, m)
        return (*found, state[1] * found[0] + state[3] * found[2])

    grown = states_at(rates, np.vstack((begin, 0 * begin[:1])), chain.time[None])[4, 0]
    [found] = actions([chain])
    assert found == pytest.approx(grown.sum(), rel=1e-12)
