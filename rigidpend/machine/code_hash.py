"""Hash of the package's code: what a module runs, and all that it imports of the package.

Comments, docstrings and layout don't count, nor what only type checkers import.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rigidpend.machine import cache

PACKAGE = Path(__file__).resolve().parents[1]
KEPT = 100_000
"""Bytes of all hashes that are kept, of which each takes some 300."""


def inside(*place: str) -> Path:
    """A file of the package, by the folders that lead to it."""
    return PACKAGE.joinpath(*place)


def code_hash_of(*files: Path) -> str:
    """Hash the code of some of the package's files and of all that they import of the package."""
    places = [each.relative_to(PACKAGE).as_posix() for each in files]
    # To read them takes a third of a second.
    of, kept = f"{places} in {package_digest()}".encode(), cache.folder() / "hashes"
    found = cache.load(kept, of)
    if found is None:
        found = digest(json.dumps(sorted(needed(files).items()))).encode()
        cache.save(kept, of, found, KEPT)
    return found.decode()


def package_digest() -> str:
    """Digest of all source files of the package, byte for byte."""
    return sources(str(PACKAGE)).digest


def needed(first: Sequence[Path]) -> dict[str, str]:
    """Collect the code of the package's files that some of them import, by their places."""
    found: dict[str, str] = {}
    package = str(PACKAGE)
    names = [".".join(each.relative_to(PACKAGE.parent).with_suffix("").parts) for each in first]
    waiting = [place for name in names for place in _files(name)]
    while waiting:
        place = waiting.pop()
        # Mere names, and other packages, have no file here.
        if place not in found and place in sources(package).files:
            found[place], imported = _read(sources(package).files[place])
            waiting += [place for name in imported for place in _files(name)]
    return found


class Sources(NamedTuple):
    """The source files of the package."""

    files: dict[str, bytes]
    """Their content, by their places."""
    digest: str


@functools.cache
def sources(package: str) -> Sources:
    """Read the source files in a folder; a process's own code does not change meanwhile."""
    found, every = {}, hashlib.sha256()
    for folder, inner, names in os.walk(package):
        inner.sort()
        for path in (f"{folder}/{name}" for name in sorted(names) if name.endswith(".py")):
            with open(path, "rb") as file:
                place, source = path.removeprefix(f"{package}/"), file.read()
            found[place] = source
            every.update(f"{place} {len(source)} ".encode() + source)
    return Sources(found, every.hexdigest())


@functools.cache
def _read(source: bytes) -> tuple[str, list[str]]:
    """Digest of the code of a file that runs, and the names that it imports."""
    tree = _Running().visit(ast.parse(source))
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return digest(ast.unparse(tree)), sorted(names)


class _Running(ast.NodeTransformer):
    """Filter of what runs: neither docstrings nor what is for type checkers only."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return None if text else node

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        self.generic_visit(node)
        checked = isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        return node.orelse if checked else node


def _files(name: str) -> list[str]:
    """Places at which the code may be that runs when a name is imported: folders run first."""
    package, *inner = name.split(".")
    if package != PACKAGE.name:
        return []
    around = ["/".join([*inner[:k], "__init__.py"]) for k in range(len(inner) + 1)]
    return [f"{'/'.join(inner)}.py", *around]


def digest(text: str) -> str:
    """Hash of a text, 16 digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]
