"""Expansions and jets: exact on what they can hold, in every arithmetic."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.orbits.return_map.expansions import (
    chebyshev_analysis,
    chebyshev_basis,
    fourier_analysis,
    fourier_basis,
    nodes,
    phases,
)
from rigidpend.orbits.return_map.jets import Jet, Reciprocal
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.storage import joined, split

BITS = [53, 64, 113, 160]


@pytest.mark.parametrize("bits", BITS)
def test_agrees_a_fourier_expansion_with_its_function_and_slope(bits: int) -> None:
    a, n = precision(bits), 7
    at = a.array([0.3, 1.7, -2.5])
    values = a.cos(3 * phases(n, a)) - 2 * a.sin(phases(n, a)) + 5
    c = fourier_analysis(n, a) @ values
    expected = a.cos(3 * at) - 2 * a.sin(at) + 5
    slope = -3 * a.sin(3 * at) - 2 * a.cos(at)
    assert a.largest(fourier_basis(at, n, a) @ c - expected) < 100 * a.epsilon
    assert a.largest(fourier_basis(at, n, a, slope=True) @ c - slope) < 100 * a.epsilon


@pytest.mark.parametrize("bits", BITS)
def test_agrees_a_chebyshev_expansion_with_its_polynomial_and_slope(bits: int) -> None:
    a, n = precision(bits), 6
    at, x = a.array([0.3, -0.77, 1.0]), nodes(n, a)
    c = chebyshev_analysis(n, a) @ (x**5 - 3 * x**2 + 1)
    expected, slope = at**5 - 3 * at**2 + 1, 5 * at**4 - 6 * at
    assert a.largest(chebyshev_basis(at, n, a) @ c - expected) < 40 * a.epsilon
    assert a.largest(chebyshev_basis(at, n, a, slope=True) @ c - slope) < 200 * a.epsilon


@pytest.mark.parametrize("bits", BITS)
def test_numbers_are_rounded_once_and_stored_without_loss(bits: int) -> None:
    a = precision(bits)
    third = a.array([Fraction(1, 3), Fraction(-1, 7), 0])
    assert a.largest(third * 21 - a.array([7, -3, 0])) <= 8 * a.epsilon
    assert (joined(split(third), a) == third).all()
    if bits > 53:
        assert a.largest(third - a.array(third.astype(float))) > a.epsilon, "more than doubles"


def told(parts: dict[int, Any], first: int, tape: list[Jet]) -> Jet:
    jet = Jet(tape, first)
    jet.parts.update({D: np.array(p, dtype=float)[:, None, None] for D, p in parts.items()})
    return jet


def at(jet: Jet, degree: int, u: float, v: float) -> float:
    """The series up to a degree as a number."""
    return sum(
        float(jet.part(D)[j, 0, 0]) * u**j * v ** (D - j)
        for D in range(jet.first, degree + 1, 2)
        for j in range(D + 1)
    )


def test_order_products_and_reciprocals_of_jets_are_those_of_numbers() -> None:
    tape: list[Jet] = []
    even = told({0: [2], 2: [0.3, -1, 0.5], 4: [0] * 5, 6: [0] * 7}, 0, tape)
    odd = told({1: [1.5, -0.25], 3: [0.1, 0.2, 0.3, 0.4], 5: [0] * 6}, 1, tape)
    inverse = Reciprocal(tape)
    inverse.of = even
    for scale in (1e-1, 5e-2):
        u, v = 0.7 * scale, -0.4 * scale
        e, o = at(even, 6, u, v), at(odd, 5, u, v)
        assert at(even * odd, 5, u, v) == pytest.approx(e * o, rel=1e-14)
        assert abs(at(inverse, 6, u, v) - 1 / e) < 0.1 * scale**8
        assert abs(at(inverse * odd - odd * 2, 5, u, v) - (o / e - 2 * o)) < 0.2 * scale**7


def test_a_part_that_is_not_told_is_an_error() -> None:
    with pytest.raises(LookupError, match="degree 3"):
        (told({1: [1, 1]}, 1, []) * 2).part(3)
