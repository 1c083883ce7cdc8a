"""The prediction of rounding errors, held against errors that are made."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidpend.experiments.stress import growth
from rigidpend.experiments.stress.scenes import followed
from rigidpend.mechanics.equations import aligned
from rigidpend.orbits.integrate import Orbits
from tests.experiments.stress.verdicts import scene
from tests.orbits.integrate.problems import FIG4, GENERIC, on_separatrix
from tests.strategies import FINE, along

SCENE = scene(FIG4, 1.4, 3)


def test_rounding_is_that_of_numbers_with_all_mantissas() -> None:
    numbers = np.exp(np.random.default_rng(1).uniform(0, 50, 400_000))
    errors = np.float64(np.float32(numbers)) / numbers - 1
    assert math.sqrt((errors**2).mean()) == pytest.approx(growth.ROUNDING * 2.0**-23, rel=0.01)


def test_step_is_a_share_of_the_distance_to_the_poles_of_J1() -> None:
    u, v = 1.3, 0.7
    pole = complex(v, math.pi) / u
    assert abs(np.exp(-u * pole + v) + 1) < 1e-15
    assert growth.step(u) == pytest.approx(pole.imag * math.exp(-2))


def test_growths_agree_with_two_orbits_side_by_side() -> None:
    near, far = (on_separatrix(2, FIG4, 1e-4, 2.1 + x, 1.4) for x in (0.0, 1e-9))
    found = followed(SCENE, Orbits(SCENE.c, np.stack((near, far), axis=1), 7, 500.0)).time
    apart = np.abs(np.diff(found, axis=1))[:, 0]
    times, grown = growth.growths(SCENE, near, 150.0)
    assert np.allclose(times[:7], found[:, 0], atol=0.01)
    # At the first crossing both are still too close for times in doubles.
    assert np.allclose(grown[1:7] - grown[1], np.log(apart / apart[1])[1:], atol=0.01)
    assert grown[6] - grown[1] > 3


@pytest.mark.slow
def test_predicted_errors_are_those_that_are_made() -> None:
    states = SCENE.starts(8, 1e-4)
    errors, predicted, _ = growth.compared(SCENE, states, 6, 500.0)
    ratio = np.sqrt(((errors / predicted)[2:] ** 2).mean(axis=1))
    assert (ratio > 0.4).all()
    assert (ratio < 2.5).all()


def test_a_long_passage_is_divided_backwards() -> None:
    times = growth.restarts(np.array([0.0, 10.0, 110.0, 115.0]), 1.0)
    assert times[0] == 0
    assert {10.0, 110.0} <= set(times)
    assert np.diff(times[1:]).max() <= growth.DEEPEST
    assert 115.0 not in times


def test_symbols_are_decided_up_to_the_first_large_error() -> None:
    errors = np.array([1e-9, 1e-6, 1e-3, 1e-7, 1.0])
    assert [growth.decided(errors, limit) for limit in (1e-4, 2.0, 1e-12)] == [1, 4, 0]


def test_the_jacobian_agrees_with_finite_differences_in_60_digits() -> None:
    """Also where a component is small beside the unit step that stands for a derivative."""
    c = scene(GENERIC, 1.0).c
    x, v = [0.4, -1e-9, 0.9, 0.3, -0.5, 0.8], [0.1, 0.7, -0.3, 0.2, 0.9, -0.6]
    expected = along(lambda y: aligned(y, c), list(map(FINE.mpf, x)), list(map(FINE.mpf, v)))
    made = growth.with_tangent(c)([*x, *v], None)
    assert np.allclose(made, [*aligned(x, c), *np.array(expected, float)], rtol=0, atol=1e-15)
