"""Hash of the package's code: what a module runs, and all that it imports of the package.

Comments, docstrings and layout don't count, nor what only type checkers import.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigidpend.machine import cache

PACKAGE = Path(__file__).resolve().parents[1]


def inside(*place: str) -> Path:
    """A file of the package, by the folders that lead to it."""
    return PACKAGE.joinpath(*place)


def code_hash_of(*files: Path) -> str:
    """Hash the code of some of the package's files and of all that they import of the package."""
    places = [each.relative_to(PACKAGE).as_posix() for each in files]
    # To read them takes a third of a second.
    of = f"code hash of {places} in {package_digest()}"
    found = cache.recall(of)
    if found is None:
        found = digest(json.dumps(sorted(needed(files).items())))
        cache.remember(of, found)
    return str(found)


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
            found[place], imported = code_of(package, place)
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


def code_of(package: str, place: str) -> tuple[str, list[str]]:
    """A file's code, and the names of modules, and of what is in them, that it imports."""
    return _read(sources(package).files[place])


@functools.cache
def _read(source: bytes) -> tuple[str, list[str]]:
    """Read a file's code without comments, docstrings and layout, and the names that it imports."""
    tree = ast.parse(source)
    names: set[str] = set()
    for node in _running(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return digest(as_text(tree)), sorted(names)


BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")
"""Fields of a statement, and of a branch of one, that hold statements or such branches."""


def _running(tree: ast.AST) -> Iterator[ast.AST]:
    """Statements of a syntax tree but those for type checkers only, which compute nothing."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        match node:
            case ast.If(test=ast.Name(id="TYPE_CHECKING")):
                waiting += node.orelse
                continue
        yield node
        for block in BLOCKS:
            waiting += getattr(node, block, ())


def _files(name: str) -> list[str]:
    """Places at which the code may be that runs when a name is imported: folders run first."""
    package, *inner = name.split(".")
    if package != PACKAGE.name:
        return []
    around = ["/".join([*inner[:k], "__init__.py"]) for k in range(len(inner) + 1)]
    return [f"{'/'.join(inner)}.py", *around]


def as_text(node: Any) -> str:
    """Text of a syntax tree, of a list of them or of a value, so that versions of Python agree.

    `ast.dump` and `ast.unparse` change from one version of Python to the next, also by fields
    that are new and empty: absent ones are left out. Whether a name is read or written is told by
    where it stands.
    """
    if isinstance(node, ast.AST):
        words = [f"{type(node).__name__}("]
        for name in _in_order(node._fields):
            value = getattr(node, name, None)
            if value is not None and value != []:
                words += name, as_text(value)
        return " ".join([*words, ")"])
    if isinstance(node, list):
        return " ".join(["[", *[as_text(each) for each in node if not _is_text(each)], "]"])
    return repr(node)


@functools.cache
def _in_order(fields: tuple[str, ...]) -> list[str]:
    """Fields of a kind of node, in alphabetical order; there are few kinds and many nodes."""
    return sorted(set(fields) - {"ctx"})


def _is_text(node: Any) -> bool:
    """True if a statement is a mere text: a docstring of a module, a function or a name."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def digest(text: str) -> str:
    """Hash of a text, 16 digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]
