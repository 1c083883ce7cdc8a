"""Code in a fresh Python."""

import subprocess
import sys
from pathlib import Path
from typing import Any


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
