"""Stretching of passages: against variational equations, closed and long orbits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.mechanics.equations import aligned
from rigidpend.orbits import integrate
from rigidpend.orbits.return_map.poincare import section_state
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.reduced import coefficients
from rigidpend.routes.symbolic.chain import (
    Chain,
    on_surface,
    signs_of,
    tangents,
)
from rigidpend.routes.symbolic.closed import closed
from rigidpend.routes.symbolic.follow import section_points
from rigidpend.routes.symbolic.shortest import path
from rigidpend.routes.symbolic.stretching import stretching, variational_equations
from tests.routes.symbolic.fig4 import BODY, H, level

STEP = 1e-6
"""Step of differences on the section; its square, 1e-12 times derivatives of order 1, is left."""


def long_chain(n: int) -> Chain:
    symbols = np.random.default_rng(3).integers(0, 2, n)
    return path(level(), on_surface, signs_of(symbols), 11 * np.arange(n + 1), 0.0).chain


@pytest.mark.parametrize("k", [0, 1, 2])
def test_slopes_are_those_of_the_variational_equations(k: int) -> None:
    """Integrated through a passage, and put back on the section along the flow."""
    chain, a = long_chain(4), precision(53)
    c = coefficients(BODY.angles(), "1", a)
    rising = k % 2 == 0

    def state(d: float, chi: float) -> Any:
        at = [np.array([x]) for x in (d, chi, float(H))]
        return section_state(rising, at[0], at[1], at[2], c, a)[:, 0]

    d, chi = chain.d[k], chain.chi[k]
    found = np.empty((2, 2))
    for column, (by_d, by_chi) in enumerate(((STEP, 0.0), (0.0, STEP))):
        off = (state(d + by_d, chi + by_chi) - state(d - by_d, chi - by_chi)) / (2 * STEP)
        end = integrate.sample(
            variational_equations(c.aligned), np.append(state(d, chi), off), [0.0, chain.time[k]]
        )[:, -1]
        flow = np.array(aligned(end[:6], c.aligned))
        moved = end[6:] - flow * end[8] / flow[2]
        step = STEP / np.abs(moved).max()
        beside = np.stack((end[:6] - step * moved, end[:6] + step * moved), axis=1)
        points = section_points(BODY, beside)
        found[:, column] = [np.diff(x)[0] / (2 * step) for x in (points.d, points.chi)]
    # d is as if on separatrix 2 or 3: of an orbit on 4 or 1 it has the other sign.
    np.testing.assert_allclose(found, tangents(level(), chain)[k, :2], rtol=2e-6, atol=1e-8)


def test_a_closed_orbit_stretches_by_its_multiplier() -> None:
    orbit = closed(level(), (0, 1), 11)
    many = path(level(), on_surface, signs_of(np.array([0, 1] * 20)), 11 * np.arange(41), 0.0)
    grown = stretching(level(), many.chain)
    # In the middle the surface's orbit is beside the closed one, whose word has two passages.
    assert abs(grown[18:20].mean() - orbit.exponent) < 1e-8


def test_the_mean_of_a_long_orbit_tends_to_its_exponent() -> None:
    grown = stretching(level(), long_chain(200))
    assert grown.shape == (200,)
    assert abs(grown[1:].mean() - 2.939) < 4 * grown[1:].std() / np.sqrt(199)
