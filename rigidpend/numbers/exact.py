"""Numbers taken exactly as written, and evaluated in any precision.

An :class:`Exact` is an expression over rationals, ``pi`` and a few functions. It is never
rounded when it is made: ``exact("0.1")`` is one tenth, ``exact("3*pi/40 + 1/100")`` keeps its
``pi``, and a float is the double that it is. Rounding happens once, in :meth:`Exact.at`.
"""

from __future__ import annotations

import functools
import math
import numbers
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from rigidpend.numbers import expressions
from rigidpend.numbers.expressions import MAX_EXPONENT, MAX_TEXT, named, shown
from rigidpend.numbers.expressions import ExactError as ExactError

if TYPE_CHECKING:
    from mpmath import MPContext

PRECISIONS = (53, 106, 160)
"""Working precisions in bits, in the order in which they are tried."""
GUARD_BITS = 32
"""Bits beyond those asked for, which take up the rounding of intermediate results."""
MOST_BITS = 10_000
"""Largest number of bits, guard bits included, that is tried: what cancels so far is zero."""
FINEST = 9_000
"""Bits of the highest working precision, which leaves guard bits up to `MOST_BITS`."""
MAX_SIZE = 40_000
"""Largest number of bits in the numerator or the denominator of a rational number."""


@functools.cache
def context(bits: int) -> MPContext:
    """Context of mpmath with `bits` bits: a namespace of numbers with its own precision.

    Contexts are cached, and nothing can change their precision, so threads may share them.
    """
    return _kind_of_context()(bits)


@functools.cache
def _kind_of_context() -> type[MPContext]:
    from mpmath import MPContext

    class Context(MPContext):  # type: ignore[misc]
        """A context of one precision for good.

        mpmath's special functions raise their context's precision for a moment, which another
        thread would compute with, or keep: here they fail.
        """

        def __init__(self, bits: int) -> None:
            super().__init__()
            self._set_prec(bits)

        prec = property(lambda self: self._prec, doc="Bits of the numbers.")
        dps = property(lambda self: self._dps, doc="Decimal digits of the numbers.")

        def expm1(self, x: Any) -> Any:
            """exp(x) - 1, with as many bits more as cancel."""
            x = self.convert(x)
            bits = self.prec + GUARD_BITS - min(0, _magnitude(x))
            return self.fsub(self.exp(x, prec=bits), 1)

        @classmethod
        def _wrap_specfun(cls, *_: Any) -> None:
            """Leave out ten milliseconds of work that would be done for each precision."""

    return Context


def fraction(x: Any, bits: int | None = None) -> Fraction:
    """Make a Fraction of an mpmath number, rounded to `bits` bits where they are given."""
    from mpmath.libmp import to_rational

    rounded = x if bits is None else context(bits).mpf(x)
    return Fraction(*map(int, to_rational(rounded._mpf_)))


def _operators(name: str) -> tuple[Callable[[Exact, Any], Exact], Callable[[Exact, Any], Exact]]:
    """An operator with a number on its right, and with one on its left."""
    return (
        lambda self, other: combine(name, self, exact(other)),
        lambda self, other: combine(name, exact(other), self),
    )


