"""Provenance of a result: versions, commit, machine, and the code that computes it."""

from __future__ import annotations

import datetime
import importlib.metadata
import json
import os
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigidpend.machine.code_hash import PACKAGE, code_hash_of, digest, inside

LIBRARIES = ("numpy", "scipy", "mpmath", "h5py", "llvmlite", "python_flint")
ABSENT = "absent"
"""Version of a library that is not installed."""


def config_hash(resolved: dict[str, Any]) -> str:
    """Hash a resolved config: comments, layout and the name of its figure don't count."""
    counted = {key: value for key, value in resolved.items() if key != "figure"}
    return digest(json.dumps(counted, sort_keys=True))


def code_hash(experiment: str) -> str:
    """Hash the code that a result follows from: that of its config's schema, and what computes.

    With them counts every module of the package that they import, directly or not: its
    expansion of an axis is as much a cause of a result as an integrator. Comments and docstrings
    don't count, nor what only type checkers import.
    """
    parts = (inside("experiments", experiment, f"{part}.py") for part in ("schema", "compute"))
    return code_hash_of(*parts)


def engine_name(engine: str) -> str:
    """Name of an engine with the version of the library behind it."""
    if not engine:
        return "no engine"
    library = {"taylor": "llvmlite", "scipy": "scipy"}[engine]
    return f"{engine} ({library} {version(library)})"


def provenance() -> dict[str, str]:
    """Provenance of a run: versions, commit, processor, system and time."""
    versions = {f"version_{name}": version(name) for name in ("rigidpend", *LIBRARIES)}
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {
        **versions,
        "version_python": platform.python_version(),
        "commit": commit_here(),
        "processor": processor_model(),
        "system": f"{platform.system()} {platform.machine()}",
        "created": now,
    }


def of_workers(crew: Mapping[str, int]) -> dict[str, str]:
    """Provenance of what a cluster computed: how many parts each worker did, if any."""
    return {"workers": json.dumps(crew, indent=2)} if crew else {}


def processor_model() -> str:
    """The processor's name, as far as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def version(library: str) -> str:
    """Version of an installed library, or `ABSENT`."""
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return ABSENT


def commit_here() -> str:
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
