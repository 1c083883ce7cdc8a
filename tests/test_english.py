"""Plain English: docstrings begin with a phrase that stands alone, and names mean one thing."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "rigidpend"

BEGINNINGS = frozenset(
    ("What", "How", "By", "Which", "Where", "Whether", "Why", "Of", "In", "So", "With")
)
"""Words with which no docstring begins: they open half a sentence."""

COMMON = {
    "Config": "the whole config of an experiment, in the schema of each",
    "Problem": "the part `problem` of a config, in the schema of each",
}
"""Names of classes that are given more than once on purpose, always with one meaning."""


class Docstring(NamedTuple):
    """A docstring, of a module, a class, a function or an attribute."""

    line: int
    text: str

    @property
    def first(self) -> str:
        return self.text.strip().partition("\n")[0]


def docstrings(source: str) -> Iterator[Docstring]:
    """Every docstring of a file: texts that stand alone, wherever they are."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield Docstring(node.lineno, text)


def complaint(docstring: Docstring) -> str:
    """The rule that a docstring breaks; empty where it keeps all of them."""
    word = re.match(r"\W*(\w+)", docstring.first)
    if word and word[1] in BEGINNINGS:
        return f"it begins with {word[1]}"
    # The linter sees this too, but not of attributes.
    if not docstring.first.endswith("."):
        return "its first line is no sentence or phrase that ends with a full stop"
    return ""


def files() -> list[str]:
    return sorted(str(path.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py"))


@pytest.mark.slow
def test_docstrings_begin_with_a_phrase_that_stands_alone() -> None:
    every = ((file, d) for file in files() for d in docstrings((PACKAGE / file).read_text()))
    assert [(file, d.line, complaint(d), d.first) for file, d in every if complaint(d)] == []


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("What a killed run has finished.", "begins with What"),
        ("\n    By how much x may differ.", "begins with By"),
        ("`Of` the separatrices.", "begins with Of"),
        ("Checkpoints: resume an interrupted run", "full stop"),
        ("Checkpoints: resume a run that was\ninterrupted.", "full stop"),
        (" ", "full stop"),
    ],
)
def test_each_rule_can_be_broken(text: str, rule: str) -> None:
    assert rule in complaint(Docstring(1, text))
    assert complaint(Docstring(1, "Checkpoints: resume an interrupted run.")) == ""


def test_attributes_and_inner_functions_are_read_too() -> None:
    source = '''
"""Module."""
x = 1
"""Of the module."""
class A:
    y: int
    """Of the class."""
    def f(self):
        def g():
            """Of the function."""
'''
    found = [d.text for d in sorted(docstrings(source))]
    assert found == ["Module.", "Of the module.", "Of the class.", "Of the function."]


def homes() -> dict[str, list[str]]:
    """The files in which a class of each name is defined."""
    found: dict[str, list[str]] = defaultdict(list)
    for file in files():
        for node in ast.walk(ast.parse((PACKAGE / file).read_text())):
            if isinstance(node, ast.ClassDef):
                found[node.name].append(file)
    return found


@pytest.mark.slow
def test_no_two_classes_share_a_name_but_those_of_schemas() -> None:
    found = homes()
    shared = {name: where for name, where in found.items() if len(where) > 1}
    assert set(shared) <= set(COMMON), shared
    assert {Path(file).name for name in COMMON for file in found[name]} == {"schema.py"}
