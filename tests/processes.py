"""Code in a fresh Python."""

import subprocess
import sys
from pathlib import Path
from typing import Any


def python(folder: Path, *arguments: str, **more: Any) -> subprocess.CompletedProcess[str]:
    """What a fresh Python does in a folder, warnings being errors."""
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **more}
    command = [sys.executable, "-W", "error", *arguments]
    return subprocess.run(command, cwd=folder, text=True, timeout=120, check=False, **how)
