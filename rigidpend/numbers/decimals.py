"""Decimal forms of rational numbers, as a person writes them."""

from __future__ import annotations

import re
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

RATIONAL = re.compile(r"-?\d{1,40}(/\d{1,40})?")
"""Form of what is looked at: longer numbers stay as they stand, unread."""
DIGITS, SMALL, LARGE = 16, Fraction(1, 1000), 10**6
"""Digits of a decimal form at most; below and above these it has an exponent."""


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
