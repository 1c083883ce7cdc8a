"""Intervals of the second checkers contain what they enclose, and of rising functions no more."""

import random
from collections.abc import Callable, Iterator
from fractions import Fraction
from operator import add, mul, sub, truediv
from typing import Any

import pytest
from flint import arb, ctx
from numpy.polynomial import chebyshev

from scripts import check_certificate, check_series
from scripts.check_certificate import FUNCTIONS, Interval, Refused

EXACT = 500
"""Bits of what is taken for true: more than twice those of intervals."""
MILLION = 10**6
RISING = {
    "sqrt": (FUNCTIONS["sqrt"], arb.sqrt, (0, MILLION)),
    "atan": (FUNCTIONS["atan"], arb.atan, (-MILLION, MILLION)),
    "exp": (check_certificate.exponential, arb.exp, (0, 40)),
}
"""Functions that rise, the same by another library, and the numbers that they take."""


def true(x: Fraction) -> arb:
    return arb(x.numerator) / x.denominator


def ends(x: Interval) -> tuple[Fraction, Fraction]:
    return Fraction(x.low, 1 << Interval.digits), Fraction(x.high, 1 << Interval.digits)


def drawn(kind: str, low: int, high: int, count: int = 200) -> Iterator[Interval]:
    """Intervals between two numbers, wide and narrow, on both sides of zero and across it."""
    lot = random.Random(kind)
    for _ in range(count):
        a, b = (lot.uniform(-1, 1) * 2 ** lot.uniform(-30, 20) for _ in range(2))
        within = [
            max(low, min(high, Fraction(x))) for x in (a, a + (b - a) * lot.choice([1, 1e-9]))
        ]
        yield Interval(Interval.of(min(within)).low, Interval.of(max(within)).high)


def places(x: Interval) -> list[Fraction]:
    """Numbers of an interval, its ends among them."""
    low, high = ends(x)
    return [low + Fraction(k, 5) * (high - low) for k in range(6)]


def contained(found: Interval, value: arb) -> bool:
    """True only where an exact value is certain to lie within an interval."""
    low, high = map(true, ends(found))
    return bool(low <= value <= high)


@pytest.mark.parametrize("name", RISING)
def test_rising_functions_end_where_those_of_the_ends_do(name: str) -> None:
    function, exact, (low, high) = RISING[name]
    with ctx.workprec(EXACT):
        for x in drawn(name, low, high):
            found = function(x)
            assert all(contained(found, exact(true(at))) for at in places(x)), ends(x)
            for end, at in zip(ends(found), ends(x), strict=True):
                value = exact(true(at))
                assert abs(true(end) - value) < (1 + abs(value)) / 2**100, ends(x)


@pytest.mark.parametrize(("name", "exact"), [("sin", arb.sin), ("cos", arb.cos), ("tan", arb.tan)])
def test_sines_of_intervals_contain_those_of_their_numbers(name: str, exact: Any) -> None:
    with ctx.workprec(EXACT):
        for x in drawn(name, -MILLION, MILLION):
            low, high = ends(x)
            # Wide angles are refused, and so is a quotient by a cosine that may be zero.
            try:
                found = FUNCTIONS[name](x)
            except Refused:
                assert high - low > (1 if name == "tan" else 6), ends(x)
                continue
            values = [exact(true(at)) for at in places(x)]
            assert all(contained(found, value) for value in values), ends(x)
            if high - low < 1e-3:
                width = true(ends(found)[1] - ends(found)[0])
                assert width < 20 * true(high - low) * (1 + max(values) ** 2) + arb(2) ** -150


def test_what_takes_long_or_is_not_known_is_refused() -> None:
    for angle in (Interval.of(10**200), Interval(0, 30 << Interval.digits)):
        with pytest.raises(Refused, match="an angle is too large, or known too coarsely"):
            FUNCTIONS["cos"](angle)
    for text in ("(9**5000)**5000", "(sqrt(2)**5000)**5000", "sqrt(1e4000)**5000"):
        with pytest.raises(Refused, match="a power that is too large"):
            check_certificate.number(text)
    root = check_certificate.number("(sqrt(2)/2)**20")
    assert ends(root)[0] <= Fraction(1, 1024) <= ends(root)[1]
    assert check_certificate.number("(3/2)**-3") == Fraction(8, 27)


