"""Jacobi's functions and K against mpmath in a hundred digits, relative to each of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpmath import MPContext

from rigidpend.mechanics.jacobi import modulus, over_turns

KC = [1.0, 1 - 1e-9, 0.999, 0.7, 0.1, 1e-3, 1e-10, 1e-40]
EPS = float(np.finfo(float).eps)
FINER = MPContext()
"""100 digits: 1 - k'^2 is told from 1 where k' = 1e-40."""
FINER.dps = 100


def parameter(kc: float) -> Any:
    return 1 - FINER.mpf(kc) ** 2


@pytest.mark.parametrize("kc", [*KC, 1e-150])
def test_agrees_with_the_mean_of_gauss(kc: float) -> None:
    expected = FINER.pi / 2 / FINER.agm(1, FINER.mpf(kc))
    assert abs(modulus(kc).K / expected - 1) < 2 * EPS


@pytest.mark.parametrize("kc", KC)
def test_agrees_with_a_hundred_digits_relative_to_each_function(kc: float) -> None:
    chosen = modulus(kc)
    u = np.array([-0.97, -0.6, -0.1, 1e-9, 0.4, 0.5, 0.83, 0.99]) * chosen.K
    for name, found in zip(("sn", "cn", "dn"), over_turns(u, chosen), strict=True):
        for x, y in zip(u, found, strict=True):
            expected = FINER.ellipfun(name, FINER.mpf(float(x)), m=parameter(kc))
            # Beside its zero cn is known as well as the distance.
            distance = (chosen.K - abs(x)) / chosen.K if name == "cn" else 1
            assert abs(y / expected - 1) < 4 * EPS * (1 + abs(x)) / min(1, distance)


@pytest.mark.parametrize("kc", KC)
def test_half_a_period_changes_two_signs(kc: float) -> None:
    chosen = modulus(kc)
    u = np.array([-0.9, 0.1, 0.3]) * chosen.K
    expected = over_turns(u, chosen) * np.array([[-1], [-1], [1]])
    for turns in (-3, -1, 1, 5):
        found = over_turns(u + 2 * turns * chosen.K, chosen)
        np.testing.assert_allclose(found, expected, rtol=300 * EPS * (1 + chosen.K))
