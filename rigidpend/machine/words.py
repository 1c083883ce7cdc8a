"""Words from a file or an error, made fit for a line of a message."""

from __future__ import annotations

MOST = 200
"""Characters."""


def short(said: object, most: int = MOST) -> str:
    """The first line of what is said, clipped; what could move a cursor is shown as ?."""
    first = next(iter(str(said).splitlines()), "")
    clipped = first if len(first) <= most else f"{first[: most - 3]}..."
    return "".join(x if x.isprintable() else "?" for x in clipped)


def error(kind: BaseException) -> str:
    """An error with its kind, as a line."""
    return f"{type(kind).__name__}: {short(kind)}"
