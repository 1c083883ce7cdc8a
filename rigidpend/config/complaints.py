"""Complaints about a config, each with its place, its line and a caret."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from typing import TypeAlias

MAX_SHOWN = 20
"""Number of complaints that are shown; the rest are counted."""
MAX_MESSAGE = 300
"""Number of characters of a message that are shown."""
MAX_LINE = 160
"""Number of characters of a source line that are shown."""

Place: TypeAlias = tuple[str | int, ...]
"""Keys and indices from the root to a value."""


@dataclass(frozen=True)
class Origin:
    """Origin of a value: a place in a file, or an option of the command line."""

    source: str
    line: int | None = None
    column: int | None = None
    text: str = ""
    """The source line, for the caret."""

    def __str__(self) -> str:
        return self.source if self.line is None else f"{self.source}:{self.line}:{self.column}"

    def shown(self) -> str:
        """The source line with a caret under the place; empty for an option."""
        if self.line is None or self.column is None or not self.text.strip():
            return ""
        # Of a long line the part around the place, so that the caret is never outside.
        first = max(0, self.column - 1 - MAX_LINE // 2) if len(self.text) > MAX_LINE else 0
        shown = plain(self.text[first : first + MAX_LINE])
        before = shown[: self.column - 1 - first]
        return f"\n    {shown}\n    {''.join(map(_blank, before))}^"


@dataclass(frozen=True)
class Complaint:
    """One error in a config."""

    origin: Origin
    place: Place
    message: str
    configs: tuple[str, ...] = ()
    """Names of the configs that an option does not fit, where it fits others."""

    def __str__(self) -> str:
        path = plain(clipped(".".join(map(str, self.place))))
        middle = f" {path}:" if path else ""
        message = plain(clipped(self.message))
        configs = f"{plain(clipped(', '.join(self.configs)))}: " if self.configs else ""
        where = f"{configs}{plain(clipped(str(self.origin)))}"
        return f"{where}:{middle} {message}{self.origin.shown()}"


class ConfigError(ValueError):
    """Error: a config that cannot be used, with all its complaints."""

    def __init__(self, complaints: list[Complaint]) -> None:
        self.complaints = complaints
        said = [str(complaint) for complaint in complaints[:MAX_SHOWN]]
        if len(complaints) > MAX_SHOWN:
            said.append(f"and {len(complaints) - MAX_SHOWN} more")
        super().__init__("\n".join(said))


def plain(text: str) -> str:
    """Make a text safe for a terminal: what cannot be printed is shown as ?."""
    return "".join(x if x.isprintable() or x == "\t" else "?" for x in text)


def clipped(text: str) -> str:
    """Shorten a text to at most `MAX_MESSAGE` characters."""
    return text if len(text) <= MAX_MESSAGE else f"{text[: MAX_MESSAGE - 3]}..."


def _blank(character: str) -> str:
    """Blank as wide as a character, to place the caret under the next."""
    if character == "\t":
        return character
    return "  " if unicodedata.east_asian_width(character) in "WF" else " "
