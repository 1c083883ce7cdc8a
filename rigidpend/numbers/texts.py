"""Texts of numbers and codes: short decimals, codes as words, values in messages."""

import ast
import re
import reprlib
import sys
import threading
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

MOST_CHARACTERS = 160
"""Largest number of characters of a number in a message."""
RATIONAL = re.compile(r"-?\d{1,600}(/\d{1,600})?")
"""Pattern of the texts that :func:`as_written` rewrites; longer numbers are left as they are.

Weights go down to 1e-100 h0 and initial actions to 1e-500."""
DIGITS, SMALL, LARGE = 16, Fraction(1, 1000), 10**6
"""Most digits of a decimal, and the sizes below and above which it is written with an exponent."""
NO_SYMBOL = 255
"""Code in the place of a symbol when the orbit does not cross J1 = J2/2 again."""

_parsing = threading.Lock()


class ExactError(ValueError):
    """Error: a value that is no finite real number, or a text that is no expression of one."""


def parsed(source: str | bytes, mode: str = "exec") -> Any:
    """Parse Python source in one thread at a time: Python 3.11 fails where two threads do so."""
    with _parsing:
        return ast.parse(source, mode=mode)


def shown(text: str) -> str:
    """Shorten the text of a long number for a message, by leaving out its middle."""
    half = MOST_CHARACTERS // 2
    return text if len(text) <= MOST_CHARACTERS else f"{text[:half]} ... {text[-half:]}"


def named(value: object) -> str:
    """Describe a value of any kind in a message: in one line, and short."""
    try:
        return " ".join(_SHORT.repr(value).split())
    # Python writes no integers of more than 4300 digits.
    except ValueError:
        return f"a number of more than {sys.get_int_max_str_digits()} digits"


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxlong = _SHORT.maxother = MOST_CHARACTERS // 2


def as_written(text: str) -> str:
    """Write a rational number ``p/q`` as a decimal if a short one is exact, else leave the text.

    Short are up to `DIGITS` digits, or as many as the text has characters.

    >>> as_written("3/2"), as_written("1/100000000"), as_written("1/3"), as_written("3*pi/40")
    ('1.5', '1e-8', '1/3', '3*pi/40')
    """
    if not RATIONAL.fullmatch(text):
        return text
    try:
        value = Fraction(text)
    except ZeroDivisionError:
        return text
    with localcontext(prec=max(DIGITS, len(text))):
        rounded = (Decimal(value.numerator) / Decimal(value.denominator)).normalize()
    # A decimal that is merely close would be another number.
    if Fraction(rounded) != value:
        return text
    plain = not value or SMALL <= abs(value) <= LARGE
    return f"{rounded:f}" if plain else f"{rounded:e}".replace("e+", "e")


def everywhere(node: Any) -> Any:
    """A copy of nested dicts and lists, in which :func:`as_written` rewrites every text."""
    if isinstance(node, dict):
        return {key: everywhere(value) for key, value in node.items()}
    if isinstance(node, list):
        return [everywhere(value) for value in node]
    return as_written(node) if isinstance(node, str) else node


def words(codes: Any, known: Any) -> list[str]:
    """Codes (n_symbols, n) as texts, one per orbit: ``.`` for no symbol, ``?`` for an unknown one.

    `known` is a Boolean array of the same shape.
    """
    # Imported here, so that what only reads texts starts without NumPy.
    import numpy as np

    shown = np.where(codes == NO_SYMBOL, ".", np.asarray(codes).astype("U1"))
    return ["".join(column) for column in np.where(known, shown, "?").T]
