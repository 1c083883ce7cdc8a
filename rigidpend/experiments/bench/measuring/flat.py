"""A field as flat Python: the lines that a hand would write for speed, from those that exist.

The field is called once with symbols that write down what is done to them. Each result is a
local variable, used again where it occurs again; what is multiplied by zero is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rigidpend.numbers.generic import Scalar


class _Script:
    """The lines written so far; equal expressions share a variable."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.known: dict[str, _Symbol] = {}

    def symbol(self, expression: str) -> _Symbol:
        if expression not in self.known:
            name = f"x{len(self.lines)}"
            self.lines.append(f"    {name} = {expression}")
            self.known[expression] = _Symbol(self, name)
        return self.known[expression]


class _Symbol:
    """A variable of the script."""

    def __init__(self, script: _Script, name: str) -> None:
        self.script, self.name = script, name

    def _with(self, left: Any, sign: str, right: Any) -> Any:
        if sign == "*" and (_is(left, 0) or _is(right, 0)):
            return 0.0
        if (sign == "+" and _is(left, 0)) or (sign == "*" and _is(left, 1)):
            return right
        if (sign in "+-" and _is(right, 0)) or (sign in "*/" and _is(right, 1)):
            return left
        return self.script.symbol(f"{_text(left)} {sign} {_text(right)}")

    def __add__(self, other: Scalar) -> Any:
        return self._with(self, "+", other)

    def __radd__(self, other: Scalar) -> Any:
        return self._with(other, "+", self)

    def __sub__(self, other: Scalar) -> Any:
        return self._with(self, "-", other)

    def __rsub__(self, other: Scalar) -> Any:
        return self._with(other, "-", self)

    def __mul__(self, other: Scalar) -> Any:
        return self._with(self, "*", other)

    def __rmul__(self, other: Scalar) -> Any:
        return self._with(other, "*", self)

    def __truediv__(self, other: Scalar) -> Any:
        return self._with(self, "/", other)

    def __rtruediv__(self, other: Scalar) -> Any:
        return self._with(other, "/", self)

    def __neg__(self) -> Any:
        return self.script.symbol(f"-{self.name}")


def source(field: Callable[[Any], Any], size: int) -> str:
    """Write a function ``rates(t, y)`` that does what `field` does.

    Parameters
    ----------
    field : callable
        ``field(state)`` gives the derivatives by ``+ - * /`` alone.
    size : int
        The number of components.
    """
    script, found = _written(field, size)
    head = ["def rates(t, y):", f"    {', '.join(f'y{i}' for i in range(size))} = y"]
    return "\n".join([*head, *script.lines, f"    return [{', '.join(found)}]"])


def source_into(field: Callable[[Any], Any], size: int, arguments: str) -> str:
    """Write a function that puts the derivatives into an array, for compilers and C interfaces.

    Parameters
    ----------
    field, size
        As for :func:`source`.
    arguments : str
        The names of its arguments in their order; ``y`` and ``dy`` are the arrays.
    """
    script, found = _written(field, size)
    lines = [f"def rates({arguments}):"]
    lines += [f"    y{i} = y[{i}]" for i in range(size)] + script.lines
    return "\n".join([*lines, *(f"    dy[{i}] = {x}" for i, x in enumerate(found))])


def _written(field: Callable[[Any], Any], size: int) -> tuple[_Script, list[str]]:
    """The lines, and the names of the results."""
    script = _Script()
    found = field([_Symbol(script, f"y{i}") for i in range(size)])
    return script, [_text(x) for x in found]


def flat(field: Callable[[Any], Any], size: int) -> Callable[[float, Any], list[Any]]:
    """The function ``rates(t, y)`` of :func:`source`: of 6 floats, or of 6 arrays."""
    made: Callable[[float, Any], list[Any]] = executed(source(field, size))
    return made


def executed(text: str) -> Any:
    """The function ``rates`` of a text."""
    room: dict[str, Any] = {}
    exec(compile(text, "<field>", "exec"), room)
    return room["rates"]


def _is(x: Scalar, value: int) -> bool:
    return not isinstance(x, _Symbol) and x == value


def _text(x: Scalar) -> str:
    """A variable's name, or a number."""
    if isinstance(x, _Symbol):
        return x.name
    if not math.isfinite(x):
        raise ValueError(f"a field has no number {x}")
    return repr(float(x))
