"""The computer around the mathematics: files, caches, workers, signals, tables of text."""

import atexit
import gc


def leave_garbage() -> None:
    """Let this process collect garbage seldom, and not when it ends.

    Collections among objects just imported take a tenth of a start, and the end frees all memory.
    """
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
