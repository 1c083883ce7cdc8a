"""Sums of doubles and their functions, as the kernel computes them, against fractions."""

import functools
import itertools
import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_functions import Functions
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Doubles, Value, as_doubles
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer

OPERATIONS: dict[str, tuple[Callable[[Doubles, Value, Value], Value], Any]] = {
    "plus": (lambda n, a, b: n.plus(a, b), lambda a, b: a + b),
    "minus": (lambda n, a, b: n.minus(a, b), lambda a, b: a - b),
    "times": (lambda n, a, b: n.times(a, b), lambda a, b: a * b),
    "quotient": (lambda n, a, b: n.quotient(a, b), lambda a, b: a / b),
    "with_product": (lambda n, a, b: n.settled(n.with_product(a, a, b)), lambda a, b: a + a * b),
    "horner": (lambda n, a, b: n.horner(a, b[0], b), lambda a, b: a * Fraction(float(b)) + b),
    "horner_at": (lambda n, a, b: n.horner_at(a, b, a), lambda a, b: a * b + a),
}
SMALLEST = Fraction(2) ** -1074
"""The smallest double, by which a part that is smaller still errs."""


@functools.cache
def compiled(lines: Callable[[Doubles, Value, Value], Value], parts: int) -> Any:
    """An operation as a function of three arrays: the result and both operands."""
    code = Writer()
    n = KINDS[53 * parts](code)
    given = [
        tuple(code.load(code.at(base, i), align=8) for i in range(parts)) for base in ("%a", "%b")
    ]
    for i, part in enumerate(lines(n, *given)):
        code.store(part, code.at("%out", i), align=8)
    head = "define i64 @apply(ptr noalias %out, ptr %a, ptr %b) {"
    return machine_code.function(code.function(head, "0"))


def computed(name: str, parts: int, a: list[Fraction], b: list[Fraction]) -> list[list[float]]:
    """The parts of the results for `LANES` numbers."""
    rows = [np.array([as_doubles(x, parts) for x in xs]).T.copy() for xs in (a, b)]
    out = np.empty((parts, LANES))
    compiled(OPERATIONS[name][0], parts)(out, *rows)
    return out.T.tolist()


def summed(parts: Any) -> Fraction:
    return sum(map(Fraction, parts), Fraction(0))


def numbers(source: random.Random, parts: int, size: float = 1.0) -> list[Fraction]:
    """As many random numbers as there are lanes, of a size and a thousandfold more or less."""
    found = []
    for _ in range(LANES):
        digits = Fraction(source.getrandbits(53 * parts) | 1, 1 << 53 * parts)
        scale = Fraction(size * 10.0 ** source.uniform(-3, 3)) * source.choice((-1, 1))
        found.append(summed(as_doubles(digits * scale, parts)))
    return found


def easy(source: random.Random, parts: int) -> list[tuple[Fraction, Fraction]]:
    rows = [(numbers(source, parts), numbers(source, parts)) for _ in range(6)]
    return [pair for row in rows for pair in zip(*row, strict=True)]


def hard(source: random.Random, parts: int) -> list[tuple[Fraction, Fraction]]:
    """Numbers that cancel to any depth, lie halfway, have gaps of zeros, or tails below 1e-308."""
    found = []
    for x, tiny in zip(numbers(source, parts), numbers(source, parts, 1e-285), strict=True):
        high = Fraction(float(x))
        for depth in (1, 40, 53, 80, 106, 150, 159, 190):
            found.append((x, -x * (1 + Fraction(1, 1 << depth))))
        found += [(x, -high), (high, high / (1 << 53)), (high, high * 3 / (1 << 53 * parts))]
        found += [(high + high / (1 << 120), -high), (x, x / 10**160), (tiny, x), (tiny, tiny / 3)]
    rounded = [(as_doubles(a, parts), as_doubles(b, parts)) for a, b in found]
    return [(summed(a), summed(b)) for a, b in rounded if any(b)]


@pytest.mark.parametrize("cases", [easy, hard])
@pytest.mark.parametrize("parts", [2, 3, 4, 8])
@pytest.mark.parametrize("name", OPERATIONS)
def test_an_operation_errs_by_roundings_of_the_last_part_alone(
    name: str, parts: int, cases: Callable[[random.Random, int], list[tuple[Fraction, Fraction]]]
) -> None:
    """In a number plus a product of p parts the last takes up p^2 terms, and rounds at each.

    Those are p products, p - 1 errors of products, and the (p - 1)^2 that larger parts hand on;
    their sum is p^2 of them at most, and half an ulp of that each rounding.
    """
    pairs, true = cases(random.Random(7), parts), OPERATIONS[name][1]
    for k in range(0, len(pairs) - LANES + 1, LANES):
        a, b = map(list, zip(*pairs[k : k + LANES], strict=True))
        for x, y, found in zip(a, b, computed(name, parts, a, b), strict=True):
            size = true(abs(x), abs(y)) if name != "minus" else abs(x) + abs(y)
            lost = SMALLEST / min(1, abs(y)) if name == "quotient" else SMALLEST
            unit = size / (1 << 53 * parts) + lost
            assert abs(summed(found) - true(x, y)) < parts**4 * unit / 2, (x, y)
            each = itertools.pairwise(found)
            assert all(abs(low) <= 2.0**-52 * abs(high) for high, low in each), "parts overlap"


