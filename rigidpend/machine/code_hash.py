"""Hash of the package's code: the code of a module, and of all modules of the package it imports.

Comments, docstrings, layout and imports for type checkers do not count.
"""

import ast
import functools
import hashlib
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rigidpend.machine import cache
from rigidpend.numbers.texts import parsed

PACKAGE = Path(__file__).resolve().parents[1]
MOST_BYTES = 100_000
"""Bytes of all hashes in the cache, of which each takes some 300."""


def inside(*place: str) -> Path:
    """Path of a file of the package, from folders and name."""
    return PACKAGE.joinpath(*place)


def code_hash_of(*files: Path) -> str:
    """Hash of the code of some of the package's files, and of all that they import from it."""
    places = [each.relative_to(PACKAGE).as_posix() for each in files]
    # Cached, because reading and parsing the files takes a third of a second.
    of, kept = f"{places} in {package_digest()}".encode(), cache.folder() / "hashes"
    found = cache.load(kept, of)
    if found is None:
        found = digest(json.dumps(sorted(needed(files).items()))).encode()
        cache.save(kept, of, found, MOST_BYTES)
    return found.decode()


def package_digest() -> str:
    """Digest of all source files of the package, byte for byte."""
    return sources(str(PACKAGE)).digest


def needed(first: Sequence[Path]) -> dict[str, str]:
    """Digests of the code of some files of the package and all that they import, by place."""
    found: dict[str, str] = {}
    package = str(PACKAGE)
    names = [".".join(each.relative_to(PACKAGE.parent).with_suffix("").parts) for each in first]
    waiting = [place for name in names for place in _files(name)]
    while waiting:
        place = waiting.pop()
        # Imported names that are no modules, and other packages, have no file here.
        if place not in found and place in sources(package).files:
            found[place], imported = _read(sources(package).files[place])
            waiting += [place for name in imported for place in _files(name)]
    return found


class Sources(NamedTuple):
    """The source files of the package."""

    files: dict[str, bytes]
    """Content of the files, by place."""
    digest: str


@functools.cache
def sources(package: str) -> Sources:
    """Read the source files in a folder, once: the code of a process does not change meanwhile."""
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
    """Digest of the running code of a file, and the names that it imports."""
    tree = _Running().visit(parsed(source))
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return digest(ast.unparse(tree)), sorted(names)


class _Running(ast.NodeTransformer):
    """Filter that removes docstrings and code for type checkers."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return None if text else node

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        self.generic_visit(node)
        checked = isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        return node.orelse if checked else node


def _files(name: str) -> list[str]:
    """Places of the files that may run when a name is imported; `__init__.py` of folders first."""
    package, *inner = name.split(".")
    if package != PACKAGE.name:
        return []
    around = ["/".join([*inner[:k], "__init__.py"]) for k in range(len(inner) + 1)]
    return [f"{'/'.join(inner)}.py", *around]


def digest(text: str) -> str:
    """Hash of a text, 16 hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]
