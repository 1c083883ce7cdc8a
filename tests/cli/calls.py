"""`python -m rigidpend` in processes of its own, in another folder, without a display."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

REFERENCE = Path(__file__).resolve().parents[2] / "results" / "reference"
ENVIRONMENT = {name: x for name, x in os.environ.items() if name != "DISPLAY"}

Done = subprocess.CompletedProcess[str]


def call(folder: Path, *arguments: str, backend: str = "nonsense") -> Done:
    """A command in a folder, in an environment without a display."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "rigidpend", *arguments],
        cwd=folder,
        env=ENVIRONMENT | {"MPLBACKEND": backend},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert "\x1b" not in done.stdout + done.stderr
    return done
