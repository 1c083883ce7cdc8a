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
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rigidpend.machine.code_cache import CodeCache

PACKAGE = Path(__file__).resolve().parents[1]
LIBRARIES = ("numpy", "scipy", "mpmath", "h5py", "llvmlite", "heyoka")
ABSENT = "absent"
"""Version of a library that is not installed."""


def config_hash(resolved: dict[str, Any]) -> str:
    """Hash a resolved config: comments, layout and the name of its figure don't count."""
    counted = {key: value for key, value in resolved.items() if key != "figure"}
    return _digest(json.dumps(counted, sort_keys=True))


def code_hash(experiment: str) -> str:
    """Hash the code that a result follows from: that of its config's schema, and what computes.

    With them counts every module of the package that they import, directly or not: its
    expansion of an axis is as much a cause of a result as an integrator. Comments and docstrings
    don't count, nor what only type checkers import.
    """
    return code_hash_of(_part(experiment, "schema"), _part(experiment, "compute"))


def code_hash_of_part(experiment: str, part: str) -> str:
    """Hash the code of one of an experiment's files, its schema say."""
    return code_hash_of(_part(experiment, part))


def code_hash_of(*files: Path) -> str:
    """Hash the code of some of the package's files and of all that they import of the package."""
    found = sorted(_needed(files).items())
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
    from rigidpend.orbits.integrate.compile_cache import processor_model

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


def _part(experiment: str, part: str) -> Path:
    return PACKAGE / "experiments" / experiment / f"{part}.py"


def _needed(first: Sequence[Path]) -> dict[str, str]:
    """Collect the code of the package's files that some of them import, by their places."""
    found: dict[str, str] = {}
    package = str(PACKAGE)
    waiting = [each.relative_to(PACKAGE).as_posix() for each in first]
    waiting += [init for place in waiting for init in _around(package, place.rpartition("/")[0])]
    while waiting:
        place = waiting.pop()
        if place not in found:
            found[place], imported = _looked_up(package, place)
            waiting += imported
    return found


@functools.cache
def _looked_up(package: str, place: str) -> tuple[str, list[str]]:
    """A file's code, and the places of the files that it imports.

    Each is read once in a process, whose own code does not change meanwhile either.
    """
    with open(f"{package}/{place}", "rb") as file:
        code, imported = _cache().entry(file.read(), _read)
    found = (each for module in imported for each in _files(package, module))
    return code, list(dict.fromkeys(found))


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
def _files(package: str, module: str) -> list[str]:
    """Places of what runs when a module is imported; mere names and other packages have none."""
    first, _, inner = module.partition(".")
    place = inner.replace(".", "/")
    candidates = (f"{place}.py", f"{place}/__init__.py".lstrip("/"))
    for each in candidates if first == "rigidpend" else ():
        if os.path.isfile(f"{package}/{each}"):
            return [each, *_around(package, each.rpartition("/")[0])]
    return []


@functools.cache
def _around(package: str, folder: str) -> list[str]:
    """Places of the modules of a folder itself, and of those around it, as far as they have one."""
    init = f"{folder}/__init__.py".lstrip("/")
    own = [init] if os.path.isfile(f"{package}/{init}") else []
    return own + (_around(package, folder.rpartition("/")[0]) if folder else [])


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
