"""Provenance of a result: versions, commit, machine, and the code that computes it."""

import contextlib
import datetime
import importlib.metadata
import json
import os
import platform
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigidpend.machine.code_hash import PACKAGE, code_hash_of, digest, inside

LIBRARIES = ("numpy", "scipy", "mpmath", "h5py", "llvmlite", "python_flint")
MISSING = "absent"
"""Version of a library that is not installed."""


def config_hash(resolved: dict[str, Any]) -> str:
    """Hash of a resolved config, without comments, layout and the name of its figure."""
    counted = {key: value for key, value in resolved.items() if key != "figure"}
    return digest(json.dumps(counted, sort_keys=True))


def code_hash(experiment: str) -> str:
    """Hash of the code that a result follows from: the experiment's schema and computation.

    Every module of the package that they import, directly or not, is included: the expansion of an
    axis in a schema affects a result as much as an integrator. Comments, docstrings and imports
    for type checkers are not.
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
    """Provenance of the parts that a cluster computed: their number for each worker."""
    return {"workers": json.dumps(crew, indent=2)} if crew else {}


def processor_model() -> str:
    """The processor's name, as far as the system knows it."""
    known = None
    with contextlib.suppress(OSError):
        known = re.search("^model name.*?: (.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return known[1].strip() if known else platform.processor() or platform.machine()


def version(library: str) -> str:
    """Version of an installed library, or `MISSING`."""
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return MISSING


def commit_here() -> str:
    """Commit of the checkout that the code runs from, with + if files were changed.

    A repository around the checkout, or one that the user's environment names, is ignored.
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
