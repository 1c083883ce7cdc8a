"""The lemma on growth, held against eigenvalues and against pairs of true orbits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from flint import arb

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_coefficients
from rigidpend.routes.certified.approximation import jacobian
from rigidpend.routes.certified.balls import LogarithmicNorm

BODIES = {
    "fig4": Body((2, 1, "3/2"), (1, 1, 0), "0.001"),
    "heavy": Body((3, 1, "5/2"), (1, "1/5", 0), "0.2"),
    "light": Body((2, "3/2", "9/5"), (0, 1, 0), "1e-9"),
    "free": Body((2, 1, "3/2"), (1, 0, 0), 0),
}


def of(name: str) -> tuple[AlignedCoefficients, LogarithmicNorm]:
    c = aligned_coefficients(BODIES[name].angles(), math)
    return c, LogarithmicNorm.of(AlignedCoefficients(*map(arb, c)))


def weights(growth: LogarithmicNorm) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([1, 1, float(growth.upright)] + [1 / float(growth.weight)] * 3)


@pytest.mark.parametrize("name", BODIES)
def test_the_rate_bounds_the_logarithmic_norm(name: str) -> None:
    c, growth = of(name)
    D, drawn, nearest = weights(growth), np.random.default_rng(1), 0.0
    for _ in range(300):
        gamma = drawn.normal(size=3)
        state = np.concatenate((drawn.normal(size=3) * 10 ** drawn.uniform(-2, 1), gamma))
        state[3:] /= np.linalg.norm(gamma)
        scaled = D[:, None] * jacobian(state[:, None], c)[0] / D
        top = np.linalg.eigvalsh((scaled + scaled.T) / 2)[-1]
        rate = float(growth.rate(arb(abs(state[2])), arb(0)))
        assert top <= rate * (1 + 1e-12)
        nearest = max(nearest, top / rate)
    # And it is no loose bound: the saddle is met.
    assert nearest > 0.98


@pytest.mark.parametrize("name", ["fig4", "heavy"])
def test_the_rate_holds_at_a_distance(name: str) -> None:
    c, growth = of(name)
    D, drawn = weights(growth), np.random.default_rng(2)
    for _ in range(300):
        y, z = drawn.normal(size=(2, 6))
        y[3:] /= np.linalg.norm(y[3:])
        z = y + 0.3 * z
        apart = D * (y - z)
        distance = float(np.linalg.norm(apart))
        speed = apart @ (D * (np.array(aligned(y, c)) - np.array(aligned(z, c)))) / distance
        rate = float(growth.rate(arb(abs(z[2])) + _wide(distance, growth), arb(distance)))
        assert speed <= rate * distance * (1 + 1e-12)


@pytest.mark.parametrize("name", BODIES)
def test_derivatives_of_the_field_are_bounded(name: str) -> None:
    """The second one over random pairs, of which the best meets most of it, and the first one."""
    c, growth = of(name)
    D, drawn, nearest = weights(growth), np.random.default_rng(3), 0.0
    bending = float(growth.bending)
    for _ in range(2000):
        e, z, y = drawn.normal(size=(3, 6)) * 10 ** drawn.uniform(-2, 2, size=(3, 6)) / D
        e, z = e / np.linalg.norm(D * e), z / np.linalg.norm(D * z)
        second = (jacobian(e[:, None], c)[0] - jacobian(0 * e[:, None], c)[0]) @ z
        size = float(np.linalg.norm(D * second))
        assert size <= bending * (1 + 1e-12)
        nearest = max(nearest, size / bending)
        steep = np.linalg.norm(D[:, None] * jacobian(y[:, None], c)[0] / D, 2)
        assert steep <= float(growth.steepness(arb(float(np.linalg.norm(D * y))))) * (1 + 1e-12)
    assert nearest > 0.5


def _wide(distance: float, growth: LogarithmicNorm) -> arb:
    """By how much |M3| halfway can be larger."""
    return arb(distance) / (2 * growth.upright)


def test_the_norm_is_the_weighted_one() -> None:
    _, growth = of("fig4")
    d = np.array([1.0, -2.0, 3.0, 0.1, -0.2, 0.3])
    found = float(growth.norm(tuple(map(arb, d))))
    assert found == pytest.approx(np.linalg.norm(weights(growth) * d), rel=1e-12)
