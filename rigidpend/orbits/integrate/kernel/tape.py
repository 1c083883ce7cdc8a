"""A field's Python taken down: the operations of a state's derivatives, in their order.

A field is a function of generic numbers. Called with symbols it leaves behind what it does with
them, for `taylor_step` to write as machine code and `bigint` to do in integers. Plain numbers
become parameters, so that fields that differ by these alone share their code; 0 and 1 alone are
taken into account. Products stay as they are written: with parameters moved in front of them
|gamma| drifts in proportion to the time in doubles, by 4e-18 a rotation of Fig. 4's orbits.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Scalar

FUNCTIONS = ("sin", "cos", "exp", "sqrt")
"""Elementary functions of symbols."""
PARTNERS = {"sin": "cos", "cos": "sin", "exp": "exp"}
"""For each function the one whose series its rate has as a factor."""


class Operation(NamedTuple):
    """An operation on the results of earlier lines, named by their numbers."""

    name: str
    """`component`, `parameter`, `plus`, `minus`, `times`, `divided` or one of `FUNCTIONS`."""
    operands: tuple[int, ...]
    """Numbers of the lines; for a component or a parameter its own number."""


class TracedField(NamedTuple):
    """A field taken down, whose numbers are parameters."""

    lines: tuple[Operation, ...]
    rates: tuple[int, ...]
    """Lines of the derivatives."""

    @property
    def functions(self) -> tuple[str, ...]:
        """Elementary functions that it calls."""
        used = {line.name for line in self.lines}
        return tuple(name for name in FUNCTIONS if name in used)

    @property
    def sums(self) -> tuple[int, ...]:
        """Lines whose Taylor coefficients are sums: not those with a plain number as a factor."""
        return tuple(i for i, line in enumerate(self.lines) if self._is_sum(line))

    def partner(self, i: int) -> int:
        """The line whose series the rate of a function's series has as a factor."""
        operation, operands = self.lines[i]
        return self.lines.index(Operation(PARTNERS[operation], operands))

    def _is_sum(self, line: Operation) -> bool:
        operation, operands = line
        if operation not in ("times", "divided", *FUNCTIONS):
            return False
        factors = operands[1:] if operation == "divided" else operands
        return all(self.lines[i].name != "parameter" for i in factors)


def trace(field: Callable[[Any, Any], Any], size: int) -> tuple[TracedField, tuple[float, ...]]:
    """Take down a field of `size` components, and the parameters in it.

    ``field(state, m)`` gives the derivatives by ``+ - * /``, powers with whole exponents and the
    functions `FUNCTIONS` of the namespace `m`; another one is an AttributeError.
    """
    tape = _Tape()
    found = tape.taken(field([tape.write("component", i) for i in range(size)], _Functions()))
    return found, tuple(tape.parameters)


class _Tape:
    """Lines as they are written; what was written before is not written again."""

    def __init__(self) -> None:
        self.lines: dict[Operation, int] = {}
        self.parameters: list[float] = []

    def write(self, name: str, *operands: int) -> Symbol:
        line = Operation(name, operands)
        return Symbol(self, self.lines.setdefault(line, len(self.lines)))

    def taken(self, rates: Sequence[Scalar]) -> TracedField:
        """The field that has these derivatives, without the lines that none of them needs."""
        ends, lines = [self.symbol(x).line for x in rates], list(self.lines)
        needed = {i for i, line in enumerate(lines) if line.name == "component"}
        left = list(ends)
        while left:
            i = left.pop()
            if i not in needed:
                needed.add(i)
                left += [] if lines[i].name == "parameter" else lines[i].operands
                if lines[i].name in PARTNERS:
                    left.append(self.lines[lines[i]._replace(name=PARTNERS[lines[i].name])])
        place = {i: k for k, i in enumerate(sorted(needed))}
        kept = [
            line
            if (line := lines[i]).name in ("component", "parameter")
            else Operation(line.name, tuple(place[j] for j in line.operands))
            for i in sorted(needed)
        ]
        return TracedField(tuple(kept), tuple(place[i] for i in ends))

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


def _aligned(state: Sequence[Symbol], _: Any) -> Any:
    numbers = (state[0].tape.symbol(0.0) for _ in AlignedCoefficients._fields)
    return aligned(state, AlignedCoefficients(*numbers))


ALIGNED, _ = trace(_aligned, 6)
"""The aligned field, of which `AlignedCoefficients` are the parameters."""
