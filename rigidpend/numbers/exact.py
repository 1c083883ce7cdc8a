"""Numbers taken exactly as written, and evaluated in any precision.

An :class:`Exact` is an expression of rationals, ``pi`` and a few functions. Making it rounds
nothing: ``exact("0.1")`` is one tenth, ``exact("3*pi/40 + 1/100")`` keeps its ``pi``, and a float
has the value of the double that it is. Rounding happens once, in :meth:`Exact.at`.
"""

from __future__ import annotations

import ast
import functools
import math
import numbers
import operator
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from rigidpend.numbers.texts import ExactError as ExactError
from rigidpend.numbers.texts import named, parsed, shown

if TYPE_CHECKING:
    from mpmath import MPContext

PRECISIONS = (53, 106, 160)
"""Working precisions in bits, in the order in which they are tried."""
GUARD_BITS = 32
"""Bits beyond those asked for, which absorb the rounding of intermediate results."""
MOST_BITS = 10_000
"""Largest number of bits, guard bits included: what cancels to so many bits counts as zero."""
FINEST_BITS = 9_000
"""Bits of the highest working precision, which leaves guard bits up to `MOST_BITS`."""
MOST_SIZE = 40_000
"""Largest number of bits in the numerator or the denominator of a rational number."""
MOST_EXPONENT = 5000
"""Largest decimal exponent, of either sign."""
# A number written by hand needs far less. A longer text would take seconds to evaluate.
MOST_TEXT, MOST_CALLS = 4000, 64
"""Largest number of characters of a text, and of functions in it."""

FUNCTIONS = ("sqrt", "sin", "cos", "tan", "atan")
"""Functions of one argument that a text may name."""
SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
COMPUTE = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


@functools.cache
def context(bits: int) -> MPContext:
    """The mpmath context of `bits` bits: a namespace of numbers with its own precision.

    Contexts are cached. Nothing can change their precision, so that threads may share them.
    """
    return _kind_of_context()(bits)


@functools.cache
def _kind_of_context() -> type[MPContext]:
    # Within a function, since mpmath is imported only where numbers are evaluated.
    from mpmath import MPContext

    class Context(MPContext):  # type: ignore[misc]
        """A context whose precision never changes.

        mpmath's special functions raise their context's precision for a moment, and another thread
        would compute with it, or keep it. Here these functions fail instead.
        """

        def __init__(self, bits: int) -> None:
            super().__init__()
            self._set_prec(bits)

        prec = property(lambda self: self._prec, doc="Bits of the numbers.")
        dps = property(lambda self: self._dps, doc="Decimal digits of the numbers.")

        def expm1(self, x: Any) -> Any:
            """exp(x) - 1, with further bits for those that cancel."""
            x = self.convert(x)
            bits = self.prec + GUARD_BITS - min(0, _magnitude(x))
            return self.fsub(self.exp(x, prec=bits), 1)

        @classmethod
        def _wrap_specfun(cls, *_: Any) -> None:
            """Skip the special functions, which take ten milliseconds for each precision."""

    return Context


def fraction(x: Any, bits: int | None = None) -> Fraction:
    """The exact value of an mpmath number, after rounding to `bits` bits if these are given."""
    from mpmath.libmp import to_rational

    rounded = x if bits is None else context(bits).mpf(x)
    return Fraction(*map(int, to_rational(rounded._mpf_)))


def _operators(sign: str) -> tuple[Callable[[Exact, Any], Exact], Callable[[Exact, Any], Exact]]:
    """Methods for an operator with this number on its left, and on its right."""
    return (
        lambda self, other: combine(sign, self, exact(other)),
        lambda self, other: combine(sign, exact(other), self),
    )


