"""Wording: texts from files and errors made fit for messages; tables of text."""

import itertools
import math
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple, Self

MOST_CHARACTERS = 200
"""Largest number of characters of a text in a message."""


def short(said: object, most_characters: int = MOST_CHARACTERS) -> str:
    """The first line of a text, clipped, with ? for characters that could move a cursor."""
    return plain(next(iter(str(said).splitlines()), "").expandtabs(1), most_characters)


def plain(text: str, most_characters: int) -> str:
    """A text, clipped, with ? for unprintable characters except tabs."""
    clipped = text if len(text) <= most_characters else f"{text[: most_characters - 3]}..."
    return "".join(x if x.isprintable() or x == "\t" else "?" for x in clipped)


def counted(n: int, noun: str) -> str:
    """A number with its noun, in the plural unless the number is 1."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def error(kind: BaseException) -> str:
    """An error with its class, in one line."""
    return f"{type(kind).__name__}: {short(kind)}"


def library(failed: ImportError) -> str:
    """The library that our code could not import; empty if it is a module of our own."""
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


def say_warnings(say: Callable[[str], object]) -> None:
    """Report warnings as plain sentences, without their place in the code."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        say(f"rigidpend: warning: {message}")

    warnings.showwarning = show


UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"))
"""Units of time with their lengths in seconds, descending; the last serves all shorter times."""


class Column(NamedTuple):
    """A column of a table: its header, its values, and their common format."""

    header: str
    values: Iterable[Any]
    form: str = ""
    """Format specification, as ``.6f``; empty for the plain text of a value."""


class Table(NamedTuple):
    """Rows of text under a caption."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""

    @classmethod
    def of(cls, caption: str, columns: Iterable[Column], note: str = "") -> Self:
        """A table from its columns, all of one length."""
        chosen = list(columns)
        cells = ([format(value, one.form) for value in one.values] for one in chosen)
        return cls(caption, [one.header for one in chosen], list(zip(*cells, strict=True)), note)


def columns(rows: Sequence[Sequence[str]], width: int, margin: str = "") -> Iterator[str]:
    """Write rows in columns as wide as necessary; cells are wrapped if a line has no room.

    A line has `width` characters, including the margin before it; only a word longer than its
    column's share exceeds that.
    """
    natural = [max(map(len, column)) for column in zip(*rows, strict=True)]
    widths = _shares(rows, natural, width - len(margin) - 2 * (len(natural) - 1))
    for row in rows:
        # Words are never broken, because a broken path or key cannot be copied.
        cells = [
            textwrap.wrap(cell, share, break_long_words=False, break_on_hyphens=False)
            for cell, share in zip(row, widths, strict=True)
        ]
        # A row of empty cells gives an empty line.
        for line in itertools.zip_longest(*cells, fillvalue="") if any(cells) else [("",)]:
            padded = (f"{cell:<{share}}" for cell, share in zip(line, widths, strict=False))
            yield f"{margin}{'  '.join(padded)}".rstrip()


def _shares(rows: Sequence[Sequence[str]], natural: Sequence[int], room: int) -> list[int]:
    """Widths of columns: the first and narrow ones as they need, the rest in equal parts."""
    least = [
        max((len(word) for cell in column for word in cell.split()), default=1)
        for column in zip(*rows, strict=True)
    ]
    widths, left = [natural[0]] * len(natural), room - natural[0]
    # In ascending order, so that wider columns share what narrow ones leave of their equal part.
    rest = sorted(range(1, len(natural)), key=lambda k: natural[k])
    for count, k in zip(range(len(rest), 0, -1), rest, strict=True):
        widths[k] = max(1, min(natural[k], max(least[k], left // count)))
        left -= widths[k]
    return widths


def terminal(table: Table) -> Iterator[str]:
    """Write a table line by line in aligned columns, all but the first aligned to the right."""
    cells = [list(map(str, row)) for row in (table.header, *table.rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(table.header))]
    yield table.caption
    for row in cells:
        rest = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        yield "  " + "  ".join([row[0].ljust(widths[0]), *rest]).rstrip()
    if table.note:
        yield f"  {table.note}"
    yield ""


def markdown(table: Table) -> Iterator[str]:
    """Write a table line by line in Markdown, its caption above it as a paragraph."""
    yield from (table.caption, "") if table.caption else ()
    for cells in (table.header, ["---"] * len(table.header), *table.rows):
        # A bar inside a cell would end the cell.
        yield f"| {' | '.join(str(cell).replace('|', '&#124;') for cell in cells)} |"
    yield from ("", table.note) if table.note else ()


def seconds(value: float) -> str:
    """Write a time with three digits and its unit; ``-`` if it is not finite."""
    if not math.isfinite(value):
        return "-"
    unit, name = next((u for u in UNITS if value >= u[0]), UNITS[-1])
    return f"{_digits(value / unit)} {name}"


def times(ratio: float) -> str:
    """Write a ratio with three digits; ``-`` if it is not finite."""
    return _digits(ratio) if math.isfinite(ratio) else "-"


def _digits(value: float) -> str:
    """Three digits, without an exponent up to a million."""
    return f"{value:,.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"