@dataclass(frozen=True, eq=False)
class Exact:
    """A real number known exactly.

    Attributes
    ----------
    text : str
        The number as an expression that :func:`exact` reads back.
    fraction : Fraction or None
        The value where it is rational and known to be, else None.
    over : callable
        ``over(m)`` is the value in a namespace of numbers, such as balls, with its own rounding.
        It has mpf, pi, sqrt, sin, cos, tan and atan.
    """

    text: str
    fraction: Fraction | None
    over: Callable[[Any], Any]

    def at(self, bits: int) -> Any:
        """The value rounded to `bits` bits, as a number of :func:`context` ``(bits)``.

        Guard bits are added until the rounded value stands, so that what cancels inside an
        expression takes nothing from the result.
        """
        guard, value = GUARD_BITS, self._rounded(bits, GUARD_BITS)
        if self.fraction is not None:
            return value
        while bits + guard < MOST_BITS:
            guard *= 3
            finer = self._rounded(bits, guard)
            # Zero is never settled here: more bits may show that what cancelled was only tiny.
            if finer == value != 0:
                return value
            value = finer
        # Thousands of bits have cancelled: it is taken for 0.
        if abs(value) < context(bits).mpf(2) ** (-MOST_BITS // 4):
            return context(bits).mpf(0)
        raise ExactError(f"{shown(self.text)} cannot be told from its rounding errors")

    def _rounded(self, bits: int, guard: int) -> Any:
        value = context(bits).mpf(self.over(context(bits + guard)))
        if abs(_magnitude(value)) > MAX_SIZE:
            raise ExactError(f"{shown(self.text)}: beyond 2**{MAX_SIZE} or its inverse")
        return value

    def in_context(self, m: MPContext) -> Any:
        """The value in the precision of the context `m`."""
        return self.at(m.prec)

    def __float__(self) -> float:
        if self.fraction is None:
            return float(self.at(113))
        try:
            # Python rounds a quotient of whole numbers correctly.
            return self.fraction.numerator / self.fraction.denominator
        except OverflowError:
            return math.inf if self.fraction > 0 else -math.inf

    def __reduce__(self) -> tuple[Any, ...]:
        # By its text, for functions within functions cannot be pickled for a worker.
        return exact, (self.text,)

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"exact({self.text!r})"

    def __neg__(self) -> Exact:
        return combine("*", exact(-1), self)

    __add__, __radd__ = _operators("+")
    __sub__, __rsub__ = _operators("-")
    __mul__, __rmul__ = _operators("*")
    __truediv__, __rtruediv__ = _operators("/")
    __pow__, _ = _operators("**")

    def __eq__(self, other: object) -> bool:
        """Equality of what is written; two rationals are equal where their values are."""
        if not isinstance(other, Exact):
            return NotImplemented
        if self.fraction is not None and other.fraction is not None:
            return self.fraction == other.fraction
        return self.text == other.text

    def __hash__(self) -> int:
        return self._hash

    @functools.cached_property
    def _hash(self) -> int:
        # A key of caches: the hash of a Fraction takes a modular power each time.
        return hash(self.text if self.fraction is None else self.fraction)


def exact(value: Any) -> Exact:
    """Take a number exactly.

    Parameters
    ----------
    value : Exact, int, Fraction, Decimal, float, NumPy number or str
        A text may hold decimals (``"1e-6"``), ``pi``, ``+ - * / **``, brackets and the
        functions sqrt, sin, cos, tan, atan.

    Raises
    ------
    ExactError
        The value is not finite, not real, or not readable.
    """
    if isinstance(value, Exact):
        return value
    if isinstance(value, str):
        return _read(value)
    # A bool is an int to Python, and no number that anybody means.
    if isinstance(value, bool):
        raise ExactError(f"{named(value)} is not a real number")
    # NumPy's integers have no as_integer_ratio.
    if isinstance(value, numbers.Integral) and hasattr(value, "__index__"):
        value = int(value)
    if not hasattr(value, "as_integer_ratio"):
        raise ExactError(f"{named(value)} is not a real number")
    # A Decimal may hold 1e999999 in a few bytes; its ratio cannot.
    if isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) > MAX_EXPONENT:
        raise ExactError(f"{value}: exponents go to {MAX_EXPONENT}")
    try:
        taken = Fraction(*map(int, value.as_integer_ratio()))
    except (ValueError, OverflowError):
        raise ExactError(f"{named(value)} is not finite") from None
    # A class has the method too, and no number to call it on.
    except TypeError:
        raise ExactError(f"{named(value)} is not a real number") from None
    return rational(taken, None)


@functools.lru_cache(maxsize=1024)
def _read(text: str) -> Exact:
    """Read a text; of the members of a sweep nearly all are the same."""
    read = expressions.read(text, _READER)
    return Exact(text.strip(), read.fraction, read.over)


def exacts(values: Iterable[Any]) -> list[Exact]:
    """Take several numbers exactly: :func:`exact` of each."""
    return [exact(value) for value in values]


def function(name: str, x: Exact) -> Exact:
    """Make the exact number ``name(x)``, for one of sqrt, sin, cos, tan, atan."""
    if name == "sqrt":
        if x.fraction is not None and x.fraction < 0:
            raise ExactError(f"sqrt({x}) is not real")
        # sqrt(4) is rational like 2, by which equal bodies are known as equal.
        root = _rational_root(x.fraction)
        if root is not None:
            return rational(root, f"sqrt({x})")
        if x.fraction is None and x.at(53) < 0:
            raise ExactError(f"sqrt({x}) is not real")
    if name in ("sin", "cos", "tan"):
        return Exact(f"{name}({x})", None, lambda m: getattr(m, name)(_turnable(x, m)))
    return Exact(f"{name}({x})", None, lambda m: getattr(m, name)(x.over(m)))


