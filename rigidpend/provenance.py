"""What a result was made from: versions, commit, machine, and the code that computes it."""

from __future__ import annotations

import ast
import datetime
import hashlib
import importlib.metadata
import importlib.util
import json
import platform
import subprocess
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parent
COMPUTING = (
    "body.py",
    "coordinates.py",
    "equations.py",
    "exact.py",
    "melnikov.py",
    "integrate",
    "routes",
)
"""The rooms on which every result depends, beside its own experiment."""

LIBRARIES = ("numpy", "scipy", "mpmath", "h5py", "heyoka")


def config_hash(resolved: dict[str, Any]) -> str:
    """A hash of a resolved config: comments and layout don't count."""
    return _digest(json.dumps(resolved, sort_keys=True))


def code_hash(experiment: str) -> str:
    """A hash of the code that computes an experiment: comments and docstrings don't count."""
    rooms = [PACKAGE / name for name in (*COMPUTING, f"experiments/{experiment}.py")]
    files = [file for room in rooms for file in _sources(room)]
    return _digest("\n".join(_normalised(file) for file in files))


def engine_name(engine: str) -> str:
    """An engine with the version of the library behind it."""
    library = {"taylor": "heyoka", "scipy": "scipy"}[engine]
    return f"{engine} ({library} {_version(library)})"


def provenance() -> dict[str, str]:
    """What ran where and when."""
    from rigidpend.integrate.compile_cache import processor_model

    versions = {f"version_{name}": _version(name) for name in ("rigidpend", *LIBRARIES)}
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {
        **versions,
        "version_python": platform.python_version(),
        "commit": _commit(),
        "processor": processor_model(),
        "system": f"{platform.system()} {platform.machine()}",
        "created": now,
    }


def _sources(room: Path) -> list[Path]:
    return sorted(room.rglob("*.py")) if room.is_dir() else [room]


def _normalised(file: Path) -> str:
    """The file's code without comments, docstrings and layout."""
    tree = ast.parse(file.read_bytes())
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [x for x in body if not _is_text(x)] or [ast.Pass()]  # type: ignore[attr-defined]
    return f"{file.relative_to(PACKAGE)}\n{ast.unparse(tree)}"


def _is_text(node: Any) -> bool:
    """Whether a statement is a mere text: a docstring, of a module, a function, a name."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _version(library: str) -> str:
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return "absent"


def _commit() -> str:
    """The commit of the checkout that the code runs from, with + where it was changed."""
    try:
        found = subprocess.run(
            ["git", "-C", str(PACKAGE), "describe", "--always", "--dirty=+", "--abbrev=12"],
            capture_output=True,
            text=True,
            timeout=5,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return found.stdout.strip()