@dataclass(frozen=True, eq=False)
class Exact:
    """A real number known exactly."""

    text: str
    """The number as an expression that :func:`exact` reads back."""
    fraction: Fraction | None
    """The value where it is rational and known to be, else None."""
    over: Callable[[Any], Any]
    """``over(m)`` is the value in a namespace of numbers, such as balls, with its own rounding.

    It has mpf, pi, sqrt, sin, cos, tan and atan."""

    def at(self, bits: int) -> Any:
        """The value rounded to `bits` bits, as a number of :func:`context` ``(bits)``.

        Guard bits are added until the rounded value no longer changes, so that cancellation inside
        an expression costs the result no bits. ExactError is raised if it never settles.
        """
        guard, value = GUARD_BITS, self._rounded(bits, GUARD_BITS)
        if self.fraction is not None:
            return value
        while bits + guard < MOST_BITS:
            guard *= 3
            finer = self._rounded(bits, guard)
            # Zero never counts as settled: with more bits it may turn out to be only tiny.
            if finer == value != 0:
                return self._within(value)
            value = finer
        # Thousands of bits have cancelled: the value counts as 0.
        if abs(value) < context(bits).mpf(2) ** (-MOST_BITS // 4):
            return context(bits).mpf(0)
        raise ExactError(f"{shown(self.text)} cannot be told from its rounding errors")

    def _rounded(self, bits: int, guard: int) -> Any:
        return context(bits).mpf(self.over(context(bits + guard)))

    def _within(self, value: Any) -> Any:
        """A settled value, of a size that is taken: what cancels is smaller with each guard bit."""
        if abs(_magnitude(value)) > MOST_SIZE:
            raise ExactError(f"{shown(self.text)}: beyond 2**{MOST_SIZE} or its inverse")
        return value

    def __float__(self) -> float:
        if self.fraction is None:
            return float(self.at(113))
        try:
            # Python rounds a quotient of whole numbers correctly.
            return self.fraction.numerator / self.fraction.denominator
        except OverflowError:
            return math.inf if self.fraction > 0 else -math.inf

    def __reduce__(self) -> tuple[Any, ...]:
        # A worker gets the text, since a closure such as `over` cannot be pickled.
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
        """Equality of values for two rationals, else of texts."""
        if not isinstance(other, Exact):
            return NotImplemented
        return self.key == other.key

    def __hash__(self) -> int:
        return self._hash

    @property
    def key(self) -> Fraction | str:
        """The value of a rational, else the text: equal keys belong to equal numbers only."""
        return self.text if self.fraction is None else self.fraction

    @property
    def shortest(self) -> Exact:
        """The same number: a rational one with its shortest text, another as it is."""
        return self if self.fraction is None else rational(self.fraction, None)

    @functools.cached_property
    def _hash(self) -> int:
        # Numbers are keys of caches, and the hash of a Fraction takes a modular power each time.
        return hash(self.key)


def exact(value: Any) -> Exact:
    """Take a number exactly: an int, Fraction, Decimal, float, NumPy number, or a text.

    A text may hold decimals (``"1e-6"``), ``pi``, ``+ - * / **``, brackets and the functions sqrt,
    sin, cos, tan, atan. ExactError is raised if the value is not finite, not real, or not readable.
    """
    if isinstance(value, Exact):
        return value
    # An array without axes holds one number or text; what is masked stays so.
    if getattr(value, "ndim", None) == 0 and not isinstance(value, str):
        value = value[()]
    if isinstance(value, str):
        return _read(value)
    # A bool is an int in Python, but nobody means it as a number.
    if isinstance(value, bool):
        raise ExactError(f"{named(value)} is not a real number")
    # NumPy's integers have no as_integer_ratio.
    if isinstance(value, numbers.Integral) and hasattr(value, "__index__"):
        value = int(value)
    if not hasattr(value, "as_integer_ratio"):
        raise ExactError(f"{named(value)} is not a real number")
    # A Decimal may hold 1e999999 in a few bytes; its ratio cannot.
    if isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) > MOST_EXPONENT:
        raise ExactError(f"{value}: exponents go to {MOST_EXPONENT}")
    try:
        taken = Fraction(*map(int, value.as_integer_ratio()))
    except (ValueError, OverflowError):
        raise ExactError(f"{named(value)} is not finite") from None
    # The class `float` itself has the method too, but without a number to call it on.
    except TypeError:
        raise ExactError(f"{named(value)} is not a real number") from None
    return rational(taken, None)


@functools.lru_cache(maxsize=1024)
def _read(text: str) -> Exact:
    """Read a text; kept, since the members of a sweep share nearly all of their numbers."""
    if len(text) > MOST_TEXT:
        raise ExactError(f"a number of {len(text)} characters: at most {MOST_TEXT} are read")
    source = text.strip()
    # Python would skip everything behind a #; YAML takes it for a comment only behind a blank.
    if "#" in source:
        raise ExactError(f"{shown(text)!r} is not a number: a comment begins with a blank and a #")
    try:
        # Only Python's grammar is used. Nothing is evaluated, and `_node` has a list of what it
        # accepts.
        tree = parsed(source, "eval")
        if sum(isinstance(node, ast.Call) for node in ast.walk(tree)) > MOST_CALLS:
            raise ExactError(f"more than {MOST_CALLS} functions in a number")
        read = _node(tree.body, source)
    except ExactError as error:
        before = "" if str(error).startswith(repr(source)) else f"{shown(text)!r}: "
        raise ExactError(f"{before}{shown(str(error))}") from None
    # Python's parser gives up in all these ways, on nested brackets for one.
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExactError(f"{shown(text)!r} is not a number or an expression of numbers") from None
    return Exact(source, read.fraction, read.over)


def _node(node: ast.expr, source: str) -> Exact:
    """The number of a node of the syntax tree of a text."""
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            # The digits as written, not the double that Python's parser has made of them.
            part = ast.get_source_segment(source, node) or ""
            _, _, exponent = part.lower().partition("e")
            # The parser allows 1e999999999, whose exact value would fill the memory.
            if exponent and abs(int(exponent)) > MOST_EXPONENT:
                raise ExactError(f"{part}: exponents go to {MOST_EXPONENT}")
            return rational(Fraction(part), part)
        case ast.Name(id="pi"):
            return PI
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
            one = exact(-1 if isinstance(sign, ast.USub) else 1)
            return combine("*", one, _node(inner, source))
        case ast.BinOp(left=left, op=between, right=right) if type(between) in SIGNS:
            return combine(SIGNS[type(between)], _node(left, source), _node(right, source))
        case ast.Call(func=ast.Name(id=name), args=[inner], keywords=[]) if name in FUNCTIONS:
            return function(name, _node(inner, source))
    part, known = ast.get_source_segment(source, node) or source, ", ".join(FUNCTIONS)
    raise ExactError(f"{shown(part)!r} is not understood (known: numbers, pi, + - * / **, {known})")


