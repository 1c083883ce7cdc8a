"""Words from a file or an error, made fit for a line of a message."""

from __future__ import annotations

MOST = 200
"""Characters."""


def short(said: object, most: int = MOST) -> str:
    """The first line of what is said, clipped; what could move a cursor is shown as ?."""
    return plain(next(iter(str(said).splitlines()), "").expandtabs(1), most)


def plain(text: str, most: int) -> str:
    """A text, clipped; what cannot be printed, but for tabs, is shown as ?."""
    clipped = text if len(text) <= most else f"{text[: most - 3]}..."
    return "".join(x if x.isprintable() or x == "\t" else "?" for x in clipped)


def error(kind: BaseException) -> str:
    """An error with its kind, as a line."""
    return f"{type(kind).__name__}: {short(kind)}"


def library(failed: ImportError) -> str:
    """The library that cannot be imported: the first that our code came to; empty for our own."""
    if isinstance(failed, ModuleNotFoundError):
        found = str(failed.name)
    else:
        found, frame = "", failed.__traceback__
        while frame:
            name = str(frame.tb_frame.f_globals.get("__name__"))
            if name.startswith("rigidpend"):
                found = ""
            elif not name.startswith("importlib"):
                found = found or name
            frame = frame.tb_next
    top = found.partition(".")[0]
    return "" if top == "rigidpend" else top
