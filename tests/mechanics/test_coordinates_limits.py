"""States where coordinates degenerate: M along Oz or gamma, M = 0, tiny actions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics import coordinates as co
from rigidpend.mechanics.coordinates import Canonical
from tests.strategies import assert_same_canonical, assert_same_state, floats_of

UPRIGHT: dict[str, Any] = {
    "up": ((0, 0, 2), (0.6, 0, 0.8)),
    "down": ((0, 0, -2), (0.48, 0.64, -0.6)),
    "negative zeros": ((-0.0, -0.0, -2), (-0.6, -0.0, 0.8)),
    "up, along gamma": ((0, 0, 2), (0, 0, 1)),
    "up, against gamma": ((0, 0, 2), (0, 0, -1)),
    "down, along gamma": ((0, 0, -2), (0, 0, -1)),
    "at rest": ((0, 0, 0), (0.48, 0.64, -0.6)),
    "at rest, gamma up": ((0, 0, 0), (0, 0, 1)),
    "at rest, gamma down": ((0, 0, 0), (0, 0, -1)),
}
LEANING: dict[str, Any] = {
    "along gamma": ((0.6, 0.8, 0), (0.6, 0.8, 0)),
    "along gamma, down": ((-1.2, 0, -1.6), (-0.6, 0, -0.8)),
    "against gamma": ((-0.6, -0.8, 0), (0.6, 0.8, 0)),
    "on axis 1": ((1, 0, 0), (0, 1, 0)),
    "on axis 2": ((0, -1, 0), (0, 0, 1)),
    "nearly up": ((1e-140, 0, 2), (0.6, 0, 0.8)),
}


@pytest.mark.parametrize(("M", "gamma"), (UPRIGHT | LEANING).values(), ids=UPRIGHT | LEANING)
def test_agrees_degenerate_states_with_themselves(M: Any, gamma: Any) -> None:
    M, gamma, beta0 = np.array(M, dtype=float), np.array(gamma, dtype=float), 1.1
    a = co.andoyer_from_body(M, gamma)
    c = co.canonical_from_andoyer(a, beta0)
    assert np.isfinite([*a, *c]).all()
    assert_same_state(co.body_from_andoyer(a), M, gamma)
    assert_same_state(co.body_from_andoyer(co.andoyer_from_canonical(c, beta0)), M, gamma)
    assert (a.h, c.theta3) == (0, 0)
    if abs(M @ gamma) == np.linalg.norm(M) > 0:
        assert a.cosq < 1e-16


@pytest.mark.parametrize(("M", "gamma"), UPRIGHT.values(), ids=UPRIGHT)
def test_agrees_upright_momentum_with_the_values_documented(M: Any, gamma: Any) -> None:
    a = co.andoyer_from_body(M, gamma)
    c = co.canonical_from_andoyer(a, 1.1)
    assert (a.G, a.L, a.l, a.cosp) == (abs(M[2]), M[2], 0, 0)
    assert (c.J1, c.J2mJ1) == (max(M[2], 0), max(-M[2], 0))
    assert c.theta1 == 1.1
    if abs(gamma[2]) == 1:
        assert (a.g, a.cosq) == (0, 0)
    assert any(M) or float(a.H) == gamma[2]


@pytest.mark.parametrize("exponent", [-300, -150, -20, -1])
def test_agrees_tiny_actions_through_every_map(exponent: int) -> None:
    tiny, body = 10.0**exponent, Body((2, 1, "1.5"), (1, 1, 0), 0)
    A, s = floats_of(body)[0], 1 / math.sqrt(2)
    for J1, J2mJ1 in ((tiny, 2.0), (2.0, tiny)):
        c = Canonical(J1, J2mJ1, 0.4, 5.0, 1.0, 0.0, math.sqrt(1 - (0.4 / (2 + tiny)) ** 2))
        a = co.andoyer_from_canonical(co.dimensional(c, A), body.beta0)
        M, gamma = co.body_from_andoyer(a)
        aligned = co.aligned_from_body(M, gamma, body.alpha0, s)
        M, gamma = co.body_from_aligned(aligned, body.alpha0, s)
        found = co.canonical_from_andoyer(co.andoyer_from_body(M, gamma), body.beta0)
        assert_same_canonical(co.dimensionless(found, A), c)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("M", [(0.6, 0.8, 0), (0, 0.6, 0.8), (-0.48, 0.6, -0.64), (0, 1, 0)])
def test_agrees_momentum_along_or_against_gamma_with_g_documented(M: Any, side: int) -> None:
    gamma, M = np.array(M, dtype=float), 4 * side * np.array(M, dtype=float)
    a = co.andoyer_from_body(M, gamma)
    assert a.cosq < 1e-15
    assert a.g == 0
    # The rest of the state is not lost by it.
    assert_same_state(co.body_from_andoyer(a), M, gamma)


@pytest.mark.parametrize("change", [co.dimensional, co.dimensionless])
def test_agrees_units_at_rest_with_the_same_direction_of_gamma(change: Any) -> None:
    A = floats_of(Body((3, 1, "2.5"), (1, 1, 0), 0))[0]
    assert abs(float(co.scale(A)) - 1) > 0.1
    gamma = np.array((0.48, 0.64, -0.6))
    c = co.canonical_from_andoyer(co.andoyer_from_body(np.zeros(3), gamma), 1.1)
    found = change(c, A)
    assert (found.J1, found.J2mJ1, found.J3) == (0, 0, c.J3)
    assert c.J3 == -0.6
    assert_same_state(
        co.body_from_andoyer(co.andoyer_from_canonical(found, 1.1)), np.zeros(3), gamma
    )


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_agrees_theta3_from_aligned_with_the_samples_shape(shape: tuple[int, ...]) -> None:
    ones, alpha0, beta0 = np.ones(shape), 1.9, 1.5
    c = co.canonical(0.5 * ones, 2 * ones, 0.3 * ones, 5 * ones, ones, 0 * ones)
    found = co.canonical_from_aligned(co.aligned_from_canonical(c, alpha0, beta0), alpha0, beta0)
    assert np.shape(found.theta3) == shape
    assert {np.shape(field) for field in found} == {shape}
    assert np.all(found.theta3 == 0)