def _turnable(x: Exact, m: MPContext) -> Any:
    """Evaluate an angle that can be brought into one turn, which takes its size in bits."""
    value = x.over(m)
    # Other kinds of numbers than mpmath's know themselves what they lose.
    if hasattr(value, "_mpf_") and _magnitude(value) > MOST_BITS:
        raise ExactError(f"an angle beyond 2**{MOST_BITS}: {shown(x.text)}")
    return value


def _magnitude(value: Any) -> int:
    """Binary exponent of an mpmath number; 0 for 0 and for numbers that are not finite."""
    _, mantissa, exponent, bits = value._mpf_
    return int(exponent + bits) if mantissa else 0


def _rational_root(x: Fraction | None) -> Fraction | None:
    """Square root of x where it is rational, else None."""
    if x is None:
        return None
    numerator, denominator = math.isqrt(x.numerator), math.isqrt(x.denominator)
    root = Fraction(numerator, denominator)
    return root if root * root == x else None


def rational(value: Fraction, text: str | None) -> Exact:
    """Make a rational number, by default with the shortest text that says it exactly."""
    p, q = value.numerator, value.denominator
    if _size(value) > MAX_SIZE:
        raise ExactError(f"a number with more than {MAX_SIZE} bits")
    if text is None or len(text) > MAX_TEXT:
        text = _shortest(value)
    return Exact(text, value, lambda m: m.mpf(p) / q)


def _shortest(value: Fraction) -> str:
    """Shortest text of a rational: a decimal where a double's is exact, else a quotient."""
    short = repr(float(value)) if abs(value) < 1e15 else ""
    twos = (value.denominator & -value.denominator).bit_length() - 1
    decimals = short.partition(".")[2]
    if decimals.isdigit() and len(decimals) < twos:
        # Most doubles: as many decimals as halvings would be needed.
        short = ""
    # repr gives the shortest digits of the double, which may not be those of this number.
    if short and Fraction(short) == value:
        return short.removesuffix(".0")
    try:
        return str(value)
    except ValueError:
        raise ExactError("a number with more digits than can be written") from None


# The plus rounds mpmath's constant, which has no precision of its own, to the context's.
PI = Exact("pi", None, lambda m: +m.pi)


def combine(operator: str, a: Exact, b: Exact) -> Exact:
    """Make the exact number ``a operator b``, for one of ``+ - * / **``."""
    text = f"{_bracketed(a)} {operator} {_bracketed(b)}"
    if operator == "/" and (b.fraction == 0 or (b.fraction is None and b.at(53) == 0)):
        raise ExactError(f"{text}: division by zero")
    if operator == "**":
        _check_power(text, a, b)
    # Known as zero without evaluation, which could never tell it from something tiny.
    if operator == "*" and 0 in (a.fraction, b.fraction):
        return rational(Fraction(0), text)
    compute = _COMPUTE[operator]
    if a.fraction is not None and b.fraction is not None:
        return rational(compute(a.fraction, b.fraction), text)
    if operator == "**":
        assert b.fraction is not None
        n = int(b.fraction)
        return Exact(text, None, lambda m: a.over(m) ** n)
    return Exact(text, None, lambda m: compute(a.over(m), b.over(m)))


def _bracketed(x: Exact) -> str:
    """Text of `x`, bracketed where it must be to stay one operand of a larger expression."""
    plain = x.text.replace(".", "").isalnum()
    return x.text if plain else f"({x.text})"


def _check_power(text: str, a: Exact, b: Exact) -> None:
    n = b.fraction
    if n is None or n.denominator != 1 or abs(n) > 64:
        raise ExactError(f"{text}: the power must be a whole number of at most 64")
    if n < 0 and (a.fraction == 0 or (a.fraction is None and a.at(53) == 0)):
        raise ExactError(f"{text}: division by zero")
    if a.fraction is not None and abs(n) * _size(a.fraction) > MAX_SIZE:
        raise ExactError(f"{text}: a number with more than {MAX_SIZE} bits")


def _size(x: Fraction) -> int:
    return max(x.numerator.bit_length(), x.denominator.bit_length())


_COMPUTE: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda x, y: x + y,
    "-": lambda x, y: x - y,
    "*": lambda x, y: x * y,
    "/": lambda x, y: x / y,
    "**": lambda x, y: x ** int(y),
}
_READER = expressions.Reader(
    number=lambda digits: rational(Fraction(digits), digits), pi=PI, combine=combine, apply=function
)
