"""Orbits of S1- up to the section: energy, angles, and that they are on S1-."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.coordinates import (
    Aligned,
    body_from_aligned,
    scale,
)
from rigidpend.mechanics.equations import energy
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.surfaces.surface_orbits import (
    kind,
    launch,
    meet,
    numbers,
    section_angles,
    surface,
)

GENERIC = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.02")
ARITHMETIC = resolve(None, 3e-14)
M = numbers(53)


def floats(state: Any) -> Any:
    return np.array([float(x) for x in state])


@pytest.mark.parametrize("mu", ["1e-6", "0.02", "0.6"])
@pytest.mark.parametrize("theta2_0", [0.3, 2.0, 4.5])
def test_invariant_orbits_start_with_the_energy_asked_for_and_J3_zero(
    mu: str, theta2_0: float
) -> None:
    body = Body(GENERIC.A, GENERIC.r, mu)
    state = floats(launch(surface(body, exact("0.8"), 53), M.mpf(theta2_0), M.mpf(8)))
    A = [float(x) for x in body.A]
    moments, gamma = body_from_aligned(Aligned(*state), body.alpha0, scale(A, math))
    found = energy(moments, gamma, A, [float(x) for x in body.r], float(body.mu))
    assert found == pytest.approx(0.8, rel=1e-15)
    assert abs(moments @ gamma) < 1e-15
    assert gamma @ gamma == pytest.approx(1, rel=1e-15)


def test_a_small_offset_keeps_its_relative_precision() -> None:
    tiny = M.mpf("1e-20")
    state = (M.sin(tiny / 2 + 2), M.sin(tiny / 2), 0, 1, 0, 0)
    _, offset = section_angles(state, M.mpf(2), M)
    assert abs(offset / tiny - 1) < 1e-20


def test_the_section_is_met_at_the_same_point_from_any_depth() -> None:
    """A turn of theta2 earlier the same orbit of S1- is lower by exp(-2 pi^2/nu), to O(mu)."""
    from rigidpend.surfaces.splitting import harmonics

    s = surface(GENERIC, exact(1), 53)
    phases = [2 * M.pi * k / 32 for k in range(32)]
    found = []
    for depth in (40, 43, 60):
        points = meet(s, phases, M.mpf(depth), ARITHMETIC)
        assert points is not None
        told = harmonics(points, kind(s, ARITHMETIC))
        assert told is not None
        found.append(np.array(told[0], dtype=float))
    assert np.abs(found[0]).max() > 1e-5
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(found[2], found[0], rtol=0, atol=1e-15)
