"""Cache of heyoka's compiled code: one folder per processor model.

heyoka's cache on disk is keyed without the processor, while its code is compiled for it.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from pathlib import Path

VARIABLE = "HEYOKA_CACHE_DIR"


def choose() -> None:
    """Set heyoka's cache folder, unless the user has set it. To be called before its import."""
    if VARIABLE not in os.environ:
        os.environ[VARIABLE] = str(user_cache() / "rigidpend" / processor_key())


def processor_key() -> str:
    """A short name for this processor's model and instruction set."""
    return hashlib.sha256(_processor().encode()).hexdigest()[:16]


def processor_model() -> str:
    """The processor's name, as far as the system tells it."""
    for line in _processor().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _processor() -> str:
    """Identity of the processor: its model and flags where Linux tells them."""
    try:
        first, _, _ = Path("/proc/cpuinfo").read_text().partition("\n\n")
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    kept = ("model name", "flags", "Features", "CPU part", "CPU implementer")
    return "\n".join(line for line in first.splitlines() if line.startswith(kept))


def user_cache() -> Path:
    """The folder where this user's programs keep what they can make again."""
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
