"""Work for processes, which import this module and nothing that is slow to import."""

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable

from rigidpend.machine.progress import PartDone


def place(part: float, delay: float = 0.0) -> tuple[float, int, int]:
    """The part with the process and the thread that had it; the first parts take longest."""
    time.sleep(60 if part == 60 else delay / (1 + part))
    return part, os.getpid(), threading.get_ident()


def spoken(parts: int, say: Callable[[str], object]) -> int:
    """Say a line for each part, with the share that is done; return the process."""
    for part in range(parts):
        say(PartDone(f"part {part}", part + 1, parts))
    if parts == 3:
        warnings.warn("three parts are many", stacklevel=1)
    if parts == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    if parts == 4:
        time.sleep(60)
    return os.getpid() // min(parts, 1)
