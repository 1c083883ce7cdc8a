"""Jacobi's functions and K against mpmath in 60 digits and more, relative to each of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from mpmath import MPContext

from rigidpend.mechanics import jacobi, pendulum
from rigidpend.mechanics.jacobi import modulus, over_turns
from tests.strategies import FINE, ROUNDING, largest_difference, relative

GAPS = [1.0, 1e-2, 1e-5, 1e-8, 1e-11, 1e-14]
"""h0 - mu, of which the complement goes as the root."""
KC = [1.0, 1 - 1e-9, 0.999, 0.7, 0.1, 1e-3, 1e-10, 1e-40]
EPS = float(np.finfo(float).eps)
FINER = MPContext()
"""100 digits: 1 - k'^2 is told from 1 where k' = 1e-40."""
FINER.dps = 100


@pytest.mark.parametrize("gap", [0.0, *GAPS])
def test_agrees_with_mpmath_in_60_digits(gap: float) -> None:
    mu = 0.0 if gap == 0 else 0.5
    k, kc = pendulum.modulus(mu + gap or 1.0, mu, math)
    fine_kc = FINE.sqrt(FINE.mpf(mu + gap or 1.0) - mu) / FINE.sqrt(FINE.mpf(mu + gap or 1.0) + mu)
    square = 1 - fine_kc**2
    K = FINE.ellipk(square)
    assert relative(jacobi.K(k, kc, math), float(K)) < ROUNDING
    u = np.linspace(-0.97, 0.97, 39) * float(K)
    found = jacobi.sncndn(u, k, kc, np)
    for name, values in zip(("sn", "cn", "dn"), found, strict=True):
        expected = [float(FINE.ellipfun(name, FINE.mpf(x), m=square)) for x in u]
        # Rounding of u itself, and a dozen more.
        np.testing.assert_allclose(values, expected, rtol=(5 + float(K)) * ROUNDING, atol=1e-300)
    fine = jacobi.sncndn(FINE.mpf(0.7), FINE.sqrt(square), fine_kc, FINE)
    expected = [FINE.ellipfun(name, FINE.mpf(0.7), m=square) for name in ("sn", "cn", "dn")]
    assert largest_difference(fine, expected) < 1e-55


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