@pytest.mark.parametrize(
    ("size", "base", "parts", "kept"),
    [(1.02, 3.0, 2, True), (2.0, 3.0, 2, True), (1.02, 2.95, 2, False), (1.02, 2.95, 3, True)],
)
def test_sums_upon_a_base_lose_its_last_bits_alone(
    size: float, base: float, parts: int, kept: bool
) -> None:
    """Totals of pairs from -size to size need a base of three times that.

    Upon it the largest is twice the least. Upon a smaller one their difference may need 54 bits, if
    a power of two lies between it and the least total.
    """

    def lines(n: Doubles, a: Value, b: Value) -> Value:
        on, less = n.code.number(base * size), n.opposite(b)
        total = n.with_raised_product(n.raised(n.code.number(0.0), on), a, b)
        # Down in one step and up in two: errors of the same steps back and forth would cancel.
        for factor in (n.plus(less, less), b, b) * 2:
            total = n.with_raised_product(total, a, factor)
        for term in (n.opposite(a), n.opposite(a), a, a):
            total = n.with_raised(total, term)
        return n.lowered(n.with_raised_product(total, a, less), on)

    # All 12 terms cancel: what is left are the errors. The k-th is added to a second part that has
    # gathered as many roundings of the base, of 2^-53, and is itself rounded.
    source, worst = random.Random(3), 0.0
    for _ in range(50):
        rows = [
            np.array([as_doubles(x, parts) for x in xs]).T.copy()
            for xs in (just_below(source, size), just_below(source, 1))
        ]
        out = np.empty((parts, LANES))
        compiled(lines, parts)(out, *rows)
        worst = max(worst, np.abs(out).max())
    assert (worst < 12**2 / 2 * 2.0 ** (-53 * parts) * base * size) == kept


def just_below(source: random.Random, size: float) -> list[Fraction]:
    return [Fraction(size) * (1 - Fraction(source.getrandbits(96), 1 << 106)) for _ in range(LANES)]


ROUNDINGS = {53: 2.0, 106: 3.0, 159: 4.0}
"""Errors allowed, in units of 2^-bits of an angle above 1 and of any other result."""
M = context(400)
BITS = pytest.mark.parametrize("bits", [53, 106, 159])


def values(bits: int, lines: Callable[[Functions, Value], Value], x: Any) -> Any:
    """A function of LANES numbers, each as mpmath's."""
    parts = KINDS[bits].parts
    given, out = np.array(x[:parts]), np.empty((parts, LANES))
    compiled(lambda n, a, _: lines(Functions(n), a), parts)(out, given, given)
    return [sum(map(M.mpf, column)) for column in out.T.tolist()]


def numbers_between(low: float, high: float, seed: int, bits: int) -> tuple[Any, list[Any]]:
    """LANES numbers of as many parts as the bits take, and the same for mpmath."""
    random = np.random.default_rng(seed)
    parts = [random.uniform(low, high, LANES)]
    for _ in range(1, KINDS[bits].parts):
        parts.append(random.uniform(-0.5, 0.5, LANES) * np.spacing(parts[-1]))
    return parts, [sum(map(M.mpf, x)) for x in zip(*parts, strict=True)]


FUNCTIONS: dict[str, Any] = {
    "cos": (lambda f, x: f.cos_sin(x)[0], M.cos),
    "sin": (lambda f, x: f.cos_sin(x)[1], M.sin),
    "log": (Functions.logarithm_of_size, lambda x: M.log(abs(x))),
}
ANGLES = (-40, 40), (-1e-8, 1e-8), (0.78, 0.7854), (1.57, 1.5708), (-3.15, -3.14)
SIZES = (0.5, 2), (1.41, 1.414), (1 - 1e-9, 1 + 1e-9), (-1e-30, -1e-31), (1e9, 1e10)


@BITS
@pytest.mark.parametrize(
    ("name", "ends"),
    [*itertools.product(("cos", "sin"), ANGLES), *itertools.product(("log",), SIZES)],
)
def test_agrees_a_function_with_mpmath(bits: int, name: str, ends: tuple[float, float]) -> None:
    """Relative to an angle above 1, and to a logarithm."""
    (lines, function), (x, true) = FUNCTIONS[name], numbers_between(*ends, 5, bits)
    for found, z in zip(values(bits, lines, x), true, strict=True):
        size = abs(function(z)) if name == "log" else max(1, abs(z))
        assert abs(found - function(z)) < ROUNDINGS[bits] * 2.0**-bits * size, z


@BITS
def test_agrees_a_reduced_angle_with_the_angle(bits: int) -> None:
    x, true = numbers_between(-60, 60, 7, bits)
    for one, z in zip(values(bits, Functions.reduced_angle, x), true, strict=True):
        assert abs(one) < M.pi + 1e-9
        turns = (z - one) / (2 * M.pi)
        assert abs(turns - M.nint(turns)) < ROUNDINGS[bits] * 2.0**-bits
