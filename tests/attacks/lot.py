"""Chance of the random attacks: one seed and one count for all, told where an attack fails.

``make attacks SEED=7 COUNT=500`` sets both; without them `make test` tries a few of each kind.
"""

import os
import random
from collections.abc import Iterator
from contextlib import contextmanager

SEED = int(os.environ.get("RIGIDPEND_SEED", "1"))
"""Seed of every random attack."""
COUNT = int(os.environ.get("RIGIDPEND_ATTACKS", "0"))
"""Trials of a quick kind; 0 for the few of each kind that belong to the tests."""


def trials(few: int, share: float = 1.0) -> int:
    """Number of trials: `few`, or a share of the count that is asked for, if that is more."""
    return max(few, round(COUNT * share))


@contextmanager
def drawn(kind: str) -> Iterator[random.Random]:
    """The chance of one kind of attack; what fails names the seed that repeats it."""
    try:
        yield random.Random(f"{SEED} {kind}")
    except BaseException as error:
        error.add_note(f"attack {kind!r}: repeat it with make attacks SEED={SEED} COUNT={COUNT}")
        raise
