"""The flat functions do what the field does, and only what is needed."""

from __future__ import annotations

import dis
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.bench.measuring import fields
from tests.orbits.integrate.problems import FIG4, GENERIC

STATE = [0.5, 0.4, 1.2, 0.48, 0.6, 0.64, 0.1, -0.2]


@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
@pytest.mark.parametrize("size", [6, 8])
def test_both_forms_agree_with_the_field(body: Any, size: int) -> None:
    """That of Python, and the one that compilers and C take, its arguments in any order."""
    field, state, found = fields.of_body(body, angles=size == 8), STATE[:size], [0.0] * size
    np.testing.assert_array_equal(fields.flat(body, size == 8)(0.0, state), field(state))
    fields.compilable(body, "first, dy, y, t", size == 8)(None, found, state, 0.0)
    np.testing.assert_array_equal(found, field(state))


def test_takes_arrays_too() -> None:
    field = fields.of_body(GENERIC)
    orbits = np.random.default_rng(0).normal(size=(6, 5))
    np.testing.assert_allclose(
        fields.flat(GENERIC)(0.0, orbits), field(orbits), rtol=1e-14, atol=1e-15
    )


def test_nothing_is_computed_twice_nor_with_the_zero_of_r() -> None:
    """Euler-Poisson by hand: two quotients, 18 products and eleven sums where r3 = 0."""
    made = dis.get_instructions(fields.flat(FIG4))
    signs = [each.argrepr for each in made if each.opname == "BINARY_OP"]
    assert (signs.count("*") + signs.count("/"), len(signs)) == (20, 31)