@pytest.mark.parametrize(
    ("one", "other", "equal"),
    [
        ("sqrt(8)", "2*sqrt(2)", True),
        ("pi/2 - pi/2", "0", True),
        ("sqrt(2)*1e-80", "sqrt(2)*1e-100", False),
        ("sqrt(2)*1e-500", "sqrt(3)*1e-500", False),
        ("pi/10", "pi/10 + 2**-4096", False),
    ],
)
def test_numbers_are_the_same_to_more_digits_than_any_proof_uses(
    monkeypatch: pytest.MonkeyPatch, one: str, other: str, equal: bool
) -> None:
    monkeypatch.setattr(Interval, "digits", Interval.digits)
    assert check_certificate.same(one, other) is equal


@pytest.mark.parametrize("operator", [add, sub, mul, truediv])
def test_operations_contain_the_results_of_all_pairs(operator: Callable[[Any, Any], Any]) -> None:
    pairs = zip(drawn("a", -MILLION, MILLION), drawn("b", -MILLION, MILLION), strict=True)
    for a, b in pairs:
        zero = ends(b)[0] <= 0 <= ends(b)[1]
        if operator is truediv and zero:
            with pytest.raises(Refused, match="a division by what may be zero"):
                operator(a, b)
            continue
        low, high = ends(operator(a, b))
        values = [operator(x, y) for x in places(a) for y in places(b)]
        # Extremes are at ends, which are among the places.
        unit = Fraction(1, 1 << Interval.digits)
        assert low <= min(values) < low + unit
        assert high - unit < max(values) <= high


def test_bounds_on_sizes_and_neighbourhoods_contain_all_numbers() -> None:
    with ctx.workprec(EXACT):
        for a, b in zip(drawn("c", -9, 9), drawn("d", -9, 9), strict=True):
            both = ends(a), ends(b)
            largest = [max(map(abs, x)) for x in both]
            assert check_series.size(a) == largest[0]
            assert (
                true(check_certificate.hypotenuse(a, b).above)
                >= true(largest[0] ** 2 + largest[1] ** 2).sqrt()
            )
            assert ends(check_certificate.larger(a, b)) == tuple(map(max, *both))
            assert ends(a**-2 if both[0][0] > 0 else a**3)[1] >= both[0][1] ** (
                -2 if both[0][0] > 0 else 3
            )
            centre, radius = largest
            low, high = both[0]
            assert ends(check_series.around(centre, radius)) == (centre - radius, centre + radius)
            assert ends(check_series.around(a, radius)) == (low - radius, high + radius)
    # A third is none of the numbers that an interval ends at.
    assert ends(check_series.around(0, Fraction(1, 3)))[1] > Fraction(1, 3)


def test_series_contain_all_that_they_stand_for() -> None:
    """Numbers of intervals, what is off by part of a unit, and a polynomial on parts of [-1, 1]."""
    for x in drawn("series", -MILLION, MILLION, 20):
        series = check_series.Series.of(x)
        [middle] = series.terms.values()
        assert middle - series.error <= x.low <= x.high <= middle + series.error
        wider = series.wider(Fraction(1, 3))
        assert wider.error >= series.error + Fraction(1 << series.digits, 3)
    n = 30
    parts = check_series.Series.made({(n, 0, 0): 1 << 20}, 20).on_parts()
    for k, part in enumerate(parts):
        low, high = ends(part)
        inside: list[Any] = [Fraction(4 * k + j, 2 * len(parts)) - 1 for j in range(5)]
        for place in inside:
            assert low <= chebyshev.chebval(place, [0] * n + [1]) <= high
