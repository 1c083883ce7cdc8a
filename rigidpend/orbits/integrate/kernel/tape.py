"""A field's Python taken down: the operations of a state's derivatives, in their order.

A field is a function of generic numbers, by ``+ - * /``. Called with symbols it leaves behind what
it does with them, for `taylor_step` to write as machine code and `bigint` to do in integers. Plain
numbers become parameters, so that fields that differ by these alone share their code; 0 and 1 alone
are taken into account. Products stay as they are written: with parameters moved in front of them
|gamma| drifts in proportion to the time in doubles, by 4e-18 a rotation of Fig. 4's orbits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Scalar


class Operation(NamedTuple):
    """An operation on the results of earlier lines, named by their numbers."""

    name: str
    """`component`, `parameter`, `plus`, `minus`, `times` or `divided`."""
    operands: tuple[int, ...]
    """Numbers of the lines; for a component or a parameter its own number."""


class TracedField(NamedTuple):
    """A field taken down, whose numbers are parameters."""

    lines: tuple[Operation, ...]
    rates: tuple[int, ...]
    """Lines of the derivatives."""

    @property
    def sums(self) -> tuple[int, ...]:
        """Lines whose Taylor coefficients are sums: not those with a plain number as a factor."""
        return tuple(i for i, line in enumerate(self.lines) if self._is_sum(line))

    def _is_sum(self, line: Operation) -> bool:
        factors = {"times": line.operands, "divided": line.operands[1:]}.get(line.name, ())
        return bool(factors) and all(self.lines[i].name != "parameter" for i in factors)


def trace(field: Callable[[Any], Any], size: int) -> tuple[TracedField, tuple[float, ...]]:
    """Take down a field of `size` components, and the parameters in it."""
    tape = _Tape()
    found = field([tape.write("component", i) for i in range(size)])
    rates = tuple(tape.symbol(x).line for x in found)
    return TracedField(tuple(tape.lines), rates), tuple(tape.parameters)


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

    def __neg__(self) -> Any:
        return self * -1.0

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


def _is(x: Scalar, number: int) -> bool:
    return not isinstance(x, Symbol) and bool(x == number)


def _aligned(state: Sequence[Symbol]) -> Any:
    numbers = (state[0].tape.symbol(0.0) for _ in AlignedCoefficients._fields)
    return aligned(state, AlignedCoefficients(*numbers))


ALIGNED, _ = trace(_aligned, 6)
"""The aligned field, of which `AlignedCoefficients` are the parameters."""
