"""Arrays of pairs of doubles against exact fractions and mpmath's numbers."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate import sum_arrays
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.kernel.sum_loops import elementwise
from rigidpend.orbits.integrate.sum_arrays import SumArray

ROUNDING = 2.0**-101
"""Largest error of an operation, relative to the terms."""
M = context(260)


def made(*shape: int, seed: int = 1) -> SumArray:
    random = np.random.default_rng(seed)
    high = random.normal(size=shape)
    return SumArray(np.stack((high, high * random.uniform(-1, 1, shape) * 2.0**-54)))


def exactly(x: SumArray) -> Any:
    high, low = (np.vectorize(Fraction, otypes=[object])(part) for part in x.parts)
    return high + low


def in_mpmath(x: SumArray) -> list[Any]:
    return [M.mpf(one.numerator) / one.denominator for one in exactly(x).ravel()]


@pytest.mark.parametrize("shape", [(3,), (8,), (19,), (4, 5, 7)], ids=str)
def test_sums_products_and_quotients_are_those_of_fractions(shape: tuple[int, ...]) -> None:
    """Fewer numbers than lanes, as many, and a last vector that overlaps the one before."""
    a, b = made(*shape), made(*shape, seed=2)
    x, y = exactly(a), exactly(b)
    for found, expected, scale in (
        (a + b, x + y, abs(x) + abs(y)),
        (a - b[..., :1], x - y[..., :1], abs(x) + abs(y[..., :1])),
        (a * b, x * y, abs(x * y)),
        (a * b[..., ::-1], x * y[..., ::-1], abs(x * y[..., ::-1])),
        (2 * a, 2 * x, abs(x)),
        (1.5 / b, Fraction(3, 2) / y, abs(1 / y)),
    ):
        assert (abs(exactly(found) - expected) <= ROUNDING * scale).all()


@pytest.mark.parametrize("count", [1, 3, LANES, LANES + 1])
@pytest.mark.parametrize("step", [1, 2])
def test_results_are_put_nowhere_else(count: int, step: int) -> None:
    """Into every number, or every second, of arrays that go on behind them."""
    out = np.full((2, 3 * LANES), 7.0)
    place = slice(LANES // 2, LANES // 2 + step * count, step)
    a, b = made(count), made(count, seed=2)
    elementwise("multiply", 106)(*a.parts, *b.parts, out[0, place], out[1, place])
    assert (exactly(SumArray(out[:, place])) == exactly(a * b)).all()
    out[:, place] = 7
    assert (out == 7).all()


@pytest.mark.parametrize(
    ("a", "b"), [((3, 4), (4, 5)), ((6, 3, 4), (4, 9)), ((3, 4), (6, 4, 9)), ((6, 1, 4), (6, 4, 3))]
)
def test_matrix_products_are_those_of_fractions(a: Any, b: Any) -> None:
    x, y = made(*a), made(*b, seed=2)
    off = abs(exactly(x @ y) - np.matmul(exactly(x), exactly(y)))
    assert (off <= ROUNDING * np.matmul(abs(exactly(x)), abs(exactly(y)))).all()


@pytest.mark.parametrize("shape", [(3,), (16,), (4, 5)], ids=str)
def test_sums_of_products_of_polynomials_are_those_of_fractions(shape: tuple[int, ...]) -> None:
    """Fewer columns than lanes, as many, and a last vector that overlaps the one before."""
    left, right = ([made(n, *shape, seed=n) for n in rows] for rows in ((2, 4, 3), (4, 2, 3)))
    found = exactly(sum_arrays.convolved(left, right))
    factors = [(exactly(p), exactly(q)) for p, q in zip(left, right, strict=True)]
    for r, row in enumerate(found):
        terms = [p[k] * q[r - k] for p, q in factors for k in range(len(p)) if 0 <= r - k < len(q)]
        assert (abs(row - sum(terms)) <= ROUNDING * sum(map(abs, terms))).all()


def test_the_logarithm_of_zero_is_minus_infinity() -> None:
    found = sum_arrays.log(SumArray.of(np.array([0.0, 1.0])))
    np.testing.assert_array_equal(found.parts, [[-np.inf, 0.0], [0.0, 0.0]])


@pytest.mark.parametrize("name", ["cos", "sin", "exp", "log", "sqrt", "atan2"])
def test_functions_are_mpmath_s(name: str) -> None:
    """Angles in every quadrant, all others of numbers above 0."""
    given = [made(40), made(40, seed=2)] if name == "atan2" else [abs(made(3, 7))]
    found = getattr(sum_arrays, name)(*given)
    for one, *at in zip(*map(in_mpmath, (found, *given)), strict=True):
        assert abs(one - getattr(M, name)(*at)) < ROUNDING * 8


def test_pairs_are_not_taken_for_doubles_in_silence() -> None:
    with pytest.raises(TypeError, match="ask for their doubles"):
        np.asarray(made(3))
    with pytest.raises(TypeError):
        np.cumsum(made(3))


def test_pairs_are_in_order_by_both_their_parts() -> None:
    """1 - 2^-90, 1 and 1 + 2^-90, whose first parts are alike."""
    parts = np.array([[1.0, 1.0, 1.0], [-(2.0**-90), 0.0, 2.0**-90]])
    three, middle = SumArray(parts), SumArray(parts[:, 1:2])
    found = three < middle, three <= middle, three > middle, three >= middle
    assert [list(x) for x in found] == [[1, 0, 0], [1, 1, 0], [0, 0, 1], [0, 1, 1]]
