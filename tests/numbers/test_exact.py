"""Numbers taken exactly: what is read, kept, refused, and written as a person writes it."""

import functools
import math
import pickle
from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

from rigidpend.numbers.exact import (
    MOST_TEXT,
    PI,
    Exact,
    ExactError,
    context,
    exact,
    fraction,
    function,
)
from rigidpend.numbers.texts import as_written, everywhere, named, shown
from tests.strategies import examples

RATIONAL: list[tuple[Any, Fraction]] = [
    ("1e-6", Fraction(1, 10**6)),
    (" 1.3342 ", Fraction(13342, 10**4)),
    ("1/3", Fraction(1, 3)),
    ("-(1/3)**2", Fraction(-1, 9)),
    ("-2**2", Fraction(-4)),
    ("2**-3", Fraction(1, 8)),
    ("1 - 2 - 3", Fraction(-4)),
    ("2/3/4", Fraction(1, 6)),
    ("2**3**2", Fraction(512)),
    ("sqrt(9/16)", Fraction(3, 4)),
    ("+7", Fraction(7)),
    ("1e-5000", Fraction(1, 10**5000)),
    ("(" * 99 + "1" + ")" * 99, Fraction(1)),
    (5e-324, Fraction(1, 2**1074)),
    (np.float64(0.1), Fraction(0.1)),
    (np.float32(0.1), Fraction(13421773, 2**27)),
    (Decimal("0.1"), Fraction(1, 10)),
    (Decimal("1E+2"), Fraction(100)),
    (Fraction(-2, 6), Fraction(-1, 3)),
    (10**40, Fraction(10**40)),
    (np.int64(-3), Fraction(-3)),
    (np.uint8(200), Fraction(200)),
    (np.array(200, ">i2"), Fraction(200)),
    (np.array("1/3"), Fraction(1, 3)),
    (context(300).mpf(2) ** -200, Fraction(1, 2**200)),
]


@pytest.mark.parametrize(("given", "value"), RATIONAL)
def test_agrees_a_rational_number_with_its_fraction(given: Any, value: Fraction) -> None:
    assert exact(given).fraction == value
    assert float(exact(given)) == float(value)


@pytest.mark.parametrize("bits", [53, 113, 300])
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3*pi/40 + 1/100", lambda m: 3 * m.pi / 40 + m.mpf(1) / 100),
        ("sqrt(2)", lambda m: m.mpf(2) ** m.mpf("0.5")),
        ("-pi**3", lambda m: -m.exp(3 * m.log(m.pi))),
        ("sin(1/3) - cos(0.1)", lambda m: m.sin(m.mpf(1) / 3) - m.cos(m.mpf(1) / 10)),
        ("4*atan(1/5) - atan(1/239)", lambda m: m.pi / 4),
        ("tan(1)/1e-300", lambda m: m.tan(1) * m.mpf(10) ** 300),
        ("1/3", lambda m: 1 / m.mpf(3)),
        # What cancels, or has many turns.
        ("pi - 3.14159265358979323846", lambda m: m.pi - m.mpf("3.14159265358979323846")),
        ("sin(1e40)", lambda m: m.sin(m.mpf(10) ** 40)),
        ("cos(pi*1e30)", lambda m: m.cos(m.pi * m.mpf(10) ** 30)),
        ("sqrt(2) - 1.41421356237309504880", lambda m: m.sqrt(2) - m.mpf("1.4142135623730950488")),
        # Were each of these to ask the one below it twice, this would not end.
        (
            f"{40 * 'atan('}1{40 * ')'}",
            lambda m: functools.reduce(lambda x, _: m.atan(x), range(40), 1),
        ),
    ],
)
def test_agrees_at_with_mpmath_to_the_last_bit(text: str, value: Any, bits: int) -> None:
    """Whatever the precision of mpmath's own context."""
    with mpmath.workprec(1000):
        fine = value(mpmath.mp)
        expected = mpmath.mpf(fine, prec=bits)
    with mpmath.workprec(20):
        found = exact(text).at(bits)
    assert ratio(found) == ratio(expected) == fraction(found) == fraction(found, bits)
    assert float(exact(text)) == float(ratio(fine))


def ratio(x: Any) -> Fraction:
    """An mpmath number, unrounded."""
    return Fraction(*map(int, x.as_integer_ratio()))


