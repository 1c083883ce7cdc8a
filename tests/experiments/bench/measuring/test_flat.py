"""The flat function does what the field does, bit by bit, and only what is needed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.flat import (
    executed,
    flat,
    source,
    source_into,
)
from tests.orbits.integrate.problems import FIG4, GENERIC

STATE = [0.5, 0.4, 1.2, 0.48, 0.6, 0.64]


@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
@pytest.mark.parametrize("angles", [False, True], ids=["6", "8"])
def test_agrees_with_the_field_to_the_last_bit(body: Any, angles: bool) -> None:
    field = fields.of_body(body, angles=angles)
    state = [*STATE, 0.1, -0.2][: 8 if angles else 6]
    assert flat(field, len(state))(0.0, state) == list(field(state))


def test_takes_arrays_too() -> None:
    field = fields.of_body(GENERIC)
    orbits = np.random.default_rng(0).normal(size=(6, 5))
    np.testing.assert_array_equal(flat(field, 6)(0.0, orbits), field(orbits))


def test_nothing_is_computed_twice_nor_multiplied_by_zero() -> None:
    lines = source(fields.of_body(FIG4), 6).splitlines()[2:-1]
    right = [line.split(" = ")[1] for line in lines]
    assert len(set(right)) == len(right)
    assert not any("* 0.0" in x or x.startswith("0.0 *") for x in right)


def test_simple_rules() -> None:
    def field(y: Any) -> tuple[Any, ...]:
        a, b = y
        return (a * 0 + b, a * 1 - 0, 0 * a, -a / b, 2 / a, 1 * b / 1)

    made = flat(field, 2)
    assert made(0.0, [3.0, 4.0]) == [4.0, 3.0, 0.0, -0.75, 2 / 3, 4.0]


def test_a_number_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="no number inf"):
        source(lambda y: (y[0] * float("inf"),), 1)


def test_derivatives_can_be_put_into_an_array() -> None:
    """The form that compilers and C take, its arguments in any order."""
    field = fields.of_body(GENERIC, angles=True)
    state, found = [*STATE, 0.1, -0.2], [0.0] * 8
    executed(source_into(field, 8, "first, dy, y, t"))(None, found, state, 0.0)
    assert found == list(field(state))
