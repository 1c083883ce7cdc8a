"""Checks of arguments of public functions: each is taken exactly, or refused in a sentence.

Configs and functions share these checks, so that a value is refused in the same way everywhere. The
sentence, of a ParameterError, names the argument.
"""

import operator
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from rigidpend.numbers.exact import FINEST_BITS, Exact, ExactError, exact
from rigidpend.numbers.texts import named

GAP_BITS = 11
"""Least number of bits between two precisions.

Their errors then differ by a factor of some two thousand. Without such a difference the agreement
of two computations would not tell that both are right: see `rigidpend.routes.certainty`."""

MOST_PHASES = 10_000_000
"""Largest number of initial phases of one computation."""

LONGEST = 4096
"""Largest number of characters of a path, as on Linux."""


class ParameterError(ValueError):
    """Error: a parameter that breaks a condition; the message names condition and values."""

    def __init__(self, field: str, message: str) -> None:
        # Both arguments, since an error that comes from a worker process is made anew from them.
        super().__init__(field, message)
        self.field = field
        """The name of the parameter that is wrong."""

    def __str__(self) -> str:
        return str(self.args[1])


def number(name: str, value: Any) -> Exact:
    """The exact number of a value; see :func:`rigidpend.numbers.exact.exact`."""
    try:
        return exact(value)
    except ExactError as wrong:
        raise ParameterError(name, f"{name}: {wrong}") from None


def whole(name: str, value: Any, least: int, most: int | None = None) -> int:
    """A whole number from `least` to `most`, as an int, which unlike NumPy's cannot overflow."""
    try:
        # Python's bool has an index, though nobody means it as a number; NumPy's has none.
        found = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        found = None
    if found is None or found < least or (most is not None and found > most):
        limits = f"from {least} on" if most is None else f"from {least} to {most}"
        raise ParameterError(name, f"{name} must be a whole number {limits}, got {named(value)}")
    return found


def of_kind(name: str, value: Any, kind: Any) -> Any:
    """A value, if it is of a given type."""
    if not isinstance(value, kind):
        raise ParameterError(name, f"{name} must be a {kind.__name__}, got {named(value)}")
    return value


def path(name: str, value: Any) -> Path:
    """The path of a file or a folder, if systems can take it as a name."""
    text = str(value) if isinstance(value, str | Path) else ""
    if not text or "\0" in text or len(text) > LONGEST:
        raise ParameterError(
            name, f"{name} must be a path, as a text or a Path, got {named(value)}"
        )
    return Path(value)


def choice(name: str, value: Any, known: Sequence[str]) -> str:
    """A word, if it is one of the known ones."""
    if not isinstance(value, str) or value not in known:
        raise ParameterError(name, f"{name} must be one of {', '.join(known)}, got {named(value)}")
    return value


def precisions(values: Any) -> tuple[int, ...]:
    """Working precisions in bits, ascending; what one cannot decide goes to the next."""
    try:
        ladder = tuple(map(operator.index, values))
    except TypeError:
        ladder = ()
    if not ladder or not 53 <= min(ladder) <= max(ladder) <= FINEST_BITS:
        message = f"precisions must be whole numbers of bits from 53 to {FINEST_BITS}"
        raise ParameterError("precisions", f"{message}, got {named(values)}")
    for low, high in pairwise(ladder):
        if high <= low:
            raise ParameterError("precisions", f"precisions must ascend, got {named(values)}")
        if high - low < GAP_BITS:
            raise ParameterError(
                "precisions",
                f"precisions {low} and {high} are too close: computations that differ by fewer"
                f" than {GAP_BITS} bits err too much alike for their agreement to tell enough; take"
                f" {low + GAP_BITS} or more after {low}",
            )
    return ladder
