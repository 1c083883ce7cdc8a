"""Plain English: docstrings begin with a phrase that stands alone, and names mean one thing."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "rigidpend"

BEGINNINGS = {*("What", "How", "By", "Which", "Where", "Whether", "Why", "Of", "In", "So", "With")}
"""Words with which no docstring begins: they open half a sentence."""

COMMON = {"Config", "Problem"}
"""Names of classes that are given more than once on purpose: of the parts of each schema."""


def complaint(text: str) -> str:
    """The rule that a docstring breaks, be it of an attribute; empty where it keeps both."""
    first = text.strip().partition("\n")[0]
    word = re.match(r"\W*(\w+)", first)
    if word and word[1] in BEGINNINGS:
        return f"it begins with {word[1]}"
    return "" if first.endswith(".") else "its first line does not end with a full stop"


@pytest.mark.slow
def test_docstrings_begin_with_a_phrase_and_no_two_classes_share_a_name() -> None:
    broken, homes = [], defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            match node:
                case ast.Expr(value=ast.Constant(value=str(text))) if complaint(text):
                    broken.append((path, node.lineno, complaint(text)))
                case ast.ClassDef(name=name):
                    homes[name].append(path.name)
    assert broken == []
    assert {name for name, places in homes.items() if len(places) > 1} == COMMON
    assert {place for name in COMMON for place in homes[name]} == {"schema.py"}


def test_each_rule_can_be_broken() -> None:
    said = [complaint(x) for x in ("\n    By how much.", "`Of` all.", "Parts: of\na run.", "A.")]
    stop = "its first line does not end with a full stop"
    assert said == ["it begins with By", "it begins with Of", stop, ""]
