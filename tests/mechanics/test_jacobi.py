"""Jacobi's functions against mpmath in 60 digits, for moduli up to a complement of 1e-7."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ellipj

from rigidpend.mechanics import jacobi, pendulum
from tests.strategies import FINE, ROUNDING, largest_difference, relative

GAPS = [1.0, 1e-2, 1e-5, 1e-8, 1e-11, 1e-14]
"""h0 - mu, of which the complement goes as the root."""


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


def test_agrees_where_scipy_knows_too_little_of_the_complement() -> None:
    k, kc = pendulum.modulus(0.5 + 7e-10, 0.5, math)
    top = jacobi.K(k, kc, math)
    assert jacobi.sncndn(top, k, kc, math)[2] == pytest.approx(kc, rel=1e-13)
    assert abs(ellipj(top, k * k)[2] / kc - 1) > 1e-8
