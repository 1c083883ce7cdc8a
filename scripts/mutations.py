"""Mutants: where code can be changed, how, and which changes no result could show.

Beside what mutation tools change (comparisons, operators, numbers, conditions, what is returned,
calls that are left out) these are slips of numerical code: a bound that is scaled, a guard that
never fires, a key that lacks a part, a minimum for a maximum, NaN that is taken for a number.
"""

import ast
import copy
import functools
import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

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
ORDERS = ast.Lt | ast.LtE | ast.Gt | ast.GtE
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
PAIRS = [("min", "max"), ("minimum", "maximum"), ("fmin", "fmax"), ("nanmin", "nanmax")]
PAIRS += [("argmin", "argmax"), ("floor", "ceil"), ("any", "all")]
SWAPPED = dict(PAIRS) | {b: a for a, b in PAIRS}
"""Functions and methods by the one that a slip takes for it."""
NUMBERS = {"isnan": "&", "isfinite": "|"}
"""What asks whether a number is one, with what makes its answer that all are."""
SCALES = (0.5, 0.99)
"""A bound that is scaled by either is another one, and the second shows how sharp a test is."""
KEYS = re.compile(r"key|hash|digest|followed|parts?$|stated", re.IGNORECASE)
"""Names of functions and variables in which keys are put together."""


class Mutant(NamedTuple):
    """One change of one place."""

    path: str
    text: str
    """Of its line."""
    said: str
    nth: int
    """Which one, from 1, of those of this file whose text and change are the same."""
    line: int
    statement: str
    """The first line of its statement, by which coverage knows it."""
    place: int
    """Of the place in the file, in the order of :func:`places`."""
    which: int
    """Of the changes of the place."""

    def __str__(self) -> str:
        return f"{self.path}: {self.text}: {self.said}" + (f" #{self.nth}" if self.nth > 1 else "")


class Place(NamedTuple):
    """A node that can be changed, and what around it says how."""

    holder: Any
    field: str
    at: int | None
    node: Any
    line: int
    """Of the statement."""
    keyed: bool
    """Whether a key is put together here."""


def changes(node: ast.AST, *, keyed: bool = False) -> Iterator[ast.AST]:
    """Mutated copies of a node."""
    yield from _of_operator(node)
    yield from _of_number(node)
    yield from _of_statement(node)
    if isinstance(node, ast.Compare):
        yield from _of_comparison(node)
    if isinstance(node, ast.Call):
        yield from _of_call(node)
    if keyed:
        yield from _of_key(node)


def _of_comparison(node: ast.Compare) -> Iterator[ast.AST]:
    op, left, right = node.ops[0], node.left, node.comparators[0]
    if type(op) in COMPARISONS:
        yield _with(node, ops=[COMPARISONS[type(op)](), *node.ops[1:]])
    # Beside zero a factor changes nothing.
    if isinstance(op, ORDERS) and not any(map(_is_zero, (left, right))):
        for factor in SCALES:
            yield _with(node, left=_times(left, factor))
            yield _with(node, comparators=[_times(right, factor), *node.comparators[1:]])