REFUSED: dict[str, list[Any]] = {
    "is not (finite|a real number)": [
        *(math.nan, math.inf, -math.inf, True, np.True_, None, 1j, b"1", [1], np.array([1.5])),
        *(np.float32("nan"), Decimal("NaN"), Decimal("-Infinity")),
    ],
    "is not a number": ["", "1e", "0x10", "1\x002", "1;2", "(" * 150 + "1"],
    "not understood": [
        *("nan", "inf", "True", "1j", "exp(1)", "sin(1, 2)", "sin(x=1)", "(1, 2)", "7 // 2"),
        *("__import__('os')", "pi.real", "(lambda: 1)()"),
    ],
    "division by zero": [
        *("1/0", "1/(3 - 3)", "0**-1", "sin(1)/0", "1/(pi - pi)", "(pi - pi)**-1"),
        "1/(sqrt(2)**2 - 2)",
    ],
    # Shown whole, and with the part that is wrong.
    r"'1 \+ cot\(2\)'.*'cot\(2\)' is not understood": ["1 + cot(2)"],
    "not real": ["sqrt(-1)", "sqrt(3 - pi)", "sqrt(-sqrt(2))"],
    "whole number": ["2**0.5"],
    "at most 64": ["2**65", "9**9**9", "9**64**64"],
    # What is huge is so at once: were it formed, these would fill the memory.
    "exponents go to 5000": [
        *("1e5001", "1e-99999999999", Decimal("1E+99999999"), Decimal("1E-5001")),
    ],
    "4001 characters": ["1" * 4001],
    "100000 characters": ["(" * 100_000],
    "more than 40000 bits": [
        *("((9**64)**64)**64", "(((2**64)**64)**64)**64", "1e5000*1e5000*1e5000", "1e5000**64"),
        *(Fraction(1, 2**40_000), 2**40_000),
    ],
}


@pytest.mark.parametrize(
    ("value", "reason"),
    [(value, reason) for reason, values in REFUSED.items() for value in values],
    # `named` gives the address of a fraction that it cannot write, another one in each process.
    ids=lambda x: "a small fraction" if isinstance(x, Fraction) else named(x),
)
def test_what_is_refused_names_its_reason(value: Any, reason: str) -> None:
    with pytest.raises(ExactError, match=reason):
        exact(value)


WRITTEN = "0123456789.eE+-*/() pisqrtanco_,"
STRANGE = "".join(chr(2**k + 1) for k in range(5, 20)) + "a\0\n\x1b\xb2\u0663\u2212\U0010ffff"
"""Of every length in UTF-8: controls, what is a digit and is none, a minus that is none."""


@pytest.mark.slow
@examples(60, st.one_of(st.text(STRANGE), st.text(WRITTEN, max_size=12)))
def test_refused_garbage_raises_nothing_but_exact_errors(text: str) -> None:
    try:
        read = exact(text)
    except ExactError:
        return
    assert str(read) == text.strip()


LEAVES: st.SearchStrategy[Exact] = st.one_of(
    st.integers(-(10**6), 10**6).map(exact),
    st.fractions(-9, 9, max_denominator=99).map(exact),
    st.decimals(-99, 99, places=4).map(exact),
    st.sampled_from(["pi", "1e-6", "0.50", "sqrt(2)", "-(1/3)**2", "2*pi - 1"]).map(exact),
)


def _larger(parts: st.SearchStrategy[Exact]) -> st.SearchStrategy[Exact]:
    return st.one_of(
        st.tuples(parts, parts).map(lambda pair: pair[0] + pair[1]),
        st.tuples(parts, parts).map(lambda pair: pair[0] - pair[1]),
        st.tuples(parts, parts).map(lambda pair: pair[0] * pair[1]),
        st.tuples(parts, st.integers(1, 99)).map(lambda pair: pair[0] / -pair[1]),
        st.tuples(parts, st.integers(0, 3)).map(lambda pair: pair[0] ** pair[1]),
        st.tuples(st.sampled_from(["sin", "cos", "atan"]), parts).map(lambda f: function(*f)),
    )


@pytest.mark.slow
@examples(60, st.recursive(LEAVES, _larger, max_leaves=6))
def test_agrees_the_text_of_an_exact_with_its_value(x: Exact) -> None:
    assume(len(str(x)) <= MOST_TEXT)
    again = exact(str(x))
    assert (again.fraction, ratio(again.at(1000))) == (x.fraction, ratio(x.at(1000)))
    assert str(pickle.loads(pickle.dumps(x))) == str(x)
    assert repr(x) == f"exact({str(x)!r})"


NUMBERS = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(width=32, allow_nan=False, allow_infinity=False).map(np.float32),
    st.integers(),
    st.integers(0, 10**4000 - 1),
    st.integers(0, 3999).map(lambda n: 10**n),
    st.fractions(),
)


