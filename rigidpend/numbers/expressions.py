"""Texts read as exact numbers: decimals, pi, arithmetic and a few functions."""

from __future__ import annotations

import ast
from fractions import Fraction

from rigidpend.numbers.exact import (
    FUNCTIONS,
    MAX_CALLS,
    MAX_EXPONENT,
    MAX_TEXT,
    PI,
    Exact,
    ExactError,
    combine,
    exact,
    function,
    rational,
    shown,
)

_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}


def parse(text: str) -> Exact:
    """The number that a text says: see :func:`rigidpend.numbers.exact.exact`.

    Raises
    ------
    ExactError
        It says none, or one that is too large to be kept exactly.
    """
    if len(text) > MAX_TEXT:
        raise ExactError(f"a number of {len(text)} characters: at most {MAX_TEXT} are read")
    source = text.strip()
    try:
        tree = ast.parse(source, mode="eval")
        if sum(isinstance(node, ast.Call) for node in ast.walk(tree)) > MAX_CALLS:
            raise ExactError(f"more than {MAX_CALLS} functions in a number")
        value = _read(tree.body, source)
    except ExactError as error:
        before = "" if str(error).startswith(repr(source)) else f"{shown(text)!r}: "
        raise ExactError(f"{before}{shown(str(error))}") from None
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExactError(f"{shown(text)!r} is not a number or an expression of numbers") from None
    return Exact(source, value.fraction, value._evaluate)


def _read(node: ast.expr, source: str) -> Exact:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return _read_number(ast.get_source_segment(source, node) or "")
    if isinstance(node, ast.Name) and node.id == "pi":
        return PI
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        sign = -1 if isinstance(node.op, ast.USub) else 1
        return combine("*", exact(sign), _read(node.operand, source))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        left, right = _read(node.left, source), _read(node.right, source)
        return combine(_OPERATORS[type(node.op)], left, right)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        if node.func.id in FUNCTIONS and len(node.args) == 1 and not node.keywords:
            return function(node.func.id, _read(node.args[0], source))
    part = ast.get_source_segment(source, node) or source
    known = ", ".join(FUNCTIONS)
    raise ExactError(f"{shown(part)!r} is not understood (known: numbers, pi, + - * / **, {known})")


def _read_number(digits: str) -> Exact:
    _, _, exponent = digits.lower().partition("e")
    if exponent and abs(int(exponent)) > MAX_EXPONENT:
        raise ExactError(f"{digits}: exponents go to {MAX_EXPONENT}")
    return rational(Fraction(digits), digits)