def function(name: str, x: Exact) -> Exact:
    """Make the exact number ``name(x)``, for one of sqrt, sin, cos, tan, atan."""
    text = f"{name}({x})"
    if name == "sqrt":
        if _near(x) < 0:
            raise ExactError(f"{text} is not real")
        if x.fraction is not None:
            # sqrt(4) is the rational 2: bodies that are equal must be found equal.
            root = Fraction(*map(math.isqrt, x.fraction.as_integer_ratio()))
            if root**2 == x.fraction:
                return rational(root, text)

    def over(m: Any) -> Any:
        value = x.over(m)
        # Reducing a large angle to one turn takes as many bits as it has before the point. Numbers
        # of other kinds, such as balls, tell by themselves what they lose.
        turns = name in ("sin", "cos", "tan") and hasattr(value, "_mpf_")
        if turns and _magnitude(value) > MOST_BITS:
            raise ExactError(f"an angle beyond 2**{MOST_BITS}: {shown(x.text)}")
        return getattr(m, name)(value)

    return Exact(text, None, over)


def _magnitude(value: Any) -> int:
    """Binary exponent of an mpmath number; 0 for 0 and for numbers that are not finite."""
    # The value is +-mantissa 2^exponent, with a mantissa of so many bits.
    _, mantissa, exponent, bits = value._mpf_
    return int(exponent + bits) if mantissa else 0


def rational(value: Fraction, text: str | None) -> Exact:
    """Make a rational number, by default with the shortest text that gives it exactly."""
    p, q = value.numerator, value.denominator
    if _size(value) > MOST_SIZE:
        raise ExactError(f"a number with more than {MOST_SIZE} bits")
    if text is None or len(text) > MOST_TEXT:
        text = _shortest(value)
    return Exact(text, value, lambda m: m.mpf(p) / q)


def _shortest(value: Fraction) -> str:
    """Shortest text of a rational: a double's decimal if it is exact, else a quotient."""
    short = repr(float(value)) if abs(value) < 1e15 else ""
    twos = (value.denominator & -value.denominator).bit_length() - 1
    decimals = short.partition(".")[2]
    if decimals.isdigit() and len(decimals) < twos:
        # A denominator with n factors 2 needs n decimals at least, so that these cannot be exact.
        # This spares most doubles the comparison below.
        short = ""
    # repr gives the shortest digits of the double, which may not be those of this number.
    if short and Fraction(short) == value:
        return short.removesuffix(".0")
    try:
        return str(value)
    except ValueError:
        raise ExactError("a number with more digits than can be written") from None


# The plus rounds mpmath's constant, which has no precision of its own, to the context's precision.
PI = Exact("pi", None, lambda m: +m.pi)


def combine(sign: str, a: Exact, b: Exact) -> Exact:
    """Make the exact number ``a sign b``, for one of ``+ - * / **``."""
    text = f"{_bracketed(a)} {sign} {_bracketed(b)}"
    if sign == "**":
        return _power(text, a, b.fraction)
    if sign == "/" and not _near(b):
        raise ExactError(f"{text}: division by zero")
    # A product with 0 is 0 without evaluation, which could not tell it from a tiny number.
    if sign == "*" and 0 in (a.fraction, b.fraction):
        return rational(Fraction(0), text)
    compute = COMPUTE[sign]
    if a.fraction is not None and b.fraction is not None:
        return rational(compute(a.fraction, b.fraction), text)
    return Exact(text, None, lambda m: compute(a.over(m), b.over(m)))


def _power(text: str, a: Exact, power: Fraction | None) -> Exact:
    if power is None or power.denominator != 1 or abs(power) > 64:
        raise ExactError(f"{text}: the power must be a whole number of at most 64")
    n = int(power)
    if n < 0 and not _near(a):
        raise ExactError(f"{text}: division by zero")
    if a.fraction is None:
        return Exact(text, None, lambda m: a.over(m) ** n)
    if abs(n) * _size(a.fraction) > MOST_SIZE:
        raise ExactError(f"{text}: a number with more than {MOST_SIZE} bits")
    return rational(a.fraction**n, text)


def _near(x: Exact) -> Any:
    """The value of a rational, else a number of the same sign; 0 for 0."""
    return x.at(53) if x.fraction is None else x.fraction


def _bracketed(x: Exact) -> str:
    """Text of x as an operand, in brackets unless it is a single word or unsigned number."""
    return x.text if x.text.replace(".", "").isalnum() else f"({x.text})"


def _size(x: Fraction) -> int:
    """Bits of the numerator or the denominator, whichever has more."""
    return max(x.numerator.bit_length(), x.denominator.bit_length())
