"""A field traced: the arithmetic operations that give the rates of a state, in their order.

A field is a function of generic numbers that uses ``+ - * /`` only. Called with symbols, it leaves
a list of operations, which `taylor_step` writes as machine code and `bigint` does in integers.
Plain numbers become parameters, so that fields that differ only in them share their code; only 0
and 1 simplify an operation. Products are not reordered: with parameters moved in front of them
|gamma| would drift in proportion to the time in doubles, by 4e-18 a rotation of Fig. 4's orbits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers import Scalar


class Operation(NamedTuple):
    """A line: an operation on the results of earlier lines, which are given by their numbers."""

    name: str
    """`component`, `parameter`, `plus`, `minus`, `times` or `divided`."""
    operands: tuple[int, ...]
    """Numbers of the lines operated on; of a component or a parameter its own index."""


class TracedField(NamedTuple):
    """A traced field, whose plain numbers are parameters."""

    lines: tuple[Operation, ...]
    rates: tuple[int, ...]
    """Numbers of the lines that give the components' rates."""

    @property
    def sums(self) -> tuple[int, ...]:
        """Products and quotients of two series, whose Taylor coefficients are sums."""
        return tuple(i for i, line in enumerate(self.lines) if self._is_sum(line))

    def _is_sum(self, line: Operation) -> bool:
        # A product with a parameter, or the quotient by one, is linear: no sum. The numerator of a
        # quotient does not matter.
        factors = {"times": line.operands, "divided": line.operands[1:]}.get(line.name, ())
        return bool(factors) and all(self.lines[i].name != "parameter" for i in factors)


def trace(field: Callable[[Any], Any], size: int) -> tuple[TracedField, tuple[float, ...]]:
    """Trace a field of `size` components; the values of its parameters come second."""
    tape = _Tape()
    found = field([tape.write("component", i) for i in range(size)])
    rates = tuple(tape.symbol(x).line for x in found)
    return TracedField(tuple(tape.lines), rates), tuple(tape.parameters)


class _Tape:
    """Lines as they are written, none of them twice."""

    def __init__(self) -> None:
        # A dict keeps the order of insertion, so that it is the list of the lines as well.
        self.lines: dict[Operation, int] = {}
        self.parameters: list[float] = []

    def write(self, name: str, *operands: int) -> Symbol:
        line = Operation(name, operands)
        return Symbol(self, self.lines.setdefault(line, len(self.lines)))

    def symbol(self, x: Scalar) -> Symbol:
        """A symbol for a plain number; a symbol stays as it is."""
        if isinstance(x, Symbol):
            return x
        # Equal numbers do not share a parameter: the code must not depend on their values.
        self.parameters.append(float(x))
        return self.write("parameter", len(self.parameters) - 1)


class Symbol:
    """The result of a line, which stands for a number in the field's operations."""

    # So `np.float64(2) * symbol` calls __rmul__ here, rather than NumPy's own multiplication.
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

    def __neg__(self) -> Any:
        return self * -1.0

    def __mul__(self, other: Scalar) -> Any:
        if _is(other, 0):
            return 0.0
        return self if _is(other, 1) else self._with("times", other)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Any:
        # The reciprocal of a plain number is one too, and a product costs a tenth of a quotient.
        return self._with("divided", other) if isinstance(other, Symbol) else self * (1 / other)

    def __rtruediv__(self, other: Scalar) -> Symbol:
        return self._with("divided", other, turned=True)


def _is(x: Scalar, number: int) -> bool:
    return not isinstance(x, Symbol) and bool(x == number)


def _aligned(state: Sequence[Symbol]) -> Any:
    # Symbols for all coefficients: numbers that happen to be 0 or 1 would change the lines.
    numbers = (state[0].tape.symbol(0.0) for _ in AlignedCoefficients._fields)
    return aligned(state, AlignedCoefficients(*numbers))


ALIGNED, _ = trace(_aligned, 6)
"""The aligned field, whose parameters are `AlignedCoefficients` in their order."""