def _of_operator(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in OPERATORS:
            yield _with(node, op=OPERATORS[type(op)]())
        case ast.BoolOp(op=op, values=values):
            yield _with(node, op=ast.Or() if isinstance(op, ast.And) else ast.And())
            for k in range(len(values)):
                yield _with(node, values=[*values[:k], *values[k + 1 :]])
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield operand


def _of_number(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Constant(value=bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(value=int() as value):
            yield ast.Constant(value + 1)
            if value > 1:
                yield ast.Constant(0)
        case ast.Constant(value=float() as value):
            yield ast.Constant(2 * value + (value == 0))
        case ast.Assign(targets=[ast.Name(id=name)], value=value) if name.isupper():
            if _number(value):
                yield _with(node, value=_times(value, 10))
                yield _with(node, value=_times(value, 0.5))


def _of_statement(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.IfExp(test=test) | ast.If(test=test) | ast.While(test=test):
            yield _with(node, test=ast.UnaryOp(ast.Not(), test))
            if isinstance(node, ast.If) and isinstance(node.body[-1], LEAVING) and not node.orelse:
                yield _with(node, test=ast.Constant(False))
        case ast.Expr(value=ast.Call()):
            yield _with(node, value=ast.Constant(None))
        case ast.Return(value=ast.expr()) if ast.unparse(node) != "return None":
            yield _with(node, value=ast.Constant(None))


def _of_key(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Tuple(elts=elts) | ast.List(elts=elts) if len(elts) > 1:
            for k in range(len(elts)):
                yield _with(node, elts=[*elts[:k], *elts[k + 1 :]])
        case ast.Dict(keys=keys, values=values) if len(keys) > 1:
            for k in range(len(keys)):
                rest = {"keys": keys[:k] + keys[k + 1 :], "values": values[:k] + values[k + 1 :]}
                yield _with(node, **rest)


LEAVING = ast.Raise | ast.Return | ast.Continue | ast.Break


def _of_call(node: ast.Call) -> Iterator[ast.AST]:
    named = node.func
    name = named.attr if isinstance(named, ast.Attribute) else getattr(named, "id", "")
    if name in SWAPPED:
        other = "attr" if isinstance(named, ast.Attribute) else "id"
        yield _with(node, func=_with(named, **{other: SWAPPED[name]}))
    if name in NUMBERS:
        all_are = NUMBERS[name] == "|"
        op = ast.BitOr() if all_are else ast.BitAnd()
        yield ast.BinOp(node, op, ast.Constant(all_are))
    match node.args:
        case [ast.Name() | ast.Attribute() as a, ast.Name() | ast.Attribute() as b, *rest]:
            if name not in (*SWAPPED, "isinstance"):
                yield _with(node, args=[b, a, *rest])


def _with(node: ast.AST, **fields: Any) -> ast.AST:
    """A copy with other fields."""
    other = copy.copy(node)
    for name, value in fields.items():
        setattr(other, name, value)
    return other


def _times(node: ast.expr, factor: float) -> ast.expr:
    return ast.BinOp(node, ast.Mult(), ast.Constant(factor))


def _is_zero(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and not node.value


def _number(node: ast.expr) -> bool:
    """Whether an expression is made of numbers alone."""
    of_numbers = ast.Constant | ast.BinOp | ast.UnaryOp | ast.operator | ast.unaryop
    inner = list(ast.walk(node))
    return all(isinstance(x, of_numbers) for x in inner) and not any(
        isinstance(x, ast.Constant) and not isinstance(x.value, int | float) for x in inner
    )


def _shown(node: ast.AST) -> str:
    if isinstance(node, ast.If | ast.While):
        node = _with(node, body=[ast.Pass()], orelse=[])
    first, *_ = ast.unparse(ast.fix_missing_locations(node)).splitlines()
    return first if len(first) <= 100 else f"{first[:100]} ..."


def places(tree: ast.Module) -> list[Place]:
    """Every place that may be changed, in the order of the text."""
    found: list[Place] = []

    def visit(holder: ast.AST, line: int, keyed: bool) -> None:
        for field, value in ast.iter_fields(holder):
            if field in ("annotation", "returns", "decorator_list"):
                continue
            members = list(enumerate(value)) if isinstance(value, list) else [(None, value)]
            for index, node in members:
                if not isinstance(node, ast.AST):
                    continue
                if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                    continue
                # A guard of lengths that are equal by construction.
                if isinstance(node, ast.keyword) and node.arg == "strict":
                    continue
                here = node.lineno if isinstance(node, ast.stmt) else line
                within = keyed or _names_key(node)
                found.append(Place(holder, field, index, node, here, within))
                visit(node, here, within)

    visit(tree, 0, False)
    return found


def _names_key(node: ast.AST) -> bool:
    """Whether what is inside a node is put together to a key."""
    match node:
        case ast.FunctionDef(name=name):
            return bool(KEYS.search(name))
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AugAssign(target=ast.Name(id=name)):
            return bool(KEYS.search(name))
        case ast.Call(func=ast.Name(id=name)) | ast.Call(func=ast.Attribute(attr=name)):
            return bool(re.search(r"key$|hash|digest|followed", name))
    return False


@functools.cache
def mutants(path: str) -> list[Mutant]:
    """All mutants of a file, but for numbers of a drawing: how thick a line is is taste."""
    text = (ROOT / path).read_text()
    lines, alike, made = text.splitlines(), Counter[tuple[str, str]](), []
    taste = path.endswith("draw.py") or "/plots/" in path or "/render/" in path
    for k, place in enumerate(places(ast.parse(text))):
        if taste and isinstance(place.node, ast.Constant):
            continue
        for j, other in enumerate(changes(place.node, keyed=place.keyed)):
            said = f"{_shown(place.node)}  ->  {_shown(other)}"
            line = getattr(place.node, "lineno", place.line)
            here, statement = (lines[x - 1].strip() for x in (line, place.line))
            alike[here, said] += 1
            made.append(Mutant(path, here, said, alike[here, said], line, statement, k, j))
    return made


def drawn(every: Iterable[Mutant], count: int, seed: int) -> list[Mutant]:
    """So many mutants by lot, one of a place at most.

    The lot of a place is a hash of the seed and of its text: code that is changed elsewhere
    leaves it what it was, and so does a larger sample.
    """

    def lot(mutant: Mutant) -> str:
        return hashlib.sha256(f"{seed} {mutant}".encode()).hexdigest()

    chosen: dict[tuple[str, int], Mutant] = {}
    sizes = Counter((mutant.path, mutant.place) for mutant in every)
    ranks: dict[tuple[str, int], str] = {}
    for mutant in every:
        at = mutant.path, mutant.place
        rank = lot(mutant)
        if at not in ranks or rank < ranks[at]:
            chosen[at], ranks[at] = mutant, rank

    # The least of n lots is small more often: what is drawn from is places, not changes.
    def fair(at: tuple[str, int]) -> float:
        return 1 - (1 - int(ranks[at], 16) / 2**256) ** sizes[at]

    return [chosen[at] for at in sorted(chosen, key=fair)[:count]]


def source(text: str, mutant: Mutant | None = None) -> str:
    """A file's text with the mutant in it, or with none, as the same tools write it."""
    tree = ast.parse(text)
    if mutant:
        place = places(tree)[mutant.place]
        other = list(changes(place.node, keyed=place.keyed))[mutant.which]
        if place.at is None:
            setattr(place.holder, place.field, other)
        else:
            getattr(place.holder, place.field)[place.at] = other
    return ast.unparse(ast.fix_missing_locations(tree))


def equivalent(declared: Path = EQUIVALENT) -> dict[Mutant, str]:
    """The mutants that are declared to be equivalent, with the reasons.

    Raises
    ------
    ValueError
        If an entry fits none of the code's mutants.
    """
    reasons: dict[Mutant, str] = {}
    for entry in yaml.safe_load(declared.read_text()):
        path, line, change, nth = (entry.get(x, 1) for x in ("path", "line", "change", "nth"))
        of_file: Sequence[Mutant] = mutants(path)
        found = [x for x in of_file if (x.text, x.said, x.nth) == (line, change, nth)]
        if not found:
            raise ValueError(f"{declared.name} fits no mutant: {path}: `{line}`, {change}, {nth}")
        reasons[found[0]] = entry["reason"]
    return reasons
