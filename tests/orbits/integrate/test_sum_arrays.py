"""Arrays of sums of two or three doubles against exact fractions and mpmath's numbers."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate import sum_arrays
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.integrate.kernel.sum_loops import elementwise
from rigidpend.orbits.integrate.sum_arrays import SumArray

ROUNDING = {2: 2.0**-101, 3: 2.0**-154}
"""Largest error of an operation on numbers of so many parts, relative to the terms."""
M = context(400)
PARTS = pytest.mark.parametrize("parts", [2, 3])


def made(*shape: int, seed: int = 1, parts: int = 2) -> SumArray:
    random = np.random.default_rng(seed)
    found = [random.normal(size=shape)]
    for _ in range(1, parts):
        found.append(found[-1] * random.uniform(-1, 1, shape) * 2.0**-54)
    return SumArray(np.stack(found))


def exactly(x: SumArray) -> Any:
    return sum(np.vectorize(Fraction, otypes=[object])(part) for part in x.parts)


def in_mpmath(x: SumArray) -> list[Any]:
    return [M.mpf(one.numerator) / one.denominator for one in exactly(x).ravel()]


@pytest.mark.parametrize("shape", [(3,), (8,), (19,), (4, 5, 7)], ids=str)
@pytest.mark.parametrize("parts", [(2, 2), (3, 3), (2, 3), (3, 2)], ids=str)
def test_sums_products_and_quotients_are_those_of_fractions(
    shape: tuple[int, ...], parts: tuple[int, int]
) -> None:
    """Single numbers, fewer than lanes, as many, and a last vector that overlaps the one before.

    Pairs count beside triples as triples.
    """
    a, b = (made(*shape, seed=k + 1, parts=n) for k, n in enumerate(parts))
    x, y = exactly(a), exactly(b)
    double = exactly(SumArray(b.parts[:1]))
    both, left, right = max(parts), *parts
    for found, count, expected, scale in (
        (a + b, both, x + y, abs(x) + abs(y)),
        (a - b[..., :1], both, x - y[..., :1], abs(x) + abs(y[..., :1])),
        (a * b, both, x * y, abs(x * y)),
        (a * b[..., ::-1], both, x * y[..., ::-1], abs(x * y[..., ::-1])),
        (a[..., 0] * b[..., 0], both, x[..., 0] * y[..., 0], abs(x * y)[..., 0]),
        (a / b, both, x / y, abs(x / y)),
        (2 * a, left, 2 * x, abs(x)),
        (a - b.parts[0], left, x - double, abs(x) + abs(y)),
        (1.5 / b, right, Fraction(3, 2) / y, abs(1 / y)),
    ):
        assert len(found.parts) == count
        assert np.all(abs(exactly(found) - expected) <= ROUNDING[count] * scale)


@pytest.mark.parametrize("count", [1, 3, LANES, LANES + 1])
@pytest.mark.parametrize("step", [1, 2])
@PARTS
def test_results_are_put_nowhere_else(count: int, step: int, parts: int) -> None:
    """Into every number, or every second, of arrays that go on behind them."""
    out = np.full((parts, 3 * LANES), 7.0)
    place = slice(LANES // 2, LANES // 2 + step * count, step)
    a, b = made(count, parts=parts), made(count, seed=2, parts=parts)
    multiply = elementwise("multiply", 53 * parts)
    multiply(*a.parts, *b.parts, *out[:, place])
    assert multiply.nin == 2 * parts, "to others NumPy gives new arrays"
    assert (exactly(SumArray(out[:, place])) == exactly(a * b)).all()
    out[:, place] = 7
    assert (out == 7).all()


@pytest.mark.parametrize(
    ("a", "b"), [((3, 4), (4, 5)), ((6, 3, 4), (4, 9)), ((3, 4), (6, 4, 9)), ((6, 1, 4), (6, 4, 3))]
)
@pytest.mark.parametrize("parts", [(2, 2), (3, 3), (2, 3)], ids=str)
def test_matrix_products_are_those_of_fractions(a: Any, b: Any, parts: tuple[int, int]) -> None:
    x, y = made(*a, parts=parts[0]), made(*b, seed=2, parts=parts[1])
    off = abs(exactly(x @ y) - np.matmul(exactly(x), exactly(y)))
    allowed = ROUNDING[max(parts)] * np.matmul(abs(exactly(x)), abs(exactly(y)))
    assert (off <= allowed).all()
    doubles = np.matmul(exactly(x), exactly(SumArray(y.parts[:1])))
    off = abs(exactly(x @ y.parts[0]) - doubles)
    assert (off <= allowed * 2.0 ** (53 * (max(parts) - parts[0]) + 1)).all()


@PARTS
def test_sums_over_an_axis_are_those_of_fractions(parts: int) -> None:
    x = made(3, 7, 5, parts=parts)
    for axis in (0, 1, -1):
        off = abs(exactly(x.sum(axis=axis)) - exactly(x).sum(axis=axis))
        assert (off <= ROUNDING[parts] * abs(exactly(x)).sum(axis=axis)).all()


def test_numbers_of_fewer_parts_are_put_beside_others_and_those_of_more_are_cut() -> None:
    pairs, triples = made(4), made(4, seed=2, parts=3)
    x, y, first = exactly(pairs), exactly(triples), np.arange(4) == 0
    found: Any
    for found, expected in (
        (np.stack([pairs, triples]), [x, y]),
        (np.concatenate([triples, pairs]), [*y, *x]),
        (np.append(pairs, triples[0]), [*x, y[0]]),
        (np.where(first, pairs, triples), np.where(first, x, y)),
        (np.where(first, triples, 1.0), np.where(first, y, 1)),
        (np.stack(np.broadcast_arrays(pairs, triples[:1])), [x, [y[0]] * 4]),
        (np.stack(np.broadcast_arrays(triples, 0.5)), [y, [Fraction(1, 2)] * 4]),
    ):
        assert len(found.parts) == 3
        assert (exactly(found) == expected).all()
    # The number of an array's parts is its own, whatever is put into it.
    into, cut = SumArray.of(np.zeros(8), 3), SumArray.of(np.zeros(4))
    into[:4], into[4:], cut[:] = triples, pairs, triples
    assert (exactly(into) == [*y, *x]).all()
    np.testing.assert_array_equal(cut.parts, triples.parts[:2])
    np.testing.assert_array_equal(SumArray.of(triples, 2).parts, triples.parts[:2])
    like: Any
    for like, parts in ((np.zeros_like(triples), 3), (np.ones_like(pairs), 2)):
        assert like.parts.shape == (parts, 4)


@pytest.mark.parametrize("shape", [(3,), (16,), (4, 5)], ids=str)
@PARTS
def test_sums_of_products_of_polynomials_are_those_of_fractions(
    shape: tuple[int, ...], parts: int
) -> None:
    """Fewer columns than lanes, as many, and a last vector that overlaps the one before."""
    left, right = (
        [made(n, *shape, seed=n, parts=parts) for n in rows] for rows in ((2, 4, 3), (4, 2, 3))
    )
    found = exactly(sum_arrays.convolved(left, right))
    factors = [(exactly(p), exactly(q)) for p, q in zip(left, right, strict=True)]
    for r, row in enumerate(found):
        terms = [p[k] * q[r - k] for p, q in factors for k in range(len(p)) if 0 <= r - k < len(q)]
        assert (abs(row - sum(terms)) <= ROUNDING[parts] * sum(map(abs, terms))).all()


@PARTS
def test_the_logarithm_of_zero_is_minus_infinity(parts: int) -> None:
    found = sum_arrays.log(SumArray.of(np.array([0.0, 1.0]), parts))
    np.testing.assert_array_equal(found.parts, [[-np.inf, 0.0], *[[0.0, 0.0]] * (parts - 1)])


@pytest.mark.parametrize("name", ["cos", "sin", "exp", "log", "sqrt", "atan2"])
@PARTS
def test_functions_are_mpmath_s(name: str, parts: int) -> None:
    """Angles in every quadrant, all others of numbers above 0."""
    given = [made(40, seed=k + 1, parts=parts) for k in range(1 + (name == "atan2"))]
    if name != "atan2":
        given = [abs(given[0])]
    found = getattr(sum_arrays, name)(*given)
    for one, *at in zip(*map(in_mpmath, (found, *given)), strict=True):
        assert abs(one - getattr(M, name)(*at)) < ROUNDING[parts] * 8


@PARTS
def test_exponentials_of_large_numbers_are_as_sharp_as_these(parts: int) -> None:
    """A first correction leaves the square of a rounding of the number, as a double, over two."""
    given = abs(256 * made(40, parts=parts))
    for one, x in zip(*map(in_mpmath, (sum_arrays.exp(given), given)), strict=True):
        assert abs(one / M.exp(x) - 1) < ROUNDING[parts] * (1 + abs(x)) / 8


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
