"""A field as flat Python: the lines that a hand would write for speed, from those that exist.

The field is called once with symbols that write down what is done to them. Each result is a
local variable, used again where it occurs again; what is multiplied by zero is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any


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

    def __add__(self, other: Any) -> Any:
        return self._with(self, "+", other)

    def __radd__(self, other: Any) -> Any:
        return self._with(other, "+", self)

    def __sub__(self, other: Any) -> Any:
        return self._with(self, "-", other)

    def __rsub__(self, other: Any) -> Any:
        return self._with(other, "-", self)

    def __mul__(self, other: Any) -> Any:
        return self._with(self, "*", other)

    def __rmul__(self, other: Any) -> Any:
        return self._with(other, "*", self)

    def __truediv__(self, other: Any) -> Any:
        return self._with(self, "/", other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with(other, "/", self)

    def __neg__(self) -> Any:
        return self.script.symbol(f"-{self.name}")


def source(field: Callable[[Any], Any], size: int) -> str:
    """The text of a function ``rates(t, y)`` that does what `field` does.

    Parameters
    ----------
    field : callable
        ``field(state)`` gives the derivatives by ``+ - * /`` alone.
    size : int
        The number of components.
    """
    script = _Script()
    names = [f"y{i}" for i in range(size)]
    found = field([_Symbol(script, name) for name in names])
    head = ["def rates(t, y):", f"    {', '.join(names)} = y"]
    return "\n".join([*head, *script.lines, f"    return [{', '.join(map(_text, found))}]"])


def flat(field: Callable[[Any], Any], size: int) -> Callable[[float, Any], list[Any]]:
    """The function ``rates(t, y)`` of :func:`source`: of 6 floats, or of 6 arrays."""
    room: dict[str, Any] = {}
    exec(compile(source(field, size), "<field>", "exec"), room)
    made: Callable[[float, Any], list[Any]] = room["rates"]
    return made


def _is(x: Any, value: int) -> bool:
    return not isinstance(x, _Symbol) and x == value


def _text(x: Any) -> str:
    """A variable's name, or a number."""
    if isinstance(x, _Symbol):
        return x.name
    if not math.isfinite(x):
        raise ValueError(f"a field has no number {x}")
    return repr(float(x))
