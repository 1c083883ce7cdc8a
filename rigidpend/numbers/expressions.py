"""Texts of numbers and codes: decimals and codes as a person writes them, values for messages."""

from __future__ import annotations

import re
import reprlib
import sys
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

MAX_SHOWN = 160
"""Characters of a number that a message shows, at most."""
RATIONAL = re.compile(r"-?\d{1,600}(/\d{1,600})?")
"""Form of what :func:`as_written` looks at: longer numbers stay as they stand, unread.

Weights go down to 1e-100 h0 and initial actions to 1e-500."""
DIGITS, SMALL, LARGE = 16, Fraction(1, 1000), 10**6
"""Digits of a decimal form at most; below and above these it has an exponent."""
NO_SYMBOL = 255
"""The code where there is no symbol: the orbit does not cross J1 = J2/2 again."""


class ExactError(ValueError):
    """A value that is no finite real number, or a text that is no expression of one."""


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
        rounded = (Decimal(value.numerator) / Decimal(value.denominator)).normalize()
    # A decimal that is merely close would say another number.
    if Fraction(rounded) != value:
        return text
    plain = not value or SMALL <= abs(value) <= LARGE
    return f"{rounded:f}" if plain else f"{rounded:e}".replace("e+", "e")


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
