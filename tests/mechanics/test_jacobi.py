"""Jacobi's functions and K against mpmath in a hundred digits, relative to each of them."""

import math
from typing import Any

import numpy as np
import pytest
from mpmath import MPContext

from rigidpend.mechanics.jacobi import K, sncndn

KC = [1.0, 1 - 1e-9, 0.999, 0.7, 0.1, 1e-3, 1e-10, 1e-40]
EPS = float(np.finfo(float).eps)
FINER = MPContext()
"""100 digits: 1 - k'^2 is told from 1 where k' = 1e-40."""
FINER.dps = 100


@pytest.mark.parametrize("kc", [*KC, 1e-150])
def test_agrees_with_the_mean_of_gauss(kc: float) -> None:
    expected = FINER.pi / 2 / FINER.agm(1, FINER.mpf(kc))
    assert abs(K(kc, math) / expected - 1) < 2 * EPS


@pytest.mark.parametrize("kc", KC)
def test_agrees_with_a_hundred_digits_relative_to_each_function(kc: float) -> None:
    quarter = K(kc, math)
    u = np.array([-0.97, -0.6, -0.1, 1e-9, 0.4, 0.5, 0.83, 0.99]) * quarter
    for name, found in zip(("sn", "cn", "dn"), sncndn(u, kc, np), strict=True):
        for x, y in zip(u, found, strict=True):
            expected: Any = FINER.ellipfun(name, FINER.mpf(float(x)), m=1 - FINER.mpf(kc) ** 2)
            # Beside its zero cn is known as well as the distance.
            distance = (quarter - abs(x)) / quarter if name == "cn" else 1
            assert abs(y / expected - 1) < 4 * EPS * (1 + abs(x)) / min(1, distance)
