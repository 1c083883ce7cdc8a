"""Code in a fresh Python, and what that has imported in the end."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

MODULES = "\nimport sys\nprint('modules', *sys.modules)\n"


def python(folder: Path, *arguments: str, **more: Any) -> subprocess.CompletedProcess[str]:
    """What a fresh Python does in a folder, warnings being errors."""
    return subprocess.run(
        [sys.executable, "-W", "error", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        **more,
    )


def modules(code: str, folder: Path, *arguments: str) -> set[str]:
    """The names of all modules that a fresh Python has imported in the end."""
    done = python(folder, "-c", code + MODULES, json.dumps(arguments))
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split()[1:])


COMPUTE = """
import json, sys
from pathlib import Path
from rigidpend.runs import loading
from rigidpend.experiments.contract import Means
import rigidpend.experiments.{name}.compute as experiment
[path] = json.loads(sys.argv[1])
assert experiment.compute(loading.load(Path(path)).content, Means(report=print))
"""


def modules_of_computing(name: str, config: Path) -> set[str]:
    """The names of all modules that a fresh Python has imported when it has computed a config."""
    return modules(COMPUTE.format(name=name), config.parent, str(config))
