"""Provenance of a result: versions, commit, machine, and the code that computes it."""

from __future__ import annotations

import ast
import datetime
import functools
import hashlib
import importlib.metadata
import json
import os
import platform
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rigidpend.run.code_cache import CodeCache

PACKAGE = Path(__file__).resolve().parents[1]
LIBRARIES = ("numpy", "scipy", "mpmath", "h5py", "llvmlite", "heyoka")
ABSENT = "absent"
"""Version of a library that is not installed."""


def config_hash(resolved: dict[str, Any]) -> str:
    """Hash a resolved config: comments, layout and the name of its figure don't count."""
    counted = {key: value for key, value in resolved.items() if key != "figure"}
    return _digest(json.dumps(counted, sort_keys=True))


def code_hash(experiment: str) -> str:
    """Hash the code that computes an experiment: comments and docstrings don't count."""
    return code_hash_of_part(experiment, "compute")


def code_hash_of_part(experiment: str, part: str) -> str:
    """Hash the code of one of an experiment's files, its schema say."""
    return code_hash_of(PACKAGE / "experiments" / experiment / f"{part}.py")


def code_hash_of(file: Path) -> str:
    """Hash the code of one of the package's files and of all that it imports of the package."""
    found = sorted((f"{each.relative_to(PACKAGE)}", code) for each, code in _needed(file).items())
    _cache().save()
    return _digest(json.dumps(found))


def engine_name(engine: str) -> str:
    """Name of an engine with the versions of the libraries behind it, as far as installed."""
    if not engine:
        return "no engine"
    behind = {"taylor": ("llvmlite", "heyoka"), "scipy": ("scipy",)}[engine]
    versions = {library: version(library) for library in behind}
    told = (f"{library} {its}" for library, its in versions.items() if its != ABSENT)
    return f"{engine} ({', '.join(told)})"


def provenance() -> dict[str, str]:
    """Provenance of a run: versions, commit, processor, system and time."""
    from rigidpend.integrate.compile_cache import processor_model

    versions = {f"version_{name}": version(name) for name in ("rigidpend", *LIBRARIES)}
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {
        **versions,
        "version_python": platform.python_version(),
        "commit": _commit(),
        "processor": processor_model(),
        "system": f"{platform.system()} {platform.machine()}",
        "created": now,
    }


def _needed(first: Path) -> dict[Path, str]:
    """Collect the code of the package's files that one of them imports, directly or not."""
    found: dict[Path, str] = {}
    waiting = [first]
    while waiting:
        file = waiting.pop()
        if file not in found:
            found[file], imported = _cache().entry(file.read_bytes(), _read)
            waiting += _files(PACKAGE, tuple(imported))
    return found


@functools.cache
def _cache() -> CodeCache:
    return CodeCache(Path(__file__).read_bytes())


def _read(source: bytes) -> tuple[str, list[str]]:
    """Read a file's code without comments, docstrings and layout, and the names that it imports."""
    tree = ast.parse(source)
    names: set[str] = set()
    for node in _running(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return _digest(_code(tree)), sorted(names)


def _running(tree: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a syntax tree but those for type checkers only, which compute nothing."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            waiting += node.orelse
            continue
        yield node
        waiting += ast.iter_child_nodes(node)


@functools.cache
def _files(package: Path, modules: tuple[str, ...]) -> list[Path]:
    """Files of modules of this package; other packages and mere names have none."""
    inner = (module.split(".") for module in modules)
    own = (tuple(rest) for first, *rest in inner if first == package.name and rest)
    return [file for each in own if (file := _file_in(package, each)) is not None]


@functools.cache
def _file_in(package: Path, inner: tuple[str, ...]) -> Path | None:
    place = package.joinpath(*inner)
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


def _code(node: Any) -> str:
    """Text of a syntax tree, absent fields left out, so that versions of Python agree.

    `ast.dump` and `ast.unparse` change from one version of Python to the next, also by fields
    that are new and empty.
    """
    if isinstance(node, list):
        return f"[{' '.join(_code(x) for x in node if not _is_text(x))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = {name: x for name, x in ast.iter_fields(node) if x is not None and x != []}
    inner = " ".join(f"{name}={_code(x)}" for name, x in sorted(fields.items()))
    return f"{type(node).__name__}({inner})"


def _is_text(node: Any) -> bool:
    """True if a statement is a mere text: a docstring of a module, a function or a name."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def version(library: str) -> str:
    """Version of an installed library, or `ABSENT`."""
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return ABSENT


def _commit() -> str:
    """Commit of the checkout that the code runs from, with + where it was changed.

    A repository around it, or one that the user's shell names, is another's.
    """
    own = {name: x for name, x in os.environ.items() if not name.startswith("GIT_")}
    own["GIT_CEILING_DIRECTORIES"] = str(PACKAGE.parents[1])
    try:
        found = subprocess.run(
            ["git", "-C", str(PACKAGE), "describe", "--always", "--dirty=+", "--abbrev=12"],
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
            env=own,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return found.stdout.strip()
