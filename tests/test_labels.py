"""Labelled equations have one home and a test each; docstrings begin with whole phrases."""

from __future__ import annotations

import ast
import functools
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

EQUATIONS = (
    *("eq", "cond_P", "5:3", "depri_G", "depri_g", "gamma_dep", "phi", "h_d"),
    *("canon", "h_new", "h0_new", "eq1", "th3"),
    *("eq1_0", "sol_1", "sol_2", "sol_12", "sol_22", "sol_3", "eq_Ric1", "tt", "dt"),
    *("eq2", "dtheta", "Im"),
    *("tri1", "trieq", "el", "eqPV", "th_al"),
)
"""The labels of the equations in the paper's TeX source, a line a section."""

MARK = re.compile(r"\(eq\. ([^()]+)\)\.?$")


def parsed(folder: str, pattern: str, text: str) -> Iterator[tuple[Path, ast.Module]]:
    """Files of a folder in which a text stands, with their code."""
    for path in sorted((ROOT / folder).rglob(pattern)):
        if text in (code := path.read_text()):
            yield path, ast.parse(code)


@functools.cache
def homes() -> list[tuple[str, str, str]]:
    """(label, file, name) of every function and class whose first line ends with a label."""
    found = []
    for path, tree in parsed("rigidpend", "*.py", "(eq. "):
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                first = (ast.get_docstring(node) or "").partition("\n")[0]
                marked = MARK.search(first)
                labels = marked[1].split(", ") if marked else []
                found += [(label, str(path.relative_to(ROOT)), node.name) for label in labels]
    return found


@functools.cache
def all_tests() -> list[tuple[ast.Module, ast.FunctionDef]]:
    """Every function in a file of tests, each with its module; read once for all labels."""
    found = []
    for _, tree in parsed("tests", "test_*.py", "def test_eq_"):
        found += [(tree, node) for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return found


def named_after(label: str) -> list[tuple[ast.Module, ast.FunctionDef]]:
    """The tests that are named after a label, each with its module."""
    prefix = f"test_eq_{re.sub(r'[^A-Za-z0-9]', '_', label)}_"
    return [(tree, node) for tree, node in all_tests() if node.name.startswith(prefix)]


def names(tree: ast.AST) -> set[str]:
    """All names and attributes that a piece of code uses or imports."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            found.add(node.id)
        elif isinstance(node, ast.Attribute):
            found.add(node.attr)
        elif isinstance(node, ast.alias):
            found.add(node.name)
    return found


def test_each_equation_has_exactly_one_home_and_no_other_label_has_any() -> None:
    assert Counter(label for label, *_ in homes()) == dict.fromkeys(EQUATIONS, 1)


@pytest.mark.slow
@pytest.mark.parametrize("label", EQUATIONS)
def test_each_equation_has_tests_that_import_it_and_can_fail(label: str) -> None:
    [name] = {name for known, _, name in homes() if known == label}
    found = named_after(label)
    assert any(name in names(module) for module, _ in found), f"no test_eq_... uses {name}"
    for _, test in found:
        asserts = any(isinstance(node, ast.Assert) for node in ast.walk(test))
        checks = ("assert_", "raises", "check", "same")
        assert asserts or any(x.startswith(checks) for x in names(test)), test.name


BEGINNINGS = {*("What", "How", "By", "Which", "Where", "Whether", "Why", "Of", "In", "So", "With")}
"""Words with which no docstring begins: they open half a sentence."""

COMMON = {"Config", "Problem"}
"""Names of classes that are given more than once on purpose: of the parts of each schema."""


@pytest.mark.slow
def test_docstrings_begin_with_a_phrase_and_no_two_classes_share_a_name() -> None:
    broken, homes = [], defaultdict(list)
    for path, tree in parsed("rigidpend", "*.py", ""):
        for node in ast.walk(tree):
            match node:
                # Be it of an attribute.
                case ast.Expr(value=ast.Constant(value=str(text))):
                    first = text.strip().partition("\n")[0]
                    word = re.match(r"\W*(\w+)", first)
                    if (word and word[1] in BEGINNINGS) or not first.endswith("."):
                        broken.append((path, node.lineno, first))
                case ast.ClassDef(name=name):
                    homes[name].append(path.name)
    assert broken == []
    assert {name for name, places in homes.items() if len(places) > 1} == COMMON
    assert {place for name in COMMON for place in homes[name]} == {"schema.py"}
