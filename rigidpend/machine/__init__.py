"""The computer around the mathematics: files, caches, workers, signals, tables of text.

Modules
-------
files       files written completely or not at all, with digests; removal of old leftovers
cache       cached files, each with its origin, and the user's cache folder
workers     parallel threads and processes
progress    progress of long work and the time left, on stderr
code_hash   hash of the code that a module runs, sixteen digits
signals     signal handling (SIGTERM, SIGINT)
wording     texts made fit for a message; tables for a terminal or in Markdown
"""

import atexit
import gc


def leave_garbage() -> None:
    """Let this process collect garbage seldom, and not when it ends.

    Collections among objects just imported take a tenth of a start, and the end frees all memory.
    """
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
