"""Labelled equations have one home and a test each; docstrings begin with whole phrases."""

import ast
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


def homes() -> Iterator[tuple[str, str]]:
    """(label, name) of every function and class whose first line ends with labels."""
    for _, tree in parsed("rigidpend", "*.py", "(eq. "):
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                first = (ast.get_docstring(node) or "").partition("\n")[0]
                labels = marked[1].split(", ") if (marked := MARK.search(first)) else []
                yield from ((label, node.name) for label in labels)


def names(tree: ast.AST) -> set[str]:
    """All names and attributes that a piece of code uses or imports."""
    kinds = {ast.Name: "id", ast.Attribute: "attr", ast.alias: "name"}
    return {getattr(x, kinds[type(x)]) for x in ast.walk(tree) if type(x) in kinds}


def test_each_equation_has_one_home_and_tests_that_import_it_and_can_fail() -> None:
    every = list(homes())
    assert Counter(label for label, _ in every) == dict.fromkeys(EQUATIONS, 1)
    tested = set()
    for _, tree in parsed("tests", "test_*.py", "def test_eq_"):
        used = names(tree)
        for test in ast.walk(tree):
            if isinstance(test, ast.FunctionDef) and test.name.startswith("test_eq_"):
                title = test.name.removeprefix("test_eq_")
                about = [x for x in every if title.startswith(re.sub(r"\W", "_", x[0]) + "_")]
                assert about, f"{test.name} is named after no equation"
                tested |= {label for label, name in about if name in used}
                asserts = any(isinstance(node, ast.Assert) for node in ast.walk(test))
                checks = ("assert_", "raises", "check", "same")
                assert asserts or any(x.startswith(checks) for x in names(test)), test.name
    assert tested == set(EQUATIONS)


BEGINNINGS = {*("What", "How", "By", "Which", "Where", "Whether", "Why", "Of", "In", "So", "With")}
"""Words with which no docstring begins: they open half a sentence."""

COMMON = {"Config", "Problem"}
"""Names of classes that are given more than once on purpose: of the parts of each schema."""


@pytest.mark.slow
def test_docstrings_begin_with_a_phrase_and_no_two_classes_share_a_name() -> None:
    broken, places = [], defaultdict(list)
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
                    places[name].append(path.name)
    assert broken == []
    assert {name for name, files in places.items() if len(files) > 1} == COMMON
    assert {file for name in COMMON for file in places[name]} == {"schema.py"}
