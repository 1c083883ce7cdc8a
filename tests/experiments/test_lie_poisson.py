"""The Lie-Poisson splittings: order, Casimirs, reversibility, and the Taylor engine beside them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest

from rigidpend.experiments.lie_poisson import SCHEMES, splitting, stages
from rigidpend.mechanics.equations import euler_poisson
from tests.orbits.integrate.problems import GENERIC
from tests.strategies import floats_of

ORDERS = sorted(SCHEMES)
STATE = np.array([0.5, 0.4, 1.2, 0.48, 0.6, 0.64])


def numbers(body: Any = GENERIC) -> tuple[list[float], list[float], float]:
    A, r, mu = floats_of(body)
    return A.tolist(), r.tolist(), mu


def vectors(states: Any) -> list[Any]:
    """Components first, then M and gamma, then the orbits."""
    return [np.stack((states[i], states[i + 3])) for i in range(3)]


def states(v: Any) -> Any:
    return np.concatenate(([x[0] for x in v], [x[1] for x in v]))


def in_many_digits(order: int, steps: int) -> Any:
    """The state at time 1, in 50 digits, mu being large."""
    with mpmath.workdps(50):
        number = mpmath.mpf
        A, r = [number(2), number(1), number("1.5")], [number("0.6"), number("0.8"), number(0)]
        made = splitting(A, r, number("0.3"), order, number)
        begin = [number(x) for x in ("0.5", "0.4", "1.2", "0.48", "0.6", "0.64")]
        end = made.advance(vectors(np.array(begin, dtype=object)), number(1) / steps, steps, mpmath)
        return states(end)


@pytest.fixture(scope="module")
def truth() -> Any:
    return in_many_digits(8, 80)


@pytest.mark.slow
@pytest.mark.parametrize("order", ORDERS)
def test_order_is_the_one_that_is_said(order: int, truth: Any) -> None:
    errors = [max(abs(x) for x in in_many_digits(order, n) - truth) for n in (4, 8, 16)]
    fitted = [float(mpmath.log(a / b, 2)) for a, b in pairwise(errors)]
    assert fitted[1] == pytest.approx(order, abs=0.05)
    assert abs(fitted[1] - order) < abs(fitted[0] - order)


@pytest.mark.parametrize("order", ORDERS)
def test_agrees_with_the_field_as_the_step_shrinks(order: int) -> None:
    A, r, mu = numbers()
    field = np.array(euler_poisson(STATE[:3], STATE[3:], A, r, mu))
    made = splitting(A, r, mu, order)
    ahead, back = (states(made.advance(vectors(STATE), h)) for h in (1e-4, -1e-4))
    np.testing.assert_allclose((ahead - back) / 2e-4, field, atol=3e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_invariant_casimirs_whatever_the_step(order: int) -> None:
    A, r, mu = numbers()
    begin = np.random.default_rng(1).normal(size=(6, 20))
    # Steps of half a turn: the orbit is wrong, its geometry is not.
    end = states(splitting(A, r, mu, order).advance(vectors(begin), 2.0, 200))
    assert np.abs(end - begin).max() > 0.1
    size = (begin**2).sum(axis=0)
    M, gamma = slice(0, 3), slice(3, 6)
    for one in (M, gamma):
        change = (end[one] * end[gamma]).sum(axis=0) - (begin[one] * begin[gamma]).sum(axis=0)
        assert (np.abs(change) / size).max() < 200 * stages(order) * 1e-15


@pytest.mark.parametrize("order", ORDERS)
def test_a_step_back_undoes_a_step_and_what_is_given_is_left_as_it_was(order: int) -> None:
    A, r, mu = numbers()
    made, begin = splitting(A, r, mu, order), vectors(STATE)
    there = made.advance(begin, 0.7, 3)
    np.testing.assert_array_equal(states(begin), STATE)
    assert np.abs(states(there) - STATE).max() > 0.1
    np.testing.assert_allclose(states(made.advance(there, -0.7, 3)), STATE, atol=1e-13)


def test_steps_are_taken_together_as_one_by_one_and_each_orbit_its_own() -> None:
    A, r, mu = numbers()
    made = splitting(A, r, mu, 4)
    pair = np.stack((STATE, STATE[[2, 0, 1, 5, 3, 4]]), axis=1)
    h = np.array([0.1, 0.25])
    together = states(made.advance(vectors(pair), h, 5))
    for column in range(2):
        v = vectors(pair[:, column])
        for _ in range(5):
            v = made.advance(v, h[column])
        np.testing.assert_allclose(states(v), together[:, column], atol=1e-15)


def test_a_vector_fixed_in_space_is_turned_like_gamma() -> None:
    A, r, mu = numbers()
    twice = [np.stack((x[0], x[1], x[1])) for x in vectors(STATE)]
    for x in splitting(A, r, mu, 6).advance(twice, 0.3, 10):
        assert x[1] == x[2]
