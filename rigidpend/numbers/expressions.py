"""Texts and numbers: expressions read, decimals and codes written as a person writes them.

A text may hold decimals, pi, arithmetic and a few functions.

The kind of number is the caller's: a :class:`Reader` says how one is made and combined. So this
module knows nothing of :class:`rigidpend.numbers.exact.Exact`, which builds on it.
"""

from __future__ import annotations

import ast
import re
import reprlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any, Generic, TypeVar

# Whoever writes a number by hand needs far less; what is longer would take seconds to evaluate.
MAX_TEXT = 4000
"""Characters of a text at most."""
MAX_CALLS = 64
"""Functions in a text at most."""
MAX_SHOWN = 160
"""Characters of a number that a message shows, at most."""
MAX_EXPONENT = 5000
"""Largest decimal exponent, of either sign."""

FUNCTIONS = ("sqrt", "sin", "cos", "tan", "atan")
"""Functions of one argument that a text may name."""

_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}

RATIONAL = re.compile(r"-?\d{1,40}(/\d{1,40})?")
"""Form of what :func:`as_written` looks at: longer numbers stay as they stand, unread."""
DIGITS, SMALL, LARGE = 16, Fraction(1, 1000), 10**6
"""Digits of a decimal form at most; below and above these it has an exponent."""

NO_SYMBOL = 255
"""The code where there is no symbol: the orbit does not cross J1 = J2/2 again."""

Number = TypeVar("Number")


class ExactError(ValueError):
    """A value that is no finite real number, or a text that is no expression of one."""


@dataclass(frozen=True)
class Reader(Generic[Number]):
    """Making and combining numbers of one kind."""

    number: Callable[[str], Number]
    """Takes decimal digits, as written."""
    pi: Number
    combine: Callable[[str, Number, Number], Number]
    """Takes one of + - * / ** and the two operands."""
    apply: Callable[[str, Number], Number]
    """Takes one of `FUNCTIONS` and its argument."""


def read(text: str, reader: Reader[Number]) -> Number:
    """Read the number that a text says.

    Raises
    ------
    ExactError
        It says none, or one that is too large to be kept exactly.
    """
    if len(text) > MAX_TEXT:
        raise ExactError(f"a number of {len(text)} characters: at most {MAX_TEXT} are read")
    source = text.strip()
    # Python would take the rest for a comment, which YAML does only behind a blank.
    if "#" in source:
        raise ExactError(f"{shown(text)!r} is not a number: a comment begins with a blank and a #")
    try:
        # Python's grammar only: nothing is evaluated, and `_read` takes what it names and no more.
        tree = ast.parse(source, mode="eval")
        if sum(isinstance(node, ast.Call) for node in ast.walk(tree)) > MAX_CALLS:
            raise ExactError(f"more than {MAX_CALLS} functions in a number")
        return _read(tree.body, source, reader)
    except ExactError as error:
        before = "" if str(error).startswith(repr(source)) else f"{shown(text)!r}: "
        raise ExactError(f"{before}{shown(str(error))}") from None
    # Python's parser gives up in all these ways, on nested brackets for one.
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExactError(f"{shown(text)!r} is not a number or an expression of numbers") from None


def shown(text: str) -> str:
    """Shorten a number for a message, by leaving out the middle of a long one."""
    half = MAX_SHOWN // 2
    return text if len(text) <= MAX_SHOWN else f"{text[:half]} ... {text[-half:]}"


def named(value: object) -> str:
    """Name a value of any kind for a message: in one line, and short."""
    try:
        return " ".join(_SHORT.repr(value).split())
    # Python writes no integers of more than 4300 digits.
    except ValueError:
        return f"a number of more than {sys.get_int_max_str_digits()} digits"


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxlong = _SHORT.maxother = MAX_SHOWN // 2


def _read(node: ast.expr, source: str, reader: Reader[Number]) -> Number:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        # The digits as written, not the double that the parser has made of them.
        return _read_number(ast.get_source_segment(source, node) or "", reader)
    if isinstance(node, ast.Name) and node.id == "pi":
        return reader.pi
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        sign = "-1" if isinstance(node.op, ast.USub) else "1"
        return reader.combine("*", reader.number(sign), _read(node.operand, source, reader))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        left, right = _read(node.left, source, reader), _read(node.right, source, reader)
        return reader.combine(_OPERATORS[type(node.op)], left, right)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        if node.func.id in FUNCTIONS and len(node.args) == 1 and not node.keywords:
            return reader.apply(node.func.id, _read(node.args[0], source, reader))
    part = ast.get_source_segment(source, node) or source
    known = ", ".join(FUNCTIONS)
    raise ExactError(f"{shown(part)!r} is not understood (known: numbers, pi, + - * / **, {known})")


def _read_number(digits: str, reader: Reader[Number]) -> Number:
    _, _, exponent = digits.lower().partition("e")
    # Python's own parser allows 1e999999999, of which the exact value would fill the memory.
    if exponent and abs(int(exponent)) > MAX_EXPONENT:
        raise ExactError(f"{digits}: exponents go to {MAX_EXPONENT}")
    return reader.number(digits)


def as_written(text: str) -> str:
    """Write a rational number ``p/q`` as a short decimal where it is one, else as it stands.

    >>> as_written("3/2"), as_written("1/100000000"), as_written("1/3"), as_written("3*pi/40")
    ('1.5', '1e-8', '1/3', '3*pi/40')
    """
    if not RATIONAL.fullmatch(text):
        return text
    try:
        value = Fraction(text)
    except ZeroDivisionError:
        return text
    with localcontext(prec=DIGITS):
        rounded = Decimal(value.numerator) / Decimal(value.denominator)
    # A decimal that is merely close would say another number.
    if Fraction(rounded) != value:
        return text
    if value.denominator == 1 and abs(value) <= LARGE:
        return str(value)
    plain = rounded.normalize()
    if not value or SMALL <= abs(value) <= LARGE:
        return f"{plain:f}"
    digits = "".join(map(str, plain.as_tuple().digits))
    mantissa = digits[0] + (f".{digits[1:]}" if digits[1:] else "")
    return f"{'-' * (value < 0)}{mantissa}e{plain.adjusted()}"


def everywhere(node: Any) -> Any:
    """Copy of plain data, in which every text that is a rational number is :func:`as_written`."""
    if isinstance(node, dict):
        return {key: everywhere(value) for key, value in node.items()}
    if isinstance(node, list):
        return [everywhere(value) for value in node]
    return as_written(node) if isinstance(node, str) else node


def words(codes: Any, known: Any) -> list[str]:
    """Codes (n_symbols, n) as texts, one an orbit: ``.`` for no symbol, ``?`` where not known."""
    # Where nothing is computed NumPy is not imported.
    import numpy as np

    shown = np.where(codes == NO_SYMBOL, ".", np.asarray(codes).astype("U1"))
    return ["".join(column) for column in np.where(known, shown, "?").T]
