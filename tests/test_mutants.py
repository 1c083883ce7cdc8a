"""The mutation runner: what it changes, where, and what it leaves alone."""

from __future__ import annotations

import ast
import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def mutants() -> Any:
    spec = importlib.util.spec_from_file_location("mutants", ROOT / "scripts" / "mutants.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutants"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a < b", "a <= b"),
        ("a == b", "a != b"),
        ("a + b", "a - b"),
        ("a // b", "a * b"),
        ("a and b", "a or b"),
        ("not a", "a"),
        ("-a", "a"),
        ("3", "4"),
        ("0.5", "1.0"),
        ("0.0", "1.0"),
        ("True", "False"),
    ],
)
def test_an_expression_is_changed(mutants: Any, before: str, after: str) -> None:
    node = ast.parse(before, mode="eval").body
    changed, said = mutants.changed(node)
    assert ast.unparse(changed) == after
    assert said == f"{before}  ->  {after}"
    assert ast.unparse(node) == before, "the node itself stays"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("return a", "return None"),
        ("f(a)", "None"),
        ("a += 1", "a -= 1"),
        ("if a:\n    b", "if not a:\n    b"),
        ("while a:\n    b", "while not a:\n    b"),
    ],
)
def test_a_statement_is_changed(mutants: Any, before: str, after: str) -> None:
    [node] = ast.parse(before).body
    assert ast.unparse(mutants.changed(node)[0]) == after


@pytest.mark.parametrize("text", ["a", "'word'", "f(a)[b]", "a.b"])
def test_names_and_texts_are_left_alone(mutants: Any, text: str) -> None:
    assert mutants.changed(ast.parse(text, mode="eval").body) is None


def test_annotations_and_docstrings_are_left_alone(mutants: Any) -> None:
    tree = ast.parse('def f(a: Literal[1]) -> Literal[2]:\n    """Three 3."""\n    b: C[3] = a\n')
    assert list(mutants.places(tree)) == []


@pytest.mark.slow
def test_a_mutant_is_its_file_with_one_change(mutants: Any) -> None:
    path = "rigidpend/routes/certainty.py"
    plain = ast.unparse(ast.parse((ROOT / path).read_text())).splitlines()
    every = mutants.mutants(path)
    assert len(every) > 30
    for mutant in every[::5]:
        mutated = mutants.source(mutant).splitlines()
        if len(mutated) == len(plain):
            assert sum(a != b for a, b in zip(plain, mutated, strict=True)) == 1, mutant
        else:
            assert mutated != plain


def test_every_module_that_is_named_has_tests_that_are_there(mutants: Any) -> None:
    named = {"compare", "regression", "coordinates", "equations", "routes", "integrate"}
    assert {Path(room).stem for room in mutants.TESTS if "integrate/" not in room} == named
    assert all((ROOT / room).exists() for room in mutants.TESTS)
    assert mutants.room_of("rigidpend/integrate/arcs.py")[0] == "rigidpend/integrate/arcs.py"
    assert mutants.room_of("rigidpend/integrate/batch.py")[0] == "rigidpend/integrate"
    for path in mutants.files():
        assert all((ROOT / test).exists() for test in mutants.tests_of(path))
    for test in mutants.SLOW:
        file, _, function = test.partition("::")
        assert f"def {function.partition('[')[0]}" in (ROOT / file).read_text()
