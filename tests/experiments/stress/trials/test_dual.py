"""Dual numbers give derivatives of the field itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress.trials.dual import Dual, cotangent, tangent
from rigidpend.experiments.stress.trials.truth import Scene
from rigidpend.mechanics.equations import aligned
from tests.orbits.integrate.problems import GENERIC
from tests.strategies import FINE, along

C = Scene(GENERIC, 1.0).c
X = [0.4, -0.2, 0.9, 0.3, -0.5, 0.8]
V = [0.1, 0.7, -0.3, 0.2, 0.9, -0.6]
W = [1.1, -0.4, 0.5, 0.8, -0.7, 0.3]


def field(x: Any) -> Any:
    return aligned(x, C)


def test_agrees_with_finite_differences_in_60_digits() -> None:
    expected = along(field, list(map(FINE.mpf, X)), list(map(FINE.mpf, V)))
    assert np.allclose(tangent(field, X, V), np.array(expected, dtype=float), rtol=0, atol=1e-15)


def test_cotangent_is_the_transpose() -> None:
    forwards = sum(w * y for w, y in zip(W, tangent(field, X, V), strict=True))
    backwards = sum(v * y for v, y in zip(V, cotangent(field, X, W), strict=True))
    assert forwards == pytest.approx(backwards, rel=1e-14)
    assert abs(forwards) > 0.1


def test_constants_have_no_slope() -> None:
    x = Dual(3.0, 1.0)
    for made, value, slope in ((5 - x, 2, -1), (2 * x + 1, 7, 2), (x * x - x, 6, 5), (-x, -3, -1)):
        assert (made.value, made.slope) == (value, slope)
