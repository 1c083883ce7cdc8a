"""Mutants: where code can be changed, how, and which changes no result could show."""

from __future__ import annotations

import ast
import copy
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

ROOT = Path(__file__).resolve().parents[1]
EQUIVALENT = ROOT / "tests" / "equivalent_mutants.yaml"
"""Mutants that change nothing that a result could show, each with the reason."""

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}


class Mutant(NamedTuple):
    """One change of one place."""

    path: str
    line: int
    number: int
    """Of the place in the file, in the order of :func:`places`."""
    said: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}#{self.number}: {self.said}"


def changed(node: ast.AST) -> tuple[ast.AST, str] | None:
    """A mutated copy of a node with what changed in it, if it is of a kind that is mutated."""
    other = copy.deepcopy(node)
    match other:
        case ast.Compare(ops=[op, *_]) if type(op) in COMPARISONS:
            other.ops[0] = COMPARISONS[type(op)]()
        case ast.BinOp(op=op) if type(op) in OPERATORS:
            other.op = OPERATORS[type(op)]()
        case ast.AugAssign(op=op) if type(op) in OPERATORS:
            other.op = OPERATORS[type(op)]()
        case ast.BoolOp():
            other.op = ast.Or() if isinstance(other.op, ast.And) else ast.And()
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            other = other.operand
        case ast.Constant(value=bool() as value):
            other.value = not value
        case ast.Constant(value=int() | float() as value):
            other.value = value + 1 if isinstance(value, int) else 2 * value + (value == 0)
        case ast.IfExp() | ast.If() | ast.While():
            other.test = ast.UnaryOp(ast.Not(), other.test)
        case ast.Expr(value=ast.Call()):
            other.value = ast.Constant(None)
        case ast.Return(value=ast.expr()) if ast.unparse(other) != "return None":
            other.value = ast.Constant(None)
        case _:
            return None
    return other, f"{_shown(node)}  ->  {_shown(other)}"


def _shown(node: ast.AST) -> str:
    first, *rest = ast.unparse(ast.fix_missing_locations(copy.deepcopy(node))).splitlines()
    return first[:70] + (" ..." if rest or len(first) > 70 else "")


def places(tree: ast.Module) -> Iterator[tuple[ast.AST, str, int | None, ast.AST]]:
    """Every place that can be mutated: its holder, field, index, and the node there."""
    skipped = set()
    for holder in ast.walk(tree):
        if isinstance(holder, ast.AnnAssign | ast.arg) and holder.annotation:
            skipped |= set(ast.walk(holder.annotation))
        if isinstance(holder, ast.FunctionDef) and holder.returns:
            skipped |= set(ast.walk(holder.returns))
        if isinstance(holder, ast.If) and ast.unparse(holder.test) == "TYPE_CHECKING":
            skipped |= set(ast.walk(holder))
    for holder in ast.walk(tree):
        for field, value in ast.iter_fields(holder):
            members = list(enumerate(value)) if isinstance(value, list) else [(None, value)]
            for index, node in members:
                if isinstance(node, ast.AST) and node not in skipped and changed(node):
                    yield holder, field, index, node


@functools.cache
def mutants(path: str) -> list[Mutant]:
    """All mutants of a file."""
    tree = ast.parse((ROOT / path).read_text())
    made = []
    for number, (*_, node) in enumerate(places(tree)):
        change = changed(node)
        assert change
        made.append(Mutant(path, getattr(node, "lineno", 0), number, change[1]))
    return made


def source(mutant: Mutant) -> str:
    """The file's text with the mutant in it."""
    tree = ast.parse((ROOT / mutant.path).read_text())
    holder, field, index, node = list(places(tree))[mutant.number]
    change = changed(node)
    assert change
    if index is None:
        setattr(holder, field, change[0])
    else:
        getattr(holder, field)[index] = change[0]
    return ast.unparse(ast.fix_missing_locations(tree))


class Entry(NamedTuple):
    """A declared mutant, found by the text of its line, for numbers of lines move."""

    path: str
    line: str
    change: str
    reason: str
    nth: int = 0
    """Which one, from 1, where several of the file's mutants are of this line and change."""

    def fits(self) -> list[Mutant]:
        """The mutants of the present code that it declares."""
        lines = (ROOT / self.path).read_text().splitlines()
        alike = sorted(
            x
            for x in mutants(self.path)
            if x.said == self.change and lines[x.line - 1].strip() == self.line
        )
        return alike[self.nth - 1 : self.nth] if self.nth else alike


def equivalent(declared: Path = EQUIVALENT) -> dict[Mutant, str]:
    """The mutants that are declared to be equivalent, with the reasons.

    Raises
    ------
    ValueError
        If an entry fits none of the code's mutants, or several.
    """
    reasons: dict[Mutant, str] = {}
    for entry in (Entry(**one) for one in yaml.safe_load(declared.read_text())):
        found = entry.fits()
        if len(found) != 1:
            said = f"{entry.path}: `{entry.line}`, {entry.change}"
            raise ValueError(f"{declared.name} fits {len(found)} mutants, not one: {said}")
        reasons[found[0]] = entry.reason
    return reasons