@pytest.mark.slow
@examples(100, NUMBERS)
def test_agrees_the_text_of_a_number_with_the_number(value: Any) -> None:
    x = exact(value)
    assert x.fraction == Fraction(*map(int, value.as_integer_ratio()))
    assert exact(str(x)) == x
    assert exact(str(x)).fraction == x.fraction
    assert pickle.loads(pickle.dumps(x)) == x


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.5, "0.5"),
        (2.0, "2"),
        (-1.5, "-1.5"),
        (0.1, "3602879701896397/36028797018963968"),
        (np.float32(0.1), "13421773/134217728"),
        (1e22, "10000000000000000000000"),
    ],
)
def test_agrees_a_float_s_text_with_the_decimal_or_quotient(value: Any, text: str) -> None:
    assert str(exact(value)) == text


def test_agrees_a_double_too_large_or_small_with_its_limit() -> None:
    assert float(exact("1e400")) == math.inf
    assert float(exact("-1e400")) == -math.inf
    assert float(exact("pi*1e400")) == math.inf
    assert float(exact("1e-400")) == 0
    assert float(exact("pi - (pi + 1e-100)")) == -1e-100, "what cancels beyond all guard bits"
    assert float(exact("sin(pi)*sin(pi)")) == 0, "no smaller than a product of zeros"
    with pytest.raises(ExactError, match=r"beyond 2\*\*40000 or its inverse"):
        exact("pi*1e-5000*1e-5000*1e-5000").at(53)


def test_agrees_operators_with_a_number_on_either_side() -> None:
    x, third = exact("pi/3"), math.pi / 3
    found = [-x, 1 + x, 2 * x, 1 / x, 3 - x, x + 1, x * 2, x / 2, x - 3, x**2]
    expected = [-third, 1 + third, 2 * third, 1 / third, 3 - third]
    expected += [third + 1, third * 2, third / 2, third - 3, third**2]
    assert [float(y) for y in found] == pytest.approx(expected, rel=1e-15, abs=0)


def test_agrees_equality_with_value_and_writing() -> None:
    assert exact("2/4") == exact(0.5) == exact(Decimal("0.50"))
    assert len({exact("2/4"), exact(0.5), exact("pi"), PI}) == 2
    assert exact("pi") != exact(math.pi)
    assert exact(0.1) != exact("0.1")
    assert exact("pi") != "pi"


@pytest.mark.parametrize("x", ["-0.3", "1e-40", "-1e-3000", "0", "3", "-200"])
def test_expm1_rounds_once(x: str) -> None:
    m = context(113)
    with mpmath.workprec(20_000):
        true = mpmath.expm1(mpmath.mpf(m.mpf(x)))
    assert m.expm1(m.mpf(x)) == m.mpf(true)


@pytest.mark.parametrize("call", ["sech", "prec", "dps"])
def test_what_would_change_a_context_fails(call: str) -> None:
    m = context(113)
    with pytest.raises(AttributeError, match="no setter"):
        m.sech(1) if call == "sech" else setattr(m, call, 300)
    assert (m.prec, m.mpf(1) / 3 == context(113).mpf(1) / 3) == (113, True)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("3/2", "1.5"),
        ("1/100000000", "1e-8"),
        ("-1/1000", "-0.001"),
        ("239205/100000000000000", "2.39205e-9"),
        ("6671/5000", "1.3342"),
        ("1/3", "1/3"),
        # A phase with many digits, as `find` prints it, and the double nearest to 0.1.
        (f"47785267201850281796833867217/1{28 * '0'}", "4.7785267201850281796833867217"),
        ("10000000000000000000001/2", "5.0000000000000000000005e21"),
        ("3602879701896397/36028797018963968", "3602879701896397/36028797018963968"),
        ("0", "0"),
        ("20000", "20000"),
        ("10000000", "1e7"),
        (f"1/1{40 * '0'}", "1e-40"),
        (f"-123/1{501 * '0'}", "-1.23e-499"),
        (f"1/1{600 * '0'}", f"1/1{600 * '0'}"),
        ("3*pi/40", "3*pi/40"),
        ("1/0", "1/0"),
        ("1/00", "1/00"),
        ("route_codes", "route_codes"),
    ],
)
def test_numbers_are_as_a_person_writes_them(text: str, written: str) -> None:
    assert as_written(text) == written


@examples(40, st.fractions(), st.integers(-30, 30))
def test_the_number_is_the_same(x: Fraction, power: int) -> None:
    value = x * Fraction(10) ** power
    assert exact(as_written(str(value))).fraction == value


def test_data_keep_their_shape() -> None:
    data = {"a": ["3/2", 7, None, True], "b": {"c": "1/1000"}}
    assert everywhere(data) == {"a": ["1.5", 7, None, True], "b": {"c": "0.001"}}


@pytest.mark.parametrize(("length", "told"), [(160, 160), (161, 165)])
def test_a_long_number_is_shown_without_its_middle(length: int, told: int) -> None:
    text = "1" * length
    assert len(shown(text)) == told
    assert (shown(text) == text) is (told == length)
