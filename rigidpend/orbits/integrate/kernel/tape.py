"""A field's Python taken down: the operations of a state's derivatives, in their order.

A field is a function of generic numbers. Called with symbols it leaves behind what it does with
them, for `traced_field` to write as recurrences. Plain numbers become parameters, so that fields
that differ by these alone share their code; 0 and 1 alone are taken into account.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

from rigidpend.numbers.generic import Scalar

FUNCTIONS = ("sin", "cos", "exp", "sqrt")
"""Elementary functions of symbols."""


class Operation(NamedTuple):
    """An operation on the results of earlier lines, named by their numbers."""

    name: str
    """`component`, `parameter`, `plus`, `minus`, `times`, `divided` or one of `FUNCTIONS`."""
    operands: tuple[int, ...]
    """Numbers of the lines; for a component or a parameter its own number."""


class Traced(NamedTuple):
    """A field taken down."""

    lines: tuple[Operation, ...]
    rates: tuple[int, ...]
    """Lines of the derivatives."""
    parameters: tuple[float, ...]


def trace(field: Callable[[Any, Any], Any], size: int) -> Traced:
    """Take down a field of `size` components.

    Parameters
    ----------
    field : callable
        ``field(state, m)`` gives the derivatives by ``+ - * /``, powers with whole exponents and
        the functions `FUNCTIONS` of the namespace `m`.
    size : int

    Raises
    ------
    AttributeError
        The field asks for another function.
    """
    tape = _Tape()
    state = [tape.write("component", i) for i in range(size)]
    rates = tuple(tape.symbol(x).line for x in field(state, _Functions()))
    return Traced(tuple(tape.lines), rates, tuple(tape.parameters))


class _Tape:
    """Lines as they are written; what was written before is not written again."""

    def __init__(self) -> None:
        self.lines: dict[Operation, int] = {}
        self.parameters: list[float] = []

    def write(self, name: str, *operands: int) -> Symbol:
        line = Operation(name, operands)
        return Symbol(self, self.lines.setdefault(line, len(self.lines)))

    def symbol(self, x: Scalar) -> Symbol:
        """A symbol for a number, or the symbol itself."""
        if isinstance(x, Symbol):
            return x
        self.parameters.append(float(x))
        return self.write("parameter", len(self.parameters) - 1)


class Symbol:
    """The result of a line, with which a field goes on to compute."""

    # NumPy's numbers leave an operation with a symbol to the symbol.
    __array_ufunc__ = None
    __slots__ = ("line", "tape")

    def __init__(self, tape: _Tape, line: int) -> None:
        self.tape, self.line = tape, line

    def _with(self, name: str, other: Scalar, turned: bool = False) -> Symbol:
        operands = self.line, self.tape.symbol(other).line
        return self.tape.write(name, *(operands[::-1] if turned else operands))

    def __add__(self, other: Scalar) -> Symbol:
        return self if _is(other, 0) else self._with("plus", other)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Symbol:
        return self if _is(other, 0) else self._with("minus", other)

    def __rsub__(self, other: Scalar) -> Symbol:
        return self._with("minus", other, turned=True)

    def __neg__(self) -> Symbol:
        return self._with("times", -1.0)

    def __mul__(self, other: Scalar) -> Any:
        if _is(other, 0):
            return 0.0
        return self if _is(other, 1) else self._with("times", other)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Any:
        # The reciprocal of a parameter is one too, and a product costs a tenth of a quotient.
        return self._with("divided", other) if isinstance(other, Symbol) else self * (1 / other)

    def __rtruediv__(self, other: Scalar) -> Symbol:
        return self._with("divided", other, turned=True)

    def __pow__(self, exponent: int) -> Any:
        """Product of so many factors, a whole number."""
        if operator.index(exponent) == 0:
            return 1.0
        if exponent < 0:
            return 1.0 / self**-exponent
        half = self ** (exponent // 2)
        return half * half * (self if exponent % 2 else 1)


def _is(x: Scalar, number: int) -> bool:
    return not isinstance(x, Symbol) and bool(x == number)


class _Functions:
    """The namespace of a field: functions of symbols, math's of plain numbers."""

    pi = math.pi

    def __getattr__(self, name: str) -> Callable[[Any], Any]:
        if name not in FUNCTIONS:
            raise AttributeError(f"a field that is integrated must do without {name}")

        def applied(x: Scalar) -> Any:
            if not isinstance(x, Symbol):
                return getattr(math, name)(x)
            if name in ("sin", "cos"):
                # The recurrence of each needs the other.
                for both in ("sin", "cos"):
                    x.tape.write(both, x.line)
            return x.tape.write(name, x.line)

        return applied
