"""The computer around the mathematics: files, caches, workers, signals, tables of text.

Modules
-------
files       files written whole or not at all, sealed; what killed writers left, by its age
cache       kept files, each with what it is of, and the user's folder of them
workers     threads and processes side by side
progress    how far long work is, and how long the rest takes, on stderr
code_hash   what a module runs, in sixteen digits
signals     signal handling (SIGTERM, SIGINT)
wording     words fit for a message; tables for a terminal, in Markdown or HTML
"""

import atexit
import gc


def leave_garbage() -> None:
    """Let this process look for garbage seldom, and not when it ends.

    To look among what was just imported is a tenth of a start, and the end gives all memory back.
    """
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
